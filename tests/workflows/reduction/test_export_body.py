"""Every format from a body file to files on disk.

What cannot be written says so in one line and leaves nothing.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from carrierflex.reduction.body_files import BodyFileError, read_body, write_body
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.linearised import mounting_modes
from carrierflex.workflows.reduction import check_certificate, export_body, reduce_body
from tests.reduction.imports.sid_sample import sample

SUFFIX = {
    "body": "h5",
    "op4": "op4",
    "dmig": "dmig",
    "mbdyn": "fem",
    "sid": "SID_FEM",
    "exudyn": "hdf5",
    "simscape": "mat",
    "openfast": "dat",
    "openfast-flex5": "dat",
    "statespace": "npz",
}


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    path = tmp_path_factory.mktemp("body") / "pin.h5"
    reduce_body.main(body="pin", out=path, modes=4, size=0.06, quiet=True)
    return path


@pytest.mark.long
@pytest.mark.parametrize("format", SUFFIX)
def test_a_body_is_written_in_every_format(tmp_path, body, format):
    out = tmp_path / f"new/pin.{SUFFIX[format]}"
    result = export_body.main(body, format=format, out=out, quiet=True)
    assert out in result.files
    assert sorted(out.parent.iterdir()) == sorted(result.files)
    assert all(file.stat().st_size > 100 for file in result.files)
    assert result.figures
    limits = {"grounding": 1e-8, "difference": 1e-6}
    for name, value in result.figures.items():
        for word, limit in limits.items():
            assert not name.startswith(word) or value < limit, name
    assert result.checks or format == "statespace"
    if format in ("mbdyn", "sid"):
        assert result.figures["modes"] == 16.0


@pytest.mark.long
@pytest.mark.parametrize("format", SUFFIX)
def test_files_of_others_are_not_replaced_and_those_of_this_program_are(tmp_path, body, format):
    out = tmp_path / f"pin.{SUFFIX[format]}"
    written = export_body.main(body, format=format, out=out, quiet=True).files
    assert export_body.main(body, format=format, out=out, quiet=True).files == written
    for file in written:
        (tmp_path / "alone").mkdir()
        foreign = tmp_path / "alone" / file.name
        foreign.write_text("$ GRID of another program\n")
        with pytest.raises(FileExistsError, match=rf"{file.name}: is there already and is no file"):
            export_body.main(body, format=format, out=tmp_path / "alone" / out.name, quiet=True)
        assert [path.read_text() for path in foreign.parent.iterdir()] == [
            "$ GRID of another program\n"
        ]
        foreign.unlink()
        foreign.parent.rmdir()


@pytest.mark.long
def test_an_export_does_not_replace_the_partner_of_another_one(tmp_path, body):
    export_body.main(body, format="op4", out=tmp_path / "pin.op4", quiet=True)
    partner = (tmp_path / "pin.pch").read_text()
    with pytest.raises(FileExistsError, match=r"pin\.pch: is there already"):
        export_body.main(body, format="dmig", out=tmp_path / "pin.pch", quiet=True)
    assert (tmp_path / "pin.pch").read_text() == partner
    export_body.main(body, format="dmig", out=tmp_path / "new.pch", quiet=True)
    with pytest.raises(FileExistsError, match=r"new\.pch: is there already"):
        export_body.main(body, format="op4", out=tmp_path / "new.op4", quiet=True)


def test_a_measurement_is_not_replaced_by_a_body_or_a_certificate(tmp_path, body):
    for write, name in ((reduce_body.main, "run.h5"), (check_certificate.main, "run.json")):
        (tmp_path / name).write_text("time, force")
        choices = {"body": "pin", "quiet": True} if write is reduce_body.main else {"body": body}
        with pytest.raises(FileExistsError, match=rf"{name}: is there already"):
            write(out=tmp_path / name, **choices)
        assert (tmp_path / name).read_text() == "time, force"
    for _ in range(2):
        check_certificate.main(body, out=tmp_path / "certificate.json")


def test_the_held_pilot_is_a_choice(tmp_path, body):
    export_body.main(
        body, format="mbdyn", out=tmp_path / "pin.fem", pilot="pin_1_midspan", quiet=True
    )
    assert "Modal node: pilot pin_1_midspan, held" in (tmp_path / "pin.fem").read_text()


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        (
            {"format": "op4", "pilot": "pin_1_upwind"},
            "--pilot is given, but op4 holds no pilot; expected it with mbdyn",
        ),
        (
            {"format": "sid", "pilot": "hub"},
            r"pin\.h5: pin has no pilot 'hub'; expected one of pin_1_upwind, pin_1",
        ),
        ({"format": "op4", "out": "pin.dat"}, r"pin\.dat: suffix '\.dat'; expected \.op4"),
        (
            {"format": "statespace", "out": "pin.csv"},
            r"pin\.csv: suffix '\.csv'; expected \.mat or \.npz",
        ),
        (
            {"format": "statespace", "out": "pin.mat", "run": "LC1"},
            r"--run is 'LC1' and .*pin\.h5 is a body, which is linear; expected --run with a case",
        ),
        (
            {"format": "op4", "out": "pin.op4", "run": "LC1"},
            "--run is given, but op4 writes a body; expected it with statespace",
        ),
        ({"format": "simscape", "out": "pin.m"}, r"pin\.m: suffix '\.m'; expected \.mat"),
        ({"format": "exudyn", "out": "pin.h5"}, r"pin\.h5: suffix '\.h5'; expected \.hdf5"),
    ],
)
def test_a_wrong_choice_is_one_line_and_leaves_nothing(tmp_path, body, choices, message):
    out = tmp_path / choices.pop("out", "pin.out")
    with pytest.raises(ValueError, match=message) as caught:
        export_body.main(body, out=out, quiet=True, **choices)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_a_body_of_another_program_is_converted_with_its_checks(tmp_path, body):
    chain = (("sid", "a.SID_FEM"), ("op4", "b.op4"), ("simscape", "c.mat"), ("body", "d.h5"))
    source, losses = body, []
    for format, name in chain:
        written = export_body.main(source, format=format, out=tmp_path / name, quiet=True)
        losses.append(written.losses)
        checks = {check.name: check for check in written.checks}
        assert checks["free rigid motions"].after == 6.0
        assert checks["mass [kg]"].after == pytest.approx(read_body(body).mass_properties.mass)
        compared = [c.difference for c in written.checks if c.difference is not None]
        assert len(compared) > 12
        assert max(compared) < 1e-10, format
        source = tmp_path / name
    assert losses[0] == ()
    assert losses[1] == ("op4 has no inertia invariants: mbdyn and sid cannot be written of b.op4",)
    assert losses[3] == (
        "c.mat: matrices alone hold no inertia invariants: mbdyn and sid cannot be written of them",
    )
    again, first = read_body(tmp_path / "d.h5"), read_body(body)
    pins = first.pilot_rows
    assert list(again.pilots) == list(first.pilots)
    for letter in "KM":
        A, B = getattr(again, letter), getattr(first, letter)
        size = np.sqrt(np.outer(B.diagonal()[pins], B.diagonal()[pins]))
        assert (np.abs(A - B)[np.ix_(pins, pins)] / size).max() < 1e-10
    # Its certificate is that of the matrices alone.
    certificate = check_certificate.main(tmp_path / "d.h5")
    assert certificate.met
    assert certificate.cut_off_hz == 0.0


def test_exudyns_file_comes_back_with_the_pilots_it_was_written_of(tmp_path, body):
    written = export_body.main(body, format="exudyn", out=tmp_path / "a.hdf5", quiet=True)
    checks = {c.name: c.difference for c in written.checks if c.difference is not None}
    response = next(name for name in checks if name.startswith("frequency response"))
    # Exudyn has no damping, so that responses differ; all else is the same.
    assert checks.pop(response) > 1e-6
    assert max(checks.values()) < 1e-8
    assert written.losses[0].startswith("exudyn has no damping")
    with pytest.raises(
        ValueError, match=r"exudyn needs the finite elements, which a\.hdf5 does not"
    ):
        export_body.main(tmp_path / "a.hdf5", format="exudyn", out=tmp_path / "b.hdf5", quiet=True)


def test_a_public_body_of_one_pilot_becomes_a_body_file(tmp_path):
    (tmp_path / "plate.SID_FEM").write_text(sample())
    written = export_body.main(
        tmp_path / "plate.SID_FEM", format="body", out=tmp_path / "plate.h5", quiet=True
    )
    assert max(c.difference for c in written.checks if c.difference is not None) < 1e-12
    assert len(written.losses) == 2
    grounding = next(c for c in written.checks if c.name.startswith("grounding"))
    assert grounding.after == 0.0
    # The frame's only pilot has no stiffness, and no warning of numpy says so.
    check_certificate.main(tmp_path / "plate.h5")


def test_what_is_not_read_back_says_so(tmp_path, body):
    written = export_body.main(body, format="mbdyn", out=tmp_path / "a.fem", quiet=True)
    assert all(check.after is None for check in written.checks)
    assert written.losses == ("mbdyn is not read back by carrierflex: no figures after",)


@pytest.mark.parametrize(
    ("name", "choices", "message"),
    [
        ("a.npz", {}, r"a\.npz: a body of Exudyn in pickled form is not read .*SaveToFile"),
        ("a.fbi", {}, r"Simpack's binary body is not read .* export SID_FEM in ASCII"),
        ("a.cdb", {}, r"not reduced yet is not read .* `carrierflex reduce` with --interfaces"),
        ("a.xyz", {}, r"suffix '\.xyz' is that of no body that is read; expected \.h5, \.op4"),
        ("a.SID_FEM", {}, r"a\.SID_FEM: no line 'end part': the file is cut short"),
        ("a.bdf", {}, r"a\.bdf: no matrix; expected one, or one whose name begins with K"),
        ("pin.h5", {"units": "mm-N"}, r"--units is mm-N, and .*pin\.h5 is a body file"),
    ],
)
def test_what_is_no_body_of_another_program_is_refused(tmp_path, body, name, choices, message):
    source = body if name == "pin.h5" else tmp_path / name
    if source != body:
        source.write_text("no body\n")
    with pytest.raises(ValueError, match=message) as caught:
        export_body.main(source, format="op4", out=tmp_path / "b.op4", quiet=True, **choices)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.glob("b.*"))


def test_what_is_no_body_file_is_refused(tmp_path):
    (tmp_path / "pin.h5").write_text("solid pin")
    with pytest.raises(BodyFileError, match=r"pin\.h5: not a complete body file"):
        export_body.main(tmp_path / "pin.h5", format="op4", out=tmp_path / "pin.op4", quiet=True)
    assert [file.name for file in tmp_path.iterdir()] == ["pin.h5"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"size": None},
            "pin: the body file does not record size; expected one of carrierflex reduce "
            "--coupling rbe3",
        ),
        (
            {"coupling": "rbe2"},
            "pin: the body file was reduced with --coupling rbe2, --interface fixed; "
            "expected one of carrierflex reduce",
        ),
        (
            {"modes": 6},
            "pin: the body made again has other coordinates; expected this program's own body file",
        ),
        ({"size": 0.05}, "pin: the body made again"),
    ],
)
def test_exudyn_refuses_a_body_it_cannot_make_again(tmp_path, body, change, message):
    model = read_body(body)
    record = dict(model.provenance) | {key: json.dumps(value) for key, value in change.items()}
    if change == {"size": None}:
        del record["size"]
    write_body(replace(model, provenance=record), tmp_path / "pin.h5")
    with pytest.raises(ValueError, match=message):
        export_body.main(
            tmp_path / "pin.h5", format="exudyn", out=tmp_path / "pin.hdf5", quiet=True
        )
    assert [file.name for file in tmp_path.iterdir()] == ["pin.h5"]


def test_exudyn_refuses_a_body_whose_matrices_are_not_those_of_its_inputs(tmp_path, body):
    model = read_body(body)
    write_body(replace(model, K=model.K * 1.001), tmp_path / "pin.h5")
    with pytest.raises(
        ValueError,
        match=r"pin: the body made again differs from the file by 1\.0e-03; expected less than "
        r"1e-06",
    ):
        export_body.main(
            tmp_path / "pin.h5", format="exudyn", out=tmp_path / "pin.hdf5", quiet=True
        )
    assert [file.name for file in tmp_path.iterdir()] == ["pin.h5"]


def test_a_body_of_another_make_has_no_finite_elements(tmp_path, body):
    write_body(replace(read_body(body), name="gear"), tmp_path / "gear.h5")
    with pytest.raises(
        ValueError,
        match="no finite elements are known for a body named 'gear'; expected pin, flexible_car",
    ):
        export_body.main(
            tmp_path / "gear.h5", format="exudyn", out=tmp_path / "gear.hdf5", quiet=True
        )


def test_floating_frame_formats_need_the_invariants(tmp_path, body):
    write_body(replace(read_body(body), ffrf=None), tmp_path / "pin.h5")
    for format in ("mbdyn", "sid"):
        with pytest.raises(
            ValueError, match="pin has no inertia invariants, which floating-frame codes need"
        ):
            export_body.main(
                tmp_path / "pin.h5", format=format, out=tmp_path / "pin.out", quiet=True
            )
    assert [file.name for file in tmp_path.iterdir()] == ["pin.h5"]


def test_a_mounting_is_written_about_the_largest_torque_of_a_run(tmp_path):
    out = tmp_path / "mounting.npz"
    result = export_body.main(Path("mounting_2011"), format="statespace", out=out, quiet=True)
    assert result.figures["torque [N m]"] == pytest.approx(81.6e3, rel=1e-4)
    actual = np.load(out)
    assert list(actual["output_names"]) == ["ssx", "spx", "ssz", "spz", "spy", "sbx"]
    case = read_mounting_case(shipped_case("mounting_2011"))
    roots = mounting_modes(case.rig, case.truth, actual["operating_point_values"]).roots
    distance = np.abs(np.linalg.eigvals(actual["A"])[:, None] - roots).min(axis=0)
    assert (distance < 1e-10 * np.abs(roots)).all()


@pytest.mark.parametrize(
    ("case", "choices", "message"),
    [
        ("mounting_2011", {"run": "x"}, "no run 'x'; expected one of load_case"),
        ("carrier_lc1_to_lc4", {}, "holds no equations of motion; expected a body file"),
        ("stage_lc1", {"run": "LC1"}, "a stage is linearised at the speed of its case"),
        ("stage_lc1", {"pilot": "hub"}, "--pilot is given, but statespace holds no pilot"),
    ],
)
def test_cases_without_a_state_space_are_refused(tmp_path, case, choices, message):
    out = tmp_path / "a.mat"
    with pytest.raises(ValueError, match=message):
        export_body.main(Path(case), format="statespace", out=out, quiet=True, **choices)
    assert not list(tmp_path.iterdir())


def test_a_case_is_no_body(tmp_path):
    with pytest.raises(ValueError, match=r"a\.toml: a case, .* or --format statespace"):
        export_body.main(tmp_path / "a.toml", format="op4", out=tmp_path / "a.op4", quiet=True)

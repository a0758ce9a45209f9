"""From the command's functions to a body file that can be trusted, and one that cannot."""

import io
import json

import h5py
import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose
from rich.console import Console

from carrierflex.reduction.body_files import read_body, read_certificate
from carrierflex.workflows.fe import compare_couplings
from carrierflex.workflows.reduction import check_certificate, export_body, reduce_body
from carrierflex.workflows.screen.tables import reduced_table
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long

COARSE = 0.06


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    path = tmp_path_factory.mktemp("bodies") / "carrier.h5"
    reduce_body.main(body="carrier", out=path, modes=12, size=COARSE, quiet=True)
    return path


def test_a_reduced_carrier_carries_a_certificate_that_is_met(body, tmp_path):
    certificate = check_certificate.main(body, out=tmp_path / "certificate.json")
    assert certificate.met
    assert certificate.cut_off_hz > 100.0
    assert checked_document(tmp_path / "certificate.json")["met"] is True


def test_damaged_matrices_are_found_when_the_certificate_is_shown(body, tmp_path):
    damaged = tmp_path / "damaged.h5"
    damaged.write_bytes(body.read_bytes())
    with h5py.File(damaged, "r+") as file:
        file["M"][...] = 1.01 * file["M"][...]
    assert read_certificate(damaged).met
    certificate = check_certificate.main(damaged)
    assert not certificate.met
    assert "mass" in next(check.name for check in certificate.checks if not check.met)


@pytest.mark.long
def test_a_number_that_cuts_a_pair_keeps_both_and_says_so(tmp_path):
    path = tmp_path / "carrier.h5"
    model = reduce_body.main(body="carrier", out=path, modes=1, size=0.1, quiet=True)
    frequencies = np.sqrt(model.K.diagonal()[6 * len(model.pilots) :])
    assert_allclose(frequencies[1:], frequencies[:1], rtol=1e-9)
    assert model.provenance["modes"] == "2"
    text = io.StringIO()
    Console(file=text, width=120).print(reduced_table(model))
    assert "2, 1 requested: modes of equal frequency are kept together" in text.getvalue()
    names = [check.name for check in check_certificate.main(path).checks]
    assert "asymmetry of the modal part, ppm" in names
    assert "unlike response of equal pilots up to the cut-off" in names


def test_a_body_of_an_earlier_version_is_checked_for_what_it_was_not_then(body, tmp_path):
    old = tmp_path / "old.h5"
    old.write_bytes(body.read_bytes())
    with h5py.File(old, "r+") as file:
        earlier = ["unlike" not in name for name in file["certificate/names"].asstr()[:]]
        for column in ("names", "wanted", "reached", "met"):
            values = file["certificate"][column][:][earlier]
            del file["certificate"][column]
            file["certificate"][column] = values
    assert not any("unlike" in check.name for check in read_certificate(old).checks)
    assert any("unlike" in check.name for check in check_certificate.main(old).checks)


def test_modes_follow_from_the_frequency_of_use(tmp_path):
    model = reduce_body.main(
        body="carrier", out=tmp_path / "a.h5", up_to=450.0, size=0.1, quiet=True
    )
    hz = np.sqrt(model.K.diagonal()[6 * len(model.pilots) :]) / (2.0 * np.pi)
    assert 4 < len(hz) < 12
    assert hz.max() < 4.0 * 450.0
    assert read_certificate(tmp_path / "a.h5").cut_off_hz == 450.0
    # Every fixed-interface mode of a pin lies far above: its pilots say all.
    pin = reduce_body.main(body="pin", out=tmp_path / "pin.h5", size=COARSE, quiet=True)
    assert pin.n_coordinates == 6 * len(pin.pilots)
    certificate = check_certificate.main(tmp_path / "pin.h5")
    assert certificate.met
    assert certificate.cut_off_hz == 750.0
    assert any("none below the cut-off; error of the first" in c.name for c in certificate.checks)
    with pytest.raises(ValueError, match="--up-to and --modes are both given"):
        reduce_body.main(body="pin", out=tmp_path / "pin.h5", up_to=1.0, modes=3, quiet=True)


def test_a_body_without_certificate_is_refused(body, tmp_path):
    bare = tmp_path / "bare.h5"
    bare.write_bytes(body.read_bytes())
    with h5py.File(bare, "r+") as file:
        del file["certificate"]
    with pytest.raises(ValueError, match="written without a certificate"):
        check_certificate.main(bare)


def test_cut_off_frequency_keeps_the_modes_below_it(tmp_path):
    path = tmp_path / "pin.h5"
    reduce_body.main(body="pin", out=path, modes_below=12_000.0, size=COARSE, quiet=True)
    frequencies = [
        float(label.split("(")[1].split(" ")[0])
        for label in read_body(path).labels
        if "mode" in label
    ]
    assert frequencies
    assert max(frequencies) < 12_000.0
    with pytest.raises(ValueError, match="expected one of them"):
        reduce_body.main(body="pin", out=path, modes=3, modes_below=1.0, quiet=True)


@pytest.mark.long
def test_a_free_interface_body_is_certified_and_holds_its_free_modes(body, tmp_path):
    path = tmp_path / "free.h5"
    model = reduce_body.main(
        body="carrier", interface="free", out=path, modes=12, size=COARSE, quiet=True
    )
    certificate = check_certificate.main(path)
    assert certificate.met
    names = " ".join(check.name for check in certificate.checks)
    assert "MAC of these" in names
    assert "static compliance at downwind_seat" in names

    def free_hz(reduced):
        return np.sqrt(np.abs(scipy.linalg.eigh(reduced.K, reduced.M, eigvals_only=True)))[6:14] / (
            2.0 * np.pi
        )

    labelled = [
        float(label.split("(")[1].split(" ")[0])
        for label in model.labels
        if label.startswith("mode")
    ]
    assert labelled[:6] == [0.0] * 6
    assert_allclose(free_hz(model), labelled[6:14], atol=0.06)
    # Holding nine pilots shifts every mode: the body of as many fixed-interface modes lies above.
    shift = free_hz(read_body(body)) / free_hz(model) - 1.0
    assert (shift > 0.0).all()
    assert shift.max() > 0.02
    with h5py.File(path) as file:
        assert "effective_interface_mass" not in file
    for more in ({"coupling": "rbe2"}, {"residual_vectors": True}):
        with pytest.raises(
            ValueError, match="--interface free keeps modes by number or frequency at distributing"
        ):
            reduce_body.main(body="pin", interface="free", out=path, quiet=True, **more)


def test_equal_node_weights_are_another_distributing_coupling(tmp_path):
    stiffness = {}
    for coupling in ("rbe3", "rbe3-nodes", "rbe2"):
        path = tmp_path / f"{coupling}.h5"
        model = reduce_body.main(
            body="pin", coupling=coupling, out=path, modes=4, size=COARSE, quiet=True
        )
        assert check_certificate.main(path).met
        stiffness[coupling] = model.K.diagonal()[:18]
    assert (stiffness["rbe3-nodes"] < stiffness["rbe2"]).all()
    difference = np.abs(stiffness["rbe3-nodes"] / stiffness["rbe3"] - 1.0)
    assert 1e-3 < difference.max() < 0.3
    with pytest.raises(
        ValueError, match="was reduced with --coupling rbe3-nodes, --interface fixed"
    ):
        export_body.main(tmp_path / "rbe3-nodes.h5", format="exudyn", out=tmp_path / "pin.npz")


@pytest.mark.long
def test_rigid_couplings_bound_the_stiffness_from_above(tmp_path):
    # Five solutions a carrier: coarser than the others.
    brackets = compare_couplings.main(out=tmp_path, size=0.1, quiet=True)
    for bracket in brackets.values():
        soft, rigid = bracket.stiffness
        assert np.all(rigid > soft)
    # Without pins the bores' own deformation makes half of the rim's three waves: a rigid bore
    # takes it away.
    distributing, stiff = (curve.axial_order_content()[3] for curve in brackets["flexible"].curves)
    assert stiff < 0.7 * distributing
    assert [bracket.curve_name for bracket in brackets.values()] == ["delta_f", "delta_s"]
    # The bores alone make more of the change than the seats or the face, and none of them all of
    # it.
    changes = [
        brackets["flexible"].curve_change(curve)
        for curve in ("shaft face", "bearing seats", "pins", "everything")
    ]
    assert 0.0 < changes[0] < changes[1] < changes[2] < changes[3] < 1.0
    assert brackets["flexible"].curve_change("nothing") == 0.0
    # With bonded pins the load enters at the pins: what holds the shaft face hardly matters.
    assert (
        brackets["stiff"].curve_change("shaft face") < 0.02 < brackets["stiff"].curve_change("pins")
    )
    written = checked_document(tmp_path / "couplings.json")
    assert written["curve_change"]["delta_f"]["pins"] == brackets["flexible"].curve_change("pins")


def test_a_pin_assembled_by_scikit_fem_is_the_same_body(tmp_path):
    arguments = {"body": "pin", "modes": 2, "size": 0.08, "cache": False, "quiet": True}
    compiled = reduce_body.main(out=tmp_path / "a.h5", **arguments)
    plain = reduce_body.main(out=tmp_path / "b.h5", assembly="scikit-fem", **arguments)
    # Rounding, enlarged by the condition of the static condensation.
    assert_allclose(plain.K, compiled.K, rtol=0.0, atol=1e-8 * np.abs(compiled.K).max())
    assert json.loads(plain.provenance["assembly"]) == "scikit-fem"

import os
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
import pytest
import tomli_w
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import (
    campaign_document,
    read_campaign,
    write_campaign,
)
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run
from tests.identification.synthetic_campaigns import carrier_campaign


def same(first, second):
    assert (first.kind, first.name, dict(first.rig)) == (second.kind, second.name, dict(second.rig))
    assert vars(first.baseline) == vars(second.baseline)
    for one, other in zip(first.channels, second.channels, strict=True):
        assert (one.name, one.quantity, one.unit, one.sensor) == (
            other.name,
            other.quantity,
            other.unit,
            other.sensor,
        )
        assert (one.noise_std, one.radius) == (other.noise_std, other.radius)
        if one.angle is not None:
            assert_allclose(one.angle, other.angle, rtol=1e-14)
    for one, other in zip(first.runs, second.runs, strict=True):
        assert (one.name, one.file, one.condition) == (other.name, other.file, other.condition)
        assert (one.time == other.time).all()
        assert list(one.columns()) == list(other.columns())
        for name, values in one.columns().items():
            np.testing.assert_array_equal(values, other.columns()[name])


def with_gaps(campaign, suffix=".csv"):
    runs = []
    for run in campaign.runs:
        signals = {name: values.copy() for name, values in run.signals.items()}
        signals["s137"][3:9] = np.nan
        runs.append(replace(run, signals=signals, file=run.name + suffix))
    return replace(campaign, runs=tuple(runs))


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_campaign_comes_back_bit_for_bit_with_its_missing_samples(tmp_path, suffix):
    campaign = with_gaps(carrier_campaign(), suffix)
    write_campaign(campaign, tmp_path / "new" / "campaign")
    same(read_campaign(tmp_path / "new" / "campaign"), campaign)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["campaign"]


def test_missing_samples_are_empty_cells(tmp_path):
    write_campaign(with_gaps(carrier_campaign()), tmp_path / "campaign")
    lines = (tmp_path / "campaign" / "LC1.csv").read_text().splitlines()
    assert lines[0] == "time,carrier_angle,torque,ntl_y,ntl_z,s047,s137,s227,s317"
    assert lines[4].split(",")[6] == ""


def test_predictions_of_another_simulator_come_back(tmp_path):
    campaign = carrier_campaign()
    runs = tuple(
        replace(run, predictions={k: 0.9 * v for k, v in run.signals.items()})
        for run in campaign.runs
    )
    campaign = replace(campaign, baseline=Baseline("columns"), runs=runs)
    write_campaign(campaign, tmp_path / "c")
    same(read_campaign(tmp_path / "c"), campaign)


def mounting_campaign():
    time = np.arange(5) / 10.0
    inputs = {name: np.ones(5) for name in ("torque", "speed", "carrier_angle", "ntl_y", "ntl_z")}
    rig = dict.fromkeys(
        "R_x R_y R_z R_b R_yz bushing_radial_stiffness bushing_radial_damping "
        "bushing_axial_stiffness bushing_axial_damping housing_mass housing_cg_x shaft_mass "
        "shaft_cg_x coupling_mass coupling_arm "
        "main_bearing_x gear_ratio".split(),
        1.5,
    )
    rig |= {"housing_inertia": [1.0, 2.0, 3.0], "zeroing_samples": 2}
    channel = Channel("u", "housing_displacement", "m", sensor="ssx")
    run = Run("A", "A.csv", "c", time, inputs, {"u": time * 1e-3})
    baseline = Baseline("model", ("cubic_stiffness",))
    return Campaign("mounting", "bushings", baseline, rig, (channel,), (run,))


def element_campaign(unit="m", **rig):
    time = np.arange(5) / 10.0
    run = Run("A", "A.parquet", "c", time, {"force": time**2}, {"y": time})
    channel = Channel("y", "displacement", unit, noise_std=1e-6)
    baseline = Baseline("model", ("coulomb_friction",))
    inputs = (InputSignal("force", unit),) if unit != "m" else ()
    return Campaign(
        "element", "mount", baseline, {"drive": "force", **rig}, (channel,), (run,), inputs
    )


@pytest.mark.parametrize(
    "campaign",
    [
        mounting_campaign(),
        element_campaign(mass=2.0, settle_samples=0),
        element_campaign("V", periodic=True, period_samples=4),
    ],
)
def test_campaigns_of_the_other_kinds_come_back(tmp_path, campaign):
    write_campaign(campaign, tmp_path / "c")
    same(read_campaign(tmp_path / "c"), campaign)
    assert dict(read_campaign(tmp_path / "c").input_units) == dict(campaign.input_units)


def test_an_earlier_simulated_campaign_is_replaced_and_anything_else_is_left_alone(tmp_path):
    folder = tmp_path / "c"
    write_campaign(carrier_campaign(), folder, simulated=True)
    write_campaign(carrier_campaign(seed=3), folder, simulated=True)
    same(read_campaign(folder), carrier_campaign(seed=3))
    (folder / "view.html").write_text("<script>k3d</script>")
    write_campaign(carrier_campaign(), folder, simulated=True)
    assert not (folder / "view.html").exists()
    (folder / "view.html").write_text("a page of mine")
    with pytest.raises(ValueError, match=r"holds 'view\.html', which is no file of the campaign"):
        write_campaign(carrier_campaign(), folder, simulated=True)
    (folder / "view.html").unlink()
    write_campaign(carrier_campaign(seed=3), folder, simulated=True)
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"holds 'notes\.txt', which is no file of the campaign"):
        write_campaign(carrier_campaign(), folder)
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.tex").write_text("mine")
    with pytest.raises(ValueError, match="holds something that is not a campaign"):
        write_campaign(carrier_campaign(), other)
    assert (other / "thesis.tex").read_text() == "mine"
    with pytest.raises(ValueError, match="a file or a link"):
        write_campaign(carrier_campaign(), other / "thesis.tex")


def test_a_failed_write_leaves_nothing(tmp_path):
    def fails(path):
        path.write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_campaign(
            carrier_campaign(), tmp_path / "c", more_files={"deflection_curves.csv": fails}
        )
    assert list(tmp_path.iterdir()) == []


def edit_document(change):
    def edit(folder):
        document = campaign_document(read_campaign(folder))
        change(document)
        (folder / "campaign.toml").write_bytes(tomli_w.dumps(document).encode())

    return edit


def edit_csv(change):
    def edit(folder):
        lines = (folder / "LC1.csv").read_text().splitlines()
        (folder / "LC1.csv").write_text("\n".join(change(lines)) + "\n")

    return edit


def set_cell(line, column, text):
    def change(lines):
        cells = lines[line].split(",")
        cells[column] = text
        return [*lines[:line], ",".join(cells), *lines[line + 1 :]]

    return edit_csv(change)


REFUSALS = {
    "format": (
        edit_document(lambda d: d.update(format="x")),
        r"campaign\.toml: key 'format' is 'x'; expected 'carr",
    ),
    "newer": (
        edit_document(lambda d: d.update(version=3)),
        r"'version' is 3, written by a newer version; expected 2",
    ),
    "version text": (
        edit_document(lambda d: d.update(version="1")),
        r"key 'version' is '1'; expected 2",
    ),
    "unknown key": (
        edit_document(lambda d: d.update(owner="me")),
        r"campaign\.toml: unknown key 'owner'",
    ),
    "missing key": (
        edit_document(lambda d: d.pop("rig")),
        r"campaign\.toml: missing key 'rig'; expected a table",
    ),
    "kind": (
        edit_document(lambda d: d.update(kind="tower")),
        r"key 'kind' is 'tower'; expected one of carrier",
    ),
    "source": (
        edit_document(lambda d: d["baseline"].update(source="guess")),
        r"\[baseline\]: key 'source' is 'guess'",
    ),
    "no effects": (
        edit_document(lambda d: d["baseline"].pop("effects")),
        r"\[baseline\]: missing key 'effects'",
    ),
    "effect": (
        edit_document(lambda d: d["baseline"].update(effects=["magic"])),
        r"campaign\.toml: \[baseline\]: unknown effect 'magic' in 'effects'; kind carrier "
        r"knows axial_offset",
    ),
    "effect of another kind": (
        edit_document(lambda d: d["baseline"].update(effects=["cubic_stiffness"])),
        "unknown effect 'cubic_stiffness'",
    ),
    "rig key": (edit_document(lambda d: d["rig"].update(R_x=1.0)), r"\[rig\]: unknown key 'R_x'"),
    "rig missing": (
        edit_document(lambda d: d["rig"].pop("n_planets")),
        r"\[rig\]: missing key 'n_planets'",
    ),
    "rig value": (
        edit_document(lambda d: d["rig"].update(n_planets=3.5)),
        r"'n_planets' is 3.5; expected a whole",
    ),
    "curves escape": (
        edit_document(lambda d: d["rig"].update(deflection_curves="../c.csv")),
        r"\[rig\]: key 'deflection_curves' '\.\./c\.csv' leads out of the campaign folder",
    ),
    "unit": (
        edit_document(lambda d: d["channels"][1].update(unit="mm")),
        r"campaign\.toml: \[\[channels\]\] s137: key 'unit' is 'mm'; expected 'm'",
    ),
    "quantity": (
        edit_document(lambda d: d["channels"][0].update(quantity="speed")),
        r"\[\[channels\]\] s047: key 'quantity' is 'speed'; expected one of axial_displacement",
    ),
    "channel key": (
        edit_document(lambda d: d["channels"][0].update(sensor="ssx")),
        r"\[\[channels\]\] 1: unknown key 'sensor'",
    ),
    "channel missing": (
        edit_document(lambda d: d["channels"][0].pop("angle_deg")),
        r"\[\[channels\]\] 1: missing key 'angle_deg'; expected a finite number",
    ),
    "duplicate channel": (
        edit_document(lambda d: d["channels"].append(d["channels"][0])),
        r"\[\[channels\]\] name 's047' occurs twice",
    ),
    "input as channel": (
        edit_document(lambda d: d["channels"][0].update(name="torque")),
        "'name' is that of an input column",
    ),
    "noise": (
        edit_document(lambda d: d["channels"][0].update(noise_std=0.0)),
        "'noise_std' is 0.0; expected a pos",
    ),
    "duplicate run": (
        edit_document(lambda d: d["runs"][1].update(name="LC1")),
        r"\[\[runs\]\] name 'LC1' occurs",
    ),
    "duplicate file": (
        edit_document(lambda d: d["runs"][1].update(file="LC1.csv")),
        r"\[\[runs\]\] file 'LC1\.csv'",
    ),
    "escape": (
        edit_document(lambda d: d["runs"][0].update(file="../LC1.csv")),
        r"\[\[runs\]\] 1: key 'file' '\.\./LC1\.csv' leads out of the campaign folder; "
        r"expected a plain file name",
    ),
    "absolute": (
        edit_document(lambda d: d["runs"][0].update(file="/etc/x.csv")),
        "leads out of the campaign folder",
    ),
    "backslash": (
        edit_document(lambda d: d["runs"][0].update(file="..\\x.csv")),
        "leads out of the campaign folder",
    ),
    "suffix": (
        edit_document(lambda d: d["runs"][0].update(file="LC1.mat")),
        "'LC1.mat'; expected a name ending in",
    ),
    "no file": (
        edit_document(lambda d: d["runs"][0].update(file="LC9.csv")),
        r"run LC1: file 'LC9\.csv' is not in",
    ),
    "not toml": (
        lambda f: (f / "campaign.toml").write_text("= 1"),
        r"campaign\.toml: not a TOML file",
    ),
    "no campaign": (
        lambda f: (f / "campaign.toml").unlink(),
        r"no file campaign\.toml; expected a campaign folder",
    ),
    "extra column": (
        edit_csv(lambda lines: [line + (",x" if i == 0 else ",0") for i, line in enumerate(lines)]),
        r"LC1\.csv: column 'x' is neither an input nor a channel \(as in campaign\.toml\); "
        r"expected time, carrier_angle",
    ),
    "prediction without columns": (
        edit_csv(
            lambda lines: [line + (",s047_sim" if i == 0 else ",0") for i, line in enumerate(lines)]
        ),
        r"LC1\.csv: column 's047_sim' is neither an input nor a channel",
    ),
    "missing prediction": (
        edit_document(lambda d: d.update(baseline={"source": "columns"})),
        r"LC1\.csv: no column for the prediction 's047_sim' \(as in campaign\.toml\); found time",
    ),
    "missing channel": (
        edit_csv(lambda lines: [line.rsplit(",", 1)[0] for line in lines]),
        r"LC1\.csv: no column for the channel 's317' \(as in campaign\.toml\); found time",
    ),
    "channel renamed": (
        edit_document(lambda d: d["channels"][0].update(name="carrier")),
        r"LC1\.csv: no column for the channel 'carrier' \(as in campaign\.toml\); found time",
    ),
    "missing input": (
        edit_csv(
            lambda lines: [",".join(line.split(",")[:2] + line.split(",")[3:]) for line in lines]
        ),
        r"LC1\.csv: no column for the input 'torque'",
    ),
    "repeated column": (set_cell(0, 6, "s047"), r"LC1\.csv: column 's047' occurs twice"),
    "time first": (set_cell(0, 0, "t"), r"LC1\.csv: first column is 't'; expected 'time'"),
    "no samples": (edit_csv(lambda lines: lines[:1]), r"LC1\.csv: .*expected at least one"),
    "empty file": (
        lambda f: (f / "LC1.csv").write_text(""),
        r"LC1\.csv: first column is ''; expected 'time'",
    ),
    "text": (set_cell(5, 6, "abc"), r"LC1\.csv: .*abc.*; expected numbers in every column"),
    "ragged": (
        edit_csv(lambda lines: [*lines, "1,2"]),
        r"LC1\.csv: .*[Ee]xpected 9 columns, got 2",
    ),
    "time back": (
        set_cell(5, 0, "0.0"),
        r"LC1\.csv: run LC1: column 'time' is 0.0 at sample 4 .*strictly increasing",
    ),
    "time missing": (set_cell(5, 0, ""), r"LC1\.csv: run LC1: column 'time' is nan at sample 4"),
    "input missing": (
        set_cell(5, 2, ""),
        r"LC1\.csv: run LC1: column 'torque' is nan at sample 4 .*a finite number",
    ),
    "input infinite": (
        set_cell(5, 2, "inf"),
        r"LC1\.csv: run LC1: column 'torque' is inf at sample 4",
    ),
    "angle infinite": (
        set_cell(5, 1, "1e400"),
        r"LC1\.csv: run LC1: column 'carrier_angle' is inf at sample 4",
    ),
    "signal infinite": (
        set_cell(5, 6, "-inf"),
        r"LC1\.csv: run LC1: column 's137' is -inf at sample 4",
    ),
    "wrapped": (
        set_cell(200, 1, "0.1"),
        r"LC1\.csv: run LC1: column 'carrier_angle' is 0.1 at sample 199 .*unwrap it",
    ),
    "long header": (
        set_cell(0, 8, "x" * 100_001),
        r"LC1\.csv: the header line exceeds 100000 bytes",
    ),
    "binary": (
        lambda f: (f / "LC1.csv").write_bytes(b"\xff\xfe\x00"),
        r"LC1\.csv: the header line is not UTF-8",
    ),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("written") / "campaign"
    write_campaign(carrier_campaign(), folder)
    return folder


@pytest.mark.parametrize("name", REFUSALS)
def test_what_breaks_the_contract_is_refused_with_one_line(tmp_path, written, name):
    folder = tmp_path / "campaign"
    folder.mkdir()
    for path in written.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    edit, message = REFUSALS[name]
    edit(folder)
    with pytest.raises(ValueError, match=message) as caught:
        read_campaign(folder)
    assert "\n" not in str(caught.value)


def test_parquet_with_text_or_another_format_is_refused(tmp_path):
    campaign = element_campaign()
    write_campaign(campaign, tmp_path / "c")
    table = pa_parquet.read_table(tmp_path / "c" / "A.parquet")
    text = table.set_column(2, "y", pa.array(["a"] * 5))
    pa_parquet.write_table(text, tmp_path / "c" / "A.parquet")
    with pytest.raises(ValueError, match=r"A\.parquet: column 'y': holds string; expected numbers"):
        read_campaign(tmp_path / "c")
    (tmp_path / "c" / "A.parquet").write_text("time,force,y\n")
    with pytest.raises(ValueError, match=r"A\.parquet: not a Parquet file"):
        read_campaign(tmp_path / "c")


def test_a_parquet_column_whose_name_is_not_text_is_told_with_its_file(tmp_path):
    write_campaign(element_campaign(), tmp_path / "c")
    path = tmp_path / "c" / "A.parquet"
    path.write_bytes(path.read_bytes().replace(b"\x05force", b"\x05\xfforce"))
    with pytest.raises(ValueError, match=r"A\.parquet: a column's name is not UTF-8 text"):
        read_campaign(tmp_path / "c")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda d: d["rig"].update(drive="hand"),
            "'drive' is 'hand'; expected one of force, displacement",
        ),
        (
            lambda d: d["rig"].pop("drive"),
            "missing key 'drive'; expected one of force, displacement",
        ),
        (lambda d: d["rig"].update(periodic=True), "missing key 'period_samples'"),
        (lambda d: d["channels"][0].update(unit="mm"), "'unit' is 'mm'; expected 'm'"),
        (lambda d: d["channels"][0].update(unit="N"), "'unit' is 'N'; expected 'm'"),
        (
            lambda d: d["channels"][0].update(quantity="force"),
            "'quantity' is 'force'; expected one of displacement",
        ),
    ],
)
def test_wrong_element_campaigns_are_refused(tmp_path, change, message):
    write_campaign(element_campaign(), tmp_path / "c")
    edit_document(change)(tmp_path / "c")
    with pytest.raises(ValueError, match=message):
        read_campaign(tmp_path / "c")


def test_a_displacement_driven_element_measures_force(tmp_path):
    run = Run("A", "A.csv", "c", np.arange(3.0), {"displacement": np.zeros(3)}, {"f": np.zeros(3)})
    channel = Channel("f", "force", "N")
    campaign = Campaign(
        "element", "damper", Baseline("model"), {"drive": "displacement"}, (channel,), (run,)
    )
    write_campaign(campaign, tmp_path / "c")
    same(read_campaign(tmp_path / "c"), campaign)


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_what_is_no_file_is_refused_without_being_opened(tmp_path, make):
    campaign = carrier_campaign()
    write_campaign(campaign, tmp_path / "twin")
    path = tmp_path / "twin" / campaign.runs[0].file
    path.unlink()
    make(path)
    with pytest.raises(ValueError, match=f"file '{path.name}' is no regular file in the folder"):
        read_campaign(tmp_path / "twin")

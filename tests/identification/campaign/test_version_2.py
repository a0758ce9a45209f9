"""Version 2 of the campaign format: new keys, what older files may not hold, all errors at once."""

from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from carrierflex.identification.campaign.campaign_files import (
    campaign_document,
    read_campaign,
    write_campaign,
)
from carrierflex.identification.campaign.declarations import Baseline, InputSignal, KnownValue
from tests.identification.campaign.test_campaign_files import element_campaign
from tests.identification.synthetic_campaigns import RIG, carrier_campaign, run_case

SHORT = [run_case("LC1", duration=6.0)]


def every_new_key():
    """Carrier campaign that uses what version 2 brought."""
    campaign = carrier_campaign(SHORT)
    channel, *others = campaign.channels
    declared = replace(channel, gain_std=0.01, zero_std=1e-5, delay_std=1e-3, angle_std=0.01)
    declared = replace(declared, radius_std=2e-3)
    fixed = {
        "carrier_tilt.phi_PLC": KnownValue(5.8e-4, 2e-5),
        "carrier_tilt.theta_PLC": KnownValue(1.05, 0.05),
    }
    return replace(
        campaign,
        baseline=Baseline("model", ("axial_offset", "carrier_tilt"), fixed, ("face_runout",)),
        channels=(declared, *others),
        runs=tuple(replace(run, use=((0.5, 2.0), (3.0, 5.5))) for run in campaign.runs),
        inputs=(InputSignal("torque", "N m", noise_std=10.0, gain_std=0.005),),
    )


def document(campaign=None):
    return campaign_document(campaign or carrier_campaign(SHORT))


def rewritten(folder, changed):
    (folder / "campaign.toml").write_bytes(tomli_w.dumps(changed).encode())


@pytest.fixture
def folder(tmp_path):
    write_campaign(carrier_campaign(SHORT), tmp_path / "c")
    return tmp_path / "c"


def test_every_key_of_version_2_comes_back(tmp_path):
    campaign = every_new_key()
    write_campaign(campaign, tmp_path / "c")
    read = read_campaign(tmp_path / "c")
    assert read.channels[0].angle_std == pytest.approx(0.01, rel=1e-12)
    for name in ("gain_std", "zero_std", "delay_std", "noise_std", "radius_std"):
        assert getattr(read.channels[0], name) == getattr(campaign.channels[0], name)
    assert vars(read.inputs[0]) == vars(campaign.inputs[0])
    assert vars(read.baseline) == vars(campaign.baseline)
    assert read.runs[0].use == campaign.runs[0].use
    assert read.input_units["torque"] == "N m"


def test_a_file_states_the_first_version_that_knows_its_keys():
    assert document()["version"] == 1
    assert document(every_new_key())["version"] == 2
    assert document(element_campaign())["version"] == 1
    assert document(element_campaign("V"))["version"] == 2


@pytest.mark.parametrize(
    ("table_of", "key"),
    [
        (lambda d: d["runs"][0], "use"),
        (lambda d: d["channels"][0], "gain_std"),
        (lambda d: d["channels"][0], "angle_std_deg"),
        (lambda d: d["baseline"], "fixed"),
        (lambda d: d["baseline"], "impossible"),
        (lambda d: d, "inputs"),
    ],
)
def test_a_new_key_in_a_file_of_version_1_is_refused_by_name(folder, table_of, key):
    old, new = document(), document(every_new_key())
    table_of(old)[key] = table_of(new)[key]
    rewritten(folder, old)
    with pytest.raises(ValueError, match=f"key '{key}' belongs to version 2; expected version = 2"):
        read_campaign(folder)


def test_an_analogue_of_version_1_declares_its_input_among_the_channels(tmp_path):
    write_campaign(element_campaign("V"), tmp_path / "c")
    old = document(element_campaign("V"))
    old["channels"].append({"quantity": "force", **old.pop("inputs")[0]})
    rewritten(tmp_path / "c", {**old, "version": 1})
    assert read_campaign(tmp_path / "c").input_units == {"force": "V"}


def test_all_errors_of_a_document_and_the_files_it_names_are_told_at_once(folder):
    changed = document()
    changed["rig"]["n_planets"] = 9
    changed["channels"][1]["unit"] = "mm"
    rewritten(folder, changed)
    (folder / "LC1.csv").unlink()
    with pytest.raises(ValueError, match=r"^3 problems") as caught:
        read_campaign(folder)
    text = str(caught.value)
    assert "'n_planets' is 9; expected a whole number from 3 to 8" in text
    assert "s137: key 'unit' is 'mm'" in text
    assert f"run LC1: file 'LC1.csv' is not in the folder {folder}" in text


def test_records_are_opened_where_their_document_is_sound(folder):
    lines = (folder / "LC1.csv").read_text().splitlines()
    lines[3] = lines[2]
    (folder / "LC1.csv").write_text("\n".join(lines))
    rewritten(folder, {**document(), "no_such_key": 1})
    with pytest.raises(ValueError, match="unknown key 'no_such_key'") as caught:
        read_campaign(folder)
    assert "LC1" not in str(caught.value)
    rewritten(folder, document())
    with pytest.raises(ValueError, match=r"LC1\.csv: run LC1: column 'time' is 0\.05 at sample 2"):
        read_campaign(folder)


def test_all_errors_of_several_records_are_told_at_once(tmp_path):
    write_campaign(carrier_campaign(), tmp_path / "c")
    for name, column in (("LC1", 2), ("LC2", 5)):
        lines = (tmp_path / "c" / f"{name}.csv").read_text().splitlines()
        cells = lines[4].split(",")
        cells[column] = "inf"
        (tmp_path / "c" / f"{name}.csv").write_text("\n".join([*lines[:4], ",".join(cells)]))
    with pytest.raises(ValueError, match=r"2 problems.*LC1\.csv.*'torque'.*LC2\.csv.*'s047'"):
        read_campaign(tmp_path / "c")


def test_other_columns_are_left_out_with_a_note(folder):
    lines = (folder / "LC1.csv").read_text().splitlines()
    lines = [lines[0] + ",oil,remark", *(line + ",40,warm" for line in lines[1:])]
    (folder / "LC1.csv").write_text("\n".join(lines))
    with pytest.raises(ValueError, match="column 'oil' is neither an input nor a channel"):
        read_campaign(folder)
    rewritten(folder, {**document(), "version": 2})
    read = read_campaign(folder)
    assert read.notes == ("LC1.csv: left out, neither an input nor a channel: 'oil', 'remark'",)
    assert "oil" not in read.runs[0].columns()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d["runs"][0].update(use=[[2.0, 1.0]]), r"'use' is \[2, 1\]; expected a list of"),
        (
            lambda d: d["runs"][0].update(use=[[1.0, 3.0], [2.0, 4.0]]),
            "expected a list of windows .* in order and apart",
        ),
        (
            lambda d: d["runs"][0].update(use=[[100.0, 200.0]]),
            "run LC1: no sample of LC1.csv lies in a window of 'use'; its time runs from 0 to",
        ),
        (
            lambda d: d["baseline"].update(fixed={"carrier_tilt.phi_PLC": {"value": 1, "std": 1}}),
            "'carrier_tilt.phi_PLC' alone; expected 'carrier_tilt.theta_PLC' too",
        ),
        (
            lambda d: d["baseline"].update(fixed={"tilt.phi": {"value": 1.0, "std": 1.0}}),
            "'fixed' holds 'tilt.phi'; expected 'effect.parameter' with one of axial_offset",
        ),
        (
            lambda d: d["baseline"].update(fixed={"stiff_pins.rho": {"value": 1.0, "std": 1.0}}),
            "holds 'stiff_pins.rho'; expected one of the parameters rho_s of stiff_pins",
        ),
        (
            lambda d: d["baseline"].update(fixed={"stiff_pins.rho_s": {"value": 1.0, "std": -1.0}}),
            "'std' is -1.0; expected a number >= 0",
        ),
        (
            lambda d: d["baseline"].update(impossible=["axial_offset"]),
            "effect 'axial_offset' is in 'effects' and in 'impossible'",
        ),
        (
            lambda d: d["baseline"].update(impossible=["magic"]),
            "unknown effect 'magic' in 'impossible'",
        ),
        (
            lambda d: d.update(inputs=[{"name": "load", "unit": "N"}]),
            r"\[\[inputs\]\]: key 'name' is 'load'; expected one of carrier_angle, torque",
        ),
        (
            lambda d: d.update(inputs=[{"name": "torque", "unit": "kN m"}]),
            r"\[\[inputs\]\] torque: key 'unit' is 'kN m'; expected 'N m'",
        ),
        (
            lambda d: d["rig"].update(n_planets=4),
            "'n_planets' is 4, and the default carrier has 3; expected key 'deflection_curves'",
        ),
        (lambda d: d["rig"].update(radial_load="some"), "'radial_load' is 'some'; expected 'none'"),
        (
            lambda d: d["rig"].update(deflection_curves="own.csv"),
            "file 'own.csv' of key 'deflection_curves' is not in the folder",
        ),
    ],
)
def test_what_version_2_refuses(folder, change, message):
    changed = {**document(), "version": 2}
    change(changed)
    rewritten(folder, changed)
    with pytest.raises(ValueError, match=message):
        read_campaign(folder)


def test_a_rig_without_radial_load_has_no_columns_of_it(tmp_path):
    campaign = carrier_campaign(SHORT)
    runs = tuple(
        replace(run, inputs={name: run.inputs[name] for name in ("carrier_angle", "torque")})
        for run in campaign.runs
    )
    without = replace(campaign, rig={**RIG, "radial_load": "none"}, runs=runs)
    write_campaign(without, tmp_path / "c")
    read = read_campaign(tmp_path / "c")
    assert set(read.runs[0].inputs) == {"carrier_angle", "torque"}
    assert document(without)["version"] == 2


def test_samples_outside_the_windows_are_missing_and_kept_in_the_record():
    run = replace(carrier_campaign(SHORT).runs[0], use=((0.5, 1.0), (2.0, 2.5)))
    inside = ((run.time >= 0.5) & (run.time <= 1.0)) | ((run.time >= 2.0) & (run.time <= 2.5))
    np.testing.assert_array_equal(np.isfinite(run.within_use().signals["s047"]), inside)
    assert np.isfinite(run.signals["s047"]).all()


def test_a_stage_as_the_baseline_comes_back_with_its_case(tmp_path):
    baseline = Baseline("stage", case="stage.toml")
    write_campaign(replace(carrier_campaign(SHORT), baseline=baseline), tmp_path / "c")
    assert "version = 2" in (tmp_path / "c" / "campaign.toml").read_text()
    assert vars(read_campaign(tmp_path / "c").baseline) == vars(baseline)


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"source": "stage"}, "key 'case' is None and key 'source' is 'stage'; expected the file"),
        (
            {"source": "columns", "case": "stage.toml"},
            "key 'case' is 'stage.toml' and key 'source' is 'columns'; expected the file",
        ),
        ({"source": "stage", "case": "../stage.toml"}, "key 'case' '../stage.toml' leads out"),
        ({"source": "stages"}, "expected one of model, columns, stage"),
    ],
)
def test_a_stage_goes_with_its_case(folder, table, text):
    rewritten(folder, {**document(), "version": 2, "baseline": table})
    with pytest.raises(ValueError, match=text):
        read_campaign(folder)


def test_only_a_carrier_has_a_stage():
    with pytest.raises(ValueError, match="kind element has no stage"):
        replace(element_campaign(), baseline=Baseline("stage", case="stage.toml"))

"""Commands on a campaign whose simulation is a stage: plan, and calibrate into the stage case."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.inference.planning.results import first_sentences
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.reduction.body_files import write_body
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.stage import causes
from carrierflex.simulation.stage.causes import case_values
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.predicted_readings import PredictedStage
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.workflows.diagnosis import calibrate_campaign, plan_campaign
from carrierflex.workflows.simulation.simulate_stage import stage_body_of_case
from tests.diagnosis.carrier.stage_twin import measured
from tests.workflows.checked_documents import checked_document

SUN, CLEARANCE = "stage/sun_radial", "stage/downwind_clearance"
SUN_STIFFNESS = 4e8


@pytest.fixture
def campaign(tmp_path, flexible_reduction, pin_reduction, monkeypatch):
    """Records of a stage whose sun is held, beside the case of one that lets it float."""
    sizes = {"sun_radial": (1e6, 1e8, 1e9, 3e9), "downwind_clearance": (0.0, 0.1e-3, 0.3e-3)}
    few = {name: replace(causes.SIZED_CAUSES[name], sizes=of) for name, of in sizes.items()}
    monkeypatch.setattr(causes, "SIZED_CAUSES", few)
    monkeypatch.setattr(causes, "GROUPS", {name: causes.GROUPS[name] for name in few})
    folder = tmp_path / "campaign"
    folder.mkdir()
    write_body(flexible_reduction.model, tmp_path / "carrier.h5")
    write_body(pin_reduction.model, folder / "pin.h5")
    text = shipped_case("stage_lc1").read_text(encoding="utf-8")
    clearances = "[bearings]\nupwind_clearance = 0.1375e-3\ndownwind_clearance = 0.1225e-3\n\n"
    bodies = f'{clearances}[bodies]\ncarrier = "../carrier.h5"\npin = "pin.h5"\n\n[effects] '
    (folder / "stage.toml").write_text(text.replace("[effects] ", bodies, 1), encoding="utf-8")
    case = read_stage_case(folder / "stage.toml")
    supported = replace(case.data, bearings=replace(case.data.bearings, sun_radial=SUN_STIFFNESS))
    body = stage_body_of_case(case, 0.06)
    records = measured(PredictedStage(body, supported, case.effects, ReadingEffects(), 2.3))
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    write_campaign(records, tmp_path / "written")
    for name, content in files.items():
        (tmp_path / "written" / name).write_bytes(content)
    return tmp_path / "written"


@pytest.mark.long
def test_a_held_sun_goes_into_the_stage_case_and_takes_the_gap(campaign, tmp_path):
    result = calibrate_campaign.main(campaign, out=tmp_path / "out", quiet=True)
    (put_in,) = result.put_in
    assert put_in.effect == SUN
    assert put_in.file == "campaign/stage.toml"
    assert put_in.drawn == StageData().bearings.sun_radial
    assert put_in.calibrated == pytest.approx(SUN_STIFFNESS, rel=0.3)
    case = tomllib.loads((tmp_path / "out" / "campaign" / "stage.toml").read_text())
    assert case["bearings"]["sun_radial"] == put_in.calibrated
    assert case["bearings"]["upwind_clearance"] == 0.1375e-3
    # The copy is elsewhere: a body outside the campaign is named by its whole path.
    assert case["bodies"] == {"carrier": str((tmp_path / "carrier.h5").resolve()), "pin": "pin.h5"}
    assert result.after.verdict == "at_noise_floor"
    assert result.ratio < 0.2
    checked_document(tmp_path / "out" / "calibration.json")


@pytest.mark.long
def test_a_plan_covers_loads_and_sensors_that_no_record_has(campaign, tmp_path):
    plan = plan_campaign.main(
        campaign, out=tmp_path / "plan", effects=[SUN, CLEARANCE, "ntl_tilt"], quiet=True
    )
    sizes = {size.effect: size for size in plan.sizes}
    assert set(sizes) == {SUN, CLEARANCE, "ntl_tilt"}
    assert sizes[CLEARANCE].unit == "m"
    assert sizes[CLEARANCE].parameter == "change of downwind_clearance"
    # Sensors of 5 um in five runs see some micrometres of clearance, and not a tenth of one.
    assert 1e-7 < sizes[CLEARANCE].seen_from < 2e-5
    assert plan.is_measured
    assert (SUN, "ntl_tilt") in {(pair.cause, pair.rival) for pair in plan.pairs}
    assert first_sentences(plan)
    checked_document(tmp_path / "plan" / "plan.json")


def test_values_of_a_cause_add_to_what_the_case_has():
    effects = StageEffects(phi_PLC=1e-3, theta_PLC=0.0, pin_offset=(0.0, 1e-5, 0.0))
    added = {"phi_PLC": 1e-3, "theta_PLC": np.pi / 2.0}
    table, keys = case_values("stage/joint_tilt", added, StageData(), effects, 3)
    assert table == "effects"
    assert keys["phi_PLC"] == pytest.approx(np.sqrt(2.0) * 1e-3)
    assert keys["theta_PLC_deg"] == pytest.approx(45.0)
    shifts = {"pin_2": 2e-5, "pin_3": -1e-5}
    table, keys = case_values("stage/pin_places", shifts, StageData(), effects, 3)
    assert (table, keys["pin_offset"]) == ("effects", pytest.approx([0.0, 3e-5, -1e-5]))
    size = {"response": 1.02, "sun_radial": SUN_STIFFNESS}
    assert case_values(SUN, size, StageData(), effects, 3) == (
        "bearings",
        {"sun_radial": SUN_STIFFNESS},
    )

"""A campaign folder with a stage case: what `diagnose` reads, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.campaign_part import campaign_part
from carrierflex.identification.campaign.declarations import Baseline
from carrierflex.reduction.body_files import write_body
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.carrier.effects.inside_stage import STAGE_EFFECTS
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage import causes
from carrierflex.simulation.stage.predicted_readings import (
    LoadPoints,
    PredictedStage,
    stage_readings,
)
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.workflows.diagnosis.stage_baseline import with_stage
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.simulation.simulate_stage import stage_body_of_case
from tests.identification.synthetic_campaigns import carrier_campaign, run_case

RUNS = [run_case("LC1", duration=6.0), run_case("LC2", duration=6.0)]


@pytest.fixture
def folder(tmp_path, flexible_reduction, pin_reduction):
    """Campaign of two runs beside the case of a stage with bodies of its own."""
    write_campaign(
        replace(carrier_campaign(RUNS), baseline=Baseline("stage", case="stage.toml")),
        tmp_path / "c",
    )
    write_body(flexible_reduction.model, tmp_path / "c" / "carrier.h5")
    write_body(pin_reduction.model, tmp_path / "c" / "pin.h5")
    bodies = '[bodies]\ncarrier = "carrier.h5"\npin = "pin.h5"\n\n[effects] '
    text = shipped_case("stage_lc1").read_text(encoding="utf-8")
    (tmp_path / "c" / "stage.toml").write_text(text.replace("[effects] ", bodies, 1))
    return tmp_path / "c"


@pytest.fixture
def few_causes(monkeypatch):
    """Two causes at few sizes: each stage takes a quarter of a second."""
    names = ("sun_radial", "upwind_clearance")
    few = {name: replace(causes.SIZED_CAUSES[name], sizes=(1e8, 1e9)) for name in names[:1]}
    few["upwind_clearance"] = replace(causes.SIZED_CAUSES["upwind_clearance"], sizes=(1e-4, 2e-4))
    monkeypatch.setattr(causes, "SIZED_CAUSES", few)
    monkeypatch.setattr(causes, "GROUPS", {name: causes.GROUPS[name] for name in few})


def test_predictions_are_the_stages_readings_under_the_measured_loads(folder, monkeypatch):
    few = {"sun_radial": replace(causes.SIZED_CAUSES["sun_radial"], sizes=(1e8, 1e9))}
    monkeypatch.setattr(causes, "SIZED_CAUSES", few)
    monkeypatch.setattr(causes, "GROUPS", {name: causes.GROUPS[name] for name in few})
    measured = read_campaign(folder)
    campaign = with_stage(measured, folder)
    assert campaign.baseline.source == "columns"
    assert [cause.id for cause in campaign.causes] == ["stage/sun_radial"]
    run = campaign.runs[0]
    channel = campaign.channels[0]
    case = read_stage_case(folder / "stage.toml")
    speed = np.ptp(run.inputs["carrier_angle"]) / np.ptp(run.time)
    stage = PredictedStage(
        stage_body_of_case(case, 0.06),
        case.data,
        case.effects,
        replace(case.reading, sensors=None),
        speed,
    )
    load = np.array([[run.inputs[name][0] for name in ("torque", "ntl_y", "ntl_z")]])
    sensor = Sensor(channel.name, AXIAL, channel.angle, channel.radius)
    readings, _ = stage_readings(stage, [sensor], LoadPoints(load, np.full(3, 1e5)))
    turned = np.exp(1j * run.inputs["carrier_angle"][0] * np.arange(readings.series.shape[2]))
    expected = float((readings.series[0, 0] * turned).sum().real)
    assert run.predictions[channel.name][0] == pytest.approx(expected, abs=1e-9)
    assert abs(expected) > 1e-6


def test_causes_that_are_impossible_are_not_solved(folder, monkeypatch):
    few = {name: replace(one, sizes=(1e8,)) for name, one in causes.SIZED_CAUSES.items()}
    few = {name: few[name] for name in ("sun_radial", "axial_stiffness")}
    monkeypatch.setattr(causes, "SIZED_CAUSES", few)
    monkeypatch.setattr(causes, "GROUPS", {name: causes.GROUPS[name] for name in few})
    measured = read_campaign(folder)
    baseline = replace(
        measured.baseline, impossible=("stage/axial_stiffness", "stage/pin_places", "face_runout")
    )
    campaign = with_stage(replace(measured, baseline=baseline), folder)
    assert [cause.id for cause in campaign.causes] == ["stage/sun_radial"]
    assert campaign.baseline.impossible == ("face_runout",)


def test_a_cause_inside_the_stage_is_no_effect_of_another_baseline(folder):
    text = (folder / "campaign.toml").read_text()
    impossible = 'impossible = ["stage/sun_radial"]'
    (folder / "campaign.toml").write_text(text.replace("[baseline]", f"[baseline]\n{impossible}"))
    assert read_campaign(folder).baseline.impossible == ("stage/sun_radial",)
    other = text.replace('source = "stage"', f'source = "model"\n{impossible}')
    other = "\n".join(line for line in other.splitlines() if not line.startswith("case ="))
    (folder / "campaign.toml").write_text(other)
    with pytest.raises(ValueError, match=r"unknown effect 'stage/sun_radial' in 'impossible'"):
        read_campaign(folder)


def test_causes_that_are_not_candidates_are_not_solved(folder):
    campaign = campaign_part(read_campaign(folder), effects=["stage/sun_radial", "housing_tilt"])
    solved = set(STAGE_EFFECTS) - set(campaign.baseline.impossible)
    assert solved == {"stage/sun_radial"}
    baseline = replace(campaign.baseline, impossible=("stage/sun_radial",))
    # What a campaign rules out stays out.
    assert campaign_part(replace(campaign, baseline=baseline)).baseline.impossible == (
        "stage/sun_radial",
    )


def with_fixed(folder, line):
    path = folder / "campaign.toml"
    path.write_text(f"{path.read_text()}\n[baseline.fixed]\n{line}\n", encoding="utf-8")
    return folder


def test_a_known_size_is_solved_there_and_its_prior_is_the_campaigns(folder, few_causes):
    line = '"stage/upwind_clearance.upwind_clearance" = { value = 1e-4, std = 1e-5 }'
    campaign = with_stage(read_campaign(with_fixed(folder, line)), folder)
    (cause,) = [one for one in campaign.causes if one.id == "stage/upwind_clearance"]
    case = read_stage_case(folder / "stage.toml").data.bearings.upwind_clearance
    nodes = cause.shape_nodes(None, 1.0)
    assert_allclose(nodes, sorted({case, 8e-5, 1e-4, 1.2e-4}))
    problem = problem_of(campaign, default_curves())
    (_, size) = problem.parameters(("stage/upwind_clearance",))[-2:]
    assert (size.prior_mean, size.prior_std) == (1e-4, 1e-5)


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("stage/upwind_clearance.play", "expected one of the parameters response, upwind_clear"),
        ("stage/joint_tilt.phi_PLC", "alone; expected 'stage/joint_tilt.theta_PLC' too"),
        ("stage/nothing.size", "expected 'effect.parameter'"),
        (
            "stage/pin_places.pin_4",
            "the stage has 3 planets; expected one of stage/pin_places.pin_",
        ),
    ],
)
def test_a_known_value_that_no_cause_has_is_refused(folder, name, match):
    line = f'"{name}" = {{ value = 1e-4, std = 1e-5 }}'
    with pytest.raises(ValueError, match=match):
        with_stage(read_campaign(with_fixed(folder, line)), folder)


def test_another_baseline_stays_as_it_is(folder):
    campaign = carrier_campaign(RUNS)
    assert with_stage(campaign, folder) is campaign


def test_a_case_of_other_planets_is_refused(folder):
    campaign = read_campaign(folder)
    with pytest.raises(ValueError, match=r"stage\.toml: key 'n_planets' of \[rig\] is 3; expected"):
        with_stage(replace(campaign, rig={**campaign.rig, "n_planets": 4}), folder)


def test_a_case_that_is_not_there_is_named(folder):
    (folder / "stage.toml").unlink()
    with pytest.raises(FileNotFoundError, match=r"stage\.toml"):
        with_stage(read_campaign(folder), folder)

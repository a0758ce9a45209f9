"""What a campaign could see and part, asked before and after it is measured."""

import re

import numpy as np
import pytest

from carrierflex.blind_check.labels import ALIASED, CasePlan
from carrierflex.blind_check.truth.carrier.truth import carrier_case
from carrierflex.diagnosis.inference.planning.results import LOADS, first_sentences
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows.diagnosis import plan_campaign
from tests.workflows.checked_documents import checked_document

SEED = 71101


def case_with(tmp_path, text):
    """Shipped carrier case with two short runs and a table [plan]."""
    shipped = shipped_case("carrier_lc1_to_lc4").read_text(encoding="utf-8")
    short = shipped.replace("duration = 60.0", "duration = 12.0")
    path = tmp_path / "case.toml"
    path.write_text(f"{short}\n[plan]\n{text}", encoding="utf-8")
    return path


def test_costs_and_limits_of_a_case_are_read_and_others_are_the_defaults(tmp_path):
    case = case_with(tmp_path, "sensor_cost = 30.0\nsensor_angles_deg = [90.0]\n")
    settings = plan_campaign.case_settings(case)
    assert settings.costs.sensor == 30.0
    assert settings.costs.load_case == 15.0
    assert settings.limits.sensor_angles == pytest.approx((0.5 * np.pi,))
    assert settings.gap == 6.0


def test_a_wrong_key_of_the_plan_is_refused_by_name(tmp_path):
    with pytest.raises(ValueError, match="sensor_price"):
        plan_campaign.case_settings(case_with(tmp_path, "sensor_price = 30.0\n"))


def test_a_gap_that_is_no_size_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"--gap is -1.0; expected a positive number"):
        plan_campaign.main(case_with(tmp_path, ""), gap=-1.0, quiet=True)


def test_a_stage_is_sent_to_simulate_first():
    with pytest.raises(ValueError, match="expected one, or the campaign folder"):
        plan_campaign.main(shipped_case("stage_lc1"), quiet=True)


@pytest.mark.long
def test_a_case_is_planned_and_written(tmp_path):
    effects = ["carrier_tilt", "unequal_load_sharing", "face_runout", "flexible_pins"]
    plan = plan_campaign.main(
        case_with(tmp_path, ""), out=tmp_path / "out", effects=effects, quiet=True
    )
    document = checked_document(tmp_path / "out" / "plan.json")
    assert (tmp_path / "out" / "plan.png").stat().st_size > 10_000
    assert [size["effect"] for size in document["sizes"]] == [size.effect for size in plan.sizes]
    assert set(effects) == {size.effect for size in plan.sizes}
    assert plan.noise_std == pytest.approx(5e-6)
    assert not plan.is_measured
    assert "floors" in first_sentences(plan)


@pytest.mark.long
def test_a_radial_load_without_a_record_hides_the_static_tilt(tmp_path):
    recorded = case_with(tmp_path, "")
    text = re.sub(r"(?m)^(ntl_[yz] = )\S+", r"\g<1>0.0", recorded.read_text(encoding="utf-8"))
    effects = ["housing_tilt", "carrier_tilt"]
    assert plan_campaign.main(recorded, effects=effects, quiet=True).hidden == ()
    unrecorded = tmp_path / "unrecorded.toml"
    unrecorded.write_text(text, encoding="utf-8")
    plan = plan_campaign.main(unrecorded, effects=effects, out=tmp_path / "out", quiet=True)
    document = checked_document(tmp_path / "out" / "plan.json")
    assert [size["effect"] for size in document["hidden"]] == effects
    tilt, turning = plan.hidden
    # 200 kN along y or along z tilt by 1e-9 rad/N in each of four runs; 4.6 standard deviations.
    assert tilt.unrecorded == pytest.approx(4.6 * np.sqrt(2.0) * 2e-4 / 2.0, rel=0.03)
    # Gauges that err by 1 kN m at an arm of 1.22 m know 200 kN to 0.4 %; noise adds to that.
    assert tilt.bending == pytest.approx(tilt.unrecorded / 244.0, rel=0.1)
    # A load that stands still does not turn with the carrier.
    assert turning.unrecorded == pytest.approx(turning.none, rel=0.05)


@pytest.mark.long
def test_at_one_torque_a_clearance_asks_for_another_torque(tmp_path):
    case = CasePlan("carrier", 6, SEED, ALIASED, ("pin_clearance",), 15.0)
    given, _ = carrier_case(case)
    write_campaign(given, tmp_path / "campaign")
    plan = plan_campaign.main(tmp_path / "campaign", quiet=True)
    assert plan.is_measured
    assert plan.gap == pytest.approx(15.0, rel=0.1)
    assert ("pin_clearance", "stiff_pins") in {(pair.cause, pair.rival) for pair in plan.alike}
    addition = plan.proposal.addition
    assert addition.kind == LOADS
    assert plan.proposal.is_sufficient
    # Longer runs at the same torque tell nothing more.
    longer = [entry for entry in plan.additions if entry.addition.kind == "minutes"]
    assert longer
    assert not any(entry.is_sufficient for entry in longer)

"""Life under an identified tilt: the kink behind it, intervals, and what files may hold."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.involute_pair import ring_planet_pair, sun_planet_pair
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.simulation.stage.tooth_contact import ToothFlank
from carrierflex.workflows.simulation.estimate_gear_life import main
from carrierflex.workflows.simulation.identified_life import (
    Bounded,
    IdentifiedSharing,
    IdentifiedTilt,
    identified_life,
    identified_sharing,
    identified_tilt,
    propagated,
)
from carrierflex.workflows.simulation.order_one_supports import supports
from carrierflex.workflows.simulation.stage_bodies import stage_body_of
from carrierflex.workflows.simulation.stage_misalignment import kinks_in_meshes, stage_states
from carrierflex.workflows.simulation.study_order_one import SENSORS
from tests.workflows.checked_documents import checked_document

KINK, LOAD, FLANK = 0.58e-3, SteadyLoad(360e3), ToothFlank()
FIXED = {"housing held": supports()[19].data}
FREE = {"housing free": supports()[0].data}


@pytest.fixture(scope="module")
def body(flexible_reduction, pin_reduction):
    return stage_body_of(flexible_reduction.model, pin_reduction.model, PAPER_STIFFNESS)


@pytest.fixture(scope="module")
def pairs(gear):
    return {"sun": sun_planet_pair(gear), "ring": ring_planet_pair(gear)}


@pytest.fixture(scope="module")
def rim(body):
    """Tilt that the sensors read of the kink where the housing is held [rad]."""
    effects = StageEffects(phi_PLC=KINK)
    model = stage_model(body, FIXED["housing held"], effects=effects, speed=0.0)
    orders = sensor_orders(model, quasi_static_turn(model, LOAD), SENSORS)
    return orders.mean_amplitude(1) / SENSORS[0].radius


def tilted(value, half, effect="carrier_tilt"):
    return IdentifiedTilt(effect, Bounded(value, value - half, value + half), 0.0, ())


def lives(tilt, body, pairs, *, of=FIXED, sharing=None):
    life = identified_life(tilt, sharing, body, of, pairs=pairs, flank=FLANK, load=LOAD)
    return life, {(one.teeth, one.component): one for one in life.components}


def test_the_kink_behind_the_tilt_is_found_and_costs_what_the_kink_costs(body, pairs, rim):
    # A held housing with tight bearings shows a third of the kink.
    assert 0.2 * KINK < rim < 0.5 * KINK
    _, life = lives(tilted(rim, 0.1 * rim), body, pairs)
    (known,) = (
        kink
        for kink in kinks_in_meshes(stage_states({"": body}, FIXED, KINK, LOAD), pairs, FLANK)
        if kink.mesh == "sun"
    )
    sun = life["do not resist tilt", "sun mesh"]
    assert_allclose(sun.kink.value, KINK, rtol=1e-3)
    assert_allclose(sun.slope.value, abs(known.worst), rtol=1e-3)
    assert_allclose(sun.life_ratio.value, known.life_ratio, rtol=5e-3)
    # Without clearances the statics are linear: a tenth of the tilt is a tenth of kink and slope.
    for bounded in (sun.kink, sun.slope):
        assert_allclose(np.array(bounded.ends[1:]) / bounded.value, (0.9, 1.1), rtol=2e-3)
    for one in life.values():
        assert one.life_ratio.low < one.life_ratio.value < one.life_ratio.high <= 1.0
    # Teeth that resist tilt bring the load to the planet's bearing in place of the flank.
    assert life["resist tilt", "sun mesh"].slope.value < sun.slope.value
    bearing = life["resist tilt", "planet bearing row"]
    assert bearing.load_ratio.value > 1.005
    assert_allclose(bearing.life_ratio.value, bearing.load_ratio.value ** (-10.0 / 3.0))
    assert ("do not resist tilt", "planet bearing row") not in life


def test_a_support_that_hides_every_kink_is_excluded_and_a_joint_tilt_is_the_kink(body, pairs, rim):
    life, _ = lives(tilted(rim, 0.0), body, pairs, of=FREE)
    assert life.components == ()
    assert all(shown < rim for shown in life.excluded.values())
    assert len(life.excluded) == 2
    _, of_joint = lives(tilted(KINK, 0.0, "stage/joint_tilt"), body, pairs, of=FREE)
    assert of_joint["resist tilt", "sun mesh"].kink == Bounded(KINK, KINK, KINK)


def test_load_sharing_adds_to_the_load_and_to_the_interval(body, pairs, rim):
    factor = Bounded(1.1, 1.0, 1.2)
    _, alike = lives(tilted(rim, 0.0), body, pairs)
    _, shared = lives(tilted(rim, 0.0), body, pairs, sharing=IdentifiedSharing("LC1", factor))
    row = ("resist tilt", "planet bearing row")
    expected = np.array(factor.ends) * alike[row].load_ratio.value
    assert_allclose(shared[row].load_ratio.ends, expected, rtol=1e-9)
    mesh = ("do not resist tilt", "sun mesh")
    # Crowning is pressed flat by more load: less than the root of the factor.
    ratio = shared[mesh].load_ratio.value / alike[mesh].load_ratio.value
    assert 1.0 < ratio < np.sqrt(1.1) * 1.001


def test_intervals_are_exact_for_one_input_and_add_in_square_for_two():
    assert propagated(np.array([2.0, 4.0, 1.0])) == Bounded(2.0, 1.0, 4.0)
    e = np.exp([0.0, -0.3, 0.3, 0.4, -0.4])
    assert_allclose(propagated(e).ends, (1.0, np.exp(-0.5), np.exp(0.5)))
    # Both ends of an input may go the same way: misalignment either side of the best.
    assert propagated(np.array([2.0, 1.0, 1.5])) == Bounded(2.0, 1.0, 2.0)


def document(**changes):
    tilt = {
        "phi_PLC": {"value": 6e-4, "std": 1e-5, "unit": "rad", "ci95": [5.8e-4, 6.2e-4]},
        "theta_PLC": {"value": 1.0, "std": 1e-3, "unit": "rad", "ci95": [0.998, 1.002]},
    }
    return {
        "format": "carrierflex-diagnosis",
        "version": 2,
        "parameters": {"carrier_tilt": tilt, "torque_tilt": {}},
        "aliases": [["carrier_tilt", "face_runout"]],
    } | changes


def written(folder, name, content):
    path = folder / name
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_the_tilt_of_a_diagnosis_is_read_with_what_it_cannot_be_distinguished_from(tmp_path):
    written(tmp_path, "diagnosis.json", document())
    tilt = identified_tilt(tmp_path)
    assert tilt.phi == Bounded(6e-4, 5.8e-4, 6.2e-4)
    assert (tilt.theta, tilt.alike, tilt.is_of_joint) == (1.0, ("face_runout",), False)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"parameters": {"torque_tilt": {}}}, "it has torque_tilt"),
        ({"parameters": {}}, "it has no parameter"),
        ({"aliases": 3}, "has no tilt of the carrier with an interval; expected"),
        ({"parameters": {"carrier_tilt": {"phi_PLC": {"value": 1e-3, "ci95": [None, None]},
                                          "theta_PLC": {"value": 0.0}}}}, "expected carrier_tilt"),
        ({"parameters": {"carrier_tilt": {"phi_PLC": {"value": 1e-3, "ci95": [2e-3, 3e-3]},
                                          "theta_PLC": {"value": 0.0}}}}, "in 0.002 to 0.003"),
    ],
)  # fmt: skip
def test_a_diagnosis_without_a_tilt_is_refused_with_what_to_do(changes, reason, tmp_path):
    path = written(tmp_path, "diagnosis.json", document(**changes))
    with pytest.raises(ValueError, match=reason) as refused:
        main(out=tmp_path / "life", diagnosis=path, quiet=True)
    assert "or give --phi-plc" in str(refused.value)
    assert not (tmp_path / "life").exists()


def test_the_sharing_factor_is_of_the_run_of_the_largest_torque(tmp_path):
    def run(name, torque, *factor):
        stated = dict(zip(("value", "low", "high"), factor, strict=True))
        return {"run": name, "torque": {"value": torque}, "load_sharing_factor": stated}

    runs = [run("LC2", 9e4, 1.3, 1.1, 1.5), run("LC1", 3.6e5, 1.05, 0.97, 1.13)]
    content = {"format": "carrierflex-loads", "version": 1, "runs": runs}
    written(tmp_path, "loads.json", content)
    assert identified_sharing(tmp_path) == IdentifiedSharing("LC1", Bounded(1.05, 1.0, 1.13))
    path = written(tmp_path, "loads.json", content | {"runs": []})
    with pytest.raises(ValueError, match="has no load sharing factor with an interval"):
        identified_sharing(path)


def test_typed_and_identified_values_exclude_one_another(tmp_path):
    path = written(tmp_path, "diagnosis.json", document())
    with pytest.raises(ValueError, match="--phi-plc and --diagnosis are both given"):
        main(out=tmp_path / "life", diagnosis=path, phi_plc=1e-3, quiet=True)
    with pytest.raises(ValueError, match="--loads is given without --diagnosis"):
        main(out=tmp_path / "life", loads=path, quiet=True)


@pytest.mark.long
def test_a_diagnosis_goes_through_to_table_and_picture(tmp_path):
    path = written(tmp_path, "diagnosis.json", document())
    life = main(out=tmp_path / "life", diagnosis=path, size=0.06, quiet=True)
    stored = checked_document(tmp_path / "life" / "gear_life.json")
    assert stored["inputs"]["diagnosis"] == str(path)
    assert len(stored["result"]["identified"]["components"]) == len(life.identified.components)
    rows = (tmp_path / "life" / "identified_life.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + len(life.identified.components)
    assert (tmp_path / "life" / "identified_life.png").stat().st_size > 1000
    # The typed study beside it takes the identified size.
    assert {state.phi_PLC for state in life.states} == {0.0, 6e-4}


def test_a_clearance_takes_up_what_more_of_a_kink_would_show(body, pairs):
    clearance = replace(
        FIXED["housing held"].bearings, upwind_clearance=1e-4, downwind_clearance=1e-4
    )
    loose = {"loose": replace(FIXED["housing held"], bearings=clearance)}
    _, life = lives(tilted(4e-4, 4e-5), body, pairs, of=loose)
    _, tight = lives(tilted(4e-4, 4e-5), body, pairs)
    row = ("do not resist tilt", "sun mesh")
    # The clearances show a small kink in full; behind tight bearings it is three times the tilt.
    assert life[row].kink.value < 0.7 * tight[row].kink.value
    assert life[row].kink.low < life[row].kink.value < life[row].kink.high

"""The mounting's truth.

Hand formulas, and the project's simulator as an independent second opinion.
"""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.labels import NOTHING, ONE_CONDITION, OUTSIDE, SINGLE, CasePlan
from carrierflex.blind_check.truth.alias_table import OUTSIDE_NAMES
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.blind_check.truth.mounting.loads import RATE, MountingRecord, drawn_record
from carrierflex.blind_check.truth.mounting.refit import MountingRefit
from carrierflex.blind_check.truth.mounting.rig import RIG, bodies
from carrierflex.blind_check.truth.mounting.state import EFFECTS, MountingState, with_effect
from carrierflex.blind_check.truth.mounting.time_integration import (
    LAWS,
    LEAVES,
    Bushings,
    housing_motion,
    leaf_force,
)
from carrierflex.blind_check.truth.mounting.truth import named_parameters
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import simulate

RIG_BODIES = bodies()
K = RIG["bushing_radial_stiffness"]
L = RIG["main_bearing_x"]
R_x = RIG["R_x"]
PLAIN = Bushings(K, RIG["bushing_radial_damping"])


@pytest.fixture(scope="module")
def record():
    """Quick changes at full load, 26 s of them."""
    drawn = drawn_record(np.random.default_rng(4), 4)
    start = slice(0, 1300)
    return MountingRecord(
        drawn.condition,
        drawn.time[start],
        drawn.speed[start],
        drawn.angle[start],
        drawn.loads[start],
    )


def at_rest_under(torque, ntl_y, ntl_z, bushings=PLAIN):
    loads = (
        np.tile([torque, ntl_y, ntl_z], (200, 1))
        * np.clip(np.arange(200) / 50.0, 0.0, 1.0)[:, None]
    )
    return housing_motion(RIG_BODIES, bushings, loads, 1.0 / RATE)[-1]


@pytest.mark.long
def test_torque_rolls_the_housing_on_its_two_bushings():
    roll = 1e5 * (1.0 - 1.0 / RIG["gear_ratio"]) / (2.0 * K * R_x**2)
    np.testing.assert_allclose(
        at_rest_under(1e5, 0.0, 0.0), roll * np.array([0, 0, R_x, -R_x, 0, 0]), atol=1e-12
    )


@pytest.mark.long
def test_radial_load_tips_the_shaft_about_the_main_bearing():
    pitch = (
        5e4 * RIG["coupling_arm"] / (2.0 * K * L**2)
    )  # upward at the coupling: the housing's nose, upwind, rises
    motion = at_rest_under(0.0, 0.0, 5e4)
    np.testing.assert_allclose(motion[[2, 3]], -L * pitch, rtol=1e-9)
    np.testing.assert_allclose(
        motion[[0, 1, 5]], pitch * np.array([RIG["R_y"], RIG["R_y"], -RIG["R_b"]]), rtol=1e-9
    )


@pytest.mark.long
def test_bearing_that_gives_way_moves_by_its_force():
    """Moments about the bushings: the bearing carries the load times (L + arm) / L."""
    compliance = 2e-9
    soft = replace(PLAIN, compliance=compliance)
    change = (at_rest_under(0.0, 0.0, 5e4, soft) - at_rest_under(0.0, 0.0, 5e4))[[2, 3]]
    # The bushings' force stays, so they stay where they were while the bearing moves.
    np.testing.assert_allclose(change, 0.0, atol=1e-9)
    b_z = compliance * 5e4 * (L + RIG["coupling_arm"]) / L
    tilt = (at_rest_under(0.0, 0.0, 5e4, soft) - at_rest_under(0.0, 0.0, 5e4))[0] / RIG["R_y"]
    np.testing.assert_allclose(tilt, b_z / L, rtol=1e-3)


def simulated(record, **values):
    rig = MountingRig.from_table(RIG)
    inputs = MountingInputs(
        record.time, record.loads[:, 0], record.speed, record.angle, *record.loads[:, 1:].T
    )
    return simulate(rig, parameter_array(rig, values), inputs).signals


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "symbols", "tolerance"),
    [
        ("parasitic_torque", {"P_T": "P_T"}, 1e-6),
        ("axial_bushing_stiffness", {"k_x": "k_x"}, 1e-6),
        ("ntl_direction", {"ntl_angle": "ntl_angle"}, 1e-6),
        ("unequal_bushings", {"starboard_excess": "starboard_excess"}, 1e-6),
        # Between samples another interpolation: a spline there, a polynomial of six samples here.
        ("sensor_delay", {"delay": "delay"}, 1e-4),
        # Damped otherwise there; the bearing hardly moves.
        ("main_bearing_compliance", {"main_bearing_compliance": "main_bearing_compliance"}, 1e-3),
        # Another form of the same class: leaves, a rounded knee, a hyperbolic factor.
        ("cubic_stiffness", {"K3": "K3"}, 2e-2),
        ("quintic_stiffness", {"K5": "K5"}, 4e-2),
        ("elasto_plastic_friction", {"Kp": "Kp", "Fy": "Fy"}, 0.1),
        ("deflection_dependent_damping", {"C3": "C3"}, 0.1),
    ],
)
def test_effects_mean_what_the_simulator_means(record, effect, symbols, tolerance):
    known = MountingState(PLAIN)
    size = np.array([0.012, 0.06])
    state = with_effect(known, effect, np.random.default_rng(7), size)
    values = {name: state.parameters[effect][symbol] for name, symbol in symbols.items()}
    plain, changed = known.read(RIG_BODIES, [record])[0], state.read(RIG_BODIES, [record])[0]
    np.testing.assert_allclose(plain, simulated(record), atol=1e-6 * np.abs(plain).max())
    change, other = changed - plain, simulated(record, **values) - simulated(record)
    assert np.sqrt(np.mean((change - other) ** 2)) < tolerance * np.sqrt(np.mean(other**2))
    assert np.abs(other).max() > 1e-6


@pytest.mark.long
def test_two_branches_of_the_fluid_lie_about_the_named_one(record):
    k, tau = 4e6, 0.1
    law = (LAWS["maxwell_branch"], np.array([k, tau, 0.0, K]), np.ones(2))
    branched = housing_motion(RIG_BODIES, replace(PLAIN, laws=(law,)), record.loads, 1.0 / RATE)
    plain = housing_motion(RIG_BODIES, PLAIN, record.loads, 1.0 / RATE)
    other = simulated(record, k=k, c=k * tau) - simulated(record)
    assert np.sqrt(np.mean((branched - plain - other) ** 2)) < 0.02 * np.sqrt(np.mean(other**2))


def test_leaves_meet_the_power_at_their_steps_and_lie_above_it_between():
    size, stiffness = 8e-3, 1e9
    steps = size * np.array([-1.25, -0.5, 0.125, 0.75, 1.0])
    np.testing.assert_allclose(
        [leaf_force(stiffness, size, 3, u) for u in steps], stiffness * steps**3, rtol=1e-12
    )
    between = leaf_force(stiffness, size, 3, 0.9375 * size)
    assert 1.0 < between / (stiffness * (0.9375 * size) ** 3) < 1.02
    assert LEAVES["cubic_stiffness"] % 100 == 3
    assert LEAVES["quintic_stiffness"] % 100 == 5


@pytest.mark.long
def test_own_refit_finds_the_bushings_of_a_rig_without_effects():
    records = [drawn_record(np.random.default_rng(k), k) for k in (1, 4)]
    bushings = Bushings(1.13 * K, 1.4 * RIG["bushing_radial_damping"])
    signals = MountingState(bushings).read(RIG_BODIES, records)
    refit = MountingRefit(RIG_BODIES, [each.loads for each in records], 1.0 / RATE)
    for residual, signal in zip(refit.residuals(signals), signals, strict=True):
        assert np.abs(residual).max() < 1e-6 * np.abs(signal).max()


def test_own_refit_of_a_motion_that_runs_away_stays_in_numbers():
    t = np.arange(1500) / RATE
    loads = np.column_stack([1e5 * np.sin(t), 5e4 * np.cos(1.3 * t), 5e4 * np.sin(0.7 * t)])
    refit = MountingRefit(RIG_BODIES, [loads], 1.0 / RATE)
    (driven,) = MountingState(Bushings(K, RIG["bushing_radial_damping"])).read(
        RIG_BODIES, [replace(drawn_record(np.random.default_rng(1), 1), time=t, loads=loads)]
    )
    # Against the loads, and growing with time: the stiffer the bushings, the less is left.
    signal = -driven * np.exp(t)[:, None]
    (residual,) = refit.residuals([signal])
    assert np.isfinite(residual).all()
    assert np.abs(residual).max() < 1.01 * np.abs(signal).max()


@pytest.mark.long
def test_gap_is_as_planned_and_nothing_missing_leaves_noise(tmp_path):
    label = write_case(
        CasePlan("mounting", 1, 8, SINGLE, ("cubic_stiffness",), 12.0), tmp_path / "case"
    )
    campaign = read_campaign(tmp_path / "case")
    assert label.gap_over_floor == pytest.approx(12.0)
    assert 0.04 < label.rho < 0.13
    assert len(campaign.runs) == 5
    np.testing.assert_allclose(
        [channel.noise_std for channel in campaign.channels], label.floor, rtol=1e-9
    )
    label = write_case(CasePlan("mounting", 2, 8, NOTHING, (), 0.0), tmp_path / "nothing")
    campaign = read_campaign(tmp_path / "nothing")
    loads = [
        np.array([run.inputs[name] for name in ("torque", "ntl_y", "ntl_z")]).T
        for run in campaign.runs
    ]
    signals = [np.array(list(run.signals.values())).T for run in campaign.runs]
    residual = np.concatenate(MountingRefit(RIG_BODIES, loads, 1.0 / RATE).residuals(signals))
    # The mean of the noise at rest leaves with the zero, errors of the sensors add half a per cent.
    assert residual.std() / label.floor == pytest.approx(1.0, abs=0.04)
    assert label.present == ()
    assert label.where == {}


def test_one_condition_is_one_run(tmp_path):
    label = write_case(
        CasePlan("mounting", 3, 8, ONE_CONDITION, ("parasitic_torque",), 5.0), tmp_path / "case"
    )
    assert len(read_campaign(tmp_path / "case").runs) == 1
    assert label.gap_over_floor == pytest.approx(5.0)


@pytest.mark.acceptance
@pytest.mark.parametrize(
    "name", ["fluid_branch", "main_bearing_compliance", "sensor_zero", "softening_in_time"]
)
def test_other_effects_and_causes_make_a_case(name, tmp_path):
    family = OUTSIDE if name in OUTSIDE_NAMES["mounting"] else SINGLE
    label = write_case(CasePlan("mounting", 5, 8, family, (name,), 10.0), tmp_path / "case")
    assert label.gap_over_floor == pytest.approx(10.0)
    assert label.rho < 0.16
    assert set(label.parameters) == ({"baseline", name} if family == SINGLE else set())
    for run in read_campaign(tmp_path / "case").runs:
        assert np.isfinite(list(run.signals.values())).all()


@pytest.mark.parametrize("effect", EFFECTS)
def test_label_names_parameters_as_the_diagnosis_does(effect):
    state = with_effect(
        MountingState(PLAIN), effect, np.random.default_rng(7), np.array([0.012, 0.06])
    )
    named = named_parameters(state)
    assert set(named[effect]) == {
        parameter.name for parameter in MOUNTING_EFFECTS[effect].parameters
    }
    assert named["baseline"] == {"K1": PLAIN.K1, "C1": PLAIN.C1}
    if effect == "axial_bushing_stiffness":
        assert named[effect]["dk_x"] == state.bushings.k_x - RIG["bushing_axial_stiffness"]

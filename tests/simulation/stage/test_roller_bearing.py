"""Planet bearings roller by roller.

Laws, load zone against Sjövall's integral, clearance, and the whole stage on them.
"""

from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate
from numpy.testing import assert_allclose

from carrierflex.geometry.parameters import GearData
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.part_loads import part_loads, roller_forces
from carrierflex.simulation.stage.response import (
    joined_records,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.roller_bearing import (
    roller_set,
    stiffness_at,
)
from carrierflex.simulation.stage.roller_contact import roller_load, roller_loads
from carrierflex.simulation.stage.stage_data import (
    EXPONENT,
    BearingData,
    RollerBearingData,
    StageData,
)
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from tests.simulation.stage.conftest import SPEED

ROLLERS = RollerBearingData()
LOOSE = 40e-6
LOAD = SteadyLoad(360e3)


def bearing(clearance=0.0, **changes):
    return roller_set(replace(ROLLERS, **changes), GearData(), clearance, (1.0,) * 3)


def loads(rollers, motion, angle=0.3):
    force, tangent = np.zeros(4), np.zeros((4, 4))
    by_angle, _ = roller_load(rollers, 0, np.asarray(motion), angle, force, tangent)
    return force, tangent, by_angle


def energies(rollers, motions, angles):
    return roller_loads(rollers, 0, np.asarray(motions), np.asarray(angles))[1]


def with_rollers(clearance=0.0, **changes):
    return StageData(
        planet_rollers=replace(ROLLERS, **changes),
        bearings=replace(BearingData(), planet_clearance=clearance),
    )


def sjovall(epsilon, power=1.0):
    """Sjövall's integral of line contact (Harris 2001, eq. 7.17).

    ``1/2pi ∫ (1 - (1 - cos psi)/(2 epsilon))^(10/9) cos psi dpsi``, power 1, over the loaded zone.
    """
    edge = np.arccos(np.clip(1.0 - 2.0 * epsilon, -1.0, 1.0))

    def pressed(psi):
        return (
            max(1.0 - (1.0 - np.cos(psi)) / (2.0 * epsilon), 0.0) ** EXPONENT * np.cos(psi) ** power
        )

    return scipy.integrate.quad(pressed, -edge, edge)[0] / (2.0 * np.pi)


@pytest.mark.parametrize("clearance", [0.0, LOOSE, 3.0 * LOOSE])
def test_the_largest_roller_load_follows_from_sjovalls_integral(clearance):
    approach = 60e-6
    n = 400  # many thin rollers: the sum over them is the integral
    rollers = bearing(clearance, n_rollers=n, roller_diameter=1e-3)
    force, _, _ = loads(rollers, [0.0, -(approach + clearance), 0.0, 0.0], angle=0.0)
    largest = ROLLERS.n_rows * ROLLERS.roller_stiffness * approach**EXPONENT
    epsilon = 0.5 * (1.0 - clearance / (approach + clearance))
    assert_allclose(-force[1], n * largest * sjovall(epsilon), rtol=2e-4)
    factor = largest * n / -force[1]
    # Without clearance half the circle carries: Q_max = 4.08 F/Z (Harris 2001, eq. 7.24); usual
    # clearance: 5 F/Z.
    if clearance == 0.0:
        assert_allclose(factor, 4.08, atol=0.005)
    else:
        assert factor > 4.5


def test_seventeen_rollers_carry_like_the_integral_as_their_cage_turns():
    angles = np.linspace(0.0, 2.0 * np.pi / 17.0 / 1.46876, 60, endpoint=False)
    forces = np.array([loads(bearing(), [0.0, -53e-6, 0.0, 0.0], angle)[0] for angle in angles])
    continuous = 2.0 * 17.0 * ROLLERS.roller_stiffness * 53e-6**EXPONENT * sjovall(0.5)
    assert_allclose(-forces[:, 1].mean(), continuous, rtol=1e-3)
    assert 1e-4 < np.ptp(forces[:, 1]) / continuous < 0.02  # the rollers' passing


def test_force_is_the_energys_derivative_and_tangent_the_forces():
    rollers = bearing(LOOSE, profile=0.00035)
    motion = np.array([40e-6, -80e-6, 2e-4, -1e-4])
    step = 1e-9
    force, tangent, by_angle = loads(rollers, motion)
    ends = [(motion + step * e, motion - step * e) for e in np.eye(4)]
    by_motion = [np.subtract(*energies(rollers, pair, [0.3, 0.3])) / (2 * step) for pair in ends]
    assert_allclose(force, by_motion, rtol=1e-5)
    slopes = [(loads(rollers, up)[0] - loads(rollers, down)[0]) / (2.0 * step) for up, down in ends]
    assert_allclose(tangent, slopes, rtol=0.0, atol=1e-5 * np.abs(tangent).max())
    turn = 1e-6
    ahead, behind = energies(rollers, [motion, motion], [0.3 + turn, 0.3 - turn])
    turned = (ahead - behind) / (2.0 * turn)
    assert_allclose(by_angle, turned, rtol=1e-6)


def test_within_its_clearance_a_bearing_carries_nothing_and_beyond_it_fewer_rollers():
    assert_allclose(loads(bearing(LOOSE), [0.0, -0.99 * LOOSE, 0.0, 0.0])[0], 0.0, atol=0.0)
    loaded = []
    for clearance in (0.0, LOOSE, 3.0 * LOOSE):
        rollers = bearing(clearance)
        turns = rollers.directions[0] @ np.array(
            [1.0, 0.0]
        )  # cosine of each roller's angle from the load
        loaded.append(int((turns * (30e-6 + clearance) > clearance).sum()))
        force, _, _ = loads(rollers, [0.0, -(30e-6 + clearance), 0.0, 0.0], angle=0.0)
        approach = np.maximum(turns * (30e-6 + clearance) - clearance, 0.0)
        assert_allclose(
            -force[1],
            2.0 * ROLLERS.roller_stiffness * (approach**EXPONENT * turns).sum(),
            rtol=1e-12,
        )
    assert loaded[0] > loaded[1] > loaded[2] > 0


def test_tilt_presses_opposite_ends_of_opposite_rollers():
    # Planet turned about +y: its downwind end moves towards -z and presses the rollers at the top
    # there, angle 0.
    force, _, _ = loads(bearing(n_rollers=16), [0.0, 0.0, 3e-4, 0.0], angle=0.0)
    assert_allclose(force[:2], 0.0, atol=1e-9 * abs(force[2]) / 0.04)
    assert force[2] > 0.0
    # Two rows 80 mm apart and little else: radial stiffness times the square of half the distance,
    # and rollers' own length.
    radial, tilt = stiffness_at(bearing(), 390e3)
    assert_allclose(tilt, radial * (0.040**2 + 0.053**2 / 12.0), rtol=1e-9)


def test_rating_and_stiffness_are_those_stated():
    assert_allclose(ROLLERS.static_rating, 1.2e6, rtol=0.01)
    # ISO/TS 16281: 53 mm carry 35948 * 53^(8/9) N at 1 mm.
    assert_allclose(
        ROLLERS.roller_stiffness * 1e-3**EXPONENT, 35948.0 * 53.0 ** (8.0 / 9.0), rtol=1e-12
    )
    radial, _ = stiffness_at(bearing(), 390e3)
    # F^0.1 law: stiffness = 10/9 F / approach.
    approach = (390e3 / (2 * 17 * ROLLERS.roller_stiffness * sjovall(0.5))) ** (9.0 / 10.0)
    assert_allclose(radial, EXPONENT * 390e3 / approach, rtol=5e-3)


@pytest.fixture(scope="module")
def rolling_stage(stage_body):
    return stage_model(stage_body, with_rollers(LOOSE), speed=SPEED)


def test_planets_rollers_and_pins_hold_each_other(rolling_stage):
    c = static_coordinates(rolling_stage, LOAD, 0.4)
    rollers = roller_forces(rolling_stage, c[None])[0].sum(axis=-1)
    phi = np.arctan2(*np.moveaxis(rolling_stage.channels.rollers.directions, -1, 0)[::-1])
    phi = phi + rolling_stage.channels.rollers.cage * 0.4
    on_pin = np.stack(
        [(rollers * np.sin(phi)).sum(axis=1), -(rollers * np.cos(phi)).sum(axis=1)], axis=1
    )
    pin = part_loads(rolling_stage, c[None]).pin_force[0]
    for i, v in enumerate((0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0)):
        e, t = np.array([-np.sin(v), np.cos(v)]), np.array([-np.cos(v), -np.sin(v)])
        assert_allclose([on_pin[i] @ e, on_pin[i] @ t], pin[i, 1:], rtol=1e-9, atol=1.0)
    # Newton's third law on the whole planet: teeth, weight and centrifugal force balance what the
    # rollers give back.
    residual = rolling_stage.K[1:, 1:] @ c[1:]
    assert np.isfinite(residual).all()
    assert_allclose(pin[:, 2].sum(), -3.0 * 360e3 / (3.0 * 0.308), rtol=2e-3)


def test_the_linear_option_is_the_rollers_limit_at_the_reference_load(stage_body):
    # Spur teeth: the tilt that a helix gives the planet, 0.7 mrad, stiffens the rollers by 3 %.
    spur = replace(GearData(), helix_angle=1e-6)
    radial, tilt = stiffness_at(bearing(LOOSE), ROLLERS.reference_load)
    linear = StageData(
        gear=spur, bearings=replace(BearingData(), planet_radial=radial, planet_tilt=tilt)
    )
    change = []
    for data in (replace(with_rollers(LOOSE), gear=spur), linear):
        model = stage_model(stage_body, data, speed=0.0)
        spring = model.springs["planet_1"].G @ model.L
        turns = 2.0 * np.pi / 17.0 / 1.46876 * np.arange(5) / 5.0  # the cage by one roller
        low, high = (
            sum(
                static_coordinates(
                    model, SteadyLoad(torque, gravity=0.0), angle, mean_stiffness=True
                )
                for angle in turns
            )
            for torque in (356e3, 364e3)
        )
        change.append((spring @ (high - low))[1])  # pin 1's bearing gives way along the tangent
    assert_allclose(change[0], change[1], rtol=0.005)
    # Half the load is carried by a softer bearing.
    assert stiffness_at(bearing(LOOSE), 0.5 * ROLLERS.reference_load)[0] < 0.97 * radial


def test_clearance_shrinks_the_load_zone_of_the_stage(stage_body):
    loaded, largest = [], []
    for clearance in (0.0, LOOSE, 3.0 * LOOSE):
        model = stage_model(stage_body, with_rollers(clearance), speed=SPEED)
        forces = roller_forces(model, static_coordinates(model, LOAD)[None])[0].sum(axis=-1)
        loaded.append((forces > 0.0).sum())
        largest.append(forces.max())
    assert loaded[0] > loaded[1] > loaded[2]
    assert largest[0] < largest[1] < largest[2]


def test_the_symmetric_stage_shares_equally_on_rollers(stage_body):
    model = stage_model(stage_body, with_rollers(LOOSE), speed=0.0)
    share = part_loads(
        model, static_coordinates(model, SteadyLoad(360e3, gravity=0.0), 0.2)[None]
    ).load_share
    assert_allclose(share, 1.0 / 3.0, rtol=0.0, atol=1e-8)


def test_pin_errors_and_softer_bearings_reach_the_rollers(stage_body):
    def share(**effects):
        model = stage_model(
            stage_body, with_rollers(LOOSE), effects=StageEffects(**effects), speed=SPEED
        )
        c = static_coordinates(model, SteadyLoad(360e3, gravity=0.0), mean_stiffness=True)
        return part_loads(model, c[None]).load_share[0, 0]

    assert (
        share(pin_offset=(20e-6, 0.0, 0.0))
        > 1.0 / 3.0 + 1e-4
        > share(pin_offset=(-20e-6, 0.0, 0.0)) + 2e-4
    )
    assert share(planet_bearing_factor=(0.5, 1.0, 1.0)) < 1.0 / 3.0 - 1e-5


def run(model, duration=0.4, step=1e-3, factor=lambda t: np.ones_like(t)):
    steady = steady_drive(model, LOAD)

    def drive(time):
        rows = steady(time)
        rows[:, 0] *= factor(time)
        return rows

    start = quasi_static_start(model, LOAD)
    return joined_records(
        list(run_stage(model, drive, start, duration=duration, sample_rate=500.0, step=step))
    )


def test_energy_balances_while_rollers_lift_off_and_come_back(rolling_stage):
    record = run(rolling_stage, factor=lambda t: np.cos(12.0 * np.pi * t))
    forces = roller_forces(rolling_stage, record.c).sum(axis=-1)
    assert (
        forces.max(axis=2).min(axis=0) < 0.05 * forces.max()
    ).all()  # every planet is once almost free of its pin
    work = np.abs(np.diff(record.energy[:, 0])).sum()
    assert np.abs(record.imbalance).max() < 1e-6 * work


def test_rollers_pass_the_load_at_their_own_frequency(rolling_stage):
    record = run(rolling_stage, duration=2.0)
    forces = roller_forces(rolling_stage, record.c)[:, 0, 0].sum(axis=-1)
    passes = (np.diff((forces > 0.0).astype(int)) == 1).sum()
    # Roller 1 of planet 1 enters the load zone once a turn of the cage: 22.1 rpm * 1.4688 = 0.541
    # Hz.
    assert passes == 1
    assert_allclose(
        ROLLERS.cage_ratio(GearData()), -99.0 / 39.0 * 0.5 * (1.0 + 36.0 / 229.0), rtol=1e-12
    )


def test_error_falls_with_the_square_of_the_step_on_rollers(rolling_stage):
    rows = [0, rolling_stage.labels.index("generator Rx [rad]")]

    def swing(t):
        return 1.0 + 0.2 * np.sin(10.0 * np.pi * t) ** 2

    steps = np.array([2.5e-4, 1.25e-4, 6.25e-5])
    reference, *runs = (run(rolling_stage, 0.1, h, swing).c[:, rows] for h in (1.5625e-5, *steps))
    errors = np.array([np.abs(c - reference).max(axis=0) for c in runs])
    slopes = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert (slopes > 1.9).all(), slopes
    assert (slopes < 2.15).all(), slopes


def test_impossible_rollers_are_refused():
    with pytest.raises(ValueError, match=r"roller_length is -1\.0; expected a positive number"):
        RollerBearingData(roller_length=-1.0)
    with pytest.raises(
        ValueError,
        match=r"n_rollers is 30: rollers of 0\.036 m overlap on a pitch circle of 0\.229 m",
    ):
        RollerBearingData(n_rollers=30)
    with pytest.raises(
        ValueError, match=r"load on the planet bearing is 0\.0 N; expected a positive one"
    ):
        stiffness_at(bearing(), 0.0)

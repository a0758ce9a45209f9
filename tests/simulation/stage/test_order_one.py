"""How much of a kink in the shaft's joint the sensors see.

Limits in closed form, and every key that decides it.
"""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.quasi_static import (
    quasi_static_turn,
    rest_readings,
    sensor_orders,
    static_tilt,
)
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.simulation.stage.stage_data import BearingData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from carrierflex.workflows.simulation.order_one_supports import supports
from tests.simulation.stage.conftest import SPEED

PHI = 0.58e-3
RADIUS = 0.412
SENSORS = tuple(
    Sensor(f"s{angle:03d}", AXIAL, float(np.deg2rad(angle)), RADIUS)
    for angle in (47, 137, 227, 317)
)
WEIGHTLESS = SteadyLoad(360e3, gravity=0.0)
#: Stiffness of a mounting that holds the housing; the bearings' is 6e9.
FIXED_HOUSING = MountingData(radial_stiffness=1e13, axial_stiffness=1e13, tilt_stiffness=1e13)
#: Distance of the joint and of both bearings' seats from the main bearing [m].
JOINT = 2.1
UPWIND = 2.16
DOWNWIND = 2.6


@pytest.fixture(scope="module")
def rigid_body(flexible_reduction, pin_reduction):
    carrier = replace(flexible_reduction.model, K=1e3 * flexible_reduction.model.K)
    pinned = carrier_with_pins(carrier, pin_reduction.model, PAPER_STIFFNESS)
    return joined_to_shaft(pinned, beam_shaft(ShaftData(), pinned.pilots["shaft_face"]))


def share_of_kink(body, data, load=WEIGHTLESS, effects=None):
    """Order 1 at the sensors over the rim's motion of a kink that nothing holds."""
    model = stage_model(body, data, effects=StageEffects(phi_PLC=PHI, theta_PLC=1.0), speed=0.0)
    orders = sensor_orders(model, quasi_static_turn(model, load), SENSORS, effects)
    return orders.mean_amplitude(1) / (RADIUS * PHI)


def rigid_carrier_on_two_springs(upwind, downwind, main, tilt=0.0):
    """Rotation of a rigid carrier on a beam over the kink between them, in the plane x-z."""
    K = beam_shaft(ShaftData(), np.zeros(3)).K[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])].copy()
    K[0, 0] += main
    near, far = K[2:, 2:], K[2:, :2]
    shaft = near - far @ np.linalg.solve(K[:2, :2], far.T)
    bearings = np.diag([0.0, tilt])
    for stiffness, x in ((upwind, UPWIND), (downwind, DOWNWIND)):
        row = np.array(
            [1.0, -(x - JOINT)]
        )  # z of the seat from z and rotation about y at the joint
        bearings += stiffness * np.outer(row, row)
    return np.linalg.solve(shaft + bearings, shaft @ [0.0, 1.0])[1]


def relative_tilt_in_one_plane(bearings, mounting, rotational):
    """Rotation of a rigid carrier against its housing over the kink, in the plane x-z.

    Shaft's ends, then the housing at the joint: z and rotation each. `rotational` is the stiffness
    [N m/rad] of both bushings together about their own place.
    """
    rows = np.ix_([2, 4, 8, 10], [2, 4, 8, 10])
    K = np.zeros((6, 6))
    K[:4, :4] = beam_shaft(ShaftData(), np.zeros(3)).K[rows]
    load = K[:, 3].copy()  # a kink is a rotation that the shaft's end has without the carrier
    K[0, 0] += bearings.main_radial
    for stiffness, x in ((bearings.upwind_radial, UPWIND), (bearings.downwind_radial, DOWNWIND)):
        arm = x - JOINT
        between = np.array([0.0, 0.0, 1.0, -arm, -1.0, arm])
        K += stiffness * np.outer(between, between)
    # The joint is 0.12 m upwind of the rim's face, from which x of the bushings counts.
    bushes = np.array([0.0, 0.0, 0.0, 0.0, 1.0, -(mounting.x + 0.12)])
    K += 2.0 * mounting.radial_stiffness * np.outer(bushes, bushes)
    K[5, 5] += rotational
    motion = np.linalg.solve(K, load)
    return motion[3] - motion[5]


def wobble_and_rocking(body, data, load=WEIGHTLESS):
    """Parts of order 1 that turn with the carrier and against it, over the kink's motion."""
    model = stage_model(body, data, effects=StageEffects(phi_PLC=PHI, theta_PLC=1.0), speed=0.0)
    first = sensor_orders(model, quasi_static_turn(model, load), SENSORS).amplitudes[:, 1]
    angles = np.array([sensor.angle for sensor in SENSORS])
    sequences = [abs(np.mean(first * np.exp(sign * 1j * angles))) for sign in (1.0, -1.0)]
    return np.array(sequences) / (RADIUS * PHI)


@pytest.mark.parametrize("tilt_stiffness", [0.0, 2.7e5, 4.67e6])
def test_a_kink_rocks_about_the_axis_that_the_mounting_holds(rigid_body, tilt_stiffness):
    # A kink turns; the housing, held about z by 2 k_x arm^2 and about y by little, follows it about
    # y. A motion about one axis is half a wobble forwards and half of one backwards.
    soft = BearingData(upwind_radial=1.7e8, downwind_radial=1.15e8, sun_radial=1.0, sun_tilt=1.0)
    mounting = MountingData(axial_stiffness=8.3e6, x=0.057, tilt_stiffness=tilt_stiffness)
    about_y = 2.0 * tilt_stiffness
    about_z = about_y + 2.0 * mounting.axial_stiffness * mounting.arm**2
    y, z = (relative_tilt_in_one_plane(soft, mounting, stiff) for stiff in (about_y, about_z))
    forward, backward = wobble_and_rocking(rigid_body, StageData(bearings=soft, mounting=mounting))
    assert_allclose([forward, backward], [0.5 * (z + y), 0.5 * (z - y)], rtol=0.01)
    assert z > 0.3
    assert (y < 0.1 * z) == (tilt_stiffness < 1e6)


@pytest.mark.parametrize(
    ("upwind", "downwind", "expected"), [(6e9, 5e9, 0.2815), (1e8, 1e8, 0.8425)]
)
def test_a_held_housing_sees_what_two_bearings_leave_of_the_kink(
    rigid_body, upwind, downwind, expected
):
    bearings = BearingData(upwind_radial=upwind, downwind_radial=downwind)
    beam = rigid_carrier_on_two_springs(upwind, downwind, bearings.main_radial)
    assert_allclose(beam, expected, rtol=1e-4)
    share = share_of_kink(rigid_body, StageData(bearings=bearings, mounting=FIXED_HOUSING))
    assert_allclose(share, beam, rtol=2e-3)


def test_the_flexible_carrier_bends_and_shows_a_little_more(stage_body):
    assert_allclose(share_of_kink(stage_body, StageData(mounting=FIXED_HOUSING)), 0.29, rtol=0.01)


def test_one_bearing_shows_the_kink_but_for_its_distance_from_the_joint(stage_body):
    # Statically determinate: L / (L + a), whatever the stiffnesses; the sun must not hold a planet.
    bearings = BearingData(downwind_radial=0.0, sun_radial=1.0, sun_tilt=1.0)
    share = share_of_kink(stage_body, StageData(bearings=bearings, mounting=FIXED_HOUSING))
    assert_allclose(share, JOINT / UPWIND, rtol=1e-5)


def test_a_housing_without_moment_support_follows_the_carrier(stage_body):
    free = MountingData(axial_stiffness=1e-3)
    assert share_of_kink(stage_body, StageData(mounting=free)) < 1e-4
    # Seen from the ground the same carrier wobbles as a shaft on two pins does: the bushings stand
    # 0.22 m behind the joint.
    share = share_of_kink(
        stage_body, StageData(mounting=free), effects=ReadingEffects(reference="ground")
    )
    assert_allclose(share, JOINT / (JOINT + 0.22), rtol=0.01)


def test_every_support_against_tilt_brings_the_kink_to_the_sensors(stage_body):
    loose = BearingData(upwind_clearance=0.1375e-3, downwind_clearance=0.1225e-3)
    weight = SteadyLoad(360e3)

    def share(load=weight, **mounting):
        data = StageData(bearings=loose, mounting=MountingData(**mounting))
        return share_of_kink(stage_body, data, load)

    plain = share()
    axial = share(axial_stiffness=20.2e6)
    assert 0.02 < plain < 0.06
    assert plain < axial < share(axial_stiffness=20.2e6, x=0.5)
    assert plain < share(tilt_stiffness=5e6) < share(tilt_stiffness=5e7)
    # Bushings upwind of the rim's face are a support too.
    assert np.isfinite(share(x=-0.2))


def test_unequal_bearings_turn_with_the_housing(stage_body):
    # One bearing, statically determinate: equal loads along y and z at every carrier angle.
    bearings = BearingData(upwind_y_factor=1 / 6, downwind_radial=0.0, sun_radial=1.0, sun_tilt=1.0)
    model = stage_model(stage_body, StageData(bearings=bearings, mounting=FIXED_HOUSING), speed=0.0)
    load = SteadyLoad(360e3, ntl_y=1e4, ntl_z=1e4, gravity=0.0)
    channels = model.channels
    assert_allclose(np.diag(channels.K_fixed[6:, 6:]), [1e9, 6e9])
    for angle in (0.0, 1.0):
        turned = (
            channels.turned(angle)
            @ (static_coordinates(model, load, angle) @ channels.B)[channels.turning]
        )
        force = channels.K_fixed[6:, 6:] @ turned[6:]
        assert_allclose(force, -1e4 * 1.22 / UPWIND, rtol=0.01)


def test_unequal_bearings_keep_the_energy_and_run_as_statics_say(stage_body):
    bearings = BearingData(upwind_y_factor=1 / 60, downwind_y_factor=1 / 50)
    data = StageData(
        bearings=bearings,
        mounting=replace(
            FIXED_HOUSING, radial_stiffness=1e9, axial_stiffness=1e9, tilt_stiffness=1e9
        ),
    )
    effects = StageEffects(phi_PLC=PHI, theta_PLC=1.0)
    model = stage_model(stage_body, data, effects=effects, speed=SPEED)
    pieces = list(
        simulate_stage(
            model,
            SteadyLoad(360e3),
            SENSORS,
            duration=2.0 * np.pi / SPEED,
            sample_rate=120 * SPEED / (2.0 * np.pi),
            step=1e-3,
        )
    )
    theta = pieces[0].record.c[:, 0]
    assert np.abs(pieces[0].record.imbalance).max() < 1e-9 * pieces[0].record.energy[-1, 0]
    static = sensor_orders(model, quasi_static_turn(model, SteadyLoad(360e3)), SENSORS)
    for i, sensor in enumerate(SENSORS):
        in_time = 2.0 * np.mean(pieces[0].signals[sensor.name] * np.exp(-1j * theta))
        assert_allclose(in_time, static.amplitudes[i, 1], rtol=0.02)


def test_a_merged_bearing_resists_by_its_tilt_stiffness_alone(rigid_body):
    merged = BearingData(downwind_radial=0.0, upwind_tilt=1e8, sun_radial=1.0, sun_tilt=1.0)
    share = share_of_kink(rigid_body, StageData(bearings=merged, mounting=FIXED_HOUSING))
    beam = rigid_carrier_on_two_springs(6e9, 0.0, merged.main_radial, tilt=1e8)
    assert 0.3 < beam < 0.9 * JOINT / UPWIND
    assert_allclose(share, beam, rtol=2e-3)


def test_the_radial_load_has_an_arm_of_its_own(stage_body):
    moments = []
    for arm in (1.22, 1.75):
        model = stage_model(stage_body, StageData(mounting=MountingData(ntl_arm=arm)), speed=0.0)
        hub = model.layout.body.model.coordinates_of(model.layout.hub)
        q = np.linalg.pinv(model.L.T) @ model.loads.radial_z
        moments.append(q[hub[4]])
    assert_allclose(moments, [1.22, 1.75], rtol=1e-9)


def test_gravity_tilts_and_none_does_not(stage_body):
    model = stage_model(stage_body, speed=0.0)
    tilts = [
        static_tilt(sensor_orders(model, quasi_static_turn(model, load), SENSORS), SENSORS)
        for load in (SteadyLoad(360e3), WEIGHTLESS)
    ]
    # The carrier sinks at its downwind end against the housing: a tilt about y alone, by weight.
    assert 2e-5 < np.abs(tilts[0]).max() < 8e-5
    assert np.abs(tilts[1]).max() < 1e-7


def test_spur_gears_push_nothing_along_the_axis(stage_body):
    gear = GearData(helix_angle=0.0)
    model = stage_model(stage_body, StageData(gear=gear), speed=0.0)
    normals = np.array([line.normal for line in model.channels.lines])
    assert_allclose(normals[:, 0], 0.0, atol=1e-15)
    # Without overlap the number of teeth in contact jumps.
    helical = stage_model(stage_body, speed=0.0).channels.stiffness[0].amplitudes
    assert np.abs(model.channels.stiffness[0].amplitudes[1]) > 2.0 * np.abs(helical[1])


def test_wrong_supports_are_refused():
    with pytest.raises(ValueError, match=r"upwind_y_factor is 0\.5 with a clearance of 0\.0001 m"):
        BearingData(upwind_y_factor=0.5, upwind_clearance=1e-4)
    with pytest.raises(ValueError, match=r"\[mounting\] tilt_stiffness is -1\.0; expected"):
        MountingData(tilt_stiffness=-1.0)
    with pytest.raises(ValueError, match=r"\[mounting\] x is nan; expected a finite number"):
        MountingData(x=float("nan"))
    assert MountingData(x=-0.3).x == -0.3
    with pytest.raises(ValueError, match="reference is 'moon'; expected housing or ground"):
        ReadingEffects(reference="moon")


def test_a_motion_without_stiffness_is_named(stage_body):
    loose = StageData(bearings=BearingData(planet_tilt=0.0))
    with pytest.raises(ValueError, match=r"'planet_1 R[yz] \[rad\]' meets no stiffness"):
        static_coordinates(stage_model(stage_body, loose, speed=0.0), WEIGHTLESS)


def test_without_gravity_the_sensors_rest_at_zero(stage_body):
    model = stage_model(stage_body, speed=0.0)
    rest = np.array(list(rest_readings(model, SENSORS, 0.3).values()))
    weightless = np.array(list(rest_readings(model, SENSORS, 0.3, gravity=0.0).values()))
    assert np.abs(rest).max() > 1e-6
    assert np.abs(weightless).max() < 1e-12


def case_of(support, folder):
    """Case file that states a support of the study by its keys alone."""
    text = shipped_case("stage_lc1").read_text(encoding="utf-8")
    text = text.replace("[effects] ", "[effects]\n#").replace("[reading] ", "[reading]\n#")
    tables = {
        name: changes(getattr(support.data, name), getattr(StageData(), name))
        for name in ("bearings", "mounting", "mesh")
    }
    for name, table in tables.items():
        lines = [f"{key} = {value!r}" for key, value in table.items()]
        text += "\n".join(["", f"[{name}]", *lines, ""])
    reading = changes(support.reading, ReadingEffects())
    lines = [f"{key} = {str(value)!r}" if key == "reference" else f"{key} = {value!r}"
             for key, value in reading.items()]  # fmt: skip
    text = text.replace("noise_std = 5e-6 ", "\n".join([*lines, "#"]))
    text = text.replace("phi_PLC = 0.58e-3", f"phi_PLC = {support.phi_PLC!r}")
    text = text.replace("pin_fit_stiffness", f"gravity = {support.load.gravity}\npin_fit_stiffness")
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return read_stage_case(path)


def changes(value, nominal):
    """Fields of a record that are not the nominal ones."""
    both = ((entry.name, getattr(value, entry.name)) for entry in fields(value))
    return {name: changed for name, changed in both if changed != getattr(nominal, name)}


def documented_orders():
    """Order 1 [um] by support, from the page's table."""
    page = (Path(__file__).parents[3] / "docs" / "papers.md").read_text(encoding="utf-8")
    section = page.partition("### Order 1 by support")[2].partition("\n#")[0]
    rows = [line.strip("| ").split(" | ") for line in section.splitlines() if line[:2] == "| "]
    return {name: float(order_1) for name, order_1, *_ in rows[1:]}


@pytest.mark.parametrize("support", supports(), ids=lambda support: support.name)
def test_every_support_of_the_table_is_a_case_file_and_gives_its_order_1(
    stage_body, tmp_path, support
):
    case = case_of(support, tmp_path)
    assert case.data == support.data
    assert case.runs[0].load == support.load
    model = stage_model(stage_body, case.data, effects=case.effects, speed=0.0)
    record = quasi_static_turn(model, case.runs[0].load)
    orders = sensor_orders(model, record, case.sensors, case.reading)
    axial = [sensor.quantity == AXIAL for sensor in case.sensors]
    order_1 = np.abs(orders.amplitudes[axial, 1]).mean()
    # The page's elements are half as long; half of its last digit is 1 % of the smallest.
    assert_allclose(order_1 * 1e6, documented_orders()[support.name], rtol=0.02)

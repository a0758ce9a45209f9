"""Carriers of three to five planets: what the symmetry says holds for every number of them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.half_sector_curve import half_sector_curve
from carrierflex.fe.load_cases import bonded_pin_load, gear_forces, simply_supported_pin_load
from carrierflex.fe.static import clamped_displacement
from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.reduction.certificate import inner_checks
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.pin_fit import PinFitFamily
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.fe.bodies import body_structure
from carrierflex.workflows.reduction.half_sector_bodies import half_sector_body
from carrierflex.workflows.simulation.stage_bodies import stage_body_of

SIZE = 0.06
N_MODES = 8
#: Planet teeth, centre distance [m] and planets' tip diameter [m] of a stage with the same ring.
GEARS = {3: (39, 0.308, 0.4212), 4: (33, 0.3388, 0.3596), 5: (29, 0.3593, 0.3185)}


def stage_of(n_planets):
    """Stage of this number of planets by the rules of four_planets.toml."""
    planet_teeth, a, tip = GEARS[n_planets]
    sun_teeth, beyond = 99 - 2 * planet_teeth, a - 0.308
    pin = round(0.160 * planet_teeth / 39, 3)
    carrier = CarrierParameters(
        n_planets=n_planets, centre_distance=a, pin_hole_diameter=pin, outer_radius=0.435 + beyond,
        sensor_radius=0.412 + beyond, web_inner_radius=0.235 + beyond,
        planet_clearance_radius=round(tip / 2.0 + 0.0084, 3),
    )  # fmt: skip
    gear = GearData(
        planet_teeth=planet_teeth, sun_teeth=sun_teeth, centre_distance=a, planet_tip_diameter=tip,
        sun_tip_diameter=2.0 * a * sun_teeth / (99 - planet_teeth) + 0.02,
    )  # fmt: skip
    return StageParameters(carrier, PinParameters(diameter=pin), gear)


pytestmark = pytest.mark.long

NUMBERS = (3, 4, 5)


@pytest.fixture(scope="module", params=NUMBERS, ids=lambda n: f"{n} planets")
def stage(request):
    return stage_of(request.param)


@pytest.fixture(scope="module")
def bodies(stage):
    """Whole carrier without pins, its reduction, that from the half sector, and the pin's."""
    mesh, structure = body_structure("flexible_carrier", stage, SIZE)
    half, sensors = half_sector_body("flexible_carrier", stage, SIZE)
    full = craig_bampton(structure, N_MODES)
    symmetric = symmetric_craig_bampton(half, N_MODES, sensors=sensors)
    pin = craig_bampton(body_structure("pin", stage, SIZE)[1], 4).model
    return mesh, structure, full, symmetric, pin


def torque_loads(stage):
    """Loads of 1 kN m on pin 1 of the carrier without and with its pins."""
    carrier, n = stage.carrier, stage.carrier.n_planets
    force = gear_forces(1000.0, stage.gear, n).F_PLC
    return simply_supported_pin_load(1, force, 0.0, carrier), bonded_pin_load(1, force, 0.0, n)


def test_blocks_give_the_whole_bodys_pilots_frequencies_and_sensors(bodies):
    _, _, full, symmetric, _ = bodies
    m = full.Psi.shape[1]
    for letter in "KM":
        result, expected = (getattr(r.model, letter)[:m, :m] for r in (symmetric, full))
        scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
        assert_allclose(result / scale, expected / scale, rtol=0.0, atol=1e-9)
    assert_allclose(symmetric.basis.omega[:N_MODES], full.modes.omega[:N_MODES], rtol=1e-9)
    expected = full.model.sensor_rows[:, :m]
    result = symmetric.model.sensor_rows[:, :m]
    assert_allclose(result, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_a_body_has_the_symmetry_of_its_pins_and_no_other(bodies):
    model = bodies[3].model
    n = sum(name.endswith("_upwind") for name in model.pilots)
    checks = inner_checks(model, 500.0)
    assert any(check.name == f"asymmetry under {360 / n:g} deg, ppm" for check in checks)
    assert all(check.met for check in checks), checks


def test_the_half_sectors_curve_is_the_whole_carriers(stage, bodies):
    mesh, structure, *_ = bodies
    carrier, n = stage.carrier, stage.carrier.n_planets
    half = flexible_half_sector(carrier, SIZE)
    curve = half_sector_curve(half, carrier, torque_loads(stage)[0])
    force = gear_forces(1000.0, stage.gear, n).F_PLC
    loads = {}
    for pin in range(1, n + 1):
        loads |= simply_supported_pin_load(pin, force, 0.0, carrier)
    f = structure.load_vector(loads)[:, None]
    u = clamped_displacement(structure, np.unique(mesh.surface("shaft_face")), f).u
    axial = (structure.sensors.rows @ u)[:360, 0]
    assert_allclose(curve.axial, axial, rtol=0.0, atol=1e-9 * np.abs(axial).max())


def test_curves_have_one_peak_a_planet_without_pins_and_two_with_bonded_pins(stage):
    carrier, n = stage.carrier, stage.carrier.n_planets
    flexible_load, stiff_load = torque_loads(stage)
    flexible = half_sector_curve(flexible_half_sector(carrier, SIZE), carrier, flexible_load)
    half = stiff_half_sector(carrier, stage.pin, SIZE)
    stiff = half_sector_curve(half, carrier, stiff_load)
    assert len(flexible.peak_angles()) == n
    assert len(stiff.peak_angles()) == 2 * n
    for curve in (flexible, stiff):
        content = curve.axial_order_content()
        others = content[np.arange(content.size) % n != 0]
        assert others.max() < 1e-9 * content.max()


def test_a_stiffer_pin_fit_lowers_the_planets_order(stage, bodies):
    _, _, full, _, pin = bodies
    forces = gear_forces(1000.0, stage.gear, stage.carrier.n_planets)
    family = PinFitFamily(full.model, pin, forces, stage.carrier.sensor_radius)
    n = family.n_planets
    assert n == stage.carrier.n_planets
    orders = [family.curve(k).axial_order_content()[n] for k in (0.0, 1e7, 1e8, np.inf)]
    assert sorted(orders, reverse=True) == orders
    assert orders[-1] < 0.5 * orders[0]


def test_planets_share_the_torque_and_the_stage_repeats_from_pin_to_pin(stage, bodies):
    _, _, full, _, pin = bodies
    n, gear = stage.carrier.n_planets, stage.gear
    model = stage_model(stage_body_of(full.model, pin, 1e7), StageData(gear=gear), speed=0.0)
    torque = 100e3
    # A pitch of the pins later each planet stands where its neighbour stood.
    c = quasi_static_turn(model, SteadyLoad(torque), n_angles=n).c
    loads = part_loads(model, c)
    expected = np.roll(loads.pin_force[0], -1, axis=0)
    assert_allclose(loads.pin_force[1], expected, rtol=0.0, atol=1e-8 * torque)
    assert_allclose(loads.load_share.mean(axis=0), 1.0 / n, rtol=2e-3)
    # Weight adds nothing to the mean over a turn: the pins carry the torque.
    tangential = loads.pin_force[:, :, 2].sum(axis=1).mean()
    assert_allclose(-tangential * gear.centre_distance, torque, rtol=2e-3)

"""Inertia in the turning frame, and the sign of the misalignment."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.involute_pair import ring_planet_pair
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from tests.simulation.stage.conftest import SPEED


@pytest.fixture(scope="module")
def still_stage(stage_body):
    return stage_model(stage_body, speed=0.0)


def test_what_stands_still_in_the_fixed_frame_feels_no_inertia(nominal_stage, still_stage):
    # Everything shifted along the fixed z, seen from the carrier: u = c_z, u' = Omega c_y, u'' =
    # -Omega^2 c_z at theta = 0.
    along_y, along_z = np.linalg.solve(nominal_stage.L, nominal_stage.places.translations[:, 1:]).T
    terms = (
        -(SPEED**2) * nominal_stage.M @ along_z,
        SPEED * nominal_stage.G @ along_y,
        (nominal_stage.K - still_stage.K) @ along_z,
    )
    assert_allclose(sum(terms), 0.0, rtol=0.0, atol=1e-6 * np.abs(terms[0]).max())


def test_coriolis_forces_do_no_work(nominal_stage):
    assert_allclose(
        nominal_stage.G, -nominal_stage.G.T, rtol=0.0, atol=1e-9 * np.abs(nominal_stage.G).max()
    )


def test_turning_planets_are_held_by_their_pins_against_the_centrifugal_force(nominal_stage, gear):
    loads = part_loads(
        nominal_stage, static_coordinates(nominal_stage, SteadyLoad(360e3, gravity=0.0))[None]
    )
    pair = ring_planet_pair(gear)
    radial = np.cos(pair.base_helix_angle) * np.sin(pair.working_pressure_angle)
    teeth = (loads.mesh_force[0, :3] - loads.mesh_force[0, 3:6]) * radial
    # 147 kg at 0.308 m; the pin's own bending moves the planet by less than 1 mm.
    assert_allclose(loads.pin_force[0, :, 1] - teeth, 147.0 * 0.308 * SPEED**2, rtol=3e-3)


def test_misalignment_tilts_the_rim_as_the_papers_equation_1_does():
    angle = np.linspace(0.0, 6.0, 7)
    ry, rz = StageEffects(phi_PLC=1e-3, theta_PLC=0.4).misalignment
    # A small rotation moves the rim point R e(v) by R (ry cos v + rz sin v) along x.
    assert_allclose(
        ry * np.cos(angle) + rz * np.sin(angle), 1e-3 * np.sin(0.4 - angle), rtol=0.0, atol=1e-18
    )

"""Main shaft as a beam, and its joint with the carrier."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes, mass_properties_from
from carrierflex.simulation.stage.stage_body import (
    ShaftData,
    StageBody,
    beam_shaft,
    joined_to_shaft,
)


@pytest.fixture(scope="module")
def shaft():
    return beam_shaft(ShaftData(), np.zeros(3))


def test_shaft_has_the_papers_torsional_stiffness(shaft):
    # 2011 paper, figure 12: 50 MN m/rad, which the diameter was chosen for (printed with two
    # digits).
    assert_allclose(shaft.K[9, 9], 50e6, rtol=1e-2)


def test_shaft_bends_like_a_cantilever_with_shear(shaft):
    tip = np.linalg.solve(shaft.K[6:, 6:], np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    area, second = np.pi * (0.1705**2 - 0.03**2), np.pi / 4.0 * (0.1705**4 - 0.03**4)
    # F l^3 / 3 EI + F l / kappa GA, slope F l^2 / 2 EI.
    assert_allclose(
        tip[1], 2.1**3 / (3.0 * 210e9 * second) + 2.1 / (0.89 * 79.3e9 * area), rtol=1e-9
    )
    assert_allclose(tip[5], 2.1**2 / (2.0 * 210e9 * second), rtol=1e-9)


def test_shaft_moves_freely_and_keeps_its_mass(shaft):
    R = geometric_rigid_modes(shaft)
    assert_allclose(shaft.K @ R, 0.0, rtol=0.0, atol=1e-9 * np.abs(shaft.K).max())
    result, stated = mass_properties_from(shaft, R), shaft.mass_properties
    assert_allclose(result.mass, 1460.0, rtol=0.01)  # data sheet
    assert_allclose(result.centre, stated.centre, rtol=0.0, atol=1e-9)
    assert_allclose(result.inertia, stated.inertia, rtol=1e-9, atol=1e-6)


def test_joined_body_moves_freely_and_adds_up(stage_body, pinned_carrier, shaft):
    model = stage_body.model
    R = geometric_rigid_modes(model)
    assert np.abs(model.K @ R).max() < 1e-6 * np.abs(model.K).max()
    assert_allclose(
        mass_properties_from(model, R).mass,
        pinned_carrier.mass_properties.mass + shaft.mass_properties.mass,
        rtol=1e-9,
    )


def test_misalignment_of_a_free_body_bends_nothing(stage_body, pinned_carrier):
    # The load is what holds the carrier unbent in its tilt, so the tilted, unbent state carries no
    # force.
    model, tilt = stage_body.model, np.array([1e-3, -2e-3])
    rigid = geometric_rigid_modes(model)
    joint = pinned_carrier.pilots["shaft_face"]
    about_joint = rigid[:, 3:] + rigid[:, :3] @ np.cross(np.eye(3), -joint[None]).T
    tilted = about_joint[:, 1:] @ tilt
    for pilot in ("main_bearing_seat", "carrier_joint"):
        tilted[model.coordinates_of(pilot)] = 0.0
    force = model.K @ tilted - stage_body.misalignment_load @ tilt
    assert np.abs(force).max() < 1e-6 * np.abs(stage_body.misalignment_load @ tilt).max()
    # There the rim reads the rigid tilt: u_x = ry z - rz y.
    rim = (model.sensor_rows @ tilted + stage_body.misalignment_reading @ tilt)[:360]
    angle = np.deg2rad(np.arange(360))
    # The coarse mesh's circle is 412 mm to 5e-5.
    assert_allclose(
        rim,
        0.412 * (tilt[0] * np.cos(angle) + tilt[1] * np.sin(angle)),
        rtol=0.0,
        atol=1e-4 * 0.412 * 2e-3,
    )


def test_bodies_without_what_the_stage_holds_are_refused(stage_body, pinned_carrier, shaft):
    with pytest.raises(KeyError, match=r"no body has a pilot 'carrier_joint'"):
        joined_to_shaft(pinned_carrier, renamed(shaft))
    with pytest.raises(ValueError, match=r"carrier_joint and shaft_face are 0\.12 m apart"):
        joined_to_shaft(pinned_carrier, shaft)
    with pytest.raises(
        ValueError,
        match=r"has no pilot 'main_bearing_seat', which the planetary stage takes hold of",
    ):
        StageBody(pinned_carrier, ("pin_1_midspan_of_pin",), np.zeros((1, 2)), np.zeros((1, 2)))
    blind = replace(
        stage_body.model, sensor_names=(), sensor_rows=np.zeros((0, stage_body.model.n_coordinates))
    )
    with pytest.raises(ValueError, match=r"has no sensor rows rim_axial_"):
        replace(stage_body, model=blind)


def renamed(shaft):
    """A shaft whose pilots have other names."""
    rows = {
        f"other_{name}": rows_of_pilot for name, rows_of_pilot in shaft.pilot_coordinates.items()
    }
    return replace(
        shaft,
        pilots={f"other_{name}": point for name, point in shaft.pilots.items()},
        pilot_coordinates=rows,
    )


def test_impossible_shafts_are_refused():
    with pytest.raises(ValueError, match=r"inner_diameter is 0\.5 m; expected less than 0\.341 m"):
        ShaftData(inner_diameter=0.5)
    with pytest.raises(ValueError, match=r"length is -1\.0; expected a positive number"):
        ShaftData(length=-1.0)

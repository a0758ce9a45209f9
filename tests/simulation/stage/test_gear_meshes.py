"""Lines of action, mesh stiffness and phases."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.involute_pair import ring_planet_pair, sun_planet_pair
from carrierflex.simulation.stage.channels import _approach_row
from carrierflex.simulation.stage.gear_meshes import flank_line, mesh_phase, mesh_stiffness
from carrierflex.simulation.stage.stage_data import MeshData


def test_driving_the_train_opens_and_closes_no_mesh(nominal_stage):
    drive = nominal_stage.layout.drive_motion
    for line in nominal_stage.channels.lines:
        assert abs(_approach_row(nominal_stage.layout, line) @ drive) < 1e-14


@pytest.mark.parametrize(("mate", "pair"), [("sun", sun_planet_pair), ("ring", ring_planet_pair)])
def test_a_tooth_force_turns_planet_and_mate_by_their_base_radii(gear, mate, pair):
    pair = pair(gear)
    for coast in (False, True):
        line = flank_line(mate, 2, gear, 3, x=0.185, coast=coast, gap=0.0)
        assert_allclose(np.linalg.norm(line.normal), 1.0, rtol=1e-14)
        angle = 2.0 * math.pi / 3.0
        centre = np.array([0.185, -0.308 * math.sin(angle), 0.308 * math.cos(angle)])
        lever = np.abs(
            [
                np.cross(line.point - o, line.normal)[0]
                for o in (centre, np.array([0.185, 0.0, 0.0]))
            ]
        )
        assert_allclose(
            lever, np.abs(pair.base_radii) * math.cos(pair.base_helix_angle), rtol=1e-12
        )


def test_drive_flanks_push_the_planet_against_the_rotation_and_apart_along_the_axis(gear):
    sun, ring = (
        flank_line(mate, 1, gear, 3, x=0.0, coast=False, gap=0.0).normal for mate in ("sun", "ring")
    )
    # Pin 1 stands along z; increasing angle there is -y. The sun pushes out (+z) and downwind, the
    # ring in and upwind.
    assert sun[1] > 0.0
    assert ring[1] > 0.0
    assert_allclose(sun + ring, [0.0, 2.0 * sun[1], 0.0], rtol=0.0, atol=1e-15)
    assert sun[2] > 0.0
    assert sun[0] > 0.0
    # The axial part of a helical tooth: F_a = F_t tan(beta at the working circle).
    assert_allclose(sun[0] / sun[1], math.tan(math.radians(7.5)) * 400.4 / 393.4, rtol=1e-3)


def test_stiffness_follows_the_number_of_teeth_in_contact(gear):
    data = MeshData(n_harmonics=400)
    stiffness, pair = mesh_stiffness("ring", 1, gear, data, 3), ring_planet_pair(gear)
    # Direct count: tooth pairs in contact over slices of the face width, teeth one base pitch
    # apart.
    slices = (np.arange(400) + 0.5) / 400 * pair.overlap_ratio - pair.overlap_ratio / 2.0
    for phase in (0.0, 0.13, 0.4, 0.77):
        position = phase + slices[:, None] + np.arange(-3, 4)
        pairs = (np.abs(position) < pair.contact_ratio / 2.0).sum(axis=1).mean()
        assert_allclose(
            stiffness.at(2.0 * np.pi * phase) / stiffness.mean,
            pairs / pair.contact_ratio,
            rtol=3e-3,
        )
    assert stiffness.mean == 4.1e9


def test_meshes_of_these_tooth_numbers_are_in_phase(gear):
    # z_r / 3 = 33 and z_s / 3 = 7 are whole: every planet meets its teeth at the same time.
    for mate in ("sun", "ring"):
        phases = [mesh_phase(mate, planet, gear, 3) for planet in (1, 2, 3)]
        assert_allclose(
            np.exp(2j * np.pi * np.array(phases)),
            np.exp(2j * np.pi * phases[0]),
            rtol=0.0,
            atol=1e-12,
        )


def test_impossible_meshes_are_refused():
    with pytest.raises(
        ValueError, match=r"\[mesh\] backlash is -0\.001; expected a finite number >= 0"
    ):
        MeshData(backlash=-1e-3)
    with pytest.raises(ValueError, match="expected positive ones"):
        MeshData(sun_stiffness=0.0)

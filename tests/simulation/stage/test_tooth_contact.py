"""Slices against closed forms.

One spur pair is Hertz's cylinder contact, and slices add up to the load.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.involute_pair import InvolutePair, ring_planet_pair, sun_planet_pair
from carrierflex.geometry.parameters import GearData
from carrierflex.simulation.stage.tooth_contact import ToothFlank, life_ratio, mesh_contact

GEAR = GearData()
SUN, RING = sun_planet_pair(GEAR), ring_planet_pair(GEAR)
SPUR = replace(SUN, helix_angle=0.0, centre_distance=0.3055)
BARE = ToothFlank(crowning=0.0, tip_relief=0.0)
FORCE = 541.1 * 360.0


def _load(contact, pair):
    """Force in the plane of action, normal to the flanks."""
    width = contact.face_position[1] - contact.face_position[0]
    return contact.line_load.sum(axis=(1, 2)) * width / math.cos(pair.base_helix_angle)


@pytest.mark.parametrize("pair", [SUN, RING, SPUR])
@pytest.mark.parametrize("misalignment", [0.0, 2e-4, -2e-3])
def test_slices_carry_the_whole_load_in_every_position(pair, misalignment):
    normal = FORCE / (math.cos(pair.working_pressure_angle) * math.cos(pair.base_helix_angle))
    assert_allclose(
        _load(mesh_contact(pair, ToothFlank(), FORCE, misalignment=misalignment), pair),
        normal,
        rtol=1e-12,
    )


def test_one_pair_of_spur_teeth_is_the_contact_of_two_cylinders():
    contact = mesh_contact(SPUR, BARE, FORCE, n_phases=200)
    lines = (contact.pressure > 0.0).any(axis=2)
    single = int(np.argmin(lines.sum(axis=1)))
    assert lines[single].sum() == 1
    begin, _ = SPUR.path_of_contact
    line = int(np.argmax(lines[single]))
    s = begin + (contact.phase[single] + line) * SPUR.base_pitch
    rho = [SPUR.tangent_lengths[0] + s, SPUR.tangent_lengths[1] - s]
    load = FORCE / math.cos(SPUR.working_pressure_angle) / SPUR.face_width
    hertz = math.sqrt(load * BARE.effective_modulus / math.pi * (1.0 / rho[0] + 1.0 / rho[1]))
    assert_allclose(contact.pressure[single, line], hertz, rtol=1e-12)


def test_two_pairs_share_the_load_of_spur_teeth_in_halves():
    contact = mesh_contact(SPUR, BARE, FORCE)
    lines = (contact.pressure > 0.0).any(axis=2)
    double = int(np.argmax(lines.sum(axis=1)))
    shares = contact.line_load[double, lines[double]].sum(axis=1)
    assert_allclose(shares[0], shares[1], rtol=1e-12)


def test_misalignment_that_opens_no_slice_changes_the_spur_load_linearly():
    """Springs in parallel: mean load over the width plus stiffness, slope and distance."""
    slope = 1e-5
    contact = mesh_contact(SPUR, BARE, FORCE, misalignment=slope, n_phases=200)
    single = int(np.argmin((contact.pressure > 0.0).any(axis=2).sum(axis=1)))
    line = contact.line_load[single].max(axis=0)
    assert_allclose(
        np.diff(line) / np.diff(contact.face_position), -BARE.stiffness_per_width * slope, rtol=1e-9
    )


def test_spur_gears_do_not_care_for_the_sign_of_the_misalignment_and_helical_ones_do():
    def pressure(pair, slope):
        return mesh_contact(pair, ToothFlank(), FORCE, misalignment=slope).largest_pressure

    assert_allclose(pressure(SPUR, 2e-4), pressure(SPUR, -2e-4), rtol=1e-12)
    assert abs(pressure(SUN, 2e-4) / pressure(SUN, -2e-4) - 1.0) > 1e-3


def test_sun_is_pressed_harder_than_the_ring_as_the_paper_says():
    assert (
        mesh_contact(SUN, ToothFlank(), FORCE).largest_pressure
        > 1.5 * mesh_contact(RING, ToothFlank(), FORCE).largest_pressure
    )


def test_pressure_grows_with_the_square_root_of_the_load_where_nothing_holds_slices_apart():
    ratio = (
        mesh_contact(SUN, BARE, 4.0 * FORCE).largest_pressure
        / mesh_contact(SUN, BARE, FORCE).largest_pressure
    )
    assert_allclose(ratio, 2.0, rtol=1e-12)


def test_more_slices_and_positions_change_the_worst_pressure_by_less_than_a_percent():
    coarse = mesh_contact(SUN, ToothFlank(), FORCE, misalignment=1e-4).largest_pressure
    fine = mesh_contact(
        SUN, ToothFlank(), FORCE, misalignment=1e-4, n_slices=400, n_phases=200
    ).largest_pressure
    assert_allclose(coarse, fine, rtol=0.01)


def test_life_of_the_papers_example():
    assert_allclose(life_ratio(1.015), 0.7665, atol=5e-5)
    with pytest.raises(ValueError, match="expected a positive number"):
        life_ratio(0.0)


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="tangential force is nan"):
        mesh_contact(SUN, BARE, math.nan)
    with pytest.raises(ValueError, match=r"crowning is -1e-05; expected zero or more"):
        ToothFlank(crowning=-1e-5)
    with pytest.raises(ValueError, match=r"expected at most 0\.5"):
        ToothFlank(tip_relief_share=0.6)


def test_involute_geometry_of_the_papers_table_3():
    assert_allclose(math.degrees(SUN.working_pressure_angle), 22.74, atol=0.01)
    assert_allclose(SUN.working_pressure_angle, RING.working_pressure_angle, rtol=1e-12)
    assert_allclose(
        np.sum(SUN.tangent_lengths), 0.308 * math.sin(SUN.working_pressure_angle), rtol=1e-12
    )
    assert 1.4 < SUN.contact_ratio < RING.contact_ratio < 1.8
    assert_allclose(SUN.overlap_ratio, 0.914, atol=1e-3)


def test_gears_that_never_touch_are_refused():
    with pytest.raises(ValueError, match="contact ratio"):
        replace(SUN, tip_radii=(0.197, 0.107))
    with pytest.raises(ValueError, match="inside the base circle"):
        replace(SUN, tip_radii=(0.1, 0.1178))
    with pytest.raises(ValueError, match="base radii add up"):
        InvolutePair(
            (39, 21), 0.010, GEAR.pressure_angle, GEAR.helix_angle, 0.25, (0.21, 0.118), 0.22
        )


@pytest.mark.parametrize("slope", [2e-5, 6e-5])
def test_face_load_factor_of_bare_spur_teeth_is_that_of_the_standard(slope):
    """K_Hbeta = 1 + F_beta c_gamma / (2 F_m / b) while the whole face touches (ISO 6336-1)."""
    contact = mesh_contact(SPUR, BARE, FORCE, misalignment=slope, n_slices=400, n_phases=400)
    c_gamma = SPUR.contact_ratio * BARE.stiffness_per_width
    w_m = FORCE / math.cos(SPUR.working_pressure_angle) / SPUR.face_width
    F_beta = slope * SPUR.face_width
    expected = 1.0 + F_beta * c_gamma / (2.0 * w_m)
    assert 1.05 < expected < 2.0
    # Phases in steps of a 400th of the base pitch.
    assert_allclose(contact.face_load_factor, expected, rtol=3e-3)
    assert mesh_contact(SPUR, BARE, FORCE).face_load_factor == pytest.approx(1.0)

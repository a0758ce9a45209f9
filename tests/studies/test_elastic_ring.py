"""An elastic ring against closed forms, and what its sensors read in the gearbox."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eigh, null_space

from studies.elastic_ring import (
    U_R,
    PointForce,
    PointSpring,
    RingSection,
    harmonic_stiffness,
    ring_on_springs,
)
from studies.tabulate_elastic_ring import CASES, readings, ring_row, ring_table

#: Thin, so that shear and stretch, which the closed forms leave out, are below 1e-3.
THIN = RingSection(inner_diameter=1.0, outer_diameter=1.02, width=0.01)
QUARTERS = tuple(0.5 * np.pi * np.arange(4))


def on_weak_springs(section, highest):
    """A ring that four springs keep from floating away, far softer than it."""
    k = 1e-6 * section.stiffness[3] / section.radius**3
    return ring_on_springs(section, [PointSpring(at, (k, k, k)) for at in QUARTERS], highest)


def test_two_opposite_forces_stretch_a_ring_as_in_roark():
    # Roark's Formulas, table 9.2, case 1: changes of both diameters.
    R, EI, W = THIN.radius, THIN.stiffness[3], 10.0
    ring = on_weak_springs(THIN, 60)
    q = ring.answer([[PointForce(0.0, (0.0, W, 0.0)), PointForce(np.pi, (0.0, W, 0.0))]])
    even = q.reshape(-1, 6)[ring.n == 0, U_R].real
    along, across = (
        2.0 * (ring.motion(q, angle)[1] + even)[0] * EI / W / R**3 for angle in (0.0, 0.5 * np.pi)
    )
    assert along == pytest.approx(np.pi / 4.0 - 2.0 / np.pi, rel=1e-3)
    assert across == pytest.approx(-(2.0 / np.pi - 0.5), rel=1e-3)


def test_four_alternating_axial_forces_warp_a_ring_by_castiglianos_theorem():
    # An eighth of the ring from a force to where bending vanishes: shear P/2, torsion 0 at the
    # force by symmetry, and moments in balance with them.
    R, (_, _, _, _, EI, GJ), P = THIN.radius, THIN.stiffness, 3.0
    V, end = 0.5 * P, 0.25 * np.pi

    def bending(s):
        return V * R * (np.cos(s) * np.tan(end) - np.sin(s))

    def torsion(s):
        return V * R * (1.0 - np.cos(s) - np.sin(s) * np.tan(end))

    energy = 8.0 * R * quad(lambda s: bending(s) ** 2 / (2.0 * EI), 0.0, end)[0]
    energy += 8.0 * R * quad(lambda s: torsion(s) ** 2 / (2.0 * GJ), 0.0, end)[0]
    ring = on_weak_springs(THIN, 60)
    signs = (1.0, -1.0, 1.0, -1.0)
    q = ring.answer(
        [[PointForce(a, (s * P, 0.0, 0.0)) for a, s in zip(QUARTERS, signs, strict=True)]]
    )
    # Work of four forces at deflection w: energy = 4 P w / 2.
    w = [float(s * ring.motion(q, a)[0, 0]) for a, s in zip(QUARTERS, signs, strict=True)]
    np.testing.assert_allclose(w, energy / (2.0 * P), rtol=2e-3)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_free_ring_has_loves_frequencies(n):
    # Love, Theory of Elasticity, arts. 293: in its plane and out of it.
    R, b, h, rho = THIN.radius, THIN.width, THIN.height, 7850.0
    A, EI_x, EI_r, GJ = b * h, *THIN.stiffness[3:]
    polar = b * h * (b**2 + h**2) / 12.0
    M = 2.0 * np.pi * R * rho * np.diag([A, A, A, b * h**3 / 12.0, h * b**3 / 12.0, polar])
    omega = np.sqrt(eigh(harmonic_stiffness(THIN, n), M, eigvals_only=True)[:2])
    waves = n * (n**2 - 1) / R**2
    m = rho * A
    in_plane = waves * np.sqrt(EI_x / m / (n**2 + 1))
    out_of_plane = waves * np.sqrt(EI_r / m / (n**2 + EI_r / GJ))
    np.testing.assert_allclose(omega, np.sort([in_plane, out_of_plane]), rtol=5e-3)


def test_a_free_ring_has_six_rigid_motions():
    closed = RingSection(cover_stiffness=1e9)
    motions = [null_space(harmonic_stiffness(closed, n), rcond=1e-12).shape[1] for n in (-1, 0, 1)]
    assert motions == [2, 2, 2]
    assert null_space(harmonic_stiffness(closed, 2), rcond=1e-12).shape[1] == 0
    # A turn about z: u_x = R sin, Omega = e_z = cos e_r - sin e_t.
    turn = np.array([closed.radius / 2j, 0.0, 0.0, 0.0, 0.5, -1.0 / 2j])
    K = harmonic_stiffness(closed, 1)
    np.testing.assert_allclose(K @ turn, 0.0, atol=1e-12 * np.abs(K).max())


def test_deflection_under_a_force_converges_with_the_harmonics():
    section = RingSection()
    load = [[PointForce(0.0, (0.0, 1.0, 0.0)), PointForce(np.pi, (0.0, 1.0, 0.0))]]

    def stretch(highest):
        ring = on_weak_springs(section, highest)
        return float(ring.motion(ring.answer(load), 0.0)[1, 0])

    # From below, as Rayleigh and Ritz have it. Bending leaves 1/N^3, a shear force that jumps 1/N.
    steps = np.diff([stretch(highest) for highest in (10, 20, 40, 80)])
    assert (steps > 0.0).all()
    ratio = steps[:-1] / steps[1:]
    assert ((ratio > 2.0) & (ratio < 8.0)).all()
    # At the sensors, away from the forces.
    case = next(case for case in CASES if case.arm_x < -0.2 and case.section.cover_stiffness)
    low, high = (readings(case, 360e3, 0.0, highest) for highest in (20, 40))
    np.testing.assert_allclose(low, high, rtol=0, atol=0.02 * np.abs(high).max())


def test_torque_warps_the_ring_where_the_arms_stand_beside_its_middle_and_a_load_does_not():
    free = CASES[0]
    saddle = {x: ring_row(replace(free, arm_x=x)).torque_saddle for x in (-0.2, 0.0, 0.2)}
    # Vertical forces T / (2 arm) at the arms are moments about r of one sign: harmonics 0, 2, 4.
    assert saddle[0.2] == pytest.approx(-saddle[-0.2], rel=1e-3)
    assert abs(saddle[0.0]) < 1e-9 < 1e-5 < saddle[0.2]
    # A load pushes both arms the same way: harmonics 1, 3, 5, no saddle.
    assert abs(ring_row(replace(free, arm_x=-0.2)).load_saddle) < 1e-9
    above = ring_row(replace(free, arm_x=-0.2, arm_height=0.1575))
    assert 1e-7 < abs(above.load_saddle) < 5e-6


def test_planets_that_pass_make_orders_three_and_six_alone():
    signals = readings(CASES[0], 360e3, 0.0)
    order = np.abs(np.fft.rfft(signals, axis=0))[:13]
    others = np.delete(order, [0, 3, 6, 9, 12], axis=0)
    assert others.max() < 1e-6 * order[3].min()


@pytest.mark.long
def test_the_page_shows_the_table():
    page = (Path(__file__).parents[2] / "docs" / "papers.md").read_text(encoding="utf-8")
    rows = [ring_row(case) for case in CASES]
    assert "\n".join(ring_table(rows)) in page
    # "One order of magnitude smaller" than the carrier's 42 um, axially.
    assert max(row.axial_3 for row in rows) < 7e-6

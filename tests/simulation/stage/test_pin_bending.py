"""Pins as beams: closed forms, balance of the load, and the pin's own finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.shapes.body_stresses import body_stresses
from carrierflex.simulation.stage.part_loads import PartLoads
from carrierflex.simulation.stage.pin_bending import PinBeam

SYMMETRIC = PinBeam(0.0, 0.15, 0.3, 0.16, 0.16, 0.308)


def loads(force, moment):
    """One planet over one instant: components axial, radial, tangential."""
    return PartLoads(
        np.zeros((1, 4)), np.array([[force]], dtype=float), np.array([[moment]], dtype=float)
    )


def test_a_central_force_bends_as_the_textbook_says():
    F, L, w, d = 2e5, 0.3, 0.16, 0.16
    M = SYMMETRIC.bending_moment(loads([0.0, 0.0, -F], [0.0, 0.0, 0.0]))[0, 0]
    # F L / 4 of a point force less F w / 8 of its width; in the middle.
    assert_allclose(np.abs(M).max(), F * (L / 4.0 - w / 8.0), rtol=1e-12)
    assert np.abs(M[:, 1]).argmax() == len(SYMMETRIC.stations) // 2
    assert_allclose(M[[0, -1]], 0.0, atol=1e-9 * F)
    stress = SYMMETRIC.stress(loads([0.0, 0.0, -F], [0.0, 0.0, 0.0]))[0, 0]
    assert_allclose(stress.max(), 32.0 * F * (L / 4.0 - w / 8.0) / (np.pi * d**3), rtol=1e-12)
    # Pressed against the rotation: tension on that side, at 270 deg from the radial direction.
    _, fibre = np.unravel_index(stress.argmax(), stress.shape)
    assert_allclose(np.rad2deg(SYMMETRIC.fibres[fibre]), 270.0)


def test_a_moment_is_a_couple_of_the_supports():
    couple = 1e4
    M = SYMMETRIC.bending_moment(loads([0.0, 0.0, 0.0], [0.0, couple, 0.0]))[0, 0]
    # Opposite and equal about the middle, M0 / L (L / 2 - w / 2) at the bearing's ends.
    assert_allclose(M, -M[::-1], atol=1e-6)
    edge = np.interp(0.15 - 0.08, SYMMETRIC.stations, np.abs(M[:, 1]))
    assert_allclose(edge, couple / 0.3 * 0.07, rtol=1e-2)
    assert_allclose(M[:, 0], 0.0, atol=1e-9)


def test_moments_are_those_of_the_load_by_numbers():
    beam = PinBeam(0.0325, 0.185, 0.3275, 0.16, 0.16, 0.308)
    one = loads([0.0, 3e4, -2e5], [0.0, 2e3, -1e3])
    fine = np.linspace(beam.upwind, beam.downwind, 200_001)
    h = beam.bearing_width / 2.0
    q = np.zeros((len(fine), 2))
    for row, start in zip(one.row_forces(h)[0, 0], (beam.midspan - h, beam.midspan), strict=True):
        q[(fine >= start) & (fine < start + h)] += row / h
    dx = fine[1] - fine[0]
    span = beam.downwind - beam.upwind
    A = ((beam.downwind - fine)[:, None] * q).sum(axis=0) * dx / span
    V = A - np.cumsum(q, axis=0) * dx
    expected = np.cumsum(V, axis=0) * dx
    M = beam.bending_moment(one)[0, 0]
    sampled = np.stack([np.interp(beam.stations, fine, row) for row in expected.T], axis=1)
    assert_allclose(M, sampled, rtol=0.0, atol=1e-4 * np.abs(M).max())
    # The couple of the rows is the planet's moment: x × (row forces) about the middle.
    rows = one.row_forces(h)[0, 0]
    assert_allclose((rows[1] - rows[0]) * h / 2.0, [-1e3, -2e3])


def test_the_pin_of_finite_elements_bends_about_as_the_beam(
    one_pin_mesh, pin_reduction, carrier, pin
):
    model = pin_reduction.model
    stresses = body_stresses(one_pin_mesh, pin_reduction.basis)
    points = {name.split("_")[-1]: float(point[0]) for name, point in model.pilots.items()}
    dimensions = {"bearing_width": pin.bearing_width, "diameter": pin.diameter}
    beam = PinBeam(**points, **dimensions, distance=float(model.pilots["pin_1_midspan"][2]))
    assert_allclose(beam.upwind, carrier.upwind_plate_thickness / 2.0, atol=1e-4)
    # Pin 1 is on top: radial is z, tangential -y. Ends hold translations, and one the spin.
    ends = [model.coordinates_of(f"pin_1_{side}") for side in ("upwind", "downwind")]
    fixed = np.concatenate([ends[0][:4], ends[1][:3]])
    free = np.setdiff1d(np.arange(model.n_coordinates), fixed)
    f = np.zeros(model.n_coordinates)
    F = 2e5
    f[model.coordinates_of("pin_1_midspan")[1]] = F
    q = np.zeros(model.n_coordinates)
    q[free] = np.linalg.solve(model.K[np.ix_(free, free)], f[free])
    axial = stresses.S[:, 0] @ q
    theory = beam.stress(loads([0.0, 0.0, -F], [0.0, 0.0, 0.0]))[0, 0]
    station, fibre = np.unravel_index(theory.argmax(), theory.shape)
    # The fibre of largest tension is where the beam has it, and of its size to a tenth: the pin is
    # not two diameters long between its supports. Facets cut off up to a tenth of the radius.
    at = beam.point(station, fibre, 0.0)
    assert_allclose(stresses.points[axial.argmax()], at, atol=0.03)
    assert_allclose(axial.max(), theory.max(), rtol=0.1)


def test_a_bearing_beyond_the_bores_is_refused():
    with pytest.raises(ValueError, match=r"expected one between the middles of the bores"):
        replace(SYMMETRIC, bearing_width=0.4)

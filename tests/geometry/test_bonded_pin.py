"""A pin out of a carrier with bonded pins is the pin that is meshed alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.structural_model import PIN_PILOTS, structural_model
from carrierflex.geometry.bonded_pin import bonded_pin
from carrierflex.geometry.carrier_interface import carrier_interface
from carrierflex.geometry.tet_mesh import boundary_facets
from carrierflex.reduction.craig_bampton import craig_bampton


def area_vectors(mesh, facets):
    a, b, c = np.moveaxis(mesh.points[facets[:, :3]], 1, 0)
    return np.cross(b - a, c - a) / 2.0


@pytest.fixture(scope="module")
def taken(stiff_mesh):
    return bonded_pin(stiff_mesh)


def test_it_is_one_closed_body_of_the_pin_s_volume(taken, one_pin_mesh):
    volumes = []
    for mesh in (taken, one_pin_mesh):
        facets = boundary_facets(mesh.tets)
        centres = mesh.points[facets[:, :3]].mean(axis=1)
        vectors = area_vectors(mesh, facets)
        assert_allclose(vectors.sum(axis=0), 0.0, atol=1e-9)
        volumes.append(np.sum(centres * vectors) / 3.0)
    # Chords of a coarse cylinder.
    assert volumes[0] == pytest.approx(volumes[1], rel=0.03)


@pytest.mark.parametrize("name", PIN_PILOTS)
def test_its_seats_lie_on_it_and_point_outwards(taken, one_pin_mesh, name):
    facets = taken.surface(name)
    boundary = {tuple(sorted(facet)) for facet in boundary_facets(taken.tets)[:, :3]}
    assert {tuple(sorted(facet)) for facet in facets[:, :3]} <= boundary
    vectors = area_vectors(taken, facets)
    middle = taken.points[:, 1:].mean(axis=0)
    outwards = taken.points[facets[:, :3]].mean(axis=1)[:, 1:] - middle
    assert (np.sum(vectors[:, 1:] * outwards, axis=1) > 0.0).all()
    # Mid-side nodes lie between the corners that they follow.
    corners = taken.points[facets[:, :3]]
    middles = (corners + np.roll(corners, -1, axis=1)) / 2.0
    assert_allclose(taken.points[facets[:, 3:]], middles, atol=0.01)
    area = np.linalg.norm(vectors, axis=1).sum()
    theirs = np.linalg.norm(area_vectors(one_pin_mesh, one_pin_mesh.surface(name)), axis=1).sum()
    assert area == pytest.approx(theirs, rel=0.05)


def test_it_is_as_stiff_as_the_pin_that_is_meshed_alone(taken, stiff_mesh, pin_reduction):
    structure = structural_model("pin", taken, carrier_interface(stiff_mesh), PIN_PILOTS)
    ours, theirs = craig_bampton(structure, 0).model, pin_reduction.model
    for name in PIN_PILOTS:
        assert_allclose(ours.pilots[name], theirs.pilots[name], atol=1e-4)
    # Bending between the seats: one end held, the other one loaded.
    ends = ours.rows_of("pin_1_downwind")
    free = np.r_[ours.rows_of("pin_1_midspan"), ends]
    compliance = [
        np.linalg.inv(K[np.ix_(free, free)])[-6:, -6:]
        for K in (ours.K[:18, :18], theirs.K[:18, :18])
    ]
    assert_allclose(np.diag(compliance[0]), np.diag(compliance[1]), rtol=0.05)
    assert ours.mass_properties.mass == pytest.approx(theirs.mass_properties.mass, rel=0.03)


def test_a_carrier_without_pins_is_refused(flexible_mesh):
    with pytest.raises(ValueError, match="no body 'pins', it has carrier; expected a carrier with"):
        bonded_pin(flexible_mesh)

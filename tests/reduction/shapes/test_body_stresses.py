"""Stress of a reduced body: the full body's own, for loads at its pilots and in motion."""

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.stress_recovery import stress_rows
from carrierflex.geometry.tet_mesh import boundary_facets
from carrierflex.reduction.body_files import (
    BodyFileError,
    has_fields,
    read_stresses,
    write_body,
)
from carrierflex.reduction.reduced_static import static_coordinates
from carrierflex.reduction.shapes.body_stresses import body_stresses
from carrierflex.reduction.shapes.stress_measures import von_mises

#: Load at the downwind bore of pin 1 [N].
LOAD = {"pin_1_downwind": np.array([1e4, 2e5, -1e5, 1e3, 2e3, 3e3])}


@pytest.fixture(scope="module")
def stresses(flexible_mesh, flexible_reduction):
    return body_stresses(flexible_mesh, flexible_reduction.basis)


def test_a_static_load_has_the_stress_of_the_full_body(
    stresses, flexible_mesh, flexible_structure, flexible_reduction
):
    from carrierflex.reduction.held_structure import HeldStructure

    model = flexible_reduction.model
    q = static_coordinates(model, ["shaft_face"], LOAD)
    shaft = [pilot for pilot in flexible_structure.pilots if pilot.name == "shaft_face"]
    f = flexible_structure.load_vector(LOAD)[:, None]
    constrained = HeldStructure(flexible_reduction.body, shaft)
    u = constrained.solve(f, np.zeros((6, 1)))[0][:, 0]
    nodes = np.unique(boundary_facets(flexible_mesh.tets)[:, :3])
    full = (stress_rows(flexible_mesh, nodes, BODY_MATERIALS) @ u).reshape(-1, 6)
    size = np.abs(full).max()
    assert size > 1e7
    assert_allclose(stresses.S @ q, full, rtol=0.0, atol=1e-7 * size)


def test_the_file_keeps_the_rows(stresses, flexible_reduction, tmp_path):
    path = tmp_path / "body.h5"
    write_body(flexible_reduction.model, path, stresses=stresses)
    reread = read_stresses(path)
    assert reread.surface_names == stresses.surface_names
    assert (reread.surface_of == stresses.surface_of).all()
    assert (reread.singular == stresses.singular).all()
    q = static_coordinates(flexible_reduction.model, ["shaft_face"], LOAD)
    expected = von_mises((stresses.S @ q)[:, :, None])
    result = von_mises((reread.S @ q)[:, :, None])
    # Single precision of rows whose parts cancel.
    assert_allclose(result, expected, rtol=0.0, atol=1e-5 * expected.max())
    write_body(flexible_reduction.model, path)
    assert read_stresses(path) is None


def test_whether_a_file_has_rows_is_said_without_reading_them(
    stresses, flexible_reduction, tmp_path
):
    path = tmp_path / "body.h5"
    write_body(flexible_reduction.model, path, stresses=stresses)
    assert has_fields(path, "stresses")
    assert not has_fields(path, "shapes")
    with h5py.File(path, "r+") as file:
        file["stresses/S"][0, 0, 0] = np.nan
    assert has_fields(path, "stresses")
    with pytest.raises(BodyFileError, match="holds a value that is not finite"):
        read_stresses(path)
    with h5py.File(path, "r+") as file:
        del file["stresses/S"]
        file["stresses/S"] = np.zeros((3, 6, 2))
    with pytest.raises(BodyFileError, match=r"stresses/S has shape \(3, 6, 2\); expected"):
        has_fields(path, "stresses")

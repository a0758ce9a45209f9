"""A body loaded by Exudyn has the static answer, the frequencies and the invariants it has here."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.sparse.linalg import spsolve

from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.exports.exudyn_files import write_exudyn
from carrierflex.reduction.reduced_static import pilot_compliance

exudyn = pytest.importorskip("exudyn")
FEM = pytest.importorskip("exudyn.FEM")


@pytest.fixture(scope="module")
def written(tmp_path_factory, pin_structure, pin_reduction, one_pin_mesh):
    path = tmp_path_factory.mktemp("exudyn") / "pin.hdf5"
    write_exudyn(pin_structure, pin_reduction, path, mesh=one_pin_mesh)
    return path


@pytest.fixture(scope="module")
def fem(written):
    loaded = FEM.FEMinterface()
    loaded.LoadFromFile(str(written))
    return loaded


@pytest.fixture(scope="module")
def free_coordinates(pin_reduction):
    return np.arange(6, pin_reduction.model.n_coordinates)


def test_exudyn_loads_mesh_matrices_and_sets(fem, pin_structure, one_pin_mesh, pin_reduction):
    assert (fem.GetNodePositionsAsArray() == pin_structure.points).all()
    assert abs(fem.GetMassMatrix() - pin_structure.M).max() == 0.0
    assert abs(fem.GetStiffnessMatrix() - pin_structure.K).max() == 0.0
    assert (fem.elements[0]["Tet10"] == one_pin_mesh.tets).all()
    assert len(fem.GetSurfaceTriangles6()) == len(fem.GetSurfaceTriangles()) > 0
    assert [entry["Name"] for entry in fem.nodeSets] == list(pin_reduction.model.pilots)
    assert_allclose(fem.eigenValues, pin_reduction.modes.omega**2)
    for words in (
        "SI units: m, kg, s, N, rad",
        "body frame: x downwind",
        "pilot pin_1_upwind held",
    ):
        assert words in fem.metaData["source"]
    for entry, pilot in zip(fem.nodeSets, pin_structure.pilots, strict=True):
        nodes = np.unique(entry["NodeNumbers"])
        assert len(nodes) == len(entry["NodeNumbers"])
        assert (nodes == np.unique(pilot.G[:3].indices // 3)).all()
        assert entry["NodeWeights"].sum() == pytest.approx(1.0)
        centre = entry["NodeWeights"] @ fem.GetNodePositionsAsArray()[entry["NodeNumbers"]]
        assert_allclose(centre, pilot.point, atol=1e-9)


def test_exudyn_reduces_to_the_same_matrices_and_mass(fem, pin_reduction, free_coordinates):
    cms = FEM.ObjectFFRFreducedOrderInterface(fem)
    model = pin_reduction.model
    for result, matrix in ((cms.massMatrixReduced, model.M), (cms.stiffnessMatrixReduced, model.K)):
        expected = matrix[np.ix_(free_coordinates, free_coordinates)]
        scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
        assert_allclose(result / scale, expected / scale, rtol=0.0, atol=1e-8)
    assert cms.totalMass == pytest.approx(model.mass_properties.mass, rel=1e-12)
    assert_allclose(cms.chiU, model.mass_properties.centre, atol=1e-12)
    assert_allclose(cms.inertiaLocal, model.ffrf.J, rtol=1e-10, atol=1e-10)
    assert_allclose(cms.mPhitTPsi, model.ffrf.N[:, free_coordinates], atol=1e-10 * model.ffrf.mass)


def test_frequencies_in_exudyn_are_those_of_the_reduced_body(fem, pin_reduction, free_coordinates):
    """The frame's node fixed to ground, the body's own equations solved by Exudyn."""
    system = exudyn.SystemContainer()
    mbs = system.AddSystem()
    cms = FEM.ObjectFFRFreducedOrderInterface(fem)
    body = cms.AddObjectFFRFreducedOrder(mbs)
    ground = mbs.AddObject(exudyn.itemInterface.ObjectGround())
    fixed = mbs.AddMarker(exudyn.itemInterface.MarkerBodyRigid(bodyNumber=ground))
    frame = mbs.AddMarker(exudyn.itemInterface.MarkerNodeRigid(nodeNumber=body["nRigidBody"]))
    mbs.AddObject(
        exudyn.itemInterface.GenericJoint(markerNumbers=[fixed, frame], constrainedAxes=[1] * 6)
    )
    mbs.Assemble()
    values, _ = exudyn.solver.ComputeODE2Eigenvalues(
        mbs, computeComplexEigenvalues=False, useAbsoluteValues=False
    )
    squares = np.sort(np.real(values))
    model = pin_reduction.model
    expected = scipy.linalg.eigh(
        model.K[np.ix_(free_coordinates, free_coordinates)],
        model.M[np.ix_(free_coordinates, free_coordinates)],
        eigvals_only=True,
    )
    assert_allclose(squares[-len(free_coordinates) :], expected, rtol=1e-6)


def test_static_answer_of_the_loaded_matrices_is_the_pilots_compliance(
    fem, pin_structure, pin_reduction
):
    """Full matrices from the file against the reduced body's compliance.

    The first pilot is fixed by multipliers.
    """
    first, others = (
        pin_structure.pilots[0].G,
        sp.vstack([pilot.G for pilot in pin_structure.pilots[1:]]),
    )
    K = sp.csc_array(fem.GetStiffnessMatrix())
    size = sp.linalg.norm(K) / sp.linalg.norm(first)
    saddle = sp.block_array([[K, size * first.T], [size * first, None]], format="csc")
    force = np.concatenate([others.T.toarray(), np.zeros((6, others.shape[0]))])
    u = spsolve(saddle, force)[: K.shape[0]]
    result, expected = (
        others @ u,
        pilot_compliance(pin_reduction.model, [pin_structure.pilots[0].name]),
    )
    scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    assert_allclose(result / scale, expected / scale, rtol=0.0, atol=1e-7)


def test_a_pilot_off_its_surface_has_no_weights_of_other_directions(
    tmp_path, pin_structure, pin_reduction
):
    # Moved along y, the pilot's x displacement takes part in the surface's rotation: its row holds
    # weights of y displacements too, which are no share of a translation along x.
    first = pin_structure.pilots[0]
    shift = np.eye(6)
    shift[0, 5], shift[2, 3] = -0.01, 0.01
    moved = replace(
        first, point=first.point + np.array([0.0, 0.01, 0.0]), G=sp.csr_array(shift @ first.G)
    )
    structure = replace(pin_structure, pilots=(moved, *pin_structure.pilots[1:]))
    write_exudyn(structure, pin_reduction, tmp_path / "pin.hdf5")
    loaded = FEM.FEMinterface()
    loaded.LoadFromFile(str(tmp_path / "pin.hdf5"))
    entry = loaded.nodeSets[0]
    assert len(np.unique(entry["NodeNumbers"])) == len(entry["NodeNumbers"])
    along_x = moved.G[[0]].toarray()[0, 0::3]
    assert_allclose(entry["NodeWeights"], along_x[entry["NodeNumbers"]])


def test_without_a_mesh_there_is_nothing_to_draw(tmp_path, pin_structure, pin_reduction):
    write_exudyn(pin_structure, pin_reduction, tmp_path / "pin.hdf5", pilot="pin_1_midspan")
    loaded = FEM.FEMinterface()
    loaded.LoadFromFile(str(tmp_path / "pin.hdf5"))
    assert loaded.elements == [] == loaded.surface
    T = loaded.modeBasis["matrix"]
    fixed_pilot = pin_structure.pilots[1]
    assert np.abs(fixed_pilot.G @ T).max() < 1e-9 * np.abs(T).max()


def test_what_exudyn_cannot_hold_is_refused(tmp_path, pin_structure, pin_reduction, one_pin_mesh):
    with pytest.raises(ValueError, match=r"pin\.h5: suffix '\.h5'; expected \.hdf5"):
        write_exudyn(pin_structure, pin_reduction, tmp_path / "pin.h5")
    rigid = rigidly_coupled(replace(pin_structure, pilots=pin_structure.pilots[::2]), one_pin_mesh)
    with pytest.raises(
        ValueError,
        match="pin: its pilots hold their surfaces rigid, and Exudyn needs every node's mass",
    ):
        write_exudyn(rigid, craig_bampton(rigid, 0), tmp_path / "pin.hdf5")
    assert not list(tmp_path.iterdir())

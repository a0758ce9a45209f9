"""RBE3 matrices of NX Nastran 9 and of pyyeti against our weighted coupling.

Those of pyyeti are on random elements.

The data sets (bulk data beside the matrices that NX Nastran made of it) come with pyyeti's own
tests, BSD-3-Clause; they are read where pyyeti is installed, none of its coupling code takes part.
18 nodes stand in rectangular, cylindrical and spherical frames that refer to one another.
"""

from pathlib import Path

import numpy as np
import pytest
import pyyeti
from numpy.testing import assert_allclose
from pyyeti import nastran
from scipy.io import loadmat

from carrierflex.fe.point_couplings import AveragedDofs, point_coupling

DATA = Path(pyyeti.__file__).parent / "tests" / "nastran_gm_data"
PILOT = 124
#: Weight, components and nodes of the elements, as the bulk data has them (make_gm_nx9_rbe3_*.dat).
LARGE = (
    (2.3, "123", (100,)),
    (2.5, "123", (200,)),
    (12.0, "23", (300,)),
    (0.5, "34", (400,)),
    (0.4, "456", (1, 2, 3)),
    (5.5, "136", (101, 102, 103)),
    (4.2, "123456", (111, 112, 113)),
    (0.05, "25", (121, 122, 123)),
)
SMALL = ((2.6, "123", (100,)), (1.8, "456", (200,)))
#: Data set: averaged degrees of freedom, components of the pilot. The um sets make other degrees of
#: freedom the dependent ones.
CASES = {
    "1": (LARGE, "123456"),
    "2": (LARGE, "123456"),
    "3": (LARGE, "123456"),
    "4": (SMALL, "1346"),
    "um_1": (LARGE, "123456"),
    "um_2": (SMALL, "123456"),
    "um_3": (SMALL, "123456"),
    "um_5": (SMALL, "1346"),
    "um_6": (SMALL, "1346"),
}


def nastran_table(name):
    """NX Nastran's table of degrees of freedom and its matrix GM.

    The table: id, component, is dependent, location, direction.
    """
    file = DATA / f"make_gm_nx9_rbe3_{name}.mat"
    if not file.exists():
        pytest.skip(f"this build of pyyeti has no {file.name}")
    data = loadmat(file, squeeze_me=True, struct_as_record=False)
    uset, rigid = data["uset"].k0, data["drg"].k0.T
    dofs = uset[:, :2].astype(int)
    dependent = uset[:, 2].astype(int) & 1 == 1
    # Rows 1, 4 of a node's own rigid motions are its first axis: translations first, rotations in
    # the last three columns.
    rotation = dofs[:, 1] > 3
    direction = np.where(rotation[:, None], rigid[:, 3:], rigid[:, :3])
    location = np.repeat(uset[::6, 3:], 6, axis=0)
    return dofs, dependent, location, direction, data["gm"].k0


def our_constraint(table, averaged, components):
    """Rows of ``q - G u = 0`` over all degrees of freedom of the table.

    q is in the pilot's own frame.
    """
    dofs, _, location, direction, _ = table
    number = {tuple(dof): i for i, dof in enumerate(dofs)}
    columns, weights = [], []
    for weight, which, nodes in averaged:
        for node in nodes:
            columns += [number[node, int(c)] for c in which]
            # NX Nastran keeps weights in single precision: with 2.3 in double, entries would differ
            # by 3e-8.
            weights += [float(np.float32(weight))] * len(which)
    node_rows, nodes = np.unique(dofs[columns, 0], return_inverse=True)
    points = np.array([location[number[node, 1]] for node in node_rows])
    averaged_dofs = AveragedDofs(
        points, nodes, direction[columns], dofs[columns, 1] > 3, np.array(weights)
    )
    pilot = [number[PILOT, c] for c in range(1, 7)]
    G = point_coupling(averaged_dofs, location[pilot[0]])
    frame = np.zeros((6, 6))
    frame[:3, :3], frame[3:, 3:] = direction[pilot[:3]], direction[pilot[3:]]
    constrained = [int(c) - 1 for c in components]
    C = np.zeros((len(constrained), len(dofs)))
    C[range(len(constrained)), [pilot[i] for i in constrained]] = 1.0
    C[:, columns] -= (frame @ G)[constrained]
    return C


@pytest.mark.parametrize("name", CASES)
def test_matrices_of_nx_nastran_are_reproduced(name):
    table = nastran_table(name)
    C = our_constraint(table, *CASES[name])
    dependent, theirs = table[1], table[4]
    assert np.count_nonzero(dependent) == len(C)
    ours = -np.linalg.solve(C[:, dependent], C[:, ~dependent])
    # Rounding, a little more where the um set's matrix has a condition number of 8e4; 5e-14
    # measured.
    assert_allclose(ours, theirs, rtol=0.0, atol=1e-12 * np.abs(theirs).max())


def test_the_published_square_of_four_nodes():
    # Example of pyyeti's formrbe3: a moment about x is carried by the nodes at +-y, one about z by
    # all four.
    square = np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]])
    dofs = AveragedDofs(
        square,
        np.repeat(np.arange(4), 3),
        np.tile(np.eye(3), (4, 1)),
        np.zeros(12, bool),
        np.ones(12),
    )
    expected = np.zeros((6, 4, 3))
    expected[[0, 1, 2], :, [0, 1, 2]] = 0.25
    expected[3, [1, 3], 2] = 0.5, -0.5
    expected[4, [0, 2], 2] = -0.5, 0.5
    expected[5, [0, 1, 2, 3], [1, 0, 1, 0]] = 0.25, -0.25, -0.25, 0.25
    assert_allclose(
        point_coupling(dofs, np.zeros(3)), expected.reshape(6, 12), rtol=0.0, atol=1e-15
    )


@pytest.mark.parametrize("seed", range(4))
def test_random_elements_agree_with_pyyeti(seed):
    rng = np.random.default_rng(seed)
    n = 5
    points, pilot = rng.standard_normal((n, 3)), 3.0 * rng.standard_normal(3)
    uset = nastran.addgrid(None, np.arange(1, n + 2), "b", 0, np.vstack([points, pilot]), 0)
    uses = rng.random((n, 6)) < 0.7
    uses[:, 0] = True
    weights = rng.uniform(0.1, 10.0, n)
    listed = [
        item
        for i in range(n)
        for item in ([int("".join(str(c + 1) for c in np.flatnonzero(uses[i]))), weights[i]], i + 1)
    ]
    theirs = nastran.formrbe3(uset, n + 1, 123456, listed)
    node, component = np.nonzero(uses)
    dofs = AveragedDofs(points, node, np.eye(3)[component % 3], component > 2, weights[node])
    ours = point_coupling(dofs, pilot)
    assert_allclose(ours, theirs, rtol=0.0, atol=1e-11 * np.abs(theirs).max())

"""Three libraries, one answer.

Each refuses a matrix that is not positive definite in the project's own words.
"""

import importlib.util

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from carrierflex.fe import factorisation
from carrierflex.fe.assembly import assemble_stiffness
from carrierflex.fe.factorisation import SingularMatrixError, factorise, upper_triangle
from carrierflex.fe.materials import STEEL
from carrierflex.reduction.held_structure import statically_determinate_dofs
from tests.fe.box_meshes import box_mesh

LIBRARIES = [
    pytest.param(
        factorisation._Pardiso,
        marks=pytest.mark.skipif(
            factorisation._mkl_library() is None, reason="MKL is not installed"
        ),
    ),
    pytest.param(
        factorisation._Cholmod,
        marks=pytest.mark.skipif(
            importlib.util.find_spec("kvxopt") is None, reason="kvxopt is not installed"
        ),
    ),
    factorisation._SuperLU,
]
BOX = box_mesh((0.3, 0.1, 0.1), (3, 2, 2))


def free_stiffness():
    return assemble_stiffness(BOX, {"carrier": STEEL})


def held_stiffness():
    K = free_stiffness()
    free = np.setdiff1d(np.arange(K.shape[0]), statically_determinate_dofs(BOX.points))
    return sp.csr_array(K[free][:, free])


def factor_of(library, A):
    return library(upper_triangle(A, np.zeros(0, dtype=np.int64)))


@pytest.mark.parametrize("library", LIBRARIES)
def test_each_library_solves_for_one_and_for_many_right_hand_sides(library):
    A = held_stiffness()
    exact = np.random.default_rng(2).standard_normal((A.shape[0], 3))
    factor = factor_of(library, A)
    # Condition of this matrix: 1e5 times rounding, with a margin.
    scale = np.abs(exact).max()
    assert_allclose(factor.solve(A @ exact), exact, rtol=0.0, atol=1e-9 * scale)
    one = factor.solve(A @ exact[:, 0])
    assert one.shape == (A.shape[0],)
    assert_allclose(one, exact[:, 0], rtol=0.0, atol=1e-9 * scale)


@pytest.mark.parametrize("library", LIBRARIES)
def test_each_library_agrees_with_a_dense_solution(library):
    A = held_stiffness()
    b = np.random.default_rng(3).standard_normal(A.shape[0])
    reference = np.linalg.solve(A.toarray(), b)
    assert_allclose(
        factor_of(library, A).solve(b), reference, rtol=0.0, atol=1e-10 * np.abs(reference).max()
    )


NOT_DEFINITE = {
    "a free body": free_stiffness,
    "a held body beside a free one": lambda: sp.csr_array(
        sp.block_diag([held_stiffness(), free_stiffness()])
    ),
    "a zero on the diagonal": lambda: sp.csr_array(np.diag([1.0, 2.0, 0.0])),
    "a negative stiffness": lambda: sp.csr_array(np.array([[1.0, 2.0], [2.0, 1.0]])),
}


@pytest.mark.parametrize("matrix", NOT_DEFINITE)
@pytest.mark.parametrize("library", LIBRARIES)
def test_each_library_refuses_a_matrix_that_is_not_positive_definite(library, matrix):
    A = NOT_DEFINITE[matrix]()
    with pytest.raises(SingularMatrixError, match=rf"the matrix of order {A.shape[0]}"):
        factor_of(library, A)


@pytest.mark.parametrize("library", LIBRARIES)
def test_matrix_and_right_hand_side_stay_unchanged(library):
    A, b = held_stiffness(), np.ones((held_stiffness().shape[0], 2))
    before = A.copy()
    factor_of(library, A).solve(b)
    assert abs(A - before).max() == 0.0
    assert (b == 1.0).all()


def test_the_fastest_installed_library_serves():
    kind = type(factorise(held_stiffness()))
    expected = (
        factorisation._SuperLU
        if importlib.util.find_spec("kvxopt") is None
        else factorisation._Cholmod
    )
    assert kind is (
        factorisation._Pardiso if factorisation._mkl_library() is not None else expected
    )


@pytest.fixture
def first_use(monkeypatch):
    """The choice of a library as on first use, forgotten again afterwards."""
    monkeypatch.setattr(factorisation, "_mkl_library", lambda: None)
    factorisation._factoriser.cache_clear()
    yield monkeypatch
    factorisation._factoriser.cache_clear()


@pytest.mark.skipif(importlib.util.find_spec("kvxopt") is None, reason="kvxopt is not installed")
def test_without_mkl_cholmod_serves_and_is_named_once(first_use, caplog):
    caplog.set_level("INFO")
    for _ in range(3):
        factor = factorise(held_stiffness())
    assert isinstance(factor, factorisation._Cholmod)
    assert [record.getMessage() for record in caplog.records] == [
        "sparse factorisation: CHOLMOD (MKL is not installed)"
    ]


def test_without_mkl_and_kvxopt_scipy_serves_and_says_so_once(first_use, caplog):
    first_use.setitem(__import__("sys").modules, "kvxopt.cholmod", None)
    A = held_stiffness()
    for _ in range(3):
        factor = factorise(A)
    assert isinstance(factor, factorisation._SuperLU)
    said = [record.getMessage() for record in caplog.records]
    assert said == [
        "sparse factorisation: neither MKL nor kvxopt is installed; scipy's SuperLU is used "
        "(slower)"
    ]
    b = np.ones(A.shape[0])
    assert_allclose(A @ factor.solve(b), b, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("library", LIBRARIES)
def test_held_freedoms_stay_at_rest_and_the_others_do_not_see_them(library, monkeypatch):
    monkeypatch.setattr(factorisation, "_factoriser", lambda: library)
    K, fixed = free_stiffness(), statically_determinate_dofs(BOX.points)
    free = np.setdiff1d(np.arange(K.shape[0]), fixed)
    b = np.random.default_rng(5).standard_normal((K.shape[0], 2))
    x = factorise(K, fixed=fixed).solve(b)
    assert not x[fixed].any()
    reference = np.linalg.solve(K[free][:, free].toarray(), b[free])
    assert_allclose(x[free], reference, rtol=0.0, atol=1e-10 * np.abs(reference).max())


def test_upper_triangle_is_scipys_where_nothing_is_held():
    A = free_stiffness()
    upper, expected = upper_triangle(A, np.zeros(0, dtype=np.int64)), sp.triu(A, format="csr")
    assert abs(upper - expected).max() == 0.0
    assert upper.nnz == expected.nnz
    triangle = upper_triangle(A, np.array([3, 5]))
    assert (triangle[[3]].indices == [3]).all()
    assert (triangle[:, [5]].tocoo().row == [5]).all()
    assert (triangle.diagonal() == A.diagonal()).all()

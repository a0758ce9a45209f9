"""Least squares in columns of unit length, against solutions that are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.estimation.scaled_least_squares import (
    DEPENDENT,
    column_lengths,
    design_solution,
    full_inverse,
    normal_inverse,
    normal_solution,
)

#: A mass beside a stiffness beside a quintic stiffness: 24 orders of magnitude.
LAW = np.array([3.0e3, 17.0e6, 1.5e15])
DEFLECTION = np.linspace(-2e-3, 1e-3, 200)
DESIGN = np.column_stack([np.sin(9.0 * np.arange(200)), DEFLECTION, DEFLECTION**5])


def test_columns_of_any_unit_are_solved_to_rounding():
    force = DESIGN @ LAW
    assert_allclose(design_solution(DESIGN, force), LAW, rtol=1e-12)
    assert_allclose(normal_solution(DESIGN.T @ DESIGN, DESIGN.T @ force), LAW, rtol=1e-10)


def test_the_solution_follows_the_units_of_its_columns():
    force = DESIGN @ LAW + np.cos(np.arange(200))
    units = np.array([1e-9, 1.0, 1e12])
    scaled = DESIGN * units
    expected = normal_solution(DESIGN.T @ DESIGN, DESIGN.T @ force) / units
    assert_allclose(normal_solution(scaled.T @ scaled, scaled.T @ force), expected, rtol=1e-9)


def test_of_two_equal_columns_each_takes_half():
    design = np.column_stack([DEFLECTION, DEFLECTION, np.ones(200)])
    target = design @ [4.0, 0.0, 1.0]
    gram = design.T @ design
    assert_allclose(normal_solution(gram, design.T @ target), [2.0, 2.0, 1.0], rtol=1e-9)
    assert_allclose(design_solution(design, target), [2.0, 2.0, 1.0], rtol=1e-9)


@pytest.mark.parametrize(
    ("share", "determined"), [(0.1 * DEPENDENT, False), (10 * DEPENDENT, True)]
)
def test_one_tolerance_says_what_is_determined(share, determined):
    # Two unit columns with the product 1 - s have the eigenvalues s and 2 - s.
    product = 1.0 - 2.0 * share
    gram = np.array([[1.0, product], [product, 1.0]])
    right = gram @ [1.0, 0.0]
    expected = [1.0, 0.0] if determined else [0.5, 0.5]
    assert_allclose(normal_solution(gram, right), expected, atol=1e-5)
    largest = np.abs(normal_inverse(gram)).max()
    assert_allclose(largest, 0.25 / share if determined else 0.25, rtol=1e-5)


def test_a_column_of_zeros_gets_zero_and_leaves_the_others_alone():
    design = np.column_stack([DEFLECTION, np.zeros(200)])
    gram = design.T @ design
    assert_allclose(column_lengths(gram), [np.linalg.norm(DEFLECTION), 1.0])
    assert_allclose(normal_solution(gram, design.T @ (5.0 * DEFLECTION)), [5.0, 0.0])
    assert_allclose(design_solution(design, 5.0 * DEFLECTION), [5.0, 0.0])
    assert_allclose(normal_inverse(gram)[:, 1], 0.0)


def test_a_ridge_is_a_share_of_every_column():
    gram = np.diag([4.0, 1e10])
    right = np.array([4.0, 1e10])
    assert_allclose(normal_solution(gram, right, ridge=0.25), [0.8, 0.8])


def test_the_inverse_of_a_regular_matrix_is_its_inverse():
    gram = DESIGN.T @ DESIGN
    length = column_lengths(gram)
    product = normal_inverse(gram) @ gram * length[:, None] / length
    assert_allclose(product, np.eye(3), atol=1e-9)


def test_the_full_inverse_is_as_large_as_a_direction_is_free():
    regular = DESIGN.T @ DESIGN
    assert_allclose(full_inverse(regular), normal_inverse(regular), rtol=1e-6)
    share = 0.1 * DEPENDENT
    gram = np.array([[1.0, 1.0 - 2.0 * share], [1.0 - 2.0 * share, 1.0]])
    assert_allclose(full_inverse(gram).max(), 0.25 / share, rtol=1e-4)
    # Two columns that are one: free as far as rounding tells.
    assert full_inverse(np.ones((2, 2))).max() > 1e14

"""Parameters beside a discrepancy of no known form."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.gram_table import discrepancy_shift
from tests.diagnosis.classes.toy_table import N_BLOCKS, N_SAMPLES, toy_columns, toy_table

N = N_BLOCKS * N_SAMPLES
NOISE = 0.1


def _case(hidden, seed=3):
    """Constant and a straight law that looks in part like the columns of class a."""
    columns = toy_columns()
    law = columns["a"][0] + np.random.default_rng(seed).standard_normal(N)
    signal = 0.5 + 2.0 * law + hidden(columns)
    table = toy_table(signal, columns, noise=NOISE, laws={"a": law})
    J = np.zeros((len(table.scale), 2))
    J[1, 0], J[-1, 1] = 1.0, 1.0
    return table, J * (table.scale[0] / table.scale)[:, None]


def test_the_shift_is_that_of_generalised_least_squares():
    table, J = _case(lambda columns: 0.8 * columns["a"][1] + 0.5 * columns["a"][0])
    shift = discrepancy_shift(table, J, independent_samples=0.5 * N)
    # The same by the covariance of noise and discrepancy, without the table's Gram matrix.
    rows = _rows(table)
    columns = np.concatenate([table.groups[name].columns for name in table.ceiling])
    target, design, phi = rows[0], J.T @ rows, rows[columns]
    plain = np.linalg.lstsq(design.T, target, rcond=None)[0]
    above = target @ target - plain @ (design @ target) - table.floor.sum()
    beyond = phi - (phi @ np.linalg.pinv(design)) @ design
    energy = np.sum(phi**2, axis=1)
    pi = np.mean(np.sum(beyond**2, axis=1) / energy)
    tau_square = above / (len(columns) * pi * energy)
    V = table.floor.sum() / (0.5 * N) * np.eye(rows.shape[1]) + (phi.T * tau_square) @ phi
    weighted = np.linalg.solve(V, design.T)
    generalised = np.linalg.solve(design @ weighted, weighted.T @ target)
    assert_allclose(shift, generalised - plain, rtol=1e-6)
    # What class a hides in the law is found in part.
    assert 0.1 < abs(shift[1]) < 0.5


def _rows(table):
    """Rows with the products of the table."""
    squares, directions = np.linalg.eigh(table.total)
    return directions * np.sqrt(np.maximum(squares, 0.0)) @ directions.T


def test_nothing_shifts_where_the_fit_leaves_the_floor():
    table, J = _case(lambda columns: 0.0)
    at_floor = replace(table, floor=1.2 * table.floor)
    assert_allclose(discrepancy_shift(at_floor, J, independent_samples=N), 0.0)


def test_a_discrepancy_unlike_the_parameters_shifts_none():
    # Class c is as good as orthogonal to constant and law.
    table, J = _case(lambda columns: 0.8 * columns["c"][0])
    shift = discrepancy_shift(table, J, independent_samples=N)
    assert np.abs(shift).max() < 0.05


def test_a_parameter_without_a_column_is_left_alone():
    table, J = _case(lambda columns: columns["a"][0])
    wider = np.column_stack([J[:, :1], np.zeros(len(J)), J[:, 1:]])
    shift = discrepancy_shift(table, wider, independent_samples=N)
    assert shift[1] == 0.0
    assert_allclose(shift[[0, 2]], discrepancy_shift(table, J, independent_samples=N))

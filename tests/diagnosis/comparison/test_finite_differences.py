"""Derivatives by differences and the sums made of them, against a model with known derivatives."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.diagnosis.kind.problem_in_time import (
    DifferencedResiduals,
    step_halving_error,
)

TIME = np.linspace(0.0, 1.0, 40)
THETA = np.array([2.0, 0.5])


@dataclass(frozen=True, eq=False)
class Record:
    """Two segments between samples that belong to none."""

    phase: float

    name = "R"
    block = np.repeat([-1, 0, 1, -1], 10)
    n_blocks = 2


RECORDS = (Record(0.0), Record(1.0))


def predicted(record, theta):
    return theta[0] * np.sin(theta[1] * TIME + record.phase)


def residual(record, theta):
    return np.where(record.block >= 0, 1.0 - predicted(record, theta), 0.0)


def derivatives(record):
    angle = THETA[1] * TIME + record.phase
    return np.array([np.sin(angle), THETA[0] * TIME * np.cos(angle)])


def differenced(*, upper=np.inf, residual=residual):
    def residuals(runs):
        return [[residual(record, theta) for theta in sets] for record, sets in runs]

    parameters = [Parameter(name, "1", -np.inf, upper, 1.0, effect="e") for name in ("a", "b")]
    return DifferencedResiduals(RECORDS, residuals, parameters, 1e-6)


# At an upper bound of 2 the first parameter is differenced downwards.
@pytest.mark.parametrize("upper", [np.inf, 2.0])
def test_sums_are_those_of_the_exact_derivatives(upper):
    chosen = np.array([False, False, True, False])
    sums = differenced(upper=upper).sums(THETA, chosen)
    record = RECORDS[1]
    for block, segment in enumerate((2, 3)):
        rows = derivatives(record)[:, record.block == block]
        r = residual(record, THETA)[record.block == block]
        assert_allclose(sums.matrix[segment], rows @ rows.T, rtol=1e-5)
        assert_allclose(sums.right_side[segment], rows @ r, rtol=1e-5)
        assert_allclose(sums.square[segment], r @ r)
    assert not sums.square[:2].any()


def test_no_parameter_is_moved_beyond_its_upper_bound():
    tried = []

    def noted(record, theta):
        tried.append(theta.copy())
        return residual(record, theta)

    differenced(upper=2.0, residual=noted).sums(THETA, np.ones(4, dtype=bool))
    assert np.max(tried) <= 2.0


def test_a_run_that_diverges_has_infinite_squares_and_no_derivatives():
    def diverging(record, theta):
        return np.where(record.phase == 0.0, np.inf, residual(record, theta))

    sums = differenced(residual=diverging).sums(THETA, np.ones(4, dtype=bool))
    assert np.isinf(sums.square).tolist() == [True, True, False, False]
    assert not sums.matrix[:2].any()


def test_halving_the_step_tells_the_error_of_a_method():
    stated, halved = ([TIME + 0.3 / factor for _ in RECORDS] for factor in (1, 2))
    assert_allclose(step_halving_error(stated, halved), 0.15)

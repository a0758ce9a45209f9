"""Derivatives by differences and the sums made of them, against a model with known derivatives."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.diagnosis.kind.problem_in_time import ProblemInTime

TIME = np.linspace(0.0, 1.0, 40)
THETA = np.array([2.0, 0.5])


@dataclass(frozen=True, eq=False)
class Record:
    """Two segments between samples that belong to none."""

    phase: float

    name = "R"
    block = np.repeat([-1, 0, 1, -1], 10)
    n_blocks = 2
    measured = np.ones(40)
    is_measured = block >= 0


RECORDS = (Record(0.0), Record(1.0))


def predicted(record, theta):
    return theta[0] * np.sin(theta[1] * TIME + record.phase)


def derivatives(record):
    angle = THETA[1] * TIME + record.phase
    return np.array([np.sin(angle), THETA[0] * TIME * np.cos(angle)])


class Problem(ProblemInTime):
    """Signals of one in every sample."""

    difference = 1e-6
    unit = edges_hz = starts = gap = pictures = candidate_experiments = cards_of = simulated = None

    def simulator(self, effects):
        return self.model.simulator


def problem(*, upper=np.inf, simulator=lambda record, theta, refined: predicted(record, theta)):
    parameters = [Parameter(name, "1", -np.inf, upper, 1.0, effect="e") for name in ("a", "b")]
    model = SimpleNamespace(
        simulator=simulator,
        parameters=lambda effects: parameters,
        predicted_together=lambda effects, runs, refined: None,
    )
    return Problem(model, RECORDS)


# At an upper bound of 2 the first parameter is differenced downwards.
@pytest.mark.parametrize("upper", [np.inf, 2.0])
def test_sums_are_those_of_the_exact_derivatives(upper):
    chosen = np.array([False, False, True, False])
    sums = problem(upper=upper).sums((), THETA, chosen)
    record = RECORDS[1]
    for block, segment in enumerate((2, 3)):
        rows = derivatives(record)[:, record.block == block]
        r = (1.0 - predicted(record, THETA))[record.block == block]
        assert_allclose(sums.matrix[segment], rows @ rows.T, rtol=1e-5)
        assert_allclose(sums.right_side[segment], rows @ r, rtol=1e-5)
        assert_allclose(sums.square[segment], r @ r)
    assert not sums.square[:2].any()


def test_no_parameter_is_moved_beyond_its_upper_bound():
    tried = []

    def noted(record, theta, refined):
        tried.append(theta.copy())
        return predicted(record, theta)

    problem(upper=2.0, simulator=noted).sums((), THETA, np.ones(4, dtype=bool))
    assert np.max(tried) <= 2.0


def test_a_run_that_diverges_has_infinite_squares_and_no_derivatives():
    def diverging(record, theta, refined):
        return np.where(record.phase == 0.0, np.inf, predicted(record, theta))

    sums = problem(simulator=diverging).sums((), THETA, np.ones(4, dtype=bool))
    assert np.isinf(sums.square).tolist() == [True, True, False, False]
    assert not sums.matrix[:2].any()


def test_halving_the_step_tells_the_error_of_a_method():
    of_step = problem(simulator=lambda record, theta, refined: TIME + 0.3 / refined)
    assert_allclose(of_step.numerical_error((), THETA), 0.15)

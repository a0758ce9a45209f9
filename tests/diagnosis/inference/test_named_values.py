"""Tilts are published by size and direction.

With errors that follow from those of their components.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.diagnosis.inference.named_values import _named_values, _scatter
from carrierflex.simulation.effect_parameters import PolarPair


@dataclass(frozen=True, eq=False)
class Fitted:
    parameters: tuple
    theta: np.ndarray
    covariance: np.ndarray
    moves_records: np.ndarray = field(default_factory=lambda: np.ones(3, dtype=bool))


def _parameter(name, run=None, pair=None):
    return Parameter(name, "rad", -1.0, 1.0, 1.0, effect="carrier_tilt", run=run, pair=pair)


def _tilt(size, angle, run=None):
    pair = PolarPair(size, angle)
    return tuple(_parameter(name, run, pair) for name in pair.components)


def test_components_become_size_and_angle_by_the_delta_method():
    covariance = np.array([[4e-12, 1e-12], [1e-12, 9e-12]])
    fit = Fitted(
        _tilt("phi_PLC", "theta_PLC"),
        np.array([3e-4, 4e-4]),
        covariance,
    )
    values = _named_values(fit, _scatter(fit, few_blocks=False))["carrier_tilt"]
    assert set(values) == {"phi_PLC", "theta_PLC"}
    assert_allclose([values["phi_PLC"].value, values["theta_PLC"].value], [5e-4, np.arctan2(4, 3)])
    draws = np.random.default_rng(0).multivariate_normal(fit.theta, covariance, 200_000)
    assert_allclose(values["phi_PLC"].std, np.hypot(*draws.T).std(), rtol=0.01)
    assert_allclose(values["theta_PLC"].std, np.arctan2(draws[:, 1], draws[:, 0]).std(), rtol=0.01)
    assert values["theta_PLC"].unit == "rad"


def test_other_parameters_and_runs_of_their_own_stay_apart():
    fit = Fitted(
        (
            *_tilt("phi_H", "theta_H", "LC1"),
            _parameter("rho_f"),
        ),
        np.array([0.0, 0.0, 0.6]),
        np.diag([1e-12, 1e-12, 1e-4]),
    )
    values = _named_values(fit, _scatter(fit, few_blocks=False))["carrier_tilt"]
    assert set(values) == {"phi_H of LC1", "theta_H of LC1", "rho_f"}
    assert_allclose([values["rho_f"].value, values["rho_f"].std], [0.6, 0.01])
    assert values["theta_H of LC1"].std > 10.0  # no direction


def test_an_amplitude_that_moves_no_sample_is_left_out():
    shown = np.array([True, True, False])
    tilt = _tilt("phi_H", "theta_H")
    fit = Fitted((*tilt, _parameter("r_B")), np.zeros(3), np.eye(3), shown)
    assert set(_named_values(fit, _scatter(fit, few_blocks=False))["carrier_tilt"]) == {
        "phi_H",
        "theta_H",
    }

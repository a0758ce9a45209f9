"""Tilts are published by size and direction, with errors that follow from those of their components."""

from dataclasses import dataclass

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.diagnosis.inference.named_values import named_values


@dataclass(frozen=True, eq=False)
class Fitted:
    parameters: tuple
    theta: np.ndarray
    covariance: np.ndarray


def _parameter(name, run=None):
    return Parameter("carrier_tilt", name, "rad", -1.0, 1.0, 1.0, run=run)


def test_components_become_size_and_angle_by_the_delta_method():
    covariance = np.array([[4e-12, 1e-12], [1e-12, 9e-12]])
    fit = Fitted(
        (_parameter("phi_PLC cos theta_PLC"), _parameter("phi_PLC sin theta_PLC")),
        np.array([3e-4, 4e-4]),
        covariance,
    )
    found = named_values(fit)["carrier_tilt"]
    assert set(found) == {"phi_PLC", "theta_PLC"}
    assert_allclose([found["phi_PLC"].value, found["theta_PLC"].value], [5e-4, np.arctan2(4, 3)])
    draws = np.random.default_rng(0).multivariate_normal(fit.theta, covariance, 200_000)
    assert_allclose(found["phi_PLC"].std, np.hypot(*draws.T).std(), rtol=0.01)
    assert_allclose(found["theta_PLC"].std, np.arctan2(draws[:, 1], draws[:, 0]).std(), rtol=0.01)
    assert found["theta_PLC"].unit == "rad"


def test_other_parameters_and_runs_of_their_own_stay_apart():
    fit = Fitted(
        (
            _parameter("phi_H cos theta_H", "LC1"),
            _parameter("phi_H sin theta_H", "LC1"),
            _parameter("rho_f"),
        ),
        np.array([0.0, 0.0, 0.6]),
        np.diag([1e-12, 1e-12, 1e-4]),
    )
    found = named_values(fit)["carrier_tilt"]
    assert set(found) == {"phi_H of LC1", "theta_H of LC1", "rho_f"}
    assert_allclose([found["rho_f"].value, found["rho_f"].std], [0.6, 0.01])
    assert found["theta_H of LC1"].std > 10.0  # no direction

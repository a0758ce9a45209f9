import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.gap.findings import exponents

TORQUE = np.array([360.0, 180.0, 360.0, 270.0, 90.0, 360.0])
LOAD = np.array([0.0, 0.0, 200.0, 100.0, 50.0, 150.0])
SPEED = np.array([2.3, 1.5, 2.3, 1.9, 2.3, 1.2])


def test_a_product_of_powers_gives_its_exponents_within_their_intervals():
    rng = np.random.default_rng(0)
    load = LOAD + 20.0
    errors = []
    for _ in range(200):
        size = (
            TORQUE**1.0 * load**0.5 * SPEED**2.0 * np.exp(0.02 * rng.standard_normal(TORQUE.size))
        )
        fitted = exponents(size, 0.02 * size, {"torque": TORQUE, "load": load, "speed": SPEED})
        truth = {"torque": 1.0, "load": 0.5, "speed": 2.0}
        errors += [
            exponent.ci95[0] < truth[name] < exponent.ci95[1] for name, exponent in fitted.items()
        ]
        assert fitted["speed"].p_value < 0.05
    # Two degrees of freedom, the variance never below the declared one: a little wider than
    # nominal.
    assert 0.93 <= np.mean(errors) <= 1.0


def test_runs_without_load_take_part_in_the_exponent_of_the_torque_only():
    size = 2.0 * TORQUE
    fitted = exponents(size, 0.01 * size, {"torque": TORQUE, "load": LOAD})
    assert_allclose(fitted["torque"].value, 1.0, atol=1e-9)
    assert fitted["torque"].n_points == 6
    assert fitted["load"].n_points == 4
    assert_allclose(fitted["load"].value, 0.0, atol=1e-9)
    assert fitted["load"].p_value > 0.9


def test_a_gap_that_the_load_enlarges_keeps_its_exponent_with_torque():
    size = TORQUE * (1.0 + LOAD / LOAD.max()) ** 0.7
    assert_allclose(
        exponents(size, 0.01 * size, {"torque": TORQUE, "load": LOAD})["torque"].value,
        1.0,
        atol=1e-6,
    )


def test_the_misfit_of_the_law_widens_the_interval():
    size = TORQUE * np.array([1.0, 1.2, 0.9, 1.1, 0.8, 1.05])
    fitted = exponents(size, 1e-3 * size, {"torque": TORQUE})["torque"]
    assert fitted.ci95[0] < 1.0 < fitted.ci95[1]
    assert fitted.ci95[1] - fitted.ci95[0] > 0.2


@pytest.mark.parametrize(
    ("conditions", "reason"),
    [
        ({"torque": np.full(6, 360.0)}, "torque does not vary"),
        ({"torque": TORQUE, "speed": TORQUE / 100.0}, "torque changes together with speed"),
    ],
)
def test_what_the_runs_do_not_tell_is_said(conditions, reason):
    fitted = exponents(TORQUE, 0.01 * TORQUE, conditions)["torque"]
    assert fitted.reason == reason
    assert np.isnan(fitted.value)


def test_one_point_has_no_growth():
    point = np.array([1.0])
    assert (
        exponents(point, point, {"torque": point})["torque"].reason
        == "fewer than two points show it"
    )

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.mounting.torsional_train import (
    TorsionalTrain,
    member_sweeps,
    natural_frequencies_hz,
)

TRAIN = TorsionalTrain()


def first(matrices):
    return natural_frequencies_hz(*matrices)[0]


def test_without_bushings_both_topologies_are_two_inertias_on_one_spring():
    rigid = replace(TRAIN, bushing_stiffness=np.inf)
    spring = 1.0 / (1.0 / 50e6 + 1.0 / 27e6)
    generator = 32.0 * (120.0 / 21.0 * 82.0 / 23.0 * 4.0) ** 2 + 30.0 * (120.0 / 21.0) ** 2
    two_inertias = np.sqrt(spring * (1.0 / 2e5 + 1.0 / generator)) / (2.0 * np.pi)
    for matrices in (rigid.in_one_housing(), rigid.ring_on_bushings()):
        assert_allclose(
            first(matrices), two_inertias, rtol=1e-3
        )  # the carrier's 108 kg m² is left out above
        assert_allclose(first(matrices), 2.07, atol=0.005)


def test_frequencies_of_both_topologies_and_of_the_paper():
    assert_allclose(first(TRAIN.ring_on_bushings()), 1.449, atol=5e-4)
    assert_allclose(first(TRAIN.in_one_housing()), 1.312, atol=5e-4)
    paper = replace(TRAIN, rotor=1.9e5)
    assert_allclose(
        first(replace(paper, bushing_stiffness=np.inf).ring_on_bushings()), 2.102, atol=5e-4
    )
    assert_allclose(first(paper.ring_on_bushings()), 1.469, atol=5e-4)
    # With both bushings: 1.57 and 1.68 Hz.
    both = replace(TRAIN, bushing_stiffness=22.7e6)
    assert_allclose(
        [first(both.in_one_housing()), first(both.ring_on_bushings())], [1.57, 1.68], atol=5e-3
    )


def test_the_printed_sign_of_the_planetary_ratio_gives_another_frequency():
    assert_allclose(
        first(replace(TRAIN, planetary_ratio=-120.0 / 21.0).ring_on_bushings()), 1.17, atol=5e-3
    )


def test_the_bushings_carry_the_share_of_the_torque_of_their_topology():
    ratio = 120.0 / 21.0 * 82.0 / 23.0 * 4.0
    for matrices, share in (
        (TRAIN.in_one_housing(), 1.0 - 1.0 / ratio),
        (TRAIN.ring_on_bushings(), 99.0 / 120.0),
    ):
        M, K = matrices
        # Held generator: a constraint between gear train and housing; its torque share is the
        # static solution's.
        high = M[2, 2:] / M[2, 2]
        free = np.zeros((4, 3))
        free[0, 0] = free[1, 1] = 1.0
        free[2, 2], free[3, 2] = -high[1] / high[0], 1.0
        angles = free @ np.linalg.solve(free.T @ K @ free, free.T @ np.array([1.0, 0.0, 0.0, 0.0]))
        # The low speed shaft's inertia makes the row of M a mixture; its part is 1e-4.
        assert_allclose(abs(11.4e6 * angles[3]), share, rtol=2e-3)


def test_torque_sweeps_give_the_stiffness_of_shaft_and_gearbox():
    sweeps = member_sweeps(TRAIN, 360e3)
    assert_allclose(
        [sweeps["main_shaft"].stiffness, sweeps["gearbox"].stiffness], [50e6, 27e6], rtol=1e-4
    )
    with pytest.raises(ValueError, match="torque is nan N m"):
        member_sweeps(TRAIN, float("nan"))


@pytest.mark.parametrize(
    ("name", "value"), [("gearbox_stiffness", -1.0), ("rotor", 0.0), ("housing_inertia", -1.0)]
)
def test_an_impossible_train_is_refused(name, value):
    with pytest.raises(
        ValueError, match=f"torsional train: {name} is {value}; expected a positive number"
    ):
        replace(TRAIN, **{name: value})


def test_housing_inertia_hardly_changes_the_first_frequency():
    heavy = replace(TRAIN, housing_inertia=1000.0)
    assert_allclose(first(heavy.in_one_housing()), first(TRAIN.in_one_housing()), rtol=3e-3)
    assert first(heavy.in_one_housing()) < first(TRAIN.in_one_housing())

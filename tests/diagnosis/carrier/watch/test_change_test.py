"""Test for a change of a mean: run length under the null, delay, bounds of the noise, drift."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.carrier.watch.change_test import (
    WINDOWS,
    ChangeTest,
    change_point,
    learned_noise,
    threshold_of,
)

P, C = 3, 2
#: Memory from revolution to revolution, and covariance of unlike channels.
PHI = np.array([0.0, 0.4, 0.8])
SIGMA = np.array([[[1.0, 0.6], [0.6, 2.0]], [[0.3, 0.0], [0.0, 0.3]], [[0.5, -0.2], [-0.2, 0.1]]])
#: Directions of a mean, of unit length.
DIRECTIONS = np.array([[[1.0, 0], [0, 0], [0, 0]], [[0, 0], [0, 0], [0, 1.0]], np.ones((P, C))])
DIRECTIONS = DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=(1, 2), keepdims=True)


def noise(rng, n_streams):
    """Steps of stationary noise with the memory and covariance above, shape (B, p, C) each."""
    roots = np.linalg.cholesky(SIGMA)
    phi = PHI[:, None]
    x = np.einsum("kcd,bkd->bkc", roots, rng.standard_normal((n_streams, P, C)))
    x /= np.sqrt(1.0 - phi**2)
    while True:
        yield x
        white = rng.standard_normal((n_streams, P, C))
        x = phi * x + np.einsum("kcd,bkd->bkc", roots, white)


def detector(n_streams, threshold, dead_band, nuisance=None, drift=0.0):
    return ChangeTest(
        memory=np.broadcast_to(PHI, (n_streams, P)),
        covariance=np.broadcast_to(SIGMA, (n_streams, P, C, C)),
        dead_band=np.full(n_streams, dead_band),
        threshold=threshold,
        nuisance=np.zeros((P, C)) if nuisance is None else nuisance,
        drift=np.full(n_streams, drift),
    )


def first_alarms(test, means, rng, n_steps):
    """Step of the first alarm of every stream; `n_steps` where there is none."""
    state = test.begin()
    first = np.full(len(test.memory), n_steps)
    for k, x in zip(range(n_steps), noise(rng, len(first)), strict=False):
        state = test.advanced(state, x + means(k))
        alarms = (state.evidence >= test.threshold) & (first == n_steps)
        first[alarms] = k + 1
    return first


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_mean_run_length_on_the_edge_of_the_dead_band_is_at_least_its_bound(direction):
    """The worst mean of the null: as large as the dead band, along any direction."""
    rng = np.random.default_rng(1)
    h, dead_band, most = np.log(50.0), 0.7, 500
    test = detector(150, h, dead_band)
    first = first_alarms(test, lambda k: dead_band * direction, rng, most)
    # Runs that end without an alarm count as ended: the true mean is larger.
    std = first.std() / np.sqrt(first.size)
    assert first.mean() - 3.0 * std > np.exp(h)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_evidence_of_one_revolution_has_a_mean_of_at_most_one(direction):
    """E[e | past] <= 1 for any mean in the ball; 1 where the mean is the worst for the estimate."""
    rng = np.random.default_rng(2)
    n, dead_band = 40_000, 0.7
    test = detector(n, 1e9, dead_band)
    steps = noise(rng, n)
    mean = dead_band * direction
    d = np.broadcast_to(2.0 * dead_band * direction, (n, len(WINDOWS), P, C))
    state = replace(test.begin(), last=next(steps) + mean, estimate=d)
    # Of the last window: little of its estimate is noise.
    e = np.exp(test.advanced(state, next(steps) + mean).sums[:, -1])
    assert e.std() > 0.1
    margin = 4.0 * e.std() / np.sqrt(n)
    assert e.mean() < 1.0 + margin
    if np.count_nonzero(direction) == 1:
        assert e.mean() > 1.0 - margin
    inside = replace(state, last=state.last - mean)
    assert np.exp(test.advanced(inside, next(steps)).sums[:, -1]).mean() < 1.0


def test_delay_is_near_the_information_bound():
    """Lorden: h / I revolutions; the estimate from the past costs less than as much again."""
    rng = np.random.default_rng(3)
    h, dead_band, size = np.log(1e6), 0.5, 1.7
    direction = DIRECTIONS[0]
    v = direction / (1.0 - PHI[:, None])
    q = float(np.einsum("kc,kcd,kd", v, SIGMA, v))
    bound = h / (0.5 * (size - dead_band) ** 2 / q)
    first = first_alarms(detector(200, h, dead_band), lambda k: size * direction, rng, 400)
    assert first.max() < 400
    assert 0.8 * bound < first.mean() < 2.0 * bound


def test_no_single_revolution_raises_an_alarm():
    rng = np.random.default_rng(4)
    test = detector(1, 10.0, 1.0)
    for length in range(1, 9):
        first = first_alarms(test, lambda k, n=length: 1e3 * (k < n) * DIRECTIONS[0], rng, length)
        assert (first[0] < length) == (length > 6), length


def test_bounds_of_the_noise_hold_for_the_noise_that_made_them():
    rng = np.random.default_rng(5)
    steps = noise(rng, 60)
    vectors = np.array([next(steps) for _ in range(200)])
    n_memory = 0
    for b in range(vectors.shape[1]):
        learned = learned_noise(vectors[:, b])
        n_memory += int((learned.memory >= PHI).sum())
        beyond = learned.covariance - SIGMA
        assert np.linalg.eigvalsh(beyond).min() > 0.0
        # Of use, too: no bound is more than a few times what it bounds.
        assert np.trace(learned.covariance[0]) < 4.0 * np.trace(SIGMA[0])
    assert n_memory > 0.95 * 60 * P


def test_a_drift_of_the_nuisance_is_followed_and_one_of_another_direction_is_an_alarm():
    nuisance = np.zeros((P, C))
    nuisance[0] = np.sqrt(0.5)
    other = np.zeros((P, C))
    other[1, 0] = 1.0
    rate, n = 0.005, 1200
    test = detector(20, np.log(1e6), 1.0, nuisance, rate)
    followed = first_alarms(test, lambda k: rate * k * nuisance, np.random.default_rng(6), n)
    assert (followed == n).all()
    alarmed = first_alarms(test, lambda k: rate * k * other, np.random.default_rng(6), n)
    assert (alarmed < n).all()
    # It leaves the dead band at 1 / rate revolutions.
    assert alarmed.min() > 1.0 / rate
    step = first_alarms(test, lambda k: 4.0 * nuisance, np.random.default_rng(6), 60)
    assert (step < 60).all()


def test_the_change_point_is_where_the_step_is():
    rng = np.random.default_rng(7)
    x = 0.3 * rng.standard_normal((100, P, C))
    x[70:] += 2.0 * DIRECTIONS[1]
    assert change_point(x, DIRECTIONS[1], 2.0) == 70


def test_too_few_revolutions_are_refused():
    with pytest.raises(ValueError, match="99 revolutions to learn from; expected at least 100"):
        learned_noise(np.zeros((99, P, C)))


def test_threshold_is_the_run_length_of_the_rate():
    assert np.exp(threshold_of(28800.0, 1e-3)) == pytest.approx(28800.0 / 1e-3)

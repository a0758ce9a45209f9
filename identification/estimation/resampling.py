"""Bootstrap draws: how often each block of a record is drawn in a sample; memory of blocks.

A sample is a row of counts, so that sums by block give a draw by one product.
"""

from collections.abc import Iterable, Sequence
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Half width of a 95 % interval in standard deviations.
NORMAL_95 = NormalDist().inv_cdf(0.975)
#: With fewer groups than this a draw of groups says nothing of their scatter.
FEWEST_GROUPS = 3


def circular_block_counts(n: int, length: int, rng: np.random.Generator) -> Array:
    """How often each of n neighbours is drawn by blocks of consecutive ones, shape (n,).

    Blocks are drawn with replacement until n are full; a block may go over the end.

    Parameters
    ----------
    n, length : int
        Neighbours, and how many of them make a block: longer than they are alike.
    rng : numpy.random.Generator
        Source of the draws.

    References
    ----------
    .. [1] D. N. Politis, J. P. Romano, "A circular block-resampling procedure for stationary data"
       (1992).
    """
    n_blocks = -(-n // length)
    first = rng.integers(0, n, n_blocks)
    drawn = (first[:, None] + np.arange(length)).ravel()[:n] % n
    return np.bincount(drawn, minlength=n).astype(np.float64)


def block_counts(n: int, rng: np.random.Generator) -> Array:
    """How often each of n independent blocks is drawn in one sample of n, shape (n,)."""
    return np.bincount(rng.integers(0, n, n), minlength=n).astype(np.float64)


def multinomial_counts(n: int, n_samples: int, *, seed: int) -> Array:
    """How often each of n independent blocks is drawn in each sample of n, shape (n_samples, n).

    Parameters
    ----------
    n, n_samples : int
        Blocks and samples.
    seed : int
        Of the draws: the same sample number then draws the same blocks in every table of n blocks.
    """
    rng = np.random.default_rng(seed)
    return rng.multinomial(n, np.full(n, 1.0 / n), n_samples).astype(np.float64)


def two_level_counts(groups: Sequence[str], *, n_samples: int, rng: np.random.Generator) -> Array:
    """How often each block is drawn where groups are drawn first, shape (n_samples, n).

    Parameters
    ----------
    groups : sequence of str, length n
        Group of every block. Groups are drawn with replacement, then as many blocks within each
        drawn group as it has; with fewer than :data:`FEWEST_GROUPS` every group is taken once.
    n_samples : int
        Samples.
    rng : numpy.random.Generator
        Source of the draws.

    References
    ----------
    .. [1] A. C. Davison, D. V. Hinkley, "Bootstrap methods and their application" (1997), section
       3.8.
    """
    group = np.asarray(groups)
    names = sorted(set(groups))
    n_groups = len(names)
    times = np.ones((n_samples, n_groups), dtype=np.int64)
    if n_groups >= FEWEST_GROUPS:
        times = rng.multinomial(n_groups, np.full(n_groups, 1.0 / n_groups), n_samples)
    counts = np.zeros((n_samples, group.size))
    for number, name in enumerate(names):
        members = np.flatnonzero(group == name)
        # Drawn k times, a group gives k times as many blocks as it has.
        equal = np.full(members.size, 1.0 / members.size)
        counts[:, members] = rng.multinomial(times[:, number] * members.size, equal)
    return counts


def growth_by_memory(errors: Iterable[Array]) -> Array:
    """Growth ``sqrt(1 + 2 r)`` of the scatter of means of neighbours that are alike, shape (p,).

    r is the correlation of errors from one neighbour to the next, taken as no less than zero.

    Parameters
    ----------
    errors : iterable of ndarray, shape (n, m, p)
        Of each record m errors of p quantities at its n neighbours.
    """
    products, squares, biases = [], [], []
    for of_record in errors:
        about_mean = of_record - of_record.mean(axis=0)
        products.append((about_mean[1:] * about_mean[:-1]).sum(axis=(0, 1)))
        squares.append(np.square(about_mean).sum(axis=(0, 1)))
        # About their mean n independent errors have the correlation -1 / n.
        biases.append(1.0 / len(of_record))
    product, square = np.sum(products, axis=0), np.sum(squares, axis=0)
    r = np.divide(product, square, out=np.zeros_like(square), where=square > 0.0)
    return np.asarray(np.sqrt(1.0 + 2.0 * np.maximum(r + np.mean(biases), 0.0)))

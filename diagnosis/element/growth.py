"""How the unexplained force of an element grows with its deflection.

The exponent of the missing law.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student_t

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.signatures import base_columns, known_force
from carrierflex.diagnosis.gap.findings import Exponent
from carrierflex.identification.estimation.scaled_least_squares import design_solution

#: Share of the blocks, those of the lowest amplitude, that the linear element is fitted to.
_LOW_AMPLITUDE = 1.0 / 8.0
#: Growth is determined where the deflection of the blocks spans at least this factor.
_SPAN = 2.0
#: An unexplained force counts where its RMS is this many times that of the noise.
_CLEAR = 2.0
_FEWEST_POINTS = 5
#: Exponents that the search starts from, and their bounds.
_STARTS = (0.3, 1.5, 2.5, 4.0)
_LOW = -1.0
_HIGH = 8.0
_SEED = 5


@dataclass(frozen=True, eq=False)
class BlockForces:
    """RMS by block of all records.

    Parameters
    ----------
    deflection, speed : ndarray, shape (n,)
        RMS of deflection and speed.
    residual, noise : ndarray, shape (n,)
        RMS of the force that a linear element leaves, and of the noise in it.
    low_deflection : float
        RMS of the deflection of the blocks that the linear element was fitted to.
    """

    deflection: FloatArray
    speed: FloatArray
    residual: FloatArray
    noise: FloatArray
    low_deflection: float


def growth_exponent(
    model: ElementModel, records: Sequence[ElementRecord], noise: FloatArray
) -> Exponent:
    """Exponent p of ``unexplained force ~ deflection^p`` over the blocks.

    The baseline is fitted to the low-amplitude blocks, of deflection g. It takes up the part of the
    law there that a linear element can, so that the residual of a block of deflection q is ``r² =
    f² + c² (s q^2p + (1 - s)(q^p - g^(p-1) q)²)``: a floor f between the noise and the residual of
    the low-amplitude blocks, the share s that no linear element takes up, and what the linear share
    has grown since. c, s, p and f are fitted to log r.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the channel's noise.

    Returns
    -------
    Exponent
        3 for a cubic spring, 2 for quadratic damping, 1 for a linear branch, near 0 for dry
        friction; its reason where the deflection hardly varies or the force is within the noise.
    """
    blocks = block_forces(model, records, noise)
    if np.count_nonzero(blocks.residual > _CLEAR * blocks.noise) < _FEWEST_POINTS:
        return _undetermined(blocks, "no unexplained force is above the noise")
    if np.ptp(np.log(blocks.deflection)) < np.log(_SPAN):
        return _undetermined(blocks, "deflection does not vary")
    return _fitted(blocks)


def block_forces(
    model: ElementModel, records: Sequence[ElementRecord], noise: FloatArray
) -> BlockForces:
    """Unexplained force of every block.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the channel's noise.

    Returns
    -------
    BlockForces
        By block.
    """
    blocks = [
        (r, record.block == b) for r, record in enumerate(records) for b in range(record.n_blocks)
    ]
    columns = [record.where_flat(base_columns(model, record)) for record in records]
    force = [record.where_flat(known_force(model, record)) for record in records]
    deflection = np.array([records[r].motion[0][samples].std() for r, samples in blocks])
    speed = np.array([records[r].motion[1][samples].std() for r, samples in blocks])
    low = np.argsort(deflection)[: _n_low(len(blocks))]
    design = np.concatenate([columns[blocks[k][0]][:, blocks[k][1]] for k in low], axis=1)
    target = np.concatenate([force[blocks[k][0]][blocks[k][1]] for k in low])
    law = design_solution(design.T, target)
    residuals = [f - law @ rows for f, rows in zip(force, columns, strict=True)]
    floor = [_force_noise(model, record, law, float(noise[r])) for r, record in enumerate(records)]
    return BlockForces(
        deflection=deflection,
        speed=speed,
        residual=np.array([np.sqrt(np.mean(residuals[r][samples] ** 2)) for r, samples in blocks]),
        noise=np.array([floor[r] for r, _ in blocks]),
        low_deflection=float(np.sqrt(np.mean(deflection[low] ** 2))),
    )


def _n_low(n_blocks: int) -> int:
    """Number of low-amplitude blocks."""
    return max(2, round(_LOW_AMPLITUDE * n_blocks))


def _force_noise(
    model: ElementModel, record: ElementRecord, law: FloatArray, variance: float
) -> float:
    """RMS of the channel's noise, brought to force space by the fitted element."""
    if not model.by_force:
        return float(np.sqrt(variance * min(2.0 * record.flat_hz * record.step, 1.0)))
    white = np.sqrt(variance) * np.random.default_rng(_SEED).standard_normal(record.response.size)
    q, v, a = record.with_response(white).motion
    rows = [q, v] if model.mass is not None else [a, q, v]
    force = (model.mass or 0.0) * a + law[: len(rows)] @ np.array(rows)
    return float(np.std(record.where_flat(force)))


def _fitted(blocks: BlockForces) -> Exponent:
    """Exponent that fits the residuals of the blocks best, with its interval."""
    n = len(blocks.residual)
    q = blocks.deflection / blocks.low_deflection
    size = float(np.median(blocks.residual))
    noise = (blocks.noise / size) ** 2
    target = np.log(np.maximum(blocks.residual / size, 1e-12))
    lowest = (np.sort(blocks.residual)[: _n_low(n)].max() / size) ** 2

    def misfit(unknown: FloatArray) -> FloatArray:
        """Logarithm of the law over the measured gap, by amplitude."""
        log_c, share, p, part = unknown
        law = share * q ** (2.0 * p) + (1.0 - share) * (q**p - q) ** 2
        floor = noise + part * max(lowest - float(noise.min()), 0.0)
        fitted = 0.5 * np.log(floor + np.exp(2.0 * log_c) * law + 1e-12)
        return np.asarray(fitted - target, dtype=np.float64)

    bounds = ([-40.0, 1e-4, _LOW, 0.0], [40.0, 1.0, _HIGH, 1.0])
    fits = []
    for p in _STARTS:
        level = float(np.median(target) - p * np.log(np.median(q)))
        start = [np.clip(level, -39.0, 39.0), 0.4, p, 0.1]
        fits.append(least_squares(misfit, start, bounds=bounds, loss="soft_l1", f_scale=0.2))
    best = min(fits, key=lambda fit: float(fit.cost))
    covariance = np.linalg.pinv(best.jac.T @ best.jac)
    degrees = n - best.x.size
    std = float(np.sqrt(covariance[2, 2] * np.sum(misfit(best.x) ** 2) / degrees))
    value = float(best.x[2])
    half = float(student_t(degrees).ppf(0.975)) * std
    p_value = float(2.0 * student_t(degrees).sf(abs(value) / std)) if std > 0.0 else 0.0
    return Exponent(value, (value - half, value + half), p_value, n)


def _undetermined(blocks: BlockForces, reason: str) -> Exponent:
    nan = float("nan")
    return Exponent(nan, (nan, nan), nan, len(blocks.residual), reason)

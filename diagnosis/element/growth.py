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
from carrierflex.diagnosis.gap.power_laws import Exponent

#: Share of the blocks, the gentlest, that the linear element is fitted to.
_GENTLE = 1.0 / 8.0
#: Growth is told where the deflection of the blocks spans at least this factor.
_SPAN = 2.0
#: An unexplained force counts where its RMS is this many times that of the noise.
_SEEN = 2.0
_FEWEST_POINTS = 5
#: An exponent is told where its interval is narrower than this on either side.
_TOLD_WITHIN = 1.5
_STARTS = (0.3, 1.5, 2.5, 4.0)
_LOW, _HIGH = -1.0, 8.0
_SEED = 5


@dataclass(frozen=True, eq=False)
class BlockForces:
    """Blocks of all records.

    RMS of deflection and speed, of the force a linear element leaves, and of the noise in it.

    Parameters
    ----------
    deflection, speed, left, noise : ndarray, shape (n,)
        RMS by block.
    gentle : float
        RMS of the deflection of the blocks that the linear element was fitted to.
    """

    deflection: FloatArray
    speed: FloatArray
    left: FloatArray
    noise: FloatArray
    gentle: float


def growth_exponent(
    model: ElementModel, records: Sequence[ElementRecord], noise: FloatArray
) -> Exponent:
    """Exponent p of ``unexplained force ~ deflection^p`` over the blocks.

    The baseline is fitted to the gentlest blocks, of deflection g. It takes up the part of the law
    there that a linear element can, so that a block of deflection q is left with ``r² = f² + c² (s
    q^2p + (1 - s)(q^p - g^(p-1) q)²)``: a floor f between the noise and what the gentlest blocks
    leave, the share s that no linear element takes up, and what the linear share has grown since.
    c, s, p and f are fitted to log r.

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
        friction; its reason where the deflection hardly varies or the force does not stand out.
    """
    blocks = block_forces(model, records, noise)
    if np.count_nonzero(blocks.left > _SEEN * blocks.noise) < _FEWEST_POINTS:
        return _silent(blocks, "no unexplained force stands out of the noise")
    if np.ptp(np.log(blocks.deflection)) < np.log(_SPAN):
        return _silent(blocks, "deflection does not vary")
    return _fitted(blocks)


def growth_words(found: Exponent) -> str:
    """``, grows with deflection^3.0 (95 %.

    2.8 to 3.2)`` where the exponent is known well enough to be said.
    """
    if not found.ci95[1] - found.value <= _TOLD_WITHIN:
        return ""
    low, high = found.ci95
    return f", grows with deflection^{found.value:.1f} (95 %: {low:.1f} to {high:.1f})"


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
    rows = [base_columns(model, record) for record in records]
    force = [known_force(model, record) for record in records]
    size, speed = (np.array([records[r].motion[k][own].std() for r, own in blocks]) for k in (0, 1))
    gentle = np.argsort(size)[: max(2, round(_GENTLE * len(blocks)))]
    design = np.concatenate([rows[blocks[k][0]][:, blocks[k][1]] for k in gentle], axis=1)
    target = np.concatenate([force[blocks[k][0]][blocks[k][1]] for k in gentle])
    scale = np.linalg.norm(design, axis=1)
    scale[scale == 0.0] = 1.0
    law = np.linalg.lstsq((design / scale[:, None]).T, target, rcond=1e-10)[0] / scale
    left = np.array(
        [np.sqrt(np.mean((force[r][own] - law @ rows[r][:, own]) ** 2)) for r, own in blocks]
    )
    floor = [_force_noise(model, record, law, float(noise[r])) for r, record in enumerate(records)]
    return BlockForces(
        size,
        speed,
        left,
        np.array([floor[r] for r, _ in blocks]),
        float(np.sqrt(np.mean(size[gentle] ** 2))),
    )


def _force_noise(
    model: ElementModel, record: ElementRecord, law: FloatArray, variance: float
) -> float:
    """RMS of the channel's noise, brought to force space by the fitted element."""
    if not model.by_force:
        return float(np.sqrt(variance * min(2.0 * record.cutoff_hz * record.step, 1.0)))
    white = np.sqrt(variance) * np.random.default_rng(_SEED).standard_normal(record.response.size)
    q, v, a = record.with_response(white).motion
    rows = [q, v] if model.mass is not None else [a, q, v]
    return float(np.std((model.mass or 0.0) * a + law[: len(rows)] @ np.array(rows)))


def _fitted(blocks: BlockForces) -> Exponent:
    q, n = blocks.deflection / blocks.gentle, len(blocks.left)
    size = float(np.median(blocks.left))
    noise, target = (blocks.noise / size) ** 2, np.log(np.maximum(blocks.left / size, 1e-12))
    gentlest = (np.sort(blocks.left)[: max(2, round(_GENTLE * n))].max() / size) ** 2

    def misfit(unknown: FloatArray) -> FloatArray:
        log_c, share, p, part = unknown
        own = share * q ** (2.0 * p) + (1.0 - share) * (q**p - q) ** 2
        floor = noise + part * max(gentlest - float(noise.min()), 0.0)
        return np.asarray(
            0.5 * np.log(floor + np.exp(2.0 * log_c) * own + 1e-12) - target, dtype=np.float64
        )

    bounds = ([-40.0, 1e-4, _LOW, 0.0], [40.0, 1.0, _HIGH, 1.0])
    fits = []
    for p in _STARTS:
        level = float(np.median(target) - p * np.log(np.median(q)))
        start = [np.clip(level, -39.0, 39.0), 0.4, p, 0.1]
        fits.append(least_squares(misfit, start, bounds=bounds, loss="soft_l1", f_scale=0.2))
    best = min(fits, key=lambda fit: float(fit.cost))
    covariance = np.linalg.pinv(best.jac.T @ best.jac)
    std = float(np.sqrt(covariance[2, 2] * np.sum(misfit(best.x) ** 2) / (n - 4)))
    half, value = float(student_t(n - 4).ppf(0.975)) * std, float(best.x[2])
    p_value = float(2.0 * student_t(n - 4).sf(abs(value) / std)) if std > 0.0 else 0.0
    return Exponent(value, (value - half, value + half), p_value, n)


def _silent(blocks: BlockForces, reason: str) -> Exponent:
    nan = float("nan")
    return Exponent(nan, (nan, nan), nan, len(blocks.left), reason)

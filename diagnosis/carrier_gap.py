"""Gap map of a carrier: residual by run, sensor pattern and shaft order, against its scatter over the revolutions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, false_discovery_control
from scipy.stats import f as fisher_f

from diagnosis.order_map import MAX_ORDER, PATTERNS, are_quarter_turns
from diagnosis.plants import GapCell
from identification.campaign import Channel
from simulation.run_cases import AXIAL

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
_Table = tuple[FloatArray, FloatArray, FloatArray, FloatArray]

_SIGNIFICANCE = 0.01
_DRAWS = 200
_SEED = 3
#: Parts of the gap named in the sentence at most, and the smallest share worth naming.
_MOST_PARTS = 3
_SMALLEST_PART = 0.05
#: Torques this far apart show how a part grows with the torque.
_TORQUE_SPAN = 1.3
PATTERN_NAMES = {0: "m=0", 1: "m=+1", -1: "m=-1", 2: "m=2"}
RADIAL = "radial"
_MEANINGS = {
    (0, "m=0"): "axial offset",
    (0, "m=+1"): "tilt fixed to the housing",
    (0, "m=-1"): "tilt fixed to the housing",
    (0, "m=2"): "saddle fixed to the housing",
    (1, "m=+1"): "tilt fixed to the carrier",
    (0, RADIAL): "radial shift fixed to the housing",
    (1, RADIAL): "eccentricity fixed to the carrier",
}


@dataclass(frozen=True, eq=False)
class PatternSplit:
    """Split of the channels into patterns.

    Parameters
    ----------
    names : tuple of str
        Patterns, or the names of channels that join none.
    amplitudes : ndarray of complex, shape (R, n_patterns, 2 MAX_ORDER + 1)
        By revolution, at the orders -MAX_ORDER to MAX_ORDER; negative orders are zero but for a radial pair.
    weights : ndarray, shape (n_patterns, 2 MAX_ORDER + 1)
        Share of a squared amplitude in the mean square over all channels.
    """

    names: tuple[str, ...]
    amplitudes: ComplexArray
    weights: FloatArray


def pattern_split(channels: Sequence[Channel], orders: ComplexArray) -> PatternSplit:
    """Split order amplitudes into sensor patterns (four axial sensors 90 deg apart), signed orders of the radial pair, rest.

    Parameters
    ----------
    channels : sequence of Channel
        Channels.
    orders : ndarray of complex, shape (R, n_channels, MAX_ORDER + 1)
        Order amplitudes.

    Returns
    -------
    PatternSplit
        Amplitudes by pattern.
    """
    axial = [c for c, channel in enumerate(channels) if channel.quantity == AXIAL]
    radial = [c for c in range(len(channels)) if c not in axial]
    angles = np.array([channel.angle for channel in channels], dtype=np.float64)
    names: list[str] = []
    rows, weights = [], []
    plain = np.where(np.arange(MAX_ORDER + 1) == 0, 1.0, 0.5) / len(channels)
    if are_quarter_turns(angles[axial]):
        for m in PATTERNS:
            names.append(PATTERN_NAMES[m])
            rows.append(_one_sided(np.einsum("rcn,c->rn", orders[:, axial], np.exp(1j * m * angles[axial]) / 4.0)))
            weights.append(_one_sided(4.0 * plain).real)
        axial = []
    if len(radial) == 2 and abs(np.sin(angles[radial[0]] - angles[radial[1]])) > 0.5:
        names.append(RADIAL)
        rows.append(_signed_orders(orders[:, radial], angles[radial]))
        weights.append(np.full(2 * MAX_ORDER + 1, 1.0 / len(channels)))
        radial = []
    for c in (*axial, *radial):
        names.append(channels[c].name)
        rows.append(_one_sided(orders[:, c]))
        weights.append(_one_sided(plain).real)
    return PatternSplit(tuple(names), np.stack(rows, axis=1), np.array(weights))


def _one_sided(values: NDArray[np.inexact]) -> ComplexArray:
    """Values of the orders from 0 on, with zeros at the negative ones before."""
    blank = np.zeros((*values.shape[:-1], MAX_ORDER), dtype=np.complex128)
    return np.concatenate([blank, values], axis=-1)


def _signed_orders(orders: ComplexArray, angles: FloatArray) -> ComplexArray:
    """Forward (+n) and backward (-n) motion ``u = sum Z_n exp(j n theta)`` of a pair, u along z plus j times along -y.

    A sensor at v reads ``Re(u) cos v + Im(u) sin v``.
    """
    solved = np.einsum("ij,rjn->rin", np.linalg.inv(np.column_stack([np.cos(angles), np.sin(angles)])), orders)
    forward = (solved[:, 0] + 1j * solved[:, 1]) / 2.0
    backward = np.conj(solved[:, 0] - 1j * solved[:, 1]) / 2.0
    result = np.zeros((len(orders), 2 * MAX_ORDER + 1), dtype=np.complex128)
    result[:, MAX_ORDER:], result[:, :MAX_ORDER] = forward, backward[:, :0:-1]
    result[:, MAX_ORDER] = solved[:, 0, 0].real + 1j * solved[:, 1, 0].real
    return result


def carrier_gap_cells(
    channels: Sequence[Channel],
    residual_orders: ComplexArray,
    runs: Sequence[str],
    run_of_revolution: NDArray[np.int64],
    noise_of_order: FloatArray,
) -> tuple[GapCell, ...]:
    """Gap map of a residual, largest share first.

    ``coherent = w (|mean|² - s²/R)`` over the R complete revolutions of a run, test ``R |mean|²/s² ~ F(d, d (R - 1))``; with
    one revolution the noise of a channel's order stands for s.

    Parameters
    ----------
    channels : sequence of Channel
        Channels.
    residual_orders : ndarray of complex, shape (R, n_channels, MAX_ORDER + 1)
        Order amplitudes of the residual by revolution.
    runs : sequence of str
        Names of the runs.
    run_of_revolution : ndarray of int, shape (R,)
        Run of every revolution.
    noise_of_order : ndarray, shape (n_runs,)
        Noise variance of the amplitude of an order in one revolution, mean over the channels [m²].

    Returns
    -------
    tuple of GapCell
        Every cell of every run that has a complete revolution.
    """
    split = pattern_split(channels, residual_orders)
    tables: list[tuple[int, _Table]] = []
    for r in range(len(runs)):
        own = split.amplitudes[run_of_revolution == r]
        own = own[np.isfinite(own).all(axis=(1, 2))]
        if len(own):
            tables.append((r, _run_table(own, split, float(noise_of_order[r]))))
    if not tables:
        return ()
    total = sum(float(table[1].sum()) for _, table in tables)
    adjusted = false_discovery_control(
        np.concatenate([table[2][split.weights > 0.0] for _, table in tables]), method="by"
    )
    cells = []
    for k, (r, (square, coherent, _, draws)) in enumerate(tables):
        drawn_total = draws.sum(axis=(1, 2)) + total - float(coherent.sum())
        used = np.argwhere(split.weights > 0.0)
        p_own = adjusted[k * len(used) : (k + 1) * len(used)]
        for (m, n), p_value in zip(used, p_own, strict=True):
            low, high = np.quantile(draws[:, m, n] / _safe(drawn_total), (0.025, 0.975))
            cells.append(
                GapCell(
                    split.names[m],
                    float(n - MAX_ORDER),
                    runs[r],
                    float(square[m, n]),
                    float(coherent[m, n]),
                    float(coherent[m, n] / total) if total else float("nan"),
                    (float(low), float(high)),
                    float(p_value),
                )
            )
    return tuple(sorted(cells, key=lambda cell: -cell.coherent))


def _safe(total: FloatArray) -> FloatArray:
    return np.where(total == 0.0, np.nan, total)


def _run_table(own: ComplexArray, split: PatternSplit, noise: float) -> _Table:
    """Mean square, coherent part, p-value and draws of the coherent part of every cell of one run."""
    n, mean = len(own), own.mean(axis=0)
    real = np.abs(own.imag).max(axis=0) == 0.0
    degrees = np.where(real, 1.0, 2.0)
    if n > 1:
        scatter = own.var(axis=0, ddof=1)
        p_value = fisher_f.sf(
            n * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny), degrees, degrees * (n - 1)
        )
    else:
        scatter = noise / np.maximum(split.weights * 4.0, np.finfo(float).tiny)
        p_value = chi2.sf(degrees * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny), degrees)
    square = split.weights * np.abs(mean) ** 2
    counts = np.random.default_rng(_SEED).multinomial(n, np.full(n, 1.0 / n), _DRAWS) / n
    draws = split.weights * (np.abs(np.einsum("dr,rmn->dmn", counts, own)) ** 2 - scatter / n)
    return square, square - split.weights * scatter / n, p_value, draws


@dataclass(frozen=True, eq=False)
class GapPart:
    """Cells of one pattern and order in all runs: share of the gap, runs in which it is beyond chance."""

    pattern: str
    order: int
    share: float
    amplitudes: dict[str, float]
    runs: tuple[str, ...]


def gap_parts(cells: Sequence[GapCell]) -> tuple[GapPart, ...]:
    """Parts of the gap over all runs, largest first; the two halves of a static tilt are one part."""
    groups: dict[tuple[str, int], list[GapCell]] = {}
    for cell in cells:
        pattern = "m=+1" if (cell.order, cell.channel_pattern) == (0, "m=-1") else cell.channel_pattern
        groups.setdefault((pattern, int(cell.order)), []).append(cell)
    parts = []
    for (pattern, order), own in groups.items():
        sizes: dict[str, float] = {}
        for cell in own:
            sizes[cell.run] = sizes.get(cell.run, 0.0) + max(cell.coherent, 0.0)
        seen = tuple(dict.fromkeys(cell.run for cell in own if cell.p_value < _SIGNIFICANCE and cell.coherent > 0.0))
        parts.append(
            GapPart(pattern, order, sum(c.share for c in own), {r: np.sqrt(s) for r, s in sizes.items()}, seen)
        )
    return tuple(sorted(parts, key=lambda part: -part.share))


def carrier_where_text(cells: Sequence[GapCell], loads: dict[str, FloatArray]) -> str:
    """One sentence about a gap map.

    Parameters
    ----------
    cells : sequence of GapCell
        The map.
    loads : mapping of str to ndarray, shape (3,)
        Mean torque [N m] and radial load along y and z [N] of every run.

    Returns
    -------
    str
        Shares with order, pattern, frame, runs and growth with the torque.
    """
    parts = [part for part in gap_parts(cells) if part.runs and part.share >= _SMALLEST_PART][:_MOST_PARTS]
    if not parts:
        return "no order or pattern of the gap stands out from the noise"
    texts = []
    for k, part in enumerate(parts):
        start = f"{100.0 * part.share:.0f} % of the gap is" if k == 0 else f"{100.0 * part.share:.0f} % is"
        runs = "in every run" if len(part.runs) == len(loads) else f"in {', '.join(sorted(part.runs))}"
        texts.append(f"{start} order {part.order}, {part.pattern}{_meaning(part)}, {runs}{_growth(part, loads)}")
    return "; ".join(texts)


def _meaning(part: GapPart) -> str:
    known = _MEANINGS.get((part.order, part.pattern))
    if known is None and part.pattern in PATTERN_NAMES.values():
        m = next(number for number, name in PATTERN_NAMES.items() if name == part.pattern)
        if part.order == 0:
            return " (fixed to the housing)"
        known = "waves fixed to the carrier" if (part.order - m) % 4 == 0 else "not of one wave fixed to the carrier"
    return f" ({known})" if known else ""


def _growth(part: GapPart, loads: dict[str, FloatArray]) -> str:
    """How a part grows with the torque, over runs of equal radial load that show it, and with the radial load."""
    exponent = torque_exponent(part, loads)
    text = ""
    if exponent is not None:
        text = ", whatever the torque" if abs(exponent) < 0.25 else f", growing as torque^{exponent:.1f}"
    forces = {run: float(np.hypot(*loads[run][1:])) for run in part.runs}
    without = [part.amplitudes[run] for run in part.runs if forces[run] < 0.01 * max(forces.values())]
    with_load = [part.amplitudes[run] for run in part.runs if forces[run] >= 0.01 * max(forces.values())]
    if without and with_load and np.ptp(with_load + without) > 0.5 * max(with_load + without):
        text += ", changing with the radial load"
    return text


def torque_exponent(part: GapPart, loads: dict[str, FloatArray]) -> float | None:
    """Exponent p of ``gap ~ |T|^p`` over the runs without radial load; None where their torques are too close."""
    largest = max(float(np.hypot(*own[1:])) for own in loads.values())
    free = [run for run in part.runs if np.hypot(*loads[run][1:]) <= 0.01 * largest and part.amplitudes[run] > 0.0]
    torque = np.array([abs(loads[run][0]) for run in free])
    if len(free) < 2 or torque.min() <= 0.0 or torque.max() < _TORQUE_SPAN * torque.min():
        return None
    return float(np.polyfit(np.log(torque), np.log([part.amplitudes[run] for run in free]), 1)[0])

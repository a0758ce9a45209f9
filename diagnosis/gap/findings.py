"""The gap beyond its map.

In time, what does not repeat, growth with the conditions, and its uncertainty by cell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from scipy.stats import wasserstein_distance

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray, GapCell
from carrierflex.diagnosis.gap.power_laws import Exponent

SIGNIFICANCE = 0.01


@dataclass(frozen=True, eq=False)
class GapMoment:
    """RMS of the gap in one window of a run.

    Parameters
    ----------
    run : str
        Run.
    time : float
        Middle of the window [s].
    rms : float
        RMS over the channels in their unit.
    """

    run: str
    time: float
    rms: float


@dataclass(frozen=True, eq=False)
class Drift:
    """Trend of one cell of the map over a run.

    Parameters
    ----------
    run, channel_pattern : str
        Cell.
    order : float
        Order, or line.
    change : float
        Amplitude of the change from the first to the last repetition, in the unit of the channels.
    share : float
        Share of the cell's mean square in that run that the trend makes up.
    p_value : float
        Without a trend; adjusted for the number of cells (Benjamini-Yekutieli).
    """

    run: str
    channel_pattern: str
    order: float
    change: float
    share: float
    p_value: float


@dataclass(frozen=True, eq=False)
class NonSynchronousCell:
    """What does not repeat in one cell.

    From revolution to revolution, period to period or run to run, or off the orders.

    Parameters
    ----------
    run, channel_pattern : str
        Cell; the names of several runs, joined by "and", for what differs between repeats of one
        condition.
    order : float, optional
        Order or line; None for everything off the orders.
    measured, simulated : float
        Mean square that does not repeat in the measured and in the simulated signal.
    gap, noise : float
        The same of the gap, and of the noise alone.
    p_value : float
        Without more than noise; adjusted (Benjamini-Yekutieli); NaN where the noise is itself
        estimated from this scatter.
    """

    run: str
    channel_pattern: str
    order: float | None
    measured: float
    simulated: float
    gap: float
    noise: float
    p_value: float


@dataclass(frozen=True, eq=False)
class PartGrowth:
    """How one part of the gap (a pattern and order over all runs) depends on the conditions.

    Parameters
    ----------
    channel_pattern : str
        Pattern or channel.
    order : float
        Order; NaN where all orders or lines are taken together.
    frame : str
        ``housing``, ``carrier`` or ``undecided``: what it is fixed to; empty where nothing turns.
    exponents : mapping of str to Exponent
        By condition.
    """

    channel_pattern: str
    order: float
    frame: str
    exponents: Mapping[str, Exponent]


@dataclass(frozen=True, eq=False)
class CellValidation:
    """Comparison error of one significant cell, before and after, and its uncertainty (ASME V&V 20).

    Parameters
    ----------
    channel_pattern, run : str
        Cell.
    order : float
        Order or line.
    error_before, error_after : float
        RMS of E, measured less simulated.
    u_val : float
        ``sqrt(u_num² + u_D²)``: step of integration and scatter of the measured cell; the inputs'
        own error is not declared.
    is_beyond : bool
        Whether |E| before exceeds u_val, so that a shrink may be claimed.
    """

    channel_pattern: str
    order: float
    run: str
    error_before: float
    error_after: float
    u_val: float
    is_beyond: bool


@dataclass(frozen=True, eq=False)
class Scalar:
    """A quantity of interest, measured and predicted, one value for every repetition in every condition."""

    name: str
    unit: str
    measured: FloatArray
    predicted: FloatArray


@dataclass(frozen=True, eq=False)
class ScalarGap:
    """Area between the distributions of a scalar, measured and simulated, before and after.

    ``integral |F_s - F_m| dx``.
    """

    name: str
    unit: str
    measured_mean: float
    area_before: float
    area_after: float


@dataclass(frozen=True, eq=False)
class GapFindings:
    """What a plant finds about the gap of one model beyond its map.

    Fields as in :class:`GapDetail`.
    """

    in_time: tuple[GapMoment, ...] = ()
    drifts: tuple[Drift, ...] = ()
    non_synchronous: tuple[NonSynchronousCell, ...] = ()
    growth: tuple[PartGrowth, ...] = ()
    parity: str = ""
    text: str = ""


@dataclass(frozen=True, eq=False)
class GapDetail:
    """The gap of the baseline beyond its map.

    Parameters
    ----------
    findings : GapFindings
        In time, incoherent, growth, parity, and words.
    cells : tuple of CellValidation
        Significant cells, largest error first.
    scalars : tuple of ScalarGap
        Area metric.
    """

    findings: GapFindings
    cells: tuple[CellValidation, ...]
    scalars: tuple[ScalarGap, ...]


@runtime_checkable
class Detailed(Protocol):
    """A plant that looks at its gap beyond the map.

    One without these methods has no such part in its diagnosis.
    """

    def gap_findings(self, effects: Effects, theta: FloatArray) -> GapFindings:
        """Gap of a model in time, incoherent, with the conditions."""
        ...

    def scalars(self, effects: Effects, theta: FloatArray) -> Sequence[Scalar]:
        """Quantities of interest of a model."""
        ...


def cell_validations(
    before: Sequence[GapCell], after: Sequence[GapCell], numerical: float
) -> tuple[CellValidation, ...]:
    """Comparison error and its uncertainty of every significant cell (ASME V&V 20-2009, section 1-5).

    Parameters
    ----------
    before, after : sequence of GapCell
        Map of the baseline and of the accepted model.
    numerical : float
        RMS error of the integration.

    Returns
    -------
    tuple of CellValidation
        Largest error before first.
    """
    later = {(c.run, c.channel_pattern, c.order): c for c in after}
    result = []
    for cell in before:
        if cell.p_value >= SIGNIFICANCE or cell.coherent <= 0.0:
            continue
        left = later[cell.run, cell.channel_pattern, cell.order]
        error, rest = float(np.sqrt(cell.mean_square)), float(np.sqrt(max(left.mean_square, 0.0)))
        u_val = float(np.sqrt(numerical**2 + max(cell.mean_square - cell.coherent, 0.0)))
        result.append(
            CellValidation(
                cell.channel_pattern, cell.order, cell.run, error, rest, u_val, error > u_val
            )
        )
    return tuple(sorted(result, key=lambda own: -own.error_before))


def scalar_gaps(before: Sequence[Scalar], after: Sequence[Scalar]) -> tuple[ScalarGap, ...]:
    """Area metric of every scalar, before and after.

    References
    ----------
    .. [1] S. Ferson, W. L. Oberkampf, L. Ginzburg, "Model validation and predictive capability for
    the thermal challenge
       problem", Comput. Methods Appl. Mech. Engrg. 197 (2008) 2408-2430.
    """
    return tuple(
        ScalarGap(
            old.name,
            old.unit,
            float(np.mean(old.measured)),
            float(wasserstein_distance(old.measured, old.predicted)),
            float(wasserstein_distance(new.measured, new.predicted)),
        )
        for old, new in zip(before, after, strict=True)
    )


def detail_document(detail: GapDetail, *, most: int) -> dict[str, Any]:
    """Content of the key ``gap`` of diagnosis.json; what is not finite is null.

    Parameters
    ----------
    detail : GapDetail
        The gap.
    most : int
        Rows of a table at most.
    """
    own = detail.findings
    tables: dict[str, Sequence[Any]] = {
        "in_time": own.in_time,
        "drift": own.drifts,
        "incoherent": own.non_synchronous,
        "growth": own.growth,
        "cells": detail.cells,
        "scalars": detail.scalars,
    }
    rows = {name: [_plain(asdict(row)) for row in table[:most]] for name, table in tables.items()}
    return {"text": own.text, "parity": own.parity, **rows}


def size_words(value: float, unit: str) -> str:
    """Size with its unit, metres in micrometres."""
    return f"{value * 1e6:.3g} µm" if unit == "m" else f"{value:.3g} {unit}"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(own) for key, own in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(own) for own in value]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value

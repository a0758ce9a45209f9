"""What is found about the gap of one model: objects, from which the report makes its words.

Where it lies, how it develops in time, what does not repeat, how it grows with the conditions, and
quantities of interest.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student_t

from carrierflex.diagnosis.comparison.problem import FloatArray

#: A condition varies where its largest value is at least this many times its smallest.
_SPAN = 1.3
#: Values below this share of the largest count as "without" (a radial load at rest of its rams).
WITHOUT = 0.01
#: A condition is separable from the others where this share of its variation is its own.
_SEPARATE_SHARE = 0.3
#: No amplitude is trusted to better than this: the law itself is not exact.
_LEAST_ERROR = 5e-3


@dataclass(frozen=True, eq=False)
class Exponent:
    """Exponent of one condition.

    Parameters
    ----------
    value : float
        Exponent; NaN where the conditions do not determine it.
    ci95 : tuple of float
        Interval of 95 %.
    p_value : float
        Probability of such an exponent where the gap does not depend on the condition.
    n_points : int
        Amplitudes that were used. With as many as unknowns the interval knows the noise only, not
        the misfit of the law.
    reason : str
        Why it is not determinable; empty where it is.
    """

    value: float
    ci95: tuple[float, float]
    p_value: float
    n_points: int
    reason: str = ""


def exponents(
    size: FloatArray, error: FloatArray, conditions: Mapping[str, FloatArray]
) -> dict[str, Exponent]:
    """Exponents p of ``size = a prod_k condition_k^p_k``, all conditions that vary fitted together.

    ``log size = log a + sum_k p_k log condition_k``, each point weighted by its relative error; the
    covariance is enlarged by ``chi²/dof`` where that exceeds 1. A condition with points at zero
    takes part in the exponents of the others as ``log(1 + x / max x)``; its own exponent comes from
    the points where it is present.

    Parameters
    ----------
    size, error : ndarray, shape (n,)
        Amplitudes and their standard deviations; only positive amplitudes are used.
    conditions : mapping of str to ndarray, shape (n,)
        Values of every condition, not negative.

    Returns
    -------
    dict of str to Exponent
        By condition.
    """
    by_condition = {}
    for name, values in conditions.items():
        used = (size > 0.0) & (values > WITHOUT * float(values.max(initial=0.0)))
        present = {other: column[used] for other, column in conditions.items()}
        by_condition[name] = _exponent(name, size[used], error[used], present)
    return by_condition


def _exponent(
    name: str, size: FloatArray, error: FloatArray, conditions: Mapping[str, FloatArray]
) -> Exponent:
    n = size.size
    if n < 2:
        return _none(n, "fewer than two points show it")
    columns = {other: _column(values) for other, values in conditions.items()}
    varying = [other for other, column in columns.items() if np.ptp(column) >= np.log(_SPAN)]
    if name not in varying:
        return _none(n, f"{name} does not vary")
    others = [other for other in varying if other != name]
    design = np.column_stack([np.ones(n), *(columns[other] for other in others)])
    centred = columns[name] - columns[name].mean()
    alone = columns[name] - design @ np.linalg.lstsq(design, columns[name], rcond=None)[0]
    if np.linalg.norm(alone) < _SEPARATE_SHARE * np.linalg.norm(centred):
        return _none(n, f"{name} changes together with {' and '.join(others)}")
    return _fitted(
        np.column_stack([columns[name], design]),
        np.log(size),
        np.maximum(error / size, _LEAST_ERROR),
    )


def _column(values: FloatArray) -> FloatArray:
    largest = float(values.max(initial=0.0))
    if largest <= 0.0:
        return np.zeros(values.size)
    if float(values.min()) > WITHOUT * largest:
        return np.asarray(np.log(values), dtype=np.float64)
    return np.asarray(np.log1p(values / largest), dtype=np.float64)


def _fitted(design: FloatArray, target: FloatArray, error: FloatArray) -> Exponent:
    """Weighted least squares; the first column's coefficient."""
    X = design / error[:, None]
    y = target / error
    covariance = np.linalg.pinv(X.T @ X)
    solution = covariance @ (X.T @ y)
    dof = len(y) - X.shape[1]
    misfit = float(np.sum((y - X @ solution) ** 2)) / dof if dof > 0 else 1.0
    std = float(np.sqrt(covariance[0, 0] * max(misfit, 1.0)))
    law = student_t(dof) if dof > 0 else norm()
    half = float(law.ppf(0.975)) * std
    value = float(solution[0])
    return Exponent(
        value, (value - half, value + half), float(2.0 * law.sf(abs(value) / std)), len(y)
    )


def _none(n: int, reason: str) -> Exponent:
    nan = float("nan")
    return Exponent(nan, (nan, nan), nan, n, reason)


#: Kinds of findings: a shaft order in a sensor pattern; a small yet significant order in all its
#: patterns; a line or band beside the shaft's orders; a band of frequency; a motion pattern; the
#: motion at one channel.
ORDER = "order"
SMALL_ORDER = "small order"
LINE = "line"
BAND = "band"
MOTION = "motion"
CHANNEL = "channel"

#: What the cells of a map are numbered by.
ORDERS = "orders"
LINES = "lines"
MOTION_BANDS = "bands of motions"

#: Parity of the missing law, determined by the lines of a periodic drive of odd lines alone, or why
#: it is not determinable.
ODD = "odd"
EVEN = "even"
ODD_AND_EVEN = "odd and even"
NO_PERIODIC_DRIVE = "no periodic drive"
NO_PERIODIC_LOADS = "no periodic loads"
NO_ODD_DRIVE = "no odd drive"


@dataclass(frozen=True, eq=False)
class FollowedLoad:
    """The load that a gap follows in time.

    Parameters
    ----------
    load : str
        Name of the input.
    is_rate : bool
        Whether it follows the load's rate rather than the load.
    correlation : float
        Size of the correlation.
    """

    load: str
    is_rate: bool
    correlation: float


@dataclass(frozen=True, eq=False)
class Finding:
    """One statement about where the gap lies.

    Parameters
    ----------
    kind : str
        ORDER, SMALL_ORDER, LINE, BAND, MOTION or CHANNEL.
    patterns : tuple of str
        Sensor patterns, the motion, or the measured quantity; largest first.
    share : float
        Share of the gap.
    runs : tuple of str
        Runs in which it is significant.
    is_in_every_run : bool
        Whether these are all runs.
    order : int, optional
        Shaft order; negative for backward motion of a radial pair.
    band_hz : tuple of float, optional
        Band of frequency [Hz].
    frame : str
        What it is fixed to; empty where nothing turns.
    p_value : float
        Largest of the significant runs; NaN where it is unknown.
    exponents : mapping of str to Exponent
        Amplitude-scaling exponents by condition.
    changes_with : str
        Condition with which it changes, though not by a power; empty where none.
    follows : FollowedLoad, optional
        Load that it follows in time.
    line : str
        Name of a line beside the orders: ``0.47X`` or ``0.83Hz``; empty otherwise.
    """

    kind: str
    patterns: tuple[str, ...]
    share: float
    runs: tuple[str, ...]
    is_in_every_run: bool
    order: int | None = None
    band_hz: tuple[float, float] | None = None
    frame: str = ""
    p_value: float = float("nan")
    exponents: Mapping[str, Exponent] = field(default_factory=dict)
    changes_with: str = ""
    follows: FollowedLoad | None = None
    line: str = ""


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
    """Scatter of one cell over the repetitions, or everything off the orders.

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
        Mean square that does not repeat in the gap, and what the noise alone leaves there.
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
    """Comparison error of one significant cell and its uncertainty (ASME V&V 20).

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
    """A quantity of interest, one value for every repetition in every condition.

    Parameters
    ----------
    name, unit : str
        What it is, and its unit.
    measured, predicted : ndarray, shape (n,)
        Values by repetition.
    """

    name: str
    unit: str
    measured: FloatArray
    predicted: FloatArray


@dataclass(frozen=True, eq=False)
class ScalarGap:
    """Area between measured and simulated distribution of a scalar, ``integral |F_s - F_m| dx``.

    Parameters
    ----------
    name, unit : str
        What it is, and its unit.
    measured_mean : float
        Mean of the measured values.
    area_before, area_after : float
        Area with the baseline and with the accepted effects, in `unit`.
    """

    name: str
    unit: str
    measured_mean: float
    area_before: float
    area_after: float


@dataclass(frozen=True, eq=False)
class Repeatability:
    """How far the gap repeats from one repetition to the next.

    Parameters
    ----------
    repetition : str
        What repeats: ``revolution``, ``period`` or ``repeat``.
    rms : float
        RMS by run of what does not repeat, above the noise, in the unit of the channels.
    share : float
        Its mean square over that of the repeating gap.
    largest : NonSynchronousCell, optional
        Cell with most of it; None where what does not repeat is noise.
    """

    repetition: str
    rms: float
    share: float
    largest: NonSynchronousCell | None


@dataclass(frozen=True, eq=False)
class GapFindings:
    """What a kind finds about the gap of one model beyond the cells of its map.

    Parameters
    ----------
    where : tuple of Finding
        Where it lies, largest first; empty where no cell is significant.
    numbered_by : str
        What the cells are numbered by: ORDERS, LINES or MOTION_BANDS.
    in_time : tuple of GapMoment
        RMS in windows of the runs.
    drifts : tuple of Drift
        Significant trends, largest change first.
    non_synchronous : tuple of NonSynchronousCell
        Cells whose scatter is beyond noise, largest excess first.
    repeatability : tuple of Repeatability
        What they amount to, by sort of repetition.
    growth : tuple of PartGrowth
        Amplitude-scaling exponents of the largest parts.
    parity : str
        ODD, EVEN, ODD_AND_EVEN, or one of the reasons why it is not determinable; empty where a
        parity has no meaning.
    """

    where: tuple[Finding, ...]
    numbered_by: str
    in_time: tuple[GapMoment, ...] = ()
    drifts: tuple[Drift, ...] = ()
    non_synchronous: tuple[NonSynchronousCell, ...] = ()
    repeatability: tuple[Repeatability, ...] = ()
    growth: tuple[PartGrowth, ...] = ()
    parity: str = ""


@dataclass(frozen=True, eq=False)
class GapDetail:
    """The gap of the baseline beyond its map.

    Parameters
    ----------
    findings : GapFindings
        Where it lies, in time, what does not repeat, growth and parity.
    cells : tuple of CellValidation
        Significant cells, largest error first.
    scalars : tuple of ScalarGap
        Area metric.
    """

    findings: GapFindings
    cells: tuple[CellValidation, ...]
    scalars: tuple[ScalarGap, ...]

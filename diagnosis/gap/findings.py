"""What is found about the gap of one model: objects, from which the report makes its words.

Where it lies, how it develops in time, what does not repeat, how it grows with the conditions, and
quantities of interest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from scipy.stats import norm, wasserstein_distance
from scipy.stats import t as student_t

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.gap.gap_map import GapMap, map_of

#: Half width of its interval within which an exponent is known.
KNOWN_WITHIN = 1.0
#: A condition varies where its largest value is at least this many times its smallest.
_SPAN = 1.3
#: Values below this share of the largest count as "without" (a radial load at rest of its rams).
WITHOUT = 0.01
#: A condition is separable from the others where this share of its variation is its own.
_SEPARATE_SHARE = 0.3
#: A gap in a block shows its growth where it is this many times the noise.
CLEAR = 2.0
#: No amplitude is trusted to better than this: the law itself is not exact.
_LEAST_ERROR = 5e-3


@dataclass(frozen=True, eq=False)
class Exponent:
    """Exponent of one condition."""

    value: Annotated[float, "Exponent; NaN where the conditions do not determine it"]
    ci95: Annotated[tuple[float, float], "Interval of 95 %"]
    p_value: Annotated[float, "Probability of such an exponent where the gap does not depend on it"]
    n_points: Annotated[
        int, "Amplitudes used; with as many as unknowns the interval holds the noise only"
    ]
    reason: Annotated[str, "Why it is not determinable; empty where it is"] = ""

    def is_within(self, half_width: float) -> bool:
        """Whether it is known to a half width; never where it is not determined."""
        return bool(self.ci95[1] - self.value <= half_width)


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
    """Exponent of one condition beside the others."""
    n = size.size
    if n < 2:
        return undetermined(n, "fewer than two points show it")
    columns = {other: _column(values) for other, values in conditions.items()}
    varying = [other for other, column in columns.items() if np.ptp(column) >= np.log(_SPAN)]
    if name not in varying:
        return undetermined(n, f"{name} does not vary")
    others = [other for other in varying if other != name]
    design = np.column_stack([np.ones(n), *(columns[other] for other in others)])
    centred = columns[name] - columns[name].mean()
    alone = columns[name] - design @ np.linalg.lstsq(design, columns[name], rcond=None)[0]
    if np.linalg.norm(alone) < _SEPARATE_SHARE * np.linalg.norm(centred):
        return undetermined(n, f"{name} changes together with {' and '.join(others)}")
    # Weighted least squares; the first column's coefficient.
    error = np.maximum(error / size, _LEAST_ERROR)
    X = np.column_stack([columns[name], design]) / error[:, None]
    y = np.log(size) / error
    covariance = np.linalg.pinv(X.T @ X)
    solution = covariance @ (X.T @ y)
    dof = n - X.shape[1]
    misfit = float(np.sum((y - X @ solution) ** 2)) / dof if dof > 0 else 1.0
    std = float(np.sqrt(covariance[0, 0] * max(misfit, 1.0)))
    law = student_t(dof) if dof > 0 else norm()
    value, half = float(solution[0]), float(law.ppf(0.975)) * std
    p_value = float(2.0 * law.sf(abs(value) / std))
    return Exponent(value, (value - half, value + half), p_value, n)


def _column(values: FloatArray) -> FloatArray:
    largest = float(values.max(initial=0.0))
    if largest <= 0.0:
        return np.zeros(values.size)
    if float(values.min()) > WITHOUT * largest:
        return np.asarray(np.log(values), dtype=np.float64)
    return np.asarray(np.log1p(values / largest), dtype=np.float64)


def undetermined(n: int, reason: str) -> Exponent:
    """Exponent that `n` pairs of gap and condition do not show, and why."""
    return Exponent(np.nan, (np.nan, np.nan), np.nan, n, reason)


#: Kinds of findings: a shaft order in a sensor pattern; a small yet significant order in all its
#: patterns; a line or band between the shaft's orders; a band of frequency; a motion pattern; the
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
    """The load that a gap follows in time."""

    load: str  # Name of the input
    is_rate: bool  # Whether it follows the load's rate rather than the load
    correlation: float  # Size of the correlation


@dataclass(frozen=True, eq=False)
class Finding:
    """One statement about where the gap lies."""

    kind: str  # ORDER, SMALL_ORDER, LINE, BAND, MOTION or CHANNEL
    patterns: tuple[str, ...]  # Sensor patterns, motion or quantity; largest first
    share: float  # Share of the gap
    runs: tuple[str, ...]  # Runs in which it is significant
    is_in_every_run: bool  # Whether these are all runs
    order: int | None = None  # Shaft order; negative: backward motion
    band_hz: tuple[float, float] | None = None  # Band of frequency [Hz]
    frame: str = ""  # Frame that it is fixed to; empty: nothing rotates
    p_value: float = np.nan  # Largest of the significant runs; NaN: unknown
    exponents: Mapping[str, Exponent] = field(default_factory=dict)  # How it grows, by condition
    changes_with: str = ""  # Condition with which it changes, though not by a power, or empty
    follows: FollowedLoad | None = None  # Load that it follows in time
    line: str = ""  # Line off the orders, ``0.47X`` or ``0.83Hz``, or empty
    place: str = ""  # Where the line lies beside the orders, in words; or empty


@dataclass(frozen=True, eq=False)
class GapMoment:
    """RMS of the gap in one window of a run."""

    run: Annotated[str, "Run"]
    time: Annotated[float, "Middle of the window [s]"]
    rms: Annotated[float, "RMS over the channels in their unit"]


@dataclass(frozen=True, eq=False)
class Drift:
    """Trend of one cell of the map over a run."""

    run: Annotated[str, "Run of the cell"]
    channel_pattern: Annotated[str, "Its sensor pattern or channel"]
    order: Annotated[float, "Order, or line"]
    change: Annotated[
        float, "Amplitude of the change from first to last repetition, in the channels' unit"
    ]
    share: Annotated[float, "Share of the cell's mean square in that run that the trend makes up"]
    p_value: Annotated[float, "Without a trend; adjusted for the number of cells"]


@dataclass(frozen=True, eq=False)
class NonSynchronousCell:
    """Scatter of one cell over the repetitions, or everything off the orders."""

    run: Annotated[
        str, 'Run; names joined by "and" for what differs between repeats of one condition'
    ]
    channel_pattern: Annotated[str, "Sensor pattern or channel"]
    order: Annotated[float | None, "Order or line; None for everything off the orders"]
    measured: Annotated[float, "Mean square that does not repeat in the measured signal"]
    simulated: Annotated[float, "The same in the simulated signal"]
    gap: Annotated[float, "The same in the gap"]
    noise: Annotated[float, "RMS of the noise alone there"]
    p_value: Annotated[
        float, "Without more than noise, adjusted; NaN where the noise is estimated from it"
    ]


@dataclass(frozen=True, eq=False)
class PartGrowth:
    """How one part of the gap (a pattern and order over all runs) depends on the conditions."""

    channel_pattern: Annotated[str, "Pattern or channel"]
    order: Annotated[float, "Order; NaN where all orders or lines are taken together"]
    frame: Annotated[str, "``housing``, ``carrier``, ``undecided``, or empty where nothing turns"]
    exponents: Annotated[Mapping[str, Exponent], "By condition"]


@dataclass(frozen=True, eq=False)
class CellValidation:
    """Comparison error of one significant cell and its uncertainty (ASME V&V 20)."""

    channel_pattern: Annotated[str, "Sensor pattern or channel"]
    order: Annotated[float, "Order or line"]
    run: Annotated[str, "Run"]
    error_before: Annotated[float, "RMS of measured less simulated, with the baseline"]
    error_after: Annotated[float, "The same with the effects"]
    u_val: Annotated[
        float, "``sqrt(u_num² + u_D²)``: step of integration, scatter of the measured cell"
    ]
    is_beyond: Annotated[bool, "Whether |E| before exceeds u_val, so that a shrink may be claimed"]


@dataclass(frozen=True, eq=False)
class Scalar:
    """A quantity of interest, one value for every repetition in every condition."""

    name: str  # What it is
    unit: str  # Its unit
    measured: FloatArray  # Measured by repetition, shape (n,)
    predicted: FloatArray  # Simulated by repetition, shape (n,)


@dataclass(frozen=True, eq=False)
class ScalarGap:
    """Area between measured and simulated distribution of a scalar, ``integral |F_s - F_m| dx``."""

    name: Annotated[str, "What it is"]
    unit: Annotated[str, "Its unit"]
    measured_mean: Annotated[float, "Mean of the measured values"]
    area_before: Annotated[float, "Area with the baseline, in `unit`"]
    area_after: Annotated[float, "Area with the accepted effects, in `unit`"]


@dataclass(frozen=True, eq=False)
class Repeatability:
    """How far the gap repeats from one repetition to the next."""

    repetition: str  # What repeats: ``revolution``, ``period`` or ``repeat``
    rms: float  # RMS by run of what does not repeat, above the noise, in the channels' unit
    share: float  # Its mean square over that of the repeating gap
    largest: NonSynchronousCell | None  # Cell with most of it; None where it is noise


@dataclass(frozen=True, eq=False)
class GapFindings:
    """What a kind finds about the gap of one model beyond the cells of its map."""

    where: Annotated[
        tuple[Finding, ...], "Position of the gap, largest first; empty: no significant cell"
    ]
    numbered_by: Annotated[str, "What the cells are numbered by: ORDERS, LINES or MOTION_BANDS"]
    in_time: Annotated[tuple[GapMoment, ...], "RMS in windows of the runs"] = ()
    drifts: Annotated[tuple[Drift, ...], "Significant trends, largest change first"] = ()
    non_synchronous: Annotated[
        tuple[NonSynchronousCell, ...], "Cells that scatter beyond noise, largest excess first"
    ] = ()
    repeatability: Annotated[tuple[Repeatability, ...], "What they amount to, by repetition"] = ()
    growth: Annotated[tuple[PartGrowth, ...], "How the largest parts grow"] = ()
    parity: Annotated[str, "ODD, EVEN, ODD_AND_EVEN, or why it is not determinable; else empty"] = (
        ""
    )


@dataclass(frozen=True, eq=False)
class GapDetail:
    """The gap of the baseline beyond its map."""

    findings: Annotated[GapFindings, "Where it lies, what does not repeat, growth, parity"]
    cells: Annotated[tuple[CellValidation, ...], "Significant cells, largest error first"]
    scalars: Annotated[tuple[ScalarGap, ...], "Area metric"]


#: Frame of an order above half the samples of a turn.
ALIASED = "aliased"


@dataclass(frozen=True, eq=False)
class OffOrderMotion:
    """A line or a band between the shaft's orders, or an order that is read too seldom."""

    #: Class: ``nonsynchronous/0.47X``, ``channel/0.47X`` where one channel alone shows it,
    #: ``aliased/99X`` above half the samples of a turn
    id: str
    #: Its strongest line: ``0.47X`` where it keeps its order, ``0.83Hz`` where its frequency
    label: str
    channels: tuple[str, ...]  # Channels that show it
    runs: tuple[str, ...]  # Runs that show it
    is_in_every_run: bool  # Whether these are all runs
    band_hz: tuple[float, float]  # Lowest and highest frequency over lines and runs [Hz]
    mean_square: Mapping[str, float]  # Mean square over the channels by run
    explained: float  # Share of its power that amplitudes fitted to other turns predict
    p_value: float  # Probability that noise makes it anywhere in the records

    @property
    def is_aliased(self) -> bool:
        """Whether it is an order above half the samples of a turn."""
        return self.id.startswith(ALIASED)

    @property
    def place(self) -> str:
        """Where its frequency lies, in words."""
        return (
            "above half the samples of a turn" if self.is_aliased else "between the shaft's orders"
        )


#: Cells of hundreds of runs are some hundred thousand, and the first 200 are written.
_MOST_CELLS = 1000


def cell_validations(
    before: Sequence[GapCell], after: Sequence[GapCell], numerical: float
) -> tuple[CellValidation, ...]:
    """Error and uncertainty of every significant cell (ASME V&V 20-2009, section 1-5)."""
    every = map_of(before)
    significant = every.chosen(every.are_significant)
    largest = np.argsort(-np.sqrt(significant.mean_squares), kind="stable")
    shown = significant.chosen(largest[:_MOST_CELLS])
    errors = np.sqrt(
        [
            shown.mean_squares,
            np.maximum(_mean_squares_after(shown, map_of(after)), 0.0),
            numerical**2 + shown.noise,
        ]
    )
    return tuple(
        CellValidation(one.channel_pattern, one.order, one.run, error, with_effects, u, error > u)
        for one, (error, with_effects, u) in zip(shown, errors.T.tolist(), strict=True)
    )


def _mean_squares_after(shown: GapMap, after: GapMap) -> list[float]:
    """Mean squares of the same cells in another map, which may hold a million."""
    sought = [(cell.run, cell.channel_pattern, cell.order) for cell in shown]
    wanted = set(sought)
    mean_squares = {}
    rows = zip(after.indices, after.orders, after.mean_squares, strict=True)
    for (run, pattern), order, mean_square in rows:
        key = (after.runs[run], after.patterns[pattern], float(order))
        if key in wanted:
            mean_squares[key] = float(mean_square)
    return [mean_squares[key] for key in sought]


def scalar_gaps(before: Sequence[Scalar], after: Sequence[Scalar]) -> tuple[ScalarGap, ...]:
    """Area metric of every scalar, before and after.

    References
    ----------
    .. [1] S. Ferson, W. L. Oberkampf, L. Ginzburg, "Model validation and predictive capability for
       the thermal challenge problem", Comput. Methods Appl. Mech. Engrg. 197 (2008) 2408-2430.
    """
    return tuple(
        ScalarGap(
            name=old.name,
            unit=old.unit,
            measured_mean=float(np.mean(old.measured)),
            area_before=float(wasserstein_distance(old.measured, old.predicted)),
            area_after=float(wasserstein_distance(new.measured, new.predicted)),
        )
        for old, new in zip(before, after, strict=True)
    )

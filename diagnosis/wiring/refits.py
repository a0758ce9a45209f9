"""The baseline refitted with the signals put right: clocks that drift, runs exchanged.

A delay that grows over a run is the one with which its prediction fits best. Records filed under
the wrong name fit the inputs of another run, though not always better than those that the baseline
was fitted to: runs that fit each other's inputs up to half as well are exchanged, and the refit
decides.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy.optimize import least_squares, linear_sum_assignment, minimize_scalar

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.wiring.linear_records import (
    FloatArray,
    LinearRecord,
    along,
    correlation,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import key_of, sample_of
from carrierflex.identification.estimation.scaled_least_squares import normal_inverse
from carrierflex.simulation.laws import Law
from carrierflex.simulation.sensing import at_other_times


class Fault(StrEnum):
    """A fault of the measurement."""

    TORQUE_SIGN = "wiring/torque_sign"
    SENSOR_ORDER = "wiring/sensor_order"
    ANGLE_DIRECTION = "wiring/angle_direction"
    CLOCK = "wiring/clock"
    RUN_ORDER = "wiring/run_order"
    INPUT_GAIN = "wiring/input_gain"
    UNIT = "wiring/unit"
    CLOCK_SHIFT = "wiring/clock_shift"
    LOAD_AXES = "wiring/load_axes"
    LOAD_ZERO = "wiring/load_zero"
    ANGLE_ZERO = "wiring/angle_zero"
    ENCODER = "wiring/encoder"
    HELD_INPUT = "wiring/held_input"
    #: A length of the rig that is not as stated.
    RIG_LENGTH = "wiring/rig_length"
    #: Zeros of channels that drift over every run.
    DRIFT = "wiring/drift"
    #: Readings spoilt sample by sample.
    RECTIFIED = "wiring/rectified"
    WRAPPED = "wiring/wrapped"
    JITTER = "wiring/jitter"
    LOAD_NOISE = "wiring/load_noise"
    DECLARED_NOISE = "wiring/declared_noise"
    #: A channel, or a run, that is at odds with all others in a way that no kind of fault explains.
    CHANNEL = "wiring/channel"
    POLARITY = "wiring/polarity"
    DEAD_CHANNEL = "wiring/dead_channel"
    COPIED_CHANNEL = "wiring/copied_channel"
    CROSSTALK = "wiring/crosstalk"
    SENSOR_ON_GROUND = "wiring/sensor_on_ground"
    FILTERED_CHANNEL = "wiring/filtered_channel"
    AC_COUPLED = "wiring/ac_coupled"
    CURVED_CHANNEL = "wiring/curved_channel"
    LATE_CHANNEL = "wiring/late_channel"
    #: Runs that differ from one another in the baseline's values, as by temperature.
    RUN_VARIATION = "run_variation"
    CHANNEL_GAIN = "wiring/channel_gain"
    CHANNEL_ZERO = "wiring/channel_zero"
    RUN = "wiring/run"
    #: Such a run that alone has a load: what acts in it may be of the load.
    RUN_OF_LOAD = "wiring/run_of_load"


#: Faults of a channel that is at odds with all others.
LONE_CHANNEL = (
    Fault.CHANNEL, Fault.CHANNEL_GAIN, Fault.CHANNEL_ZERO, Fault.POLARITY, Fault.DEAD_CHANNEL,
    Fault.COPIED_CHANNEL, Fault.CROSSTALK, Fault.SENSOR_ON_GROUND, Fault.FILTERED_CHANNEL,
    Fault.AC_COUPLED, Fault.CURVED_CHANNEL, Fault.LATE_CHANNEL,
)  # fmt: skip
#: What is at fault in a way that no kind of fault explains.
OF_NO_KIND = (Fault.CHANNEL, Fault.RUN_OF_LOAD, Fault.RUN, Fault.RUN_VARIATION)
#: Words of the faults whose id does not read as one.
_FAULT_WORDS: dict[str, str] = {
    Fault.CHANNEL: "one channel",
    Fault.CURVED_CHANNEL: "a channel that is not linear",
    Fault.FILTERED_CHANNEL: "delay and filter of a channel",
    Fault.HELD_INPUT: "a load held between readings",
    Fault.INPUT_GAIN: "gain of a load",
    Fault.JITTER: "times of the samples",
    Fault.LOAD_AXES: "axes of the loads",
    Fault.LOAD_NOISE: "noise of a load",
    Fault.LOAD_ZERO: "zero of a load",
    Fault.RECTIFIED: "a signal without its sign",
    Fault.RIG_LENGTH: "a length of the rig",
    Fault.RUN: "one run",
    Fault.RUN_OF_LOAD: "the only run with a load",
    Fault.WRAPPED: "a reading beyond its range",
}


def fault_words(fault: str) -> str:
    """Fault of the measurement, by its id, in words: ``sensor on ground``."""
    return _FAULT_WORDS.get(fault, fault.removeprefix("wiring/").replace("_", " "))


#: Loads of a shaft, the radial ones after its torque.
RADIAL_LOADS = ("ntl_y", "ntl_z")
LOADS = ("torque", *RADIAL_LOADS)
#: Share of the gap that a fault must explain whose size is fitted, or that leaves records out.
NEARLY_ALL = 0.9
#: Share of the gap that a fault must explain to be reported, and in a linear screen, about a fit
#: that the fault has led astray.
REPORTED = 0.5
#: Share of the gap by which one that explains less is still as good.
AS_GOOD = 0.03
#: Gain error from which it is looked for: a calibrated sensor or load cell is not 2 % off.
SMALLEST_GAIN = 0.02


@dataclass(frozen=True)
class GapSquare:
    """Mean square that a model leaves of the records, and that of the noise."""

    before: float
    floor: float
    #: Share that a fault must explain whose size is fitted, or that leaves records out
    nearly_all: float = NEARLY_ALL

    @property
    def enough(self) -> float:
        """Mean square that is left where nearly all of the gap is explained."""
        return self.remaining(self.nearly_all)

    @property
    def half(self) -> float:
        """Mean square that is left where half of the gap is explained."""
        return self.remaining(REPORTED)

    def remaining(self, share: float) -> float:
        """Mean square that is left where a share of the gap above the floor is explained."""
        return self.floor + (1.0 - share) * (self.before - self.floor)


@dataclass(frozen=True)
class ClockDrift:
    """Signals that are later than the inputs, or ever later."""

    run: str  # Run whose signals they are; empty for those of all runs
    delay: float  # Delay in the middle of the run [s]
    growth: float  # Growth of the delay over the run [s]


@dataclass(frozen=True)
class WiringRival:
    """The baseline refitted to a campaign whose wiring is corrected."""

    id: str  # One of the ids above
    about: str  # Input, channels or run that it is about
    text: str  # What is corrected: ``the torque of the other sign``
    mean_square: float  # Mean square that the refitted baseline leaves over all records
    line: str  # File or key that it is about
    laws: Effects = ()  # Laws that were refitted with the baseline
    corrected: Campaign | None = None  # Records put right, where they are

    @property
    def model(self) -> str:
        """What was refitted, in words."""
        return f"the baseline with {set_name(self.laws)}" if self.laws else "the baseline alone"

    def by(self, refitted: Callable[[Campaign], float]) -> "WiringRival":
        """The same with what a refit of the records put right leaves."""
        square = self.mean_square if self.corrected is None else refitted(self.corrected)
        return replace(self, mean_square=square)


@dataclass(frozen=True, eq=False)
class PredictedRecord:
    """Signals of one run and what the baseline predicts, shape (n, n_channels); NaN: missing."""

    run: str
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Measured less predicted."""
        return np.asarray(self.measured - self.predicted)


_WithLaws = Callable[[Effects, Mapping[tuple[str, str], float], Sequence[Law]], "WiringChecks"]


@dataclass(frozen=True)
class WiringChecks:
    """What can be tried of a campaign's wiring."""

    #: Campaigns with another wiring, refitted
    rivals: Callable[[], tuple[WiringRival, ...]] = lambda: ()
    #: Runs with the fitted parameters of the baseline; none where it is not the model's
    predictions: Callable[[FloatArray], tuple[PredictedRecord, ...]] = lambda theta: ()
    #: Mean square of the baseline once fitted to a campaign with the same channels and inputs
    refitted: Callable[[Campaign], float] = lambda campaign: np.nan
    #: Runs beside a baseline that can be made linear; none elsewhere
    linear: Callable[[FloatArray], Iterable[LinearRecord]] = lambda theta: ()
    #: Guesses of how late all signals, or those of a run, are, where records show it without a fit
    late: Callable[[], Sequence[ClockDrift]] = lambda: ()
    #: ``(laws, values, shapes) -> checks`` whose refits and records hold laws too; values of their
    #: fit by effect and name, and those of them that are measured shapes
    with_laws: _WithLaws = lambda laws, values, shapes: WiringChecks()
    has_cheap_refits: bool = False  # Refits take milliseconds: every fault of a load is tried
    takes_shapes: bool = True  # Whether `with_laws` takes shapes; else faults beside laws alone
    unchecked: str = ""  # Why a model's baseline has no `predictions`; empty where it has


#: Drift over its error that is one.
_SURE = 3.0
#: Drift over a record, or delay, in steps of time below which nothing is told.
SMALLEST_DRIFT = 0.05
#: Runs that are refitted, the surest first.
_MOST_RUNS = 3
#: Range of a first guess's factor in which refits are compared, how finely, and refits at most.
_FACTORS = (0.5, 1.5)
_FACTOR_STEP = 0.01
_MOST_REFITS = 12
#: Square of two exchanged runs over that of the stated ones up to which they are refitted, and the
#: pairs that are, the best first. Both bound the work alone: what a refit leaves decides.
_NEARLY_AS_GOOD = 2.0
_MOST_PAIRS = 3


def drifting_clocks(
    records: Sequence[PredictedRecord], campaign: Campaign, refitted: Callable[[Campaign], float]
) -> tuple[WiringRival, ...]:
    """Baseline refitted with the signals of a run put back in time, where its delay drifts.

    Where several do, all of them are put back together too: one logger reads all runs. `records`
    are the runs of the campaign beside the fitted baseline; `refitted` gives the mean square that
    the baseline leaves once it is fitted to a campaign.
    """
    runs = {run.name: run for run in campaign.runs}
    drifts = []
    for record in records:
        drift, sureness = _drift(record)
        if sureness > _SURE and abs(drift.growth) > SMALLEST_DRIFT * mean_step(record.time):
            drifts.append((sureness, drift))
    rivals = []
    for _, drift in sorted(drifts, key=lambda entry: -entry[0])[:_MOST_RUNS]:
        mean_square = _refitted_inside(put_back(campaign, [drift]), refitted)
        if np.isfinite(mean_square):
            rivals.append(clock_rival(runs[drift.run], drift.growth, mean_square))
    if len(drifts) > 1:
        together = [drift for _, drift in drifts]
        # What the baseline took of the delays is none where the clocks were right at the start.
        from_start = [replace(drift, delay=0.5 * drift.growth) for drift in together]
        mean_square = min(
            _refitted_inside(put_back(campaign, each), refitted) for each in (together, from_start)
        )
        if np.isfinite(mean_square):
            rates = [one.growth / float(np.ptp(runs[one.run].time)) for one in together]
            about = ", ".join(one.run for one in together)
            ppm = abs(float(np.median(rates))) * 1e6
            text = f"a clock that drifts by {ppm:.0f} ppm in {about}"
            line = sample_of(runs[together[0].run].file, 0)
            rivals.append(WiringRival(Fault.CLOCK, about, text, mean_square, line))
    return tuple(rivals)


def exchanged_runs(
    records: Sequence[PredictedRecord], campaign: Campaign, refitted: Callable[[Campaign], float]
) -> tuple[WiringRival, ...]:
    """Baseline refitted with the signals of runs exchanged: what leaves least, or none.

    None where every run fits its own inputs far better. Only runs of one length can be exchanged.
    """
    if {record.run for record in records} != {run.name for run in campaign.runs}:
        return ()
    tried = [(refitted(_exchanged(campaign, source)), source) for source in _sources(records)]
    tried = [(mean_square, source) for mean_square, source in tried if np.isfinite(mean_square)]
    if not tried:
        return ()
    mean_square, source = min(tried, key=lambda pair: pair[0])
    text = ", ".join(f"the signals of {other} as those of {name}" for name, other in source.items())
    return (
        WiringRival(
            Fault.RUN_ORDER, ", ".join(source), text, mean_square, key_of("[[runs]]", "file")
        ),
    )


def refitted_clock(
    campaign: Campaign, guess: ClockDrift, refitted: Callable[[Campaign], float], enough: float
) -> tuple[ClockDrift, float]:
    """Delay and drift about a guess with which the refitted baseline leaves least, and that.

    A guess that comes from another measure than the refit (forces that a linear element leaves) may
    be off: where it leaves more than `enough`, its factor is sought by refits, within a bracket, by
    Brent's method. The mean square is infinite where every fit runs away.
    """
    tried: dict[float, tuple[ClockDrift, float]] = {}

    def mean_square_with(factor: float) -> float:
        """Mean square with the guess times a factor."""
        if factor not in tried:
            drift = ClockDrift(guess.run, factor * guess.delay, factor * guess.growth)
            tried[factor] = drift, _refitted_inside(put_back(campaign, [drift]), refitted)
        return tried[factor][1]

    if mean_square_with(1.0) > enough:
        minimize_scalar(
            lambda factor: mean_square_with(float(factor)),
            bounds=_FACTORS,
            method="bounded",
            options={"xatol": _FACTOR_STEP, "maxiter": _MOST_REFITS},
        )
    return min(tried.values(), key=lambda pair: pair[1])


def _refitted_inside(campaign: Campaign, refitted: Callable[[Campaign], float]) -> float:
    """Mean square of the refitted baseline; infinite where it runs away, or no record is left."""
    signals = [values for run in campaign.runs for values in run.signals.values()]
    if not all(np.isfinite(values).mean() > 0.5 for values in signals):
        return np.inf
    mean_square = refitted(campaign)
    return mean_square if np.isfinite(mean_square) else np.inf


def clock_rival(run: Run, seconds: float, mean_square: float, *, delay: float = 0.0) -> WiringRival:
    """Rival that says that a clock drifts by `seconds` over a run, or is off by more all along."""
    text = f"a clock that drifts by {abs(seconds) * 1e3:.3g} ms over run {run.name}"
    if abs(delay) > abs(seconds):
        text = f"a clock that is {abs(delay) * 1e3:.3g} ms off in run {run.name}"
    return WiringRival(Fault.CLOCK, run.name, text, mean_square, sample_of(run.file, 0))


def put_back(campaign: Campaign, drifts: Sequence[ClockDrift]) -> Campaign:
    """Campaign whose signals are where the inputs were when they were read."""
    drift_of = {one.run: one for one in drifts}

    def of_run(run: Run) -> Run:
        drift = drift_of.get(run.name) or drift_of.get("")
        if drift is None:
            return run
        at = run.time + drift.delay + drift.growth * along(run.time, run.time)
        signals = {name: at_other_times(run.time, one, at) for name, one in run.signals.items()}
        return replace(run, signals=signals)

    return replace(campaign, runs=tuple(map(of_run, campaign.runs)))


def _drift(record: PredictedRecord) -> tuple[ClockDrift, float]:
    """Delay and growth at which a run lies best on its prediction; the growth over its error."""
    step = mean_step(record.time)
    growing = along(record.time, record.time)

    def remaining(steps: FloatArray) -> FloatArray:
        """What a prediction that is later misses, offsets of the channels left out."""
        at = record.time - step * (steps[0] + steps[1] * growing)
        predicted = [np.interp(at, record.time, column) for column in record.predicted.T]
        residual = record.measured - np.array(predicted).T
        return np.nan_to_num(residual - np.nanmean(residual, axis=0))

    best = least_squares(lambda steps: remaining(steps).ravel(), np.zeros(2))
    square = 2.0 * best.cost * correlation(remaining(best.x)) / np.isfinite(record.measured).sum()
    error = np.sqrt(square * np.maximum(normal_inverse(best.jac.T @ best.jac)[1, 1], 0.0))
    delay, growth = (step * best.x).tolist()
    sureness = abs(best.x[1]) / max(float(error), float(np.finfo(float).tiny))
    return ClockDrift(record.run, delay, growth), sureness


def _exchanged(campaign: Campaign, source: Mapping[str, str]) -> Campaign:
    """Campaign with the signals of each run taken from its source."""
    runs = {run.name: run for run in campaign.runs}
    pairs = [(run, runs[source.get(run.name, run.name)]) for run in campaign.runs]
    return replace(
        campaign,
        runs=tuple(
            replace(run, signals=other.signals, predictions=other.predictions)
            for run, other in pairs
        ),
    )


def _sources(records: Sequence[PredictedRecord]) -> list[dict[str, str]]:
    """Run whose signals each run takes, for every exchange that is refitted."""
    lengths: dict[int, list[PredictedRecord]] = {}
    for record in records:
        lengths.setdefault(record.time.size, []).append(record)
    best: dict[str, str] = {}
    pairs: list[tuple[float, dict[str, str]]] = []
    for alike in lengths.values():
        # Offsets of a run are left out.
        square = np.array(
            [
                [np.nanvar(two.measured - one.predicted, axis=0).sum() for two in alike]
                for one in alike
            ]
        )
        if not np.isfinite(square).all():
            continue
        _, order = linear_sum_assignment(square)
        best |= {alike[k].run: alike[j].run for k, j in enumerate(order.tolist()) if j != k}
        stated = np.diag(square)
        ratio = (square + square.T) / np.maximum(stated[:, None] + stated, np.finfo(float).tiny)
        for i, j in zip(*np.triu_indices(len(alike), 1), strict=True):
            one, other = alike[i].run, alike[j].run
            pairs.append((float(ratio[i, j]), {one: other, other: one}))
    nearly = sorted((pair for pair in pairs if pair[0] < _NEARLY_AS_GOOD), key=lambda pair: pair[0])
    sources = [best, *(source for _, source in nearly[:_MOST_PAIRS])]
    return [
        exchange for k, exchange in enumerate(sources) if exchange and exchange not in sources[:k]
    ]

"""A gap that lies in one channel, or in one run, alone.

What moves the machine moves all that measure it. The baseline, linear in its parameters about its
fit, is fitted to the records without one channel or one run: where it meets what remains, what was
left out is at fault, whatever the fault is. What such a channel reads is then compared with what
the other channels expect of it, ``y = x + sum_k c_k u_k``, one kind of fault after the other:

- a factor, ``y = g x``: reversed polarity (g = -1), a dead channel (g = 0);
- the signal of another channel, whole or in part, ``y = x_j``, ``y = x + c x_j``;
- loads without the machine between, ``y = x + c u``: a sensor that stands on the ground;
- a delay, in time or in the carrier's angle (a misplaced sensor), a low-pass or a high-pass filter
  of x, a curved characteristic ``y = g x + h x² + k x³``.

A filter that all channels share is one of the inputs: a linear machine cannot tell on which side of
it the filter is.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Annotated

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize, minimize_scalar
from scipy.signal import lfilter

from carrierflex.diagnosis.wiring.linear_records import (
    FloatArray,
    LinearRecord,
    load_answers,
    shared_products,
)
from carrierflex.diagnosis.wiring.load_faults import ANGLE, load_faults
from carrierflex.diagnosis.wiring.refits import (
    AC_COUPLED,
    CHANNEL,
    CHANNEL_GAIN,
    CHANNEL_ZERO,
    COPIED_CHANNEL,
    CROSSTALK,
    CURVED_CHANNEL,
    DEAD_CHANNEL,
    DRIFT,
    FILTERED_CHANNEL,
    INPUT_GAIN,
    LATE_CHANNEL,
    LOADS,
    NEARLY_ALL,
    POLARITY,
    RUN,
    RUN_OF_LOAD,
    RUN_VARIATION,
    SENSOR_ON_GROUND,
    GapSquare,
    WiringRival,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import key_of, sample_of
from carrierflex.identification.estimation.scaled_least_squares import (
    normal_inverse,
    normal_solution,
)
from carrierflex.simulation.sensing import delayed

#: Fewest channels of which one can be left out: two disagree, and neither is the one.
_FEWEST_CHANNELS = 3
#: Fewest runs of which one can be left out.
_FEWEST_RUNS = 3
#: Fewest runs that may differ from one another.
_FEWEST_VARYING = 2
#: A filter or a delay along the first axis: ``(size, time, values) -> values``.
_Filter = Callable[[float, FloatArray, FloatArray], FloatArray]
#: Standard deviation of a load over its largest value up to which it is steady.
_STEADY = 0.1
#: Share of the gap that must go in the linear screen: about a fit that the fault has led astray.
_SCREENED = 0.5
#: Share of what a channel has beyond the others' expectation that its fault explains.
_EXPLAINED = 0.9
#: What a fault leaves over what the best leaves, up to which the simpler one is taken.
_SIMPLER = 1.2
#: Factors of a polarity that is reversed and of a dead channel are within this.
_NEAR = 0.1
#: Faults without a pattern.
_OF_ANY = (CHANNEL, CHANNEL_ZERO)
#: Share of a signal's square in its steps from which it is white noise.
_WHITE = 0.8
#: Times [s] of filters over the step, as powers of two.
_FILTERS = range(0, 14)
#: The same of a filter, or a delay, of all channels; samples of a filter that is a mean.
_SHARED_FILTERS, _MEANS = np.arange(-2.0, 6.0, 0.5), range(2, 9)
#: Delay and time of a filter of a load, over the times above.
_LATE_AND_FILTERED = np.array([(1.0, 1.0), (1.0, 0.0), (0.0, 1.0)])
#: Refits at most that seek its size, and octaves to which they seek it: two digits.
_MOST_REFITS, _OCTAVES = 10, 0.015
#: Where a channel saturates, over its largest reading, at least.
_BEYOND = 1.001
#: Inputs that are no loads.
_OF_SHAFT = (ANGLE, "speed")
#: Correlation of a load with time from which a drift follows that load as well.
_GROWS_WITH_TIME = 0.3


@dataclass(frozen=True, eq=False)
class _Sums:
    """Products of the baseline's columns and the residual, by run and channel."""

    grams: Annotated[FloatArray, "Shape (n_runs, n_channels, q + p + 1, q + p + 1)"]
    counts: Annotated[FloatArray, "Samples, shape (n_runs, n_channels)"]
    n_of_run: Annotated[int, "q"]

    def without(self, run: int | None = None, channel: int | None = None) -> "_Sums":
        """Sums without one run or one channel."""
        grams, counts = self.grams.copy(), self.counts.copy()
        for sums in (grams, counts):
            if run is not None:
                sums[run] = 0.0
            if channel is not None:
                sums[:, channel] = 0.0
        return replace(self, grams=grams, counts=counts)

    def without_columns(self, numbers: Sequence[int]) -> "_Sums":
        """Sums without some of the columns."""
        grams = np.delete(np.delete(self.grams, list(numbers), axis=2), list(numbers), axis=3)
        n_of_run = self.n_of_run - sum(number < self.n_of_run for number in numbers)
        return replace(self, grams=grams, n_of_run=n_of_run)

    @property
    def mean_square(self) -> float:
        """Mean square that the baseline leaves once it is fitted to these."""
        total = self._shared
        right = total[:-1, -1]
        explained = float(right @ normal_inverse(total[:-1, :-1]) @ right)
        return max(float(total[-1, -1]) - explained, 0.0) / max(float(self.counts.sum()), 1.0)

    @property
    def of_each_run(self) -> float:
        """Mean square that the baseline leaves once it is fitted to every run by itself."""
        squares = [
            replace(self, grams=gram[None], counts=counts[None]).mean_square * counts.sum()
            for gram, counts in zip(self.grams, self.counts, strict=True)
        ]
        return float(np.sum(squares)) / max(float(self.counts.sum()), 1.0)

    @property
    def steps(self) -> FloatArray:
        """Steps of the parameters of every run, then of all, shape (n_runs, q + p)."""
        q = self.n_of_run
        total = self._shared
        shared = normal_solution(total[:-1, :-1], total[:-1, -1])
        steps = []
        for gram in self.grams.sum(axis=1):
            right = gram[:q, -1] - gram[:q, q:-1] @ shared
            steps.append(np.concatenate([normal_solution(gram[:q, :q], right), shared]))
        return np.array(steps)

    @property
    def _shared(self) -> FloatArray:
        """Products once every run's own parameters are fitted out."""
        of_runs = [shared_products(gram, self.n_of_run) for gram in self.grams.sum(axis=1)]
        return np.asarray(np.sum(of_runs, axis=0))


@dataclass(frozen=True, eq=False)
class _Reading:
    """What one channel reads, and what the others expect of it, about their means."""

    measured: FloatArray
    expected: FloatArray
    others: Annotated[Mapping[str, FloatArray], "Signals of the other channels"]
    loads: Annotated[FloatArray, "Shape (n_loads, n)"]
    angle: Annotated[FloatArray, "Carrier's angle, shape (1, n); (0, n) where nothing turns"]
    sampling: Annotated[Sequence[float], "Step of time of every run [s]"]
    starts: Annotated[Sequence[int], "First sample of every run"]


@dataclass(frozen=True, eq=False)
class _Fault:
    """A kind of fault with the size that fits best."""

    id: str
    text: str
    square: float
    n_unknowns: int


def lone_rivals(
    linear: Callable[[], Iterable[LinearRecord]],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """The channel, and the run, without which the baseline meets the others.

    At most one channel, one run, and values by run; each checked by a fit. `linear` gives the runs
    beside the fitted baseline one after the other: never all in memory.
    """
    sums = _sums(linear())
    if sums is None:
        return
    screened, enough = gap.remaining(_SCREENED), gap.enough
    n_runs, n_channels = sums.counts.shape
    if n_channels >= _FEWEST_CHANNELS:
        squares = [sums.without(channel=k).mean_square for k in range(n_channels)]
        channel = int(np.argmin(squares))
        if squares[channel] <= screened:
            square = refitted(_without_channel(campaign, channel))
            if square <= enough:
                reading = _reading(linear(), sums.without(channel=channel).steps, campaign, channel)
                rivals = _channel_rival(reading, campaign.channels[channel].name, square, gap)
                # Where as little is left without another channel, the rest fits anything: what a
                # channel reads must then be of a fault that has a pattern of its own.
                is_one = float(np.partition(squares, 1)[1]) > _SIMPLER * squares[channel]
                yield from (rival for rival in rivals if is_one or rival.id not in _OF_ANY)
    if n_runs >= _FEWEST_RUNS:
        squares = [sums.without(run=k).mean_square for k in range(n_runs)]
        number = int(np.argmin(squares))
        if squares[number] <= screened:
            record = next(islice(linear(), number, None))
            square = refitted(_without_run(campaign, record.run))
            if square <= enough:
                steps = sums.without(run=number).steps[number]
                yield _run_rival(record, steps, campaign, refitted, square, gap)
    if n_runs >= _FEWEST_VARYING and _loads_vary(campaign) and sums.of_each_run <= screened:
        squares = [refitted(replace(campaign, runs=(run,))) for run in campaign.runs]
        square = float(np.average(squares, weights=sums.counts.sum(axis=1)))
        # Values by run take more of any gap than one fault does.
        if square <= gap.remaining(NEARLY_ALL):
            names = ", ".join(run.name for run in campaign.runs)
            text = "values of its own for every run (temperature, adjustment, wear)"
            yield WiringRival(RUN_VARIATION, names, text, square, key_of("[[runs]]", "name"))


def filtered_signals(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """Filter of all channels with which the baseline leaves clearly less than with a delay.

    `records` are those that :func:`lone_rivals` calls for, the others its arguments. None where an
    input is an angle: in its turning frame a filtered signal is not that of a filtered load.
    """
    inputs = {name for run in campaign.runs for name in run.inputs}
    runs = list(records) if inputs and ANGLE not in inputs else []
    known = [np.isfinite(values).all() for run in campaign.runs for values in run.inputs.values()]
    if not runs or not all(known):
        return

    def residual_of(kind: _Filter, size: float) -> float:
        """Mean square beside the fitted baseline."""
        sums = _sums(_filtered_record(run, partial(kind, size)) for run in runs)
        return np.inf if sums is None else sums.mean_square

    def refit(kind: _Filter, size: float) -> float:
        """Mean square of the refitted baseline."""
        changed = tuple(
            replace(one, inputs={k: kind(size, one.time, v) for k, v in one.inputs.items()})
            for one in campaign.runs
        )
        return refitted(replace(campaign, runs=changed))

    def fitted(kind: _Filter, size: float) -> tuple[float, float]:
        """Size about a first one that leaves least, and that."""
        best = minimize_scalar(
            lambda octaves: refit(kind, size * 2.0**octaves),
            bounds=(-0.5, 0.5),
            method="bounded",
            options={"maxiter": _MOST_REFITS, "xatol": _OCTAVES},
        )
        return size * 2.0 ** float(best.x), float(best.fun)

    times = mean_step(runs[0].time) * 2.0**_SHARED_FILTERS
    n = min(_MEANS, key=partial(residual_of, _mean))
    time = min(times, key=partial(residual_of, _low_pass))
    if min(residual_of(_mean, n), residual_of(_low_pass, time)) > gap.remaining(_SCREENED):
        return
    (time, of_filter), of_mean = fitted(_low_pass, time), refit(_mean, n)
    square = min(of_filter, of_mean)
    if not square <= gap.enough:
        return
    _, of_delay = fitted(_delay, min(times, key=partial(residual_of, _delay)))
    if _SIMPLER * square < of_delay:
        size = f"of {time:.2g} s" if of_filter < of_mean else f"that is a mean of {n}"
        names = ", ".join(channel.name for channel in campaign.channels)
        line = key_of("[[channels]]", campaign.channels[0].name)
        yield WiringRival(FILTERED_CHANNEL, names, f"{names} behind a filter {size}", square, line)


def drifting_zeros(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """Straight lines over time taken out of the channels, each with its offset, in every run.

    The arguments are those of :func:`filtered_signals`. None where an input is an angle, whose
    kinds have drifts in their library, where a load grows with time as a drift does, or where
    offsets alone do it.
    """
    if not _has_steady_loads(campaign):
        return
    runs = {run.name: run for run in campaign.runs}
    sums = _sums(_with_lines(record, runs[record.run]) for record in records)
    if sums is None or sums.mean_square > gap.remaining(_SCREENED):
        return
    names = [channel.name for channel in campaign.channels]
    ramps = range(len(names), 2 * len(names))
    if sums.without_columns(ramps).mean_square <= gap.enough:
        return
    lines = sums.steps[:, : 2 * len(names)].reshape(-1, 2, len(names))

    def level(run: Run, of_run: FloatArray) -> Run:
        drifts = of_run[0] + np.multiply.outer(_along(run, run.time), of_run[1])
        signals = {name: run.signals[name] - drifts[:, k] for k, name in enumerate(names)}
        return replace(run, signals=signals)

    pairs = zip(campaign.runs, lines, strict=True)
    square = refitted(replace(campaign, runs=tuple(level(*pair) for pair in pairs)))
    if square <= gap.enough:
        about = ", ".join(names)
        text = f"the zero of {about} drifting over every run taken out"
        yield WiringRival(DRIFT, about, text, square, key_of("[[channels]]", names[0]))


def drifting_gain(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """Gain of the load that grows over every run, the same in all, with which least is left.

    What a linear machine answers grows with it, ``r = c (g t + g_0) x``; g_0 is known to the
    baseline where there is one load. The arguments are those of :func:`drifting_zeros`.
    """
    is_mounting = campaign.kind == "mounting"
    names = LOADS if is_mounting else tuple(campaign.contract.inputs)
    if not (is_mounting or (len(names) == 1 and _has_steady_loads(campaign))):
        return
    runs = {run.name: run for run in campaign.runs}
    sums = _sums(_with_growing(record, runs[record.run], names) for record in records)
    if sums is None:
        return
    # Columns of all runs follow those of each run: one of the only load, two of each of several.
    first, n_columns = sums.n_of_run, 1 if len(names) == 1 else 2
    columns = np.arange(first, first + n_columns * len(names)).reshape(len(names), n_columns)
    others = [np.delete(columns, k, axis=0).ravel().tolist() for k in range(len(names))]
    of_load = [sums.without_columns(numbers) for numbers in others]
    number = int(np.argmin([one.mean_square for one in of_load]))
    name, best = names[number], of_load[number]
    if best.mean_square > gap.remaining(_SCREENED):
        return
    growth, *constant = best.steps[0, first : first + n_columns].tolist()
    middle = 1.0 + sum(constant)
    # A gain has one sign: about a baseline that has run away any may fit.
    if middle <= 0.5 * abs(growth):
        return

    def level(run: Run) -> Run:
        gain = middle + growth * _along(run, run.time)
        return replace(run, inputs={**run.inputs, name: run.inputs[name] * gain})

    square = refitted(replace(campaign, runs=tuple(map(level, campaign.runs))))
    if square <= gap.enough:
        text = f"the gain of {name} drifting by {-growth:.1%} over every run taken out"
        yield WiringRival(INPUT_GAIN, name, text, square, sample_of(campaign.runs[0].file, 0))


def late_load(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """One of several loads that lags behind the signals, late and behind a first-order low-pass.

    What acts is ``u(t) = (1 + tau d/dt) u_read(t + d)``, and a linear machine answers it by the
    same of its answer. The arguments are those of :func:`drifting_zeros`.
    """
    if campaign.kind != "mounting":
        return
    linear = list(records)
    runs = {run.name: run for run in campaign.runs}
    times = mean_step(campaign.runs[0].time) * 2.0 ** _SHARED_FILTERS[::2]
    lags = np.concatenate([np.outer(times, split) for split in _LATE_AND_FILTERED])
    for name in LOADS:
        answers = [
            CubicSpline(record.time, _answer_to(record, runs[record.run], name))
            for record in linear
        ]
        # What any lag makes of the answer lies nearly among the answers some times ago.
        any_lag = _sums(map(partial(_with_answers, times), linear, answers))
        if any_lag is None or any_lag.mean_square > gap.remaining(_SCREENED):
            continue

        def residual(lag: FloatArray, answers: Sequence[CubicSpline] = answers) -> float:
            """Mean square beside the fitted baseline once the answer to the load is earlier."""
            sums = _sums(map(partial(_with_earlier, lag), linear, answers))
            return np.inf if sums is None else sums.mean_square

        nearest = min(lags, key=residual)
        best = minimize(
            residual,
            nearest,
            bounds=[(0.0, None)] * 2,
            method="Nelder-Mead",
            options={
                "initial_simplex": nearest + 0.5 * nearest.max() * np.eye(3, 2, -1),
                "xatol": _OCTAVES * nearest.max(),
                "fatol": np.inf,
            },
        )
        late, tau = lag = best.x
        loads = [_earlier(lag, CubicSpline(run.time, run.inputs[name])) for run in campaign.runs]
        changed = tuple(
            replace(run, inputs={**run.inputs, name: load})
            for run, load in zip(campaign.runs, loads, strict=True)
        )
        square = refitted(replace(campaign, runs=changed))
        if square <= gap.enough:
            text = f"{name} put right, which is {late:.2g} s late and filtered with {tau:.2g} s,"
            line = sample_of(campaign.runs[0].file, 0)
            yield WiringRival(FILTERED_CHANNEL, name, text, square, line)


def saturating_channel(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """The only channel reading too little where it is large, ``y = e tanh(x / e)``.

    Its first order ``r = -x³ / (3 e²)`` gives the end e to begin with, refits the one that leaves
    least. The arguments are those of :func:`filtered_signals`.
    """
    if len(campaign.channels) != 1:
        return
    name = campaign.channels[0].name
    sums = _sums(_with_columns(record, record.predicted**3) for record in records)
    if sums is None or sums.mean_square > gap.remaining(_SCREENED):
        return
    cubic = float(sums.steps[0, sums.n_of_run])
    if cubic >= 0.0:
        return
    largest = max(float(np.nanmax(np.abs(run.signals[name]))) for run in campaign.runs)

    def refit(end: float) -> float:
        """Mean square of the refitted baseline where the channel ends there."""
        runs = tuple(
            replace(run, signals={name: end * np.arctanh(run.signals[name] / end)})
            for run in campaign.runs
        )
        return refitted(replace(campaign, runs=runs))

    first = max(1.0 / np.sqrt(-3.0 * cubic), _BEYOND * largest)
    best = minimize_scalar(
        refit,
        bounds=(_BEYOND * largest, 2.0 * first),
        method="bounded",
        options={"maxiter": _MOST_REFITS, "xatol": 1e-3 * first},
    )
    if float(best.fun) <= gap.enough:
        unit = campaign.channels[0].unit
        text = f"the readings of {name} straightened, which saturate at {float(best.x):.3g} {unit},"
        line = key_of("[[channels]]", name)
        yield WiringRival(CURVED_CHANNEL, name, text, float(best.fun), line)


def _with_columns(record: LinearRecord, values: FloatArray) -> LinearRecord:
    """Record whose first columns of all runs are some values, shape ([k,] n, n_channels)."""
    return replace(record, columns=np.insert(record.columns, record.n_of_run, values, axis=0))


def _answer_to(record: LinearRecord, run: Run, name: str) -> FloatArray:
    """Answer to one load, zero where it does not act; shape (n, n_channels)."""
    answers = {answer.load: answer.response for answer in load_answers(record, run)}
    return answers.get(name, np.zeros_like(record.predicted))


def _earlier(lag: FloatArray, values: CubicSpline) -> FloatArray:
    """Values at their times before they were late by ``lag[0]`` and filtered by ``lag[1]``."""
    at = np.minimum(values.x + lag[0], values.x[-1])
    return np.asarray(values(at) + lag[1] * values(at, 1))


def _with_answers(times: FloatArray, record: LinearRecord, answer: CubicSpline) -> LinearRecord:
    """Record whose first columns of all runs are the answer to a load, earlier by some times."""
    as_read = answer(record.time)
    shifts = [_earlier(np.array([time, 0.0]), answer) - as_read for time in times]
    return _with_columns(record, np.array(shifts))


def _with_earlier(lag: FloatArray, record: LinearRecord, answer: CubicSpline) -> LinearRecord:
    """Record whose answer to a load is earlier."""
    change = _earlier(lag, answer) - answer(record.time)
    return replace(record, predicted=record.predicted + change, residual=record.residual - change)


def _with_growing(record: LinearRecord, run: Run, names: Sequence[str]) -> LinearRecord:
    """Record whose first columns of all runs are answers to loads that grow over the run.

    Where there are several, the answer itself follows each.
    """
    along = _along(run, record.time)[:, None]
    columns = []
    for name in names:
        answer = _answer_to(record, run, name)
        columns += [answer * along, *([answer] if len(names) > 1 else [])]
    return _with_columns(record, np.array(columns))


def _with_lines(record: LinearRecord, run: Run) -> LinearRecord:
    """Record whose first columns are an offset in each channel, then a ramp over time in each."""
    ramp = _along(run, record.time)[None, :, None]
    channels = np.eye(record.residual.shape[1])[:, None, :]
    lines = np.concatenate([channels * np.ones_like(ramp), channels * ramp])
    columns = np.concatenate([lines, record.columns])
    return replace(record, columns=columns, n_of_run=record.n_of_run + len(lines))


def _along(run: Run, time: FloatArray) -> FloatArray:
    """Time over the length of a run, from -0.5 to 0.5."""
    return np.asarray((time - run.time[0]) / (run.time[-1] - run.time[0]) - 0.5)


def _has_steady_loads(campaign: Campaign) -> bool:
    """Whether there are loads, no angle, and none grows or falls with time in any run."""
    inputs = {name for run in campaign.runs for name in run.inputs}
    if not inputs or ANGLE in inputs:
        return False
    return not any(
        abs(float(np.corrcoef(load, run.time)[0, 1])) > _GROWS_WITH_TIME
        for run in campaign.runs
        for load in run.inputs.values()
        if np.ptp(load) > 0.0
    )


def _filtered_record(
    record: LinearRecord, change: Callable[[FloatArray, FloatArray], FloatArray]
) -> LinearRecord:
    """Run with a change of its prediction and slopes."""
    predicted = change(record.time, record.predicted)
    residual = record.predicted + record.residual - predicted
    columns = np.array([change(record.time, column) for column in record.columns])
    return replace(record, predicted=predicted, residual=residual, columns=columns)


def _low_pass(seconds: float, time: FloatArray, values: FloatArray) -> FloatArray:
    """First-order low-pass from the first value on."""
    share = mean_step(time) / (seconds + mean_step(time))
    start = (1.0 - share) * values[:1]
    return np.asarray(lfilter([share], [1.0, share - 1.0], values, axis=0, zi=start)[0])


def _mean(samples: float, time: FloatArray, values: FloatArray) -> FloatArray:
    """Mean over the latest samples, the first value before the first."""
    n = int(samples)
    longer = np.concatenate([np.repeat(values[:1], n - 1, axis=0), values])
    return np.asarray(lfilter(np.full(n, 1.0 / n), [1.0], longer, axis=0)[n - 1 :])


def _delay(seconds: float, time: FloatArray, values: FloatArray) -> FloatArray:
    """Values of a while ago, the first value before the first."""
    return np.asarray(CubicSpline(time, values)(np.maximum(time - seconds, time[0])))


def _loads_vary(campaign: Campaign) -> bool:
    """Whether loads vary within the runs: under steady ones any cause is a value of each run."""
    loads = [
        values
        for run in campaign.runs
        for name, values in run.inputs.items()
        if name not in _OF_SHAFT and values.any()
    ]
    return all(bool(np.std(load) > _STEADY * np.abs(load).max()) for load in loads)


def _sums(records: Iterable[LinearRecord]) -> _Sums | None:
    """Products of all runs; None where there is no record."""
    grams, counts, n_of_run = [], [], 0
    for record in records:
        known = np.isfinite(record.residual) & np.isfinite(record.predicted)
        of_run = []
        for k in range(record.residual.shape[1]):
            design = np.concatenate([record.columns[:, :, k], record.residual[None, :, k]])
            design[:, ~known[:, k]] = 0.0
            of_run.append(design @ design.T)
        grams.append(of_run)
        counts.append(known.sum(axis=0))
        n_of_run = record.n_of_run
    if not grams:
        return None
    return _Sums(np.array(grams), np.array(counts, dtype=np.float64), n_of_run)


def _without_channel(campaign: Campaign, channel: int) -> Campaign:
    """Campaign that never had a channel."""
    name = campaign.channels[channel].name
    runs = tuple(
        replace(run, signals={key: values for key, values in run.signals.items() if key != name})
        for run in campaign.runs
    )
    channels = tuple(one for one in campaign.channels if one.name != name)
    return replace(campaign, channels=channels, runs=runs)


def _without_run(campaign: Campaign, name: str) -> Campaign:
    """Campaign that never had a run."""
    return replace(campaign, runs=tuple(run for run in campaign.runs if run.name != name))


def _run_rival(
    record: LinearRecord,
    steps: FloatArray,
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    without: float,
    gap: GapSquare,
) -> WiringRival:
    """Rival: what is wrong with the loads of a run, or that it is at odds with the rest."""
    line = key_of("[[runs]]", record.run)
    x = record.predicted + np.einsum("p,pnc->nc", steps, record.columns)
    y = record.predicted + record.residual
    known = np.isfinite(x) & np.isfinite(y)
    # The zeros of a run are its own.
    x, y = (signal - np.nanmean(np.where(known, signal, np.nan), axis=0) for signal in (x, y))
    gain = float(np.sum(x[known] * y[known]) / np.sum(x[known] ** 2))
    noise = gap.floor * known.sum()
    unexplained = float(np.sum((y - x)[known] ** 2)) - noise
    beside_gain = float(np.sum((y - gain * x)[known] ** 2)) - noise
    # What is constant in a run is in its zeros: of the noise that is left no gain explains much.
    is_more = unexplained > (_SIMPLER - 1.0) * noise
    if is_more and beside_gain <= (1.0 - _EXPLAINED) * unexplained:
        text = f"the loads of {record.run} {gain:.3g} times as large"
        return WiringRival(INPUT_GAIN, record.run, text, without, line)
    for fault in load_faults(campaign, record.run):
        square = refitted(fault.corrected)
        if square <= gap.enough:
            return WiringRival(fault.id, record.run, f"{fault.text} in {record.run}", square, line)
    loads = _loads_of_one(campaign, record.run)
    if loads:
        text = f"run {record.run} left out, which alone has {' and '.join(loads)},"
        return WiringRival(RUN_OF_LOAD, record.run, text, without, line)
    text = f"run {record.run} left out, which is at odds with all others,"
    return WiringRival(RUN, record.run, text, without, line)


def _loads_of_one(campaign: Campaign, name: str) -> list[str]:
    """Loads that one run alone has: a tenth as much at most is in any other."""
    alone = []
    for load in LOADS:
        sizes = {run.name: np.abs(run.inputs.get(load, np.zeros(1))).max() for run in campaign.runs}
        others = max(size for run, size in sizes.items() if run != name)
        if sizes[name] > 0.0 and others <= _STEADY * sizes[name]:
            alone.append(load)
    return alone


def _channel_rival(
    reading: _Reading, name: str, square: float, gap: GapSquare
) -> Iterator[WiringRival]:
    """Rival that says what is wrong with a channel, without which a mean square is left."""
    noise = gap.floor * reading.measured.size
    unread = reading.measured - reading.expected
    unexplained = float(np.sum(unread**2))
    line = key_of("[[channels]]", name)
    if unexplained <= _SIMPLER * noise:
        text = f"channel {name} left out, the zero of which is off,"
        yield WiringRival(CHANNEL_ZERO, name, text, square, line)
        return
    # Half the mean square of the steps of white noise is its own.
    if 0.5 * float(np.sum(np.diff(unread) ** 2)) > _WHITE * unexplained:
        return
    faults = list(_faults(reading))
    least = min(fault.square for fault in faults)
    fault = min(
        (fault for fault in faults if fault.square <= _SIMPLER * max(least, noise)),
        key=lambda fault: (fault.n_unknowns, fault.square),
    )
    if fault.square > noise + (1.0 - _EXPLAINED) * (unexplained - noise):
        fault = _Fault(CHANNEL, "is at odds with all others", 0.0, 0)
    text = f"channel {name} left out, which {fault.text},"
    yield WiringRival(fault.id, name, text, square, line)


def _reading(
    records: Iterable[LinearRecord], steps: FloatArray, campaign: Campaign, channel: int
) -> _Reading:
    """Samples of a channel that are known in all, run after run."""
    runs = {run.name: run for run in campaign.runs}
    rows, starts, n, sampling = [], [], 0, []
    for record, step in zip(records, steps, strict=True):
        measured = (record.predicted + record.residual).T
        expected = record.predicted[:, channel] + step @ record.columns[:, :, channel]
        run = runs[record.run]
        loads = [
            np.interp(record.time, run.time, run.inputs[load])
            for load in (*LOADS, ANGLE)
            if load in run.inputs
        ]
        table = np.array([measured[channel], expected, *np.delete(measured, channel, 0), *loads])
        table = table[:, np.isfinite(table).all(axis=0)]
        sampling.append(mean_step(record.time))
        rows.append(table)
        starts.append(n)
        n += table.shape[1]
    table = np.concatenate(rows, axis=1)
    # The zero of a channel is its own.
    table -= table.mean(axis=1, keepdims=True)
    names = [one.name for k, one in enumerate(campaign.channels) if k != channel]
    n_angles = int(all(ANGLE in run.inputs for run in campaign.runs))
    inputs = table[2 + len(names) :]
    return _Reading(
        table[0],
        table[1],
        dict(zip(names, table[2 : 2 + len(names)], strict=True)),
        inputs[: len(inputs) - n_angles],
        inputs[len(inputs) - n_angles :],
        sampling,
        starts,
    )


def _faults(reading: _Reading) -> Iterator[_Fault]:
    """Every kind of fault with the size that fits best."""
    y, x = reading.measured, reading.expected

    def fitted(target: FloatArray, *columns: FloatArray) -> tuple[FloatArray, float]:
        """Factors of columns, and the square that they leave of a target."""
        design = np.array(columns)
        factors = normal_solution(design @ design.T, design @ target)
        return factors, float(np.sum((target - factors @ design) ** 2))

    (gain,), square = fitted(y, x)
    if abs(gain + 1.0) < _NEAR:
        yield _Fault(POLARITY, "reads with the other sign", square, 0)
    elif abs(gain) < _NEAR:
        yield _Fault(DEAD_CHANNEL, "does not answer", float(np.sum(y**2)), 0)
    else:
        yield _Fault(CHANNEL_GAIN, f"reads {gain:.3g} times as much", square, 1)
    for name, other in reading.others.items():
        square = float(np.sum((y - other) ** 2))
        yield _Fault(COPIED_CHANNEL, f"reads the signal of {name}", square, 0)
        (share,), square = fitted(y - x, other)
        text = f"reads {share:.1%} of {name} too"
        yield _Fault(CROSSTALK, text, square, 1)
    if reading.loads.size:
        _, square = fitted(y - x, *reading.loads)
        text = "moves with the loads as a sensor that stands on the ground"
        yield _Fault(SENSOR_ON_GROUND, text, square, 3)
    pieces = np.split(x, reading.starts[1:])
    steps = zip(reading.sampling, pieces, strict=True)
    times = [step * np.arange(float(one.size)) for step, one in steps]
    for power in _FILTERS:
        time = reading.sampling[0] * 2.0**power
        slow = np.concatenate([_low_pass(time, *pair) for pair in zip(times, pieces, strict=True)])
        square = float(np.sum((y - slow) ** 2))
        text = f"is filtered with a time constant of about {time:.2g} s"
        yield _Fault(FILTERED_CHANNEL, text, square, 1)
        square = float(np.sum((y - (x - slow)) ** 2))
        text = f"loses what is slower than about {time:.2g} s (AC coupling)"
        yield _Fault(AC_COUPLED, text, square, 1)
    delay, square = _delay_of(y, pieces, times)
    text = f"is {abs(delay) * 1e3:.2g} ms {'behind' if delay > 0.0 else 'before'} the others"
    yield _Fault(LATE_CHANNEL, text, square, 1)
    for angle in reading.angle:
        turned = np.split(angle, reading.starts[1:])
        if all((np.diff(one) > 0.0).all() for one in turned):
            delay, square = _delay_of(y, pieces, turned)
            text = f"reads as if {abs(np.rad2deg(delay)):.2g} degrees from its place"
            # At one speed either is the other: the delay comes first, which no law of the library
            # is, by as much as an unknown more has to explain (Schwarz).
            yield _Fault(CHANNEL, text, square * y.size ** (1.0 / y.size), 1)
    _, square = fitted(y - y.mean(), x, x**2 - np.mean(x**2), x**3 - np.mean(x**3))
    yield _Fault(CURVED_CHANNEL, "has a curved characteristic or saturates", square, 3)


def _delay_of(
    y: FloatArray, expected: Sequence[FloatArray], along: Sequence[FloatArray]
) -> tuple[float, float]:
    """Delay along time, or the angle, of every run with which the expectation fits best.

    Negative for a lead; and the square that is left.
    """

    def missed(delay: float) -> float:
        """Square that the expectation of a while ago leaves."""
        late = [delayed(at, one, delay) for at, one in zip(along, expected, strict=True)]
        return float(np.sum((y - np.concatenate(late)) ** 2))

    step = float(np.ptp(along[0])) / (along[0].size - 1)
    nearest = min(
        (sign * step * 2.0**power for power in _FILTERS for sign in (1.0, -1.0)), key=missed
    )
    best = minimize_scalar(
        missed,
        bounds=sorted((0.25 * nearest, 2.0 * nearest)),
        method="bounded",
        options={"xatol": 0.01 * abs(nearest)},
    )
    return float(best.x), float(best.fun)

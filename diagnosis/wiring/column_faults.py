"""Faults that the baseline meets with further columns, or with columns that are late or filtered.

The baseline, linear in its parameters about its fit, is fitted anew to records with: straight lines
of time in every channel (zeros that drift), loads that grow over time (a gain that drifts), columns
behind a delay, a mean or a low-pass filter (a filter that all channels share, a load that is late
and filtered), or without the samples at the end of a channel's range (a channel that saturates).
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize, minimize_scalar
from scipy.signal import lfilter

from carrierflex.diagnosis.wiring.linear_records import (
    FloatArray,
    LinearRecord,
    along,
    baseline_sums,
    load_answers,
)
from carrierflex.diagnosis.wiring.load_faults import ANGLE, with_inputs
from carrierflex.diagnosis.wiring.refits import LOADS, Fault, GapSquare, WiringRival
from carrierflex.files.quantities import sized
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import key_of, sample_of

#: A filter or a delay along the first axis: ``(size, time, values) -> values``.
_Filter = Callable[[float, FloatArray, FloatArray], FloatArray]
#: What a fault leaves over what the best leaves, up to which the simpler one is taken.
SIMPLER = 1.2
#: Times [s] of a filter, or a delay, of all channels over the step, as powers of two; samples of a
#: filter that is a mean.
_SHARED_FILTERS, _MEANS = np.arange(-2.0, 6.0, 0.5), range(2, 9)
#: Times of a filter between torque and zeros over the step, as powers of two.
_SLOW_FILTERS = np.arange(4.0, 17.0)
#: Delay and time of a filter of a load, over the times above.
_LATE_AND_FILTERED = np.array([(1.0, 1.0), (1.0, 0.0), (0.0, 1.0)])
#: Refits at most that seek the size of a filter, and octaves to which they seek it: two digits.
_MOST_REFITS, _OCTAVES = 10, 0.015
#: Where a channel saturates, over its largest reading, at least.
_BEYOND = 1.001
#: Correlation of a load with time from which a drift follows that load as well.
_GROWS_WITH_TIME = 0.3


def filtered_signals(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """Filter of all channels with which the baseline leaves clearly less than with a delay.

    None where an input is an angle: in its turning frame a filtered signal is not that of a
    filtered load.
    """
    inputs = [pair for run in campaign.runs for pair in run.inputs.items()]
    if not inputs or ANGLE in dict(inputs) or not all(np.isfinite(one).all() for _, one in inputs):
        return
    runs = list(records)
    if not runs:
        return

    def residual_of(kind: _Filter, size: float) -> float:
        """Mean square beside the fitted baseline."""
        return baseline_sums(_filtered_record(run, partial(kind, size)) for run in runs).mean_square

    def filtered(kind: _Filter, size: float) -> Campaign:
        """Records with inputs behind the filter."""
        changed = tuple(
            replace(one, inputs={k: kind(size, one.time, v) for k, v in one.inputs.items()})
            for one in campaign.runs
        )
        return replace(campaign, runs=changed)

    def fitted(kind: _Filter, size: float) -> tuple[float, float]:
        """Size about a first one with which the refitted baseline leaves least, and that."""
        best = minimize_scalar(
            lambda octaves: refitted(filtered(kind, size * 2.0**octaves)),
            bounds=(-0.5, 0.5),
            method="bounded",
            options={"maxiter": _MOST_REFITS, "xatol": _OCTAVES},
        )
        return size * 2.0 ** float(best.x), float(best.fun)

    times = mean_step(runs[0].time) * 2.0**_SHARED_FILTERS
    of_mean, n = min((residual_of(_mean, size), size) for size in _MEANS)
    of_filter, time = min((residual_of(low_pass, size), size) for size in times)
    if min(of_mean, of_filter) > gap.half:
        return
    (time, of_filter), of_mean = fitted(low_pass, time), refitted(filtered(_mean, n))
    square = min(of_filter, of_mean)
    if not square <= gap.half:
        return
    _, of_delay = fitted(_delay, min(times, key=partial(residual_of, _delay)))
    if SIMPLER * square < of_delay:
        if of_filter < of_mean:
            size, corrected = f"of {time:.2g} s", filtered(low_pass, time)
        else:
            size, corrected = f"that is a mean of {n}", filtered(_mean, n)
        names, line = _all_channels(campaign)
        text = f"{names} behind a filter {size}"
        yield WiringRival(Fault.FILTERED_CHANNEL, names, text, square, line, corrected=corrected)


def _all_channels(campaign: Campaign) -> tuple[str, str]:
    """Names of all channels, and the key that a finding about them is about."""
    names = [channel.name for channel in campaign.channels]
    return ", ".join(names), key_of("[[channels]]", names[0])


def drifting_zeros(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """Straight lines over time taken out of the channels, each with its offset, in every run.

    None where an input is an angle, whose kinds have drifts in their library, where a load grows
    with time as a drift does, or where offsets alone do it.
    """
    if not _has_steady_loads(campaign):
        return
    runs = {run.name: run for run in campaign.runs}
    sums = baseline_sums(_with_lines(record, runs[record.run]) for record in records)
    if sums.mean_square > gap.half:
        return
    n_channels = len(campaign.channels)
    ramps = range(n_channels, 2 * n_channels)
    if sums.without_columns(ramps).mean_square <= gap.enough:
        return
    lines = sums.steps[:, : 2 * n_channels].reshape(-1, 2, n_channels)

    def level(run: Run, of_run: FloatArray) -> Run:
        drifts = of_run[0] + np.multiply.outer(along(run.time, run.time), of_run[1])
        pairs = zip(campaign.channels, drifts.T, strict=True)
        return replace(run, signals={one.name: run.signals[one.name] - d for one, d in pairs})

    corrected = replace(campaign, runs=tuple(map(level, campaign.runs, lines)))
    square = refitted(corrected)
    if square <= gap.half:
        names, line = _all_channels(campaign)
        text = f"the zero of {names} drifting over every run taken out"
        yield WiringRival(Fault.DRIFT, names, text, square, line, corrected=corrected)


def zeros_behind_the_torque(
    records: Iterable[LinearRecord], campaign: Campaign, gap: GapSquare
) -> Iterator[WiringRival]:
    """Zeros of a mounting's channels that follow its torque slowly, as where it warms.

    ``r_k = z_k s``, with the torque s behind a first-order low-pass. None where a torque on time
    does nearly as much, which is a map of the loads, or the baseline's columns that much later,
    which are those of bushings that creep. The library of a carrier has drifts.
    """
    torque = LOADS[0]
    if campaign.kind != "mounting" or not all(torque in run.inputs for run in campaign.runs):
        return
    runs = {run.name: run for run in campaign.runs}
    linear = list(records)

    def remaining(columns: Callable[[float, LinearRecord], FloatArray], time: float) -> float:
        """Mean square beside the fitted baseline with columns at a time of the filter."""
        records = (_with_columns(record, columns(time, record)) for record in linear)
        return baseline_sums(records).mean_square

    def zeros(time: float, record: LinearRecord) -> FloatArray:
        run = runs[record.run]
        slow = np.interp(record.time, run.time, low_pass(time, run.time, run.inputs[torque]))
        return np.multiply.outer(np.eye(record.residual.shape[1]), slow).transpose(0, 2, 1)

    def creeping(time: float, record: LinearRecord) -> FloatArray:
        return np.array([low_pass(time, record.time, column) for column in record.columns])

    times = mean_step(campaign.runs[0].time) * 2.0**_SLOW_FILTERS
    square, time = min((remaining(zeros, time), time) for time in times)
    if not square <= gap.enough or remaining(zeros, 0.0) <= gap.enough:
        return
    if remaining(creeping, time) > gap.enough:
        names, line = _all_channels(campaign)
        text = f"the zero of {names} following the torque in about {time:.2g} s taken out"
        yield WiringRival(Fault.DRIFT, names, text, square, line)


def drifting_gain(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """Gain of the load that grows over every run, the same in all, with which least is left.

    What a linear machine answers grows with it, ``r = c (g t + g_0) x``; g_0 is known to the
    baseline where there is one load. None where a constant gain alone does it.
    """
    is_mounting = campaign.kind == "mounting"
    names = LOADS if is_mounting else tuple(campaign.contract.inputs)
    if not (is_mounting or (len(names) == 1 and _has_steady_loads(campaign))):
        return
    runs = {run.name: run for run in campaign.runs}
    sums = baseline_sums(_with_growing(record, runs[record.run], names) for record in records)
    if sums.mean_square > gap.half:
        return
    # Columns of all runs follow those of each run: one of the only load, two of each of several.
    first, n_columns = sums.n_of_run, 1 if len(names) == 1 else 2
    columns = np.arange(first, first + n_columns * len(names)).reshape(len(names), n_columns)
    others = [np.delete(columns, k, axis=0).ravel().tolist() for k in range(len(names))]
    of_load = [sums.without_columns(numbers) for numbers in others]
    number = int(np.argmin([one.mean_square for one in of_load]))
    name, best = names[number], of_load[number]
    if best.mean_square > gap.half:
        return
    if best.without_columns([first]).mean_square <= gap.enough:
        return
    growth, *constant = best.steps[0, first : first + n_columns].tolist()
    middle = 1.0 + sum(constant)
    # A gain has one sign: about a baseline that has run away any may fit.
    if middle <= 0.5 * abs(growth):
        return

    def level(run: Run) -> FloatArray:
        """Load of a run with its gain."""
        return run.inputs[name] * (middle + growth * along(run.time, run.time))

    corrected = with_inputs(campaign, "", {name: level})
    square = refitted(corrected)
    if square <= gap.half:
        text = f"the gain of {name} drifting by {-growth:.1%} over every run taken out"
        line = sample_of(campaign.runs[0].file, 0)
        yield WiringRival(Fault.INPUT_GAIN, name, text, square, line, corrected=corrected)


def late_load(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """A load that lags behind the signals, late and behind a first-order low-pass.

    What acts is ``u(t) = (1 + tau d/dt) u_read(t + d)``, and a linear machine answers it by the
    same of its answer. None where an input is an angle, whose zero and delay are other faults.
    """
    inputs = {name for run in campaign.runs for name in run.inputs}
    names = LOADS if campaign.kind == "mounting" else sorted(inputs)
    if not names or (campaign.kind != "mounting" and ANGLE in inputs):
        return
    linear = list(records)
    runs = {run.name: run for run in campaign.runs}
    times = mean_step(campaign.runs[0].time) * 2.0 ** _SHARED_FILTERS[::2]
    lags = np.concatenate([np.outer(times, split) for split in _LATE_AND_FILTERED])
    for name in names:
        answers = [
            CubicSpline(record.time, _answer_to(record, runs[record.run], name))
            for record in linear
        ]
        # What any lag makes of the answer lies nearly among the answers some times ago.
        any_lag = baseline_sums(map(partial(_with_answers, times), linear, answers))
        if any_lag.mean_square > gap.half:
            continue

        def residual(lag: FloatArray, answers: Sequence[CubicSpline] = answers) -> float:
            """Mean square beside the fitted baseline once the answer to the load is earlier."""
            return baseline_sums(map(partial(_with_earlier, lag), linear, answers)).mean_square

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

        def earlier(run: Run, name: str = name, lag: FloatArray = lag) -> FloatArray:
            """Load of a run as it acts."""
            return _earlier(lag, CubicSpline(run.time, run.inputs[name]))

        corrected = with_inputs(campaign, "", {name: earlier})
        square = refitted(corrected)
        if square <= gap.half:
            text = f"{name} put right, which is {late:.2g} s late and filtered with {tau:.2g} s,"
            line = sample_of(campaign.runs[0].file, 0)
            yield WiringRival(Fault.FILTERED_CHANNEL, name, text, square, line, corrected=corrected)


def saturating_channel(
    records: Iterable[LinearRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
    gap: GapSquare,
) -> Iterator[WiringRival]:
    """The only channel reading too little where it is large, ``y = e tanh(x / e)``.

    Its first order ``r = -x³ / (3 e²)`` gives the end e to begin with, refits the one that leaves
    least.
    """
    if len(campaign.channels) != 1:
        return
    name = campaign.channels[0].name
    sums = baseline_sums(_with_columns(record, record.predicted**3) for record in records)
    if sums.mean_square > gap.half:
        return
    cubic = float(sums.steps[0, sums.n_of_run])
    if cubic >= 0.0:
        return
    largest = max(float(np.nanmax(np.abs(run.signals[name]))) for run in campaign.runs)

    def straightened(end: float) -> Campaign:
        """Records of a channel that ends there."""
        runs = tuple(
            replace(run, signals={name: end * np.arctanh(run.signals[name] / end)})
            for run in campaign.runs
        )
        return replace(campaign, runs=runs)

    first = max(1.0 / np.sqrt(-3.0 * cubic), _BEYOND * largest)
    best = minimize_scalar(
        lambda end: refitted(straightened(end)),
        bounds=(_BEYOND * largest, 2.0 * first),
        method="bounded",
        options={"maxiter": _MOST_REFITS, "xatol": 1e-3 * first},
    )
    if float(best.fun) <= gap.half:
        corrected = straightened(float(best.x))
        end = sized(float(best.x), campaign.channels[0].unit)
        text = f"the readings of {name} straightened, which saturate at {end},"
        line = key_of("[[channels]]", name)
        square = float(best.fun)
        yield WiringRival(Fault.CURVED_CHANNEL, name, text, square, line, corrected=corrected)


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
    growing = along(record.time, run.time)[:, None]
    columns = []
    for name in names:
        answer = _answer_to(record, run, name)
        columns += [answer * growing, *([answer] if len(names) > 1 else [])]
    return _with_columns(record, np.array(columns))


def _with_lines(record: LinearRecord, run: Run) -> LinearRecord:
    """Record whose first columns are an offset in each channel, then a ramp over time in each."""
    ramp = along(record.time, run.time)[None, :, None]
    channels = np.eye(record.residual.shape[1])[:, None, :]
    lines = np.concatenate([channels * np.ones_like(ramp), channels * ramp])
    columns = np.concatenate([lines, record.columns])
    return replace(record, columns=columns, n_of_run=record.n_of_run + len(lines))


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
    signals = np.concatenate([record.predicted[None], record.columns])
    predicted, *columns = change(record.time, signals.swapaxes(0, 1)).swapaxes(0, 1)
    residual = record.predicted + record.residual - predicted
    return replace(record, predicted=predicted, residual=residual, columns=np.array(columns))


def low_pass(seconds: float, time: FloatArray, values: FloatArray) -> FloatArray:
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

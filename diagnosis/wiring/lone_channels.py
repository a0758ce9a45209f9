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
from itertools import islice

import numpy as np
from scipy.optimize import minimize_scalar

from carrierflex.diagnosis.wiring.column_faults import SIMPLER, low_pass
from carrierflex.diagnosis.wiring.linear_records import FloatArray, LinearRecord, baseline_sums
from carrierflex.diagnosis.wiring.load_faults import ANGLE, load_faults
from carrierflex.diagnosis.wiring.refits import LOADS, NEARLY_ALL, Fault, GapSquare, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import key_of
from carrierflex.identification.estimation.scaled_least_squares import normal_solution
from carrierflex.simulation.sensing import delayed

#: Fewest channels, or runs, of which one can be left out: two disagree, and neither is the one.
_FEWEST = 3
#: Standard deviation of a load over its largest value up to which it is steady.
_STEADY = 0.1
#: Factors of a polarity that is reversed and of a dead channel are within this.
_NEAR = 0.1
#: Faults without a pattern.
_OF_ANY = (Fault.CHANNEL, Fault.CHANNEL_ZERO)
#: Share of a signal's square in its steps from which it is white noise.
_WHITE = 0.8
#: Times [s] of filters over the step, as powers of two.
_FILTERS = range(0, 14)


@dataclass(frozen=True, eq=False)
class _Reading:
    """What one channel reads, and what the others expect of it, about their means."""

    measured: FloatArray
    expected: FloatArray
    others: Mapping[str, FloatArray]  # Signals of the other channels
    loads: FloatArray  # Shape (n_loads, n)
    angle: FloatArray  # Carrier's angle, shape (1, n); (0, n) where nothing turns
    sampling: Sequence[float]  # Step of time of every run [s]
    ends: Sequence[int]  # End of every run but the last


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
    sums = baseline_sums(linear())
    n_runs, n_channels = sums.counts.shape
    if n_channels >= _FEWEST:
        squares = [sums.without(channel=k).mean_square for k in range(n_channels)]
        channel = int(np.argmin(squares))
        if squares[channel] <= gap.half:
            corrected = _without_channel(campaign, channel)
            square = refitted(corrected)
            if square <= gap.half:
                reading = _reading(linear(), sums.without(channel=channel).steps, campaign, channel)
                rivals = _channel_rival(reading, campaign.channels[channel].name, square, gap)
                # Where as little is left without another channel, the rest fits anything: what a
                # channel reads must then be of a fault that has a pattern of its own.
                is_one = float(np.partition(squares, 1)[1]) > SIMPLER * squares[channel]
                for rival in rivals:
                    if is_one or rival.id not in _OF_ANY:
                        yield replace(rival, corrected=corrected)
    if n_runs >= _FEWEST:
        squares = [sums.without(run=k).mean_square for k in range(n_runs)]
        number = int(np.argmin(squares))
        if squares[number] <= gap.half:
            record = next(islice(linear(), number, None))
            others = tuple(run for run in campaign.runs if run.name != record.run)
            square = refitted(replace(campaign, runs=others))
            if square <= gap.enough:
                steps = sums.without(run=number).steps[number]
                yield _run_rival(record, steps, campaign, refitted, square, gap)
    if n_runs > 1 and _loads_vary(campaign) and sums.of_each_run <= gap.half:
        squares = [refitted(replace(campaign, runs=(run,))) for run in campaign.runs]
        square = float(np.average(squares, weights=sums.counts.sum(axis=1)))
        # Values by run take more of any gap than one fault does.
        if square <= gap.remaining(NEARLY_ALL):
            names = ", ".join(run.name for run in campaign.runs)
            text = "values of its own for every run (temperature, adjustment, wear)"
            yield WiringRival(Fault.RUN_VARIATION, names, text, square, key_of("[[runs]]", "name"))


def run_of_largest_motion(campaign: Campaign) -> str:
    """Name of the run that moves most: an effect that grows with the motion is largest there."""
    return max(
        campaign.runs,
        key=lambda run: sum(float(np.nanstd(values)) for values in run.signals.values()),
    ).name


def _loads_vary(campaign: Campaign) -> bool:
    """Whether loads vary within the runs: under steady ones any cause is a value of each run."""
    loads = [
        values
        for run in campaign.runs
        for name, values in run.inputs.items()
        if name not in (ANGLE, "speed") and values.any()
    ]
    return all(bool(np.std(load) > _STEADY * np.abs(load).max()) for load in loads)


def _without_channel(campaign: Campaign, channel: int) -> Campaign:
    """Campaign that never had a channel."""
    channels = tuple(one for k, one in enumerate(campaign.channels) if k != channel)
    runs = tuple(
        replace(run, signals={one.name: run.signals[one.name] for one in channels})
        for run in campaign.runs
    )
    return replace(campaign, channels=channels, runs=runs)


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
    is_more = unexplained > (SIMPLER - 1.0) * noise
    if is_more and beside_gain <= (1.0 - NEARLY_ALL) * unexplained:
        text = f"the loads of {record.run} {gain:.3g} times as large"
        return WiringRival(Fault.INPUT_GAIN, record.run, text, without, line)
    for fault in load_faults(campaign, record.run):
        square = fault.by(refitted).mean_square
        if square <= gap.enough:
            return WiringRival(fault.id, record.run, f"{fault.text} in {record.run}", square, line)
    loads = _loads_of_one(campaign, record.run)
    if loads:
        text = f"run {record.run} left out, which alone has {' and '.join(loads)},"
        return WiringRival(Fault.RUN_OF_LOAD, record.run, text, without, line)
    text = f"run {record.run} left out, which is at odds with all others,"
    return WiringRival(Fault.RUN, record.run, text, without, line)


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
    if unexplained <= SIMPLER * noise:
        text = f"channel {name} left out, the zero of which is off,"
        yield WiringRival(Fault.CHANNEL_ZERO, name, text, square, line)
        return
    # Half the mean square of the steps of white noise is its own.
    if 0.5 * float(np.sum(np.diff(unread) ** 2)) > _WHITE * unexplained:
        return
    faults = list(_faults(reading))
    least = min(fault.square for fault in faults)
    fault = min(
        (fault for fault in faults if fault.square <= SIMPLER * max(least, noise)),
        key=lambda fault: (fault.n_unknowns, fault.square),
    )
    if fault.square > noise + (1.0 - NEARLY_ALL) * (unexplained - noise):
        fault = _Fault(Fault.CHANNEL, "is at odds with all others", 0.0, 0)
    text = f"channel {name} left out, which {fault.text},"
    yield WiringRival(fault.id, name, text, square, line)


def _reading(
    records: Iterable[LinearRecord], steps: FloatArray, campaign: Campaign, channel: int
) -> _Reading:
    """Samples of a channel that are known in all, run after run."""
    runs = {run.name: run for run in campaign.runs}
    rows, sampling = [], []
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
        rows.append(table[:, np.isfinite(table).all(axis=0)])
        sampling.append(mean_step(record.time))
    table = np.concatenate(rows, axis=1)
    # The zero of a channel is its own.
    table -= table.mean(axis=1, keepdims=True)
    names = [one.name for k, one in enumerate(campaign.channels) if k != channel]
    n_angles = int(all(ANGLE in run.inputs for run in campaign.runs))
    n_others, n_loaded = 2 + len(names), len(table) - n_angles
    ends = np.cumsum([one.shape[1] for one in rows])[:-1].tolist()
    others = dict(zip(names, table[2:n_others], strict=True))
    inputs = (table[n_others:n_loaded], table[n_loaded:])
    return _Reading(table[0], table[1], others, *inputs, sampling, ends)


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
        yield _Fault(Fault.POLARITY, "reads with the other sign", square, 0)
    elif abs(gain) < _NEAR:
        yield _Fault(Fault.DEAD_CHANNEL, "does not answer", float(np.sum(y**2)), 0)
    else:
        yield _Fault(Fault.CHANNEL_GAIN, f"reads {gain:.3g} times as much", square, 1)
    for name, other in reading.others.items():
        square = float(np.sum((y - other) ** 2))
        yield _Fault(Fault.COPIED_CHANNEL, f"reads the signal of {name}", square, 0)
        (share,), square = fitted(y - x, other)
        text = f"reads {share:.1%} of {name} too"
        yield _Fault(Fault.CROSSTALK, text, square, 1)
    if reading.loads.size:
        _, square = fitted(y - x, *reading.loads)
        text = "moves with the loads as a sensor that stands on the ground"
        yield _Fault(Fault.SENSOR_ON_GROUND, text, square, 3)
    pieces = np.split(x, reading.ends)
    steps = zip(reading.sampling, pieces, strict=True)
    times = [step * np.arange(float(one.size)) for step, one in steps]
    for power in _FILTERS:
        time = reading.sampling[0] * 2.0**power
        slow = np.concatenate([low_pass(time, *pair) for pair in zip(times, pieces, strict=True)])
        square = float(np.sum((y - slow) ** 2))
        text = f"is filtered with a time constant of about {time:.2g} s"
        yield _Fault(Fault.FILTERED_CHANNEL, text, square, 1)
        square = float(np.sum((y - (x - slow)) ** 2))
        text = f"loses what is slower than about {time:.2g} s (AC coupling)"
        yield _Fault(Fault.AC_COUPLED, text, square, 1)
    delay, square = _delay_of(y, pieces, times)
    text = f"is {abs(delay) * 1e3:.2g} ms {'behind' if delay > 0.0 else 'before'} the others"
    yield _Fault(Fault.LATE_CHANNEL, text, square, 1)
    for angle in reading.angle:
        turned = np.split(angle, reading.ends)
        if all((np.diff(one) > 0.0).all() for one in turned):
            delay, square = _delay_of(y, pieces, turned)
            text = f"reads as if {abs(np.rad2deg(delay)):.2g} degrees from its place"
            # At one speed either is the other: the delay comes first, which no law of the library
            # is, by as much as an unknown more has to explain (Schwarz).
            yield _Fault(Fault.CHANNEL, text, square * y.size ** (1.0 / y.size), 1)
    _, square = fitted(y - y.mean(), x, x**2 - np.mean(x**2), x**3 - np.mean(x**3))
    yield _Fault(Fault.CURVED_CHANNEL, "has a curved characteristic or saturates", square, 3)


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

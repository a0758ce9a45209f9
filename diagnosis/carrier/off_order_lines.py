"""Lines and bands off the shaft's orders: found in what a run holds without them, and taken out."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, product

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar
from scipy.special import gammaincc, gammaln

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, IntArray
from carrierflex.diagnosis.gap.findings import ALIASED, OffOrderMotion
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import aliased_order, highest_order
from carrierflex.identification.campaign.records import Run

#: Turns for each quantity that the orders follow, and samples for each of its columns: more of them
#: would take the lines beside too.
_TURNS_A_QUANTITY = 5.0
#: Highest order that is taken out, as steady waves, over the highest that follows the loads.
_HIGHEST_ORDER = 3
#: Degree of the slow drift of the offset that is taken out.
_DRIFT = 6
#: Samples of a run at most: those of a longer one are averaged in groups. Samples of all runs at
#: most, which are kept with some hundred columns of their orders while lines are looked for.
_MOST_SAMPLES, _MOST_SEARCHED = 60_000, 240_000
#: Change of a load over its size that lets the orders follow it.
_CHANGES = 1e-4
#: Directions of columns below this share of the largest are rounding.
_ALIKE = 1e-8
#: Lines of the spectrum for each line that the longest record resolves.
_FINER = 4
#: Resolved lines off the orders that stand for the surroundings of one, and the factor by which
#: their median may be too low.
_SURROUNDINGS = 60
_UNSURE = 1.5
#: Resolved lines beside an order, and from zero on, that are not looked at.
_NEAR_AN_ORDER = 2.0
_FROM_ZERO = 4.0
#: Share of the highest frequency of a record that is looked at.
_USABLE = 0.9
#: Probability of a line in noise, over the search, below which there is one.
_LARGEST_P = 1e-3
#: Power of a line over all that is off the orders, over all runs and channels, below which it is
#: left in the noise.
_MATERIAL = 0.03
#: Share of a motion that amplitudes fitted to other turns must predict.
_REPEATS = 0.5
#: Lines looked for at most: a band is several.
_MOST_CHOSEN = 24
#: A line stays at a frequency rather than at an order where it is that much stronger there.
_STAYS = 1.1
#: Lines of one kind within so many orders of the strongest, of the same sensors, are one band.
_ONE_BAND = 0.5
#: Share of a motion in one channel from which that channel alone shows it.
_ALONE = 0.9


@dataclass(frozen=True, eq=False)
class _Line:
    """Place of a line off the orders."""

    position: float  # Order [per turn], or frequency [Hz]
    is_order: bool  # Which of the two it keeps when the speed changes
    p_value: float = 0.0  # Probability that noise makes it

    @property
    def is_aliased(self) -> bool:
        """Whether it is an order above half the samples of a turn, the only whole number."""
        return self.is_order and float(self.position).is_integer()

    def order(self, speed: float) -> float:
        """Order at a speed [turns/s]."""
        return self.position if self.is_order else self.position / speed

    def phase(self, turns: FloatArray, time: FloatArray) -> FloatArray:
        """Phase at turns of the carrier and at times [rad]."""
        return np.asarray(2.0 * np.pi * self.position * (turns if self.is_order else time))


@dataclass(frozen=True, eq=False)
class OffOrderLine(_Line):
    """One line off the orders."""

    #: Amplitude, and standard deviation of either component by noise, by run and channel, shape
    #: (n_runs, C)
    amplitudes: np.ndarray = field(kw_only=True)
    errors: FloatArray = field(kw_only=True)


@dataclass(frozen=True, eq=False)
class RunOffOrders:
    """One run without its orders, at the samples that every channel has."""

    name: str  # Its name
    time: FloatArray  # Time [s], shape (n,)
    turns: FloatArray  # Turns of the carrier since the first sample of the run, growing, shape (n,)
    #: Gap of every channel without its orders, in the unit of the channel, shape (C, n)
    values: FloatArray
    orders: FloatArray  # Orthonormal basis of what was taken out, shape (n, k)

    @property
    def n_turns(self) -> float:
        """Turns of the carrier in all."""
        return float(self.turns[-1] - self.turns[0])

    @property
    def speed(self) -> float:
        """Mean speed [turns/s]."""
        return self.n_turns / float(self.time[-1] - self.time[0])

    @property
    def square(self) -> float:
        """Sum of squares over all channels."""
        return float((self.values**2).sum())

    def without_orders(self, waves: FloatArray) -> FloatArray:
        """Waves, shape (n, k), without what the orders could make of them."""
        return np.asarray(waves - self.orders @ (self.orders.T @ waves), dtype=np.float64)

    def waves(self, lines: Sequence[_Line]) -> FloatArray:
        """Cosine and sine of every line without the orders, shape (n, 2 n_lines)."""
        phases = [line.phase(self.turns, self.time) for line in lines]
        waves = [wave(phase) for phase in phases for wave in (np.cos, np.sin)]
        return self.without_orders(np.column_stack(waves))

    def power(self, line: _Line) -> float:
        """Sum of squares over all channels that a line takes off the orders."""
        basis = np.linalg.qr(self.waves([line]))[0]
        return float(((self.values @ basis) ** 2).sum())

    def without(self, lines: Sequence[_Line]) -> "RunOffOrders":
        """Run whose lines are fitted together and taken out."""
        waves = self.waves(lines)
        return replace(self, values=self.values - (waves @ _solved(waves, self.values)).T)


def _searched(campaign: Campaign) -> Sequence[int]:
    """Numbers of the runs that are searched: all, or some of them drawn, as many as may be kept."""
    n_runs = len(campaign.runs)
    samples = sum(min(run.time.size, _MOST_SAMPLES) for run in campaign.runs)
    share = _MOST_SEARCHED / samples
    if share >= 1.0:
        return range(n_runs)
    # Every tenth run may be of one condition.
    drawn = np.random.default_rng(0).permutation(n_runs)[: max(int(share * n_runs), 1)]
    return np.sort(drawn).tolist()


def _without_shared(
    made: Sequence[tuple[RunOffOrders, Sequence[FloatArray]]],
) -> Callable[[RunOffOrders, Sequence[FloatArray]], RunOffOrders]:
    """Takes out of a run what the orders make of the loads, with the same sizes in every run."""
    # A torque that ripples makes lines beside every order that follows it. A run too short to tell
    # how its orders follow the loads leaves them beside the orders; all runs together tell it, as
    # the size per newton metre is one.
    runs = [run for run, _ in made]
    n_turns = sum(run.n_turns for run in runs)
    n_loads = int(n_turns / _TURNS_A_QUANTITY) - 1
    if n_loads < 1:
        return lambda run, loaded: run
    followed = [np.hstack(loads[:n_loads]) for _, loads in made]
    table = np.vstack([run.without_orders(x) for run, x in zip(runs, followed, strict=True)])
    energy = np.sqrt((table**2).sum(axis=0))
    # What every run follows by itself is rounding here.
    counts = energy > _CHANGES * np.sqrt((np.vstack(followed) ** 2).sum(axis=0))
    if not counts.any():
        return lambda run, loaded: run
    values, energy = np.hstack([run.values for run in runs]).T, energy[counts]
    sizes = np.linalg.lstsq(table[:, counts] / energy, values, rcond=_ALIKE)[0]

    def without(run: RunOffOrders, loaded: Sequence[FloatArray]) -> RunOffOrders:
        """Run without them; `loaded` are its orders times each load, shape (n, k)."""
        columns = run.without_orders(np.hstack(loaded[:n_loads]))[:, counts]
        return replace(run, values=run.values - (columns / energy @ sizes).T)

    return without


def _runs_off_orders(
    campaign: Campaign, numbers: Iterable[int]
) -> Iterator[tuple[RunOffOrders, list[FloatArray]]]:
    """Runs that are long enough, each with its orders times each load that all runs share."""
    # 12 of three planets follow the loads.
    followed_orders = highest_order(int(campaign.rig["n_planets"]))
    for number in numbers:
        run = campaign.runs[number].within_use()
        made = _run_off_orders(run, campaign.channels, followed_orders)
        if made is not None:
            yield made


def _run_off_orders(
    run: Run, channels: tuple[Channel, ...], followed_orders: int
) -> tuple[RunOffOrders, list[FloatArray]] | None:
    """One run, and its orders times each load that all runs share; None where it is too short."""
    names = [channel.name for channel in channels]
    gap = np.array([run.signals[name] - run.predictions.get(name, 0.0) for name in names])
    present = np.isfinite(gap).all(axis=0)
    angle = run.inputs["carrier_angle"]
    turns = np.abs(angle - angle[0]) / (2.0 * np.pi)
    group = -(-int(present.sum()) // _MOST_SAMPLES) or 1
    loads = [run.inputs[name] for name in ("torque", "ntl_y", "ntl_z") if name in run.inputs]
    rows = (run.time, turns, angle, np.gradient(angle, run.time), *loads)
    time, turns, phase_angle, speed, torque, *radial = (
        _averaged(row[present], group) for row in rows
    )
    n_waves = 2 * followed_orders + 1
    n_samples = time.size
    n_turns = float(turns[-1] - turns[0]) if n_samples else 0.0
    fewest = min(n_turns, n_samples / n_waves) / _TURNS_A_QUANTITY
    if fewest < 1.0:
        return None
    waves = _order_waves(2.0 * np.pi * turns, followed_orders)
    # The most usual first.
    quantities = map(_centred, (torque, time, speed, *radial))
    followed = [np.ones(n_samples), *(row for row in quantities if row.any())]
    # A drift of the offset is slower than any line that is looked for.
    along = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    drift = np.polynomial.legendre.legvander(along, _DRIFT)[:, 1:]
    highest = min(_HIGHEST_ORDER * followed_orders, int(0.5 * _USABLE * n_samples / n_turns))
    above = 2.0 * np.pi * np.outer(turns, np.arange(followed_orders + 1, highest + 1))
    steady = [drift, np.cos(above), np.sin(above)]
    design = np.hstack([*steady, *(waves * row[:, None] for row in followed[: int(fewest)])])
    basis = np.linalg.qr(design)[0]
    values = np.array([_averaged(row[present], group) for row in gap])
    off_orders = RunOffOrders(run.name, time, turns, values - (values @ basis) @ basis.T, basis)
    shared = _order_waves(phase_angle, followed_orders)
    # Torque and radial load about their means, in their units, torque first.
    of_loads = [_centred(row) * float(np.std(row)) for row in (torque, *radial)]
    return off_orders, [shared * row[:, None] for row in of_loads]


def _order_waves(angle: FloatArray, highest: int) -> FloatArray:
    """Orders 0 to the highest of an angle [rad], shape (n, 2 highest + 1)."""
    phase = np.outer(angle, np.arange(1, highest + 1))
    return np.hstack([np.ones((angle.size, 1)), np.cos(phase), np.sin(phase)])


def _averaged(values: FloatArray, group: int) -> FloatArray:
    """Means of groups of neighbours."""
    groups = values[: values.size // group * group]
    return np.asarray(groups.reshape(-1, group).mean(axis=1), dtype=np.float64)


def _centred(values: FloatArray) -> FloatArray:
    """Values about their mean, of size one; zero where they do not change."""
    change = values - values.mean()
    size = float(np.sqrt(np.mean(change**2)))
    if not size > _CHANGES * float(np.abs(values).max()):
        return np.zeros_like(change)
    return np.asarray(change / size, dtype=np.float64)


def _log_tail(number: IntArray, total: FloatArray) -> FloatArray:
    """Log of the probability that ``Gamma(number)`` exceeds `total`; 0 where number is zero."""
    shape = np.maximum(number, 1).astype(np.float64)
    with np.errstate(divide="ignore"):
        exact = np.log(gammaincc(shape, total))
    # Beyond the smallest number of the machine the first term of the series is near enough.
    far = (shape - 1.0) * np.log(np.maximum(total, 1.0)) - total - gammaln(shape)
    log_p = np.where(np.isfinite(exact), exact, far)
    return np.asarray(np.where(number > 0, log_p, 0.0), dtype=np.float64)


def _surest_line(runs: Sequence[RunOffOrders], *, is_order: bool) -> tuple[_Line, float]:
    """Line least like noise in spectra over turns, or over time, and the resolution.

    That is the distance of lines that the longest record resolves, per turn or in Hz.
    """
    coordinates = [run.turns if is_order else run.time for run in runs]
    lengths = [float(axis[-1] - axis[0]) for axis in coordinates]
    resolution = 1.0 / max(lengths)
    highest = [
        _USABLE * 0.5 * (axis.size - 1) / length
        for axis, length in zip(coordinates, lengths, strict=True)
    ]
    # Longer records are searched at low frequencies only.
    n_lines = int(_FINER * min(np.ceil(max(highest) / resolution), _MOST_SAMPLES))
    axis: FloatArray = resolution / _FINER * np.arange(n_lines, dtype=np.float64)
    # Sums as the runs come: powers of all runs and channels would be several times the records.
    n_channels = len(runs[0].values)
    of_channel = np.zeros((n_channels, n_lines))
    n_runs = np.zeros(n_lines, dtype=np.int64)
    log_p = np.zeros(n_lines)
    for run, coordinate, length, end in zip(runs, coordinates, lengths, highest, strict=True):
        spacing = 1.0 if is_order else run.speed
        from_order = np.abs(axis - spacing * np.round(axis / spacing))
        is_off = (from_order > _NEAR_AN_ORDER / length) & (axis > _FROM_ZERO / length)
        allowed = is_off & (axis < end)
        power = np.array(
            [_relative_power(values, coordinate, axis, allowed) for values in run.values]
        )
        log_p = np.minimum(log_p, _log_tail(n_channels * allowed, power.sum(axis=0) / _UNSURE))
        of_channel += power
        n_runs += allowed
    for total in of_channel:
        log_p = np.minimum(log_p, _log_tail(n_runs, total / _UNSURE))
    log_p = np.minimum(log_p, _log_tail(n_runs * n_channels, of_channel.sum(axis=0) / _UNSURE))
    surest = int(np.argmin(log_p))
    n_tests = n_lines / _FINER * (1 + n_channels + len(runs))
    p_value = float(np.exp(min(log_p[surest] + np.log(n_tests), 0.0)))
    return _Line(float(axis[surest]), is_order, p_value), resolution


def _relative_power(
    values: FloatArray, coordinate: FloatArray, axis: FloatArray, allowed: BoolArray
) -> FloatArray:
    """Power of a signal at the allowed lines over the median of their surroundings."""
    result = np.zeros(axis.size)
    if not allowed.any():
        return result
    n = coordinate.size
    length = float(coordinate[-1] - coordinate[0])
    even = np.linspace(float(coordinate[0]), float(coordinate[-1]), n)
    level = np.interp(even, coordinate, values) * np.hanning(n)
    n_fft = int(2 ** np.ceil(np.log2(2 * _FINER * n)))
    lines = np.fft.rfftfreq(n_fft, length / (n - 1))
    power = np.interp(axis, lines, np.abs(np.fft.rfft(level, n_fft)) ** 2)[allowed]
    # Lines of this axis for each that the record resolves; medians of every second are as good.
    finer = max(int(1.0 / length / axis[1]), 1)
    step = max(finer // 2, 1)
    width = 2 * (_SURROUNDINGS * finer // step // 2) + 1
    typical = median_filter(power[::step], width, mode="nearest") / np.log(2.0)
    numbers = np.arange(power.size)
    surroundings = np.interp(numbers, numbers[::step], typical)
    result[allowed] = power / np.maximum(surroundings, np.finfo(float).tiny)
    return result


@dataclass(frozen=True, eq=False)
class OffOrders:
    """Motion off the orders, as lines and as bands."""

    campaign: Campaign  # The records without it
    #: Mean speed [turns/s] of every run that was searched, in the order of the amplitudes
    speeds: Mapping[str, float]
    motions: tuple[OffOrderMotion, ...]  # Single lines, and bands of several
    lines: tuple[tuple[OffOrderLine, ...], ...]  # Of each motion, the strongest first


def off_orders(campaign: Campaign) -> OffOrders:
    """Search for motion off the orders of the shaft.

    Orders 0 to 12 of the measured angle, of three planets, each of them following torque, time,
    speed and radial load as far as the run is long enough, and a slow drift are fitted to the run
    and subtracted: what a shape of the carrier or the housing, or an error of a sensor, could make
    is gone whatever its size. How the orders follow torque and radial load in runs too short to
    tell it is fitted to all runs together. Of a campaign too large for the memory some runs are
    searched, drawn over all.

    What follows looks at the records without the lines that are found: at the orders, and at a
    noise that no line is part of.
    """
    n_runs = len(campaign.runs)
    made = list(_runs_off_orders(campaign, _searched(campaign)))
    without_shared = _without_shared(made)
    runs = tuple(without_shared(*one) for one in made)
    speeds = {run.name: run.speed for run in runs}
    fast = _unresolved_order(runs)
    chosen = [_Line(float(fast), True)] if fast else []
    while runs and len(chosen) < _MOST_CHOSEN:
        line = _next_line([run.without(chosen) for run in runs] if chosen else runs)
        if line is None:
            break
        chosen.append(line)
    repeating, shares = _repeating(runs, chosen, speeds)
    if not repeating:
        return OffOrders(campaign, speeds, (), ())
    # Lines that stay are fitted anew without the others, to all runs.
    all_runs = (without_shared(*one) for one in _runs_off_orders(campaign, range(n_runs)))
    fitted, speeds = _fitted_lines(all_runs, [chosen[k] for band in repeating for k in band])
    in_turn = iter(fitted)
    lines = tuple(tuple(islice(in_turn, len(band))) for band in repeating)
    names = [channel.name for channel in campaign.channels]
    motions = tuple(
        _motion(band, speeds, names, share) for band, share in zip(lines, shares, strict=True)
    )
    return OffOrders(_cleaned(campaign, speeds, fitted), speeds, motions, lines)


def _unresolved_order(runs: Sequence[RunOffOrders]) -> int:
    """Order above half the samples of a turn that takes more than any line; 0 where none does."""
    order = aliased_order((run.values.T, 2.0 * np.pi * run.turns) for run in runs)
    if not order:
        return 0
    line = _next_line(runs)
    of_line = sum(run.power(line) for run in runs) if line else 0.0
    of_order = sum(run.power(_Line(order, True)) for run in runs)
    total = sum(run.square for run in runs)
    return order if of_order > max(_STAYS * of_line, _MATERIAL * total) else 0


def _repeating(
    runs: Sequence[RunOffOrders], chosen: Sequence[_Line], speeds: Mapping[str, float]
) -> tuple[list[tuple[int, ...]], list[float]]:
    """Bands whose amplitudes predict other turns, and the share of them that they predict."""
    if not chosen:
        return [], []
    # An order whose size changes from turn to turn has power beside it that lines can follow and
    # never predict: it is no line.
    repeating, shares = [], []
    for band in _bands(_fitted_lines(runs, chosen)[0], speeds):
        others = [line for k, line in enumerate(chosen) if k not in band]
        alone = [run.without(others) for run in runs] if others else list(runs)
        share = _explained(alone, [chosen[k] for k in band])
        if share >= _REPEATS:
            repeating.append(band)
            shares.append(share)
    return repeating, shares


def _next_line(runs: Sequence[RunOffOrders]) -> _Line | None:
    """The surest line; None where noise is left."""
    total = sum(run.square for run in runs)
    candidates = []
    for is_order in (True, False):
        surest, resolution = _surest_line(runs, is_order=is_order)
        if surest.p_value >= _LARGEST_P:
            continue
        # Its frequency, or its order, in the run that shows it most.
        speed = max(runs, key=lambda run: run.power(surest)).speed
        other = surest.position * speed if is_order else surest.position / speed
        for start in (surest, _Line(other, not is_order, surest.p_value)):
            line, power = _refined(runs, start, resolution)
            if power > _MATERIAL * total and not _is_an_order(runs, line):
                candidates.append((power if line.is_order else power / _STAYS, line))
    return max(candidates, key=lambda one: one[0])[1] if candidates else None


def _is_an_order(runs: Sequence[RunOffOrders], line: _Line) -> bool:
    """Whether a line is nearer to an order than every run resolves."""
    orders = [line.order(run.speed) for run in runs]
    return all(abs(n - round(n)) * run.n_turns <= 1.0 for n, run in zip(orders, runs, strict=True))


def _refined(runs: Sequence[RunOffOrders], line: _Line, resolution: float) -> tuple[_Line, float]:
    """Line at which a wave takes most of the power, and that power."""
    half = 2.0 * resolution
    lowest = max(line.position - half, _FROM_ZERO * resolution)
    best = minimize_scalar(
        lambda position: -sum(run.power(replace(line, position=position)) for run in runs),
        bounds=(lowest, max(line.position, lowest) + half),
        method="bounded",
        options={"xatol": 1e-6},
    )
    return replace(line, position=float(best.x)), -float(best.fun)


def _solved(waves: FloatArray, values: FloatArray) -> FloatArray:
    """Sizes of the waves in every channel, shape (2 n_lines, C)."""
    return np.asarray(np.linalg.lstsq(waves, values.T, rcond=_ALIKE)[0], dtype=np.float64)


def _fitted_lines(
    runs: Iterable[RunOffOrders], chosen: Sequence[_Line]
) -> tuple[tuple[OffOrderLine, ...], dict[str, float]]:
    """Amplitudes of all lines, fitted together off the orders, and their errors."""
    amplitudes, errors, speeds = [], [], {}
    for run in runs:
        waves = run.waves(chosen)
        sizes = _solved(waves, run.values)
        amplitudes.append(sizes[::2] - 1j * sizes[1::2])
        variance = np.mean((run.values - (waves @ sizes).T) ** 2, axis=1)
        errors.append(np.sqrt(2.0 * variance / run.time.size))
        speeds[run.name] = run.speed
    by_line = np.moveaxis(np.array(amplitudes), 0, 1)
    lines = tuple(
        OffOrderLine(**vars(line), amplitudes=of_line, errors=np.array(errors))
        for line, of_line in zip(chosen, by_line, strict=True)
    )
    return lines, speeds


def _explained(runs: Sequence[RunOffOrders], chosen: Sequence[_Line]) -> float:
    """Share of the lines' power that amplitudes of half of the turns predict in the other."""
    before = after = noise = 0.0
    for run in runs:
        waves = run.waves(chosen)
        rest = run.values - (waves @ _solved(waves, run.values)).T
        is_even = (run.turns // 4.0) % 2.0 == 0.0
        for training in (is_even, ~is_even):
            if training.sum() <= waves.shape[1] or training.all():
                continue
            scored = ~training
            sizes = _solved(waves[training], run.values[:, training])
            missed = run.values[:, scored] - (waves[scored] @ sizes).T
            before += float((run.values[:, scored] ** 2).sum())
            after += float((missed**2).sum())
            noise += float((rest[:, scored] ** 2).sum())
    return float(np.clip((before - after) / max(before - noise, np.finfo(float).tiny), 0.0, 1.0))


def _bands(
    lines: Sequence[OffOrderLine], speeds: Mapping[str, float]
) -> tuple[tuple[int, ...], ...]:
    """Lines that are one motion: near to one another, in the same sensors."""
    speed = float(np.mean(list(speeds.values())))
    orders = [line.order(speed) for line in lines]
    power = [float((np.abs(line.amplitudes) ** 2).sum()) for line in lines]
    bands: list[list[int]] = []
    for k in sorted(range(len(lines)), key=lambda k: -power[k]):
        for band in bands:
            is_near = abs(orders[band[0]] - orders[k]) < _ONE_BAND
            if is_near and _channel_alone(lines[band[0]]) == _channel_alone(lines[k]):
                band.append(k)
                break
        else:
            bands.append([k])
    return tuple(map(tuple, bands))


def _channel_alone(*lines: OffOrderLine) -> int | None:
    """Number of the channel that alone shows some lines; None where several do."""
    power = sum((np.abs(line.amplitudes) ** 2).sum(axis=0) for line in lines)
    largest = int(np.argmax(power))
    return largest if power.size > 1 and power[largest] > _ALONE * power.sum() else None


def _motion(
    lines: Sequence[OffOrderLine],
    speeds: Mapping[str, float],
    names: Sequence[str],
    explained: float,
) -> OffOrderMotion:
    """Motion of lines that belong together, the strongest first."""
    first = lines[0]
    alone = _channel_alone(*lines)
    label = f"{first.position:.2f}X" if first.is_order else f"{first.position:.3g}Hz"
    frame = "nonsynchronous" if alone is None else "channel"
    if first.is_aliased:
        frame, label = ALIASED, f"{first.position:.0f}X"
    squares = sum(0.5 * np.abs(line.amplitudes) ** 2 for line in lines)
    is_shown = np.abs(first.amplitudes).max(axis=1) > 4.0 * first.errors.max(axis=1)
    pairs = product(lines, speeds.values())
    bands = [line.position * (speed if line.is_order else 1.0) for line, speed in pairs]
    return OffOrderMotion(
        id=f"{frame}/{label}",
        label=label,
        channels=tuple(names) if alone is None else (names[alone],),
        runs=tuple(run for run, ok in zip(speeds, is_shown, strict=True) if ok),
        is_in_every_run=bool(is_shown.all()),
        band_hz=(min(bands), max(bands)),
        mean_square=dict(zip(speeds, squares.mean(axis=1).tolist(), strict=True)),
        explained=explained,
        p_value=first.p_value,
    )


def _cleaned(
    campaign: Campaign, speeds: Mapping[str, float], lines: Sequence[OffOrderLine]
) -> Campaign:
    """Campaign whose signals are without the lines."""
    number = {name: r for r, name in enumerate(speeds)}
    cleaned = []
    for run in campaign.runs:
        signals = dict(run.signals)
        if run.name in number:
            angle = run.inputs["carrier_angle"]
            turns = np.abs(angle - angle[0]) / (2.0 * np.pi)
            for line in lines:
                wave = np.exp(1j * line.phase(turns, run.time))
                for c, channel in enumerate(campaign.channels):
                    amplitude = line.amplitudes[number[run.name], c]
                    signals[channel.name] = signals[channel.name] - (amplitude * wave).real
        cleaned.append(run.with_signals(signals))
    return replace(campaign, runs=tuple(cleaned))

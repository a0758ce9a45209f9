"""Lines and bands beside the shaft's orders, found one after the other and taken out."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from carrierflex.diagnosis.carrier.off_orders.records import BesideOrders, FloatArray, beside_orders
from carrierflex.diagnosis.carrier.off_orders.spectra import (
    FROM_ZERO,
    spectra_over_time,
    spectra_over_turns,
)
from carrierflex.diagnosis.gap.off_order_motion import OffOrderMotion
from carrierflex.identification.campaign.campaign import Campaign

#: Position of a line, whether it is an order, p-value.
Found = tuple[float, bool, float]
#: Probability of a line in noise, over the whole search, below which there is one.
_FOUND = 1e-3
#: Power of a line over all that is beside the orders, over all runs and channels, below which it is
#: left in the noise.
_MATERIAL = 0.03
#: Share of a motion that amplitudes fitted to other turns must predict.
_REPEATS = 0.5
#: Lines looked for at most: a band is several.
_MOST_LINES = 24
#: A line stays at a frequency rather than at an order where it is that much stronger there.
_STAYS = 1.1
#: Lines of one kind within so many orders of the strongest, of the same sensors, are one band.
_ONE_BAND = 0.5
#: Share of a motion in one channel from which that channel alone shows it.
_ALONE = 0.9


@dataclass(frozen=True, eq=False)
class OffOrderLine:
    """One line beside the orders.

    Parameters
    ----------
    position : float
        Order [per turn], or frequency [Hz].
    is_order : bool
        Which of the two it keeps when the speed changes.
    p_value : float
        Probability that noise makes it.
    amplitudes : ndarray of complex, shape (n_runs, C)
        Amplitude by run and channel.
    errors : ndarray, shape (n_runs, C)
        Standard deviation of either component by noise.
    """

    position: float
    is_order: bool
    p_value: float
    amplitudes: np.ndarray
    errors: FloatArray


@dataclass(frozen=True, eq=False)
class OffOrders:
    """Everything found beside the orders.

    Parameters
    ----------
    campaign : Campaign
        The records without it.
    speeds : mapping of str to float
        Mean speed [turns/s] of every run that was searched, in the order of the amplitudes.
    lines : tuple of OffOrderLine
        Lines, the surest first.
    motions : tuple of OffOrderMotion
        The lines as motions: single lines, and bands of several.
    members : tuple of tuple of int
        Lines of each motion.
    """

    campaign: Campaign
    speeds: Mapping[str, float]
    lines: tuple[OffOrderLine, ...]
    motions: tuple[OffOrderMotion, ...]
    members: tuple[tuple[int, ...], ...]


def off_orders(campaign: Campaign) -> OffOrders:
    """Search for motion beside the orders of the shaft.

    Parameters
    ----------
    campaign : Campaign
        Records.

    Returns
    -------
    OffOrders
        Lines, and the records without them: what follows looks at the orders, and at a noise that
        no line is part of.
    """
    beside = beside_orders(campaign)
    runs = beside.searched
    speeds = {run.name: run.speed for run in runs}
    if not runs:
        return OffOrders(campaign, speeds, (), (), ())
    left = runs
    found: list[Found] = []
    while len(found) < _MOST_LINES:
        line = _next_line(left)
        if line is None:
            break
        found.append(line)
        left = tuple(_without(run, found) for run in runs)
    if not found:
        return OffOrders(campaign, speeds, (), (), ())
    lines, _ = _fitted_lines(runs, found)
    kept, shares = _repeating(runs, found, _bands(lines, speeds))
    if not kept:
        return OffOrders(campaign, speeds, (), (), ())
    # Lines that stay are fitted anew without the others, and numbered anew.
    numbers = [k for own in kept for k in own]
    lines, speeds = _fitted_lines(beside.every(), [found[k] for k in numbers])
    members = tuple(tuple(numbers.index(k) for k in own) for own in kept)
    names = [channel.name for channel in campaign.channels]
    motions = tuple(
        _motion([lines[k] for k in own], speeds, names, share)
        for own, share in zip(members, shares, strict=True)
    )
    return OffOrders(_cleaned(campaign, speeds, lines), speeds, lines, motions, members)


def _repeating(
    runs: Sequence[BesideOrders], found: Sequence[Found], bands: Sequence[tuple[int, ...]]
) -> tuple[list[tuple[int, ...]], list[float]]:
    """Bands whose amplitudes predict other turns, and the share of them that they predict.

    An order whose size changes from turn to turn has power beside it that lines can follow and
    never predict: it is no line.
    """
    kept, shares = [], []
    for band in bands:
        others = [line for k, line in enumerate(found) if k not in band]
        alone = [_without(run, others) for run in runs] if others else list(runs)
        share = _explained(alone, [found[k] for k in band])
        if share >= _REPEATS:
            kept.append(band)
            shares.append(share)
    return kept, shares


def _next_line(runs: Sequence[BesideOrders]) -> Found | None:
    """Position, whether it is an order, p-value of the surest line; None where noise is left."""
    over_turns, over_time = spectra_over_turns(runs), spectra_over_time(runs)
    whole = sum(float((run.values**2).sum()) for run in runs)
    candidates = []
    for spectra, is_order in ((over_turns, True), (over_time, False)):
        position, p_value = spectra.best_line()
        if p_value >= _FOUND:
            continue
        other = _in_other_unit(runs, position, is_order)
        for start, keeps_order in ((position, is_order), (other, not is_order)):
            place, power = _refined(runs, start, spectra.resolution, keeps_order)
            if power > _MATERIAL * whole and not _is_an_order(runs, place, keeps_order):
                preferred = power if keeps_order else power / _STAYS
                candidates.append((preferred, place, keeps_order, p_value))
    if not candidates:
        return None
    _, position, is_order, p_value = max(candidates)
    return position, is_order, p_value


def _is_an_order(runs: Sequence[BesideOrders], position: float, is_order: bool) -> bool:
    """Whether a line is nearer to an order than every run resolves."""
    for run in runs:
        order = position if is_order else position / run.speed
        if abs(order - round(order)) * float(run.turns[-1] - run.turns[0]) > 1.0:
            return False
    return True


def _in_other_unit(runs: Sequence[BesideOrders], position: float, is_order: bool) -> float:
    """Frequency of an order, or order of a frequency, in the run that shows it most."""
    clearest = max(runs, key=lambda run: _wave_power(run, position, is_order))
    return position * clearest.speed if is_order else position / clearest.speed


def _refined(
    runs: Sequence[BesideOrders], position: float, resolution: float, is_order: bool
) -> tuple[float, float]:
    """Position at which a wave takes most of the power, and that power."""

    def lost(trial: float) -> float:
        """Power that the wave leaves, up to a constant."""
        return -sum(_wave_power(run, trial, is_order) for run in runs)

    half = 2.0 * resolution
    lowest = max(position - half, FROM_ZERO * resolution)
    best = minimize_scalar(
        lost,
        bounds=(lowest, max(position, lowest) + half),
        method="bounded",
        options={"xatol": 1e-6},
    )
    return float(best.x), -float(best.fun)


def _wave_power(run: BesideOrders, position: float, is_order: bool) -> float:
    """Sum of squares over all channels that a wave takes beside the orders."""
    basis = np.linalg.qr(run.beside(_waves(run, [(position, is_order, 0.0)])))[0]
    return float(((run.values @ basis) ** 2).sum())


def _waves(run: BesideOrders, found: Sequence[Found]) -> FloatArray:
    """Cosine and sine of every line, shape (n, 2 n_lines)."""
    phases = [
        2.0 * np.pi * position * (run.turns if is_order else run.time)
        for position, is_order, _ in found
    ]
    return np.column_stack([wave(phase) for phase in phases for wave in (np.cos, np.sin)])


def _solved(waves: FloatArray, values: FloatArray) -> FloatArray:
    """Sizes of the waves in every channel, shape (2 n_lines, C)."""
    return np.asarray(np.linalg.lstsq(waves, values.T, rcond=1e-8)[0], dtype=np.float64)


def _without(run: BesideOrders, found: Sequence[Found]) -> BesideOrders:
    """Run whose lines are fitted together and taken out."""
    waves = run.beside(_waves(run, found))
    return replace(run, values=run.values - (waves @ _solved(waves, run.values)).T)


def _fitted_lines(
    runs: Iterable[BesideOrders], found: Sequence[Found]
) -> tuple[tuple[OffOrderLine, ...], dict[str, float]]:
    """Amplitudes of all lines, fitted together beside the orders, and their errors.

    With them the mean speed [turns/s] of every run, in their order.
    """
    amplitudes = []
    errors = []
    speeds = {}
    for run in runs:
        waves = run.beside(_waves(run, found))
        sizes = _solved(waves, run.values)
        amplitudes.append(sizes[::2] - 1j * sizes[1::2])
        variance = np.mean((run.values - (waves @ sizes).T) ** 2, axis=1)
        errors.append(np.sqrt(2.0 * variance / run.time.size))
        speeds[run.name] = run.speed
    by_line = np.moveaxis(np.array(amplitudes), 0, 1)
    lines = tuple(
        OffOrderLine(position, is_order, p_value, by_line[k], np.array(errors))
        for k, (position, is_order, p_value) in enumerate(found)
    )
    return lines, speeds


def _explained(runs: Sequence[BesideOrders], found: Sequence[Found]) -> float:
    """Share of the lines' power that amplitudes fitted to half of the turns predict in the other.

    Turns are taken by fours; both halves predict each other.
    """
    before = after = noise = 0.0
    for run in runs:
        waves = run.beside(_waves(run, found))
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
    orders = [line.position if line.is_order else line.position / speed for line in lines]
    power = [float((np.abs(line.amplitudes) ** 2).sum()) for line in lines]
    bands: list[list[int]] = []
    for k in sorted(range(len(lines)), key=lambda k: -power[k]):
        own = next(
            (
                band
                for band in bands
                if abs(orders[band[0]] - orders[k]) < _ONE_BAND
                and _channel_alone(lines[band[0]]) == _channel_alone(lines[k])
            ),
            None,
        )
        if own is None:
            bands.append([k])
        else:
            own.append(k)
    return tuple(tuple(band) for band in bands)


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
    squares = sum(0.5 * np.abs(line.amplitudes) ** 2 for line in lines)
    is_shown = np.abs(first.amplitudes).max(axis=1) > 4.0 * first.errors.max(axis=1)
    bands = [
        line.position * (speed if line.is_order else 1.0)
        for line in lines
        for speed in speeds.values()
    ]
    return OffOrderMotion(
        id=f"{'nonsynchronous' if alone is None else 'channel'}/{label}",
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
                phase = 2.0 * np.pi * line.position * (turns if line.is_order else run.time)
                wave = np.exp(1j * phase)
                for c, channel in enumerate(campaign.channels):
                    amplitude = line.amplitudes[number[run.name], c]
                    signals[channel.name] = signals[channel.name] - (amplitude * wave).real
        cleaned.append(run.with_signals(signals))
    return replace(campaign, runs=tuple(cleaned))

"""Faults of a measuring chain by kind and size, as changes of a campaign.

A unit is wrong the way it is in practice: a channel written in mm or um under m, a torque in kN m,
time in ms, an angle in degrees.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]
Change = Callable[[Campaign, np.random.Generator], Campaign]


@dataclass(frozen=True)
class Fault:
    """One fault of one size: `name`, `size` in words, and how it changes a campaign."""

    name: str
    size: str
    change: Change


def faults_of(kind: str) -> tuple[Fault, ...]:
    """Faults of a kind of campaign.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.

    Returns
    -------
    tuple of Fault
        In the order of the table in docs/reliability.md.
    """
    faults = [
        Fault("sign of the load turned", "-", _input_scaled(-1.0)),
        *(Fault("unit of a channel", f"{f:g}", _channel_scaled(f)) for f in (1e3, 1e6)),
        *(Fault("unit of an input", f"{f:g}", _input_scaled(1.0 / f)) for f in (1e3, 1e6)),
        *(Fault("unit of time", f"{f:g}", _time_scaled(f)) for f in (1e3, 1e6)),
        *(Fault("gain of a channel", f"{g:.0%}", _channel_scaled(1.0 + g)) for g in (0.05, 0.3)),
        *(Fault("gain of an input", f"{g:.0%}", _input_scaled(1.0 + g)) for g in (0.05, 0.3)),
        *(Fault("clock of one file drifts", f"{d * 1e3:g} ms", _late(0.0, d)) for d in _DELAYS),
        *(Fault("constant delay", f"{d * 1e3:g} ms", _late(d, 0.0)) for d in _DELAYS),
        Fault("clipped", "70 %", _on_channel(_clipped)),
        *(Fault("quantised", f"{q:g} floors", _quantised(q)) for q in (2.0, 20.0)),
        Fault("stuck", "5 %", _on_channel(_stuck)),
        *(Fault("dropouts as zeros", f"{s:.1%}", _lost(s, zero=True)) for s in _SHARES),
        *(Fault("dropouts as last value", f"{s:.1%}", _lost(s, zero=False)) for s in _SHARES),
        *(Fault("outliers", f"{s:.1%}", _spikes(s)) for s in _SHARES),
        *(Fault("mains hum", f"{a:g} floors", _tone(50.0, a)) for a in (2.0, 10.0)),
        *(Fault("other tone", f"{a:g} floors", _tone(7.37, a)) for a in (2.0, 10.0)),
        *(Fault("run copied", f"{a:g} floors of new noise", _copied(a)) for a in (0.0, 1.0)),
        Fault("signals of two runs exchanged", "-", _runs_exchanged),
        Fault("sampled too slowly", "each fourth sample", _thinned(4)),
        *(Fault("declared noise", f"x{f:g}", _noise_scaled(f)) for f in (0.1, 10.0)),
    ]
    return (*faults, *_own(kind))


_DELAYS = (0.005, 0.05)
_SHARES = (0.001, 0.01)


def _own(kind: str) -> list[Fault]:
    """Faults that only some kinds can have."""
    order = [
        Fault("two sensors exchanged", "-", _sensors_moved((1, 0))),
        Fault("all sensors one place on", "-", _sensors_moved(None)),
        Fault("angle counted the other way", "-", _column_scaled("carrier_angle", -1.0)),
    ]
    if kind == "carrier":
        degrees = float(np.rad2deg(1.0))
        return [
            *order,
            Fault("unit of the angle", "57.3", _column_scaled("carrier_angle", degrees)),
            *(Fault("radius off", f"x{f:g}", _radius_scaled(f)) for f in (1.1, 1e3)),
            Fault("number of planets", "4", _rig(n_planets=4)),
        ]
    if kind == "mounting":
        return [
            *order,
            *(Fault("arm off", f"x{f:g}", _arm_scaled(f)) for f in (1.1, 1e3)),
            Fault("zeroing samples", "x4", _rig_scaled("zeroing_samples", 4)),
        ]
    return [Fault("period stated", "500", _rig(periodic=True, period_samples=500))]


def _load(campaign: Campaign) -> str:
    """The input that loads: torque, or the drive of an element."""
    names = tuple(campaign.contract.inputs)
    return "torque" if "torque" in names else names[0]


def _runs(campaign: Campaign, change: Callable[[Run], Run]) -> Campaign:
    return replace(campaign, runs=tuple(change(run) for run in campaign.runs))


def _with_input(run: Run, name: str, values: FloatArray) -> Run:
    return replace(run, inputs={**run.inputs, name: values})


def _with_signal(run: Run, name: str, values: FloatArray) -> Run:
    return replace(run, signals={**run.signals, name: values})


def _column_scaled(name: str, factor: float) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        return _runs(campaign, lambda run: _with_input(run, name, factor * run.inputs[name]))

    return change


def _input_scaled(factor: float) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        return _column_scaled(_load(campaign), factor)(campaign, rng)

    return change


def _on_channel(change_signal: Callable[[FloatArray, np.random.Generator], FloatArray]) -> Change:
    """Change of the second channel, or of the only one."""

    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        name = campaign.channels[min(2, len(campaign.channels) - 1)].name
        return _runs(
            campaign,
            lambda run: _with_signal(run, name, change_signal(run.signals[name].copy(), rng)),
        )

    return change


def _channel_scaled(factor: float) -> Change:
    return _on_channel(lambda values, rng: factor * values)


def _time_scaled(factor: float) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        return _runs(campaign, lambda run: replace(run, time=factor * run.time))

    return change


def _late(delay: float, drift: float) -> Change:
    """Signals late by `delay` [s] in all runs, or by up to `drift` [s] in the last one."""

    def late(run: Run, by: FloatArray) -> Run:
        signals = {
            name: np.interp(run.time - by, run.time, values) for name, values in run.signals.items()
        }
        return replace(run, signals=signals)

    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        if drift:
            last = campaign.runs[-1]
            growing = drift * (last.time - last.time[0]) / np.ptp(last.time)
            return replace(campaign, runs=(*campaign.runs[:-1], late(last, growing)))
        return _runs(campaign, lambda run: late(run, np.full(run.time.size, delay)))

    return change


def _clipped(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    middle, half = 0.5 * (values.max() + values.min()), 0.5 * np.ptp(values)
    return np.clip(values, middle - 0.7 * half, middle + 0.7 * half)


def _stuck(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    first = int(rng.integers(values.size // 3, values.size // 2))
    values[first : first + values.size // 20] = values[first]
    return values


def _quantised(floors: float) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        for channel in campaign.channels:
            step = floors * float(channel.noise_std or 0.0)

            def on_grid(run: Run, name: str = channel.name, step: float = step) -> Run:
                return _with_signal(run, name, step * np.round(run.signals[name] / step))

            campaign = _runs(campaign, on_grid)
        return campaign

    return change


def _lost(share: float, *, zero: bool) -> Change:
    def lose(values: FloatArray, rng: np.random.Generator) -> FloatArray:
        lost = np.sort(
            rng.choice(np.arange(1, values.size), max(1, int(share * values.size)), False)
        )
        values[lost] = 0.0 if zero else values[lost - 1]
        return values

    return _on_channel(lose)


def _spikes(share: float) -> Change:
    def add(values: FloatArray, rng: np.random.Generator) -> FloatArray:
        hit = rng.choice(values.size, max(1, int(share * values.size)), False)
        size = np.ptp(values) * rng.uniform(1.0, 3.0, hit.size)
        values[hit] += size * rng.choice((-1.0, 1.0), hit.size)
        return values

    return _on_channel(add)


def _tone(frequency_hz: float, floors: float) -> Change:
    """A tone of an amplitude in noise floors on all channels."""

    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        for channel in campaign.channels:
            size = floors * float(channel.noise_std or 0.0)

            def humming(run: Run, name: str = channel.name, size: float = size) -> Run:
                phase = 2.0 * np.pi * frequency_hz * run.time + rng.uniform(0.0, 2.0 * np.pi)
                return _with_signal(run, name, run.signals[name] + size * np.sin(phase))

            campaign = _runs(campaign, humming)
        return campaign

    return change


def _copied(floors: float) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        first = campaign.runs[0]
        signals = {
            channel.name: first.signals[channel.name]
            + floors * float(channel.noise_std or 0.0) * rng.standard_normal(first.time.size)
            for channel in campaign.channels
        }
        copy = replace(
            first, name="copy", file="copy.parquet", condition="another day", signals=signals
        )
        return replace(campaign, runs=(*campaign.runs, copy))

    return change


def _runs_exchanged(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    first, second, *others = campaign.runs if len(campaign.runs) > 1 else campaign.runs * 2
    if first is second or first.time.size != second.time.size:
        return campaign
    exchanged = (
        replace(first, signals=second.signals, predictions=second.predictions),
        replace(second, signals=first.signals, predictions=first.predictions),
    )
    return replace(campaign, runs=(*exchanged, *others))


def _thinned(every: int) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        def thin(columns: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
            return {name: values[::every] for name, values in columns.items()}

        return _runs(
            campaign,
            lambda run: replace(
                run, time=run.time[::every], inputs=thin(run.inputs), signals=thin(run.signals)
            ),
        )

    return change


def _noise_scaled(factor: float) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        channels = tuple(
            replace(channel, noise_std=factor * float(channel.noise_std or 0.0))
            for channel in campaign.channels
        )
        return replace(campaign, channels=channels)

    return change


def _sensors_moved(order: tuple[int, ...] | None) -> Change:
    """First sensors in another order, or all one place on."""

    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        names = [channel.name for channel in campaign.channels]
        moved = [*names[1:], names[0]]
        if order is not None:
            # Of a mounting the third and fourth sensor, which move most.
            first = 2 if campaign.kind == "mounting" else 0
            moved = names.copy()
            moved[first : first + 2] = [names[first + k] for k in order]
        return _runs(
            campaign,
            lambda run: replace(
                run,
                signals={
                    name: run.signals[other] for name, other in zip(names, moved, strict=True)
                },
            ),
        )

    return change


def _radius_scaled(factor: float) -> Change:
    def change(campaign: Campaign, rng: np.random.Generator) -> Campaign:
        channels = tuple(
            replace(channel, radius=factor * float(channel.radius or 0.0))
            for channel in campaign.channels
        )
        return replace(campaign, channels=channels)

    return change


def _rig(**values: Any) -> Change:
    return lambda campaign, rng: replace(campaign, rig={**campaign.rig, **values})


def _rig_scaled(name: str, factor: float) -> Change:
    return lambda campaign, rng: _rig(**{name: campaign.rig[name] * factor})(campaign, rng)


def _arm_scaled(factor: float) -> Change:
    return _rig_scaled("R_x", factor)

"""Faults of a measuring chain by kind and size, as changes of a campaign.

A unit is wrong the way it is in practice: a channel written in mm or um under m, a torque in kN m,
time in ms, an angle in degrees.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.tones import is_driven
from carrierflex.simulation.sensing import at_other_times

FloatArray = NDArray[np.float64]
Change = Callable[[Campaign, np.random.Generator], Campaign]
#: A signal of one run and its changed copy.
SignalChange = Callable[[FloatArray, np.random.Generator], FloatArray]

_DELAYS = (0.005, 0.05)
_SHARES = (0.001, 0.01)
_MAINS_HZ = 50.0
_RADIAL = ("ntl_y", "ntl_z")
#: Frequencies between the orders of every rig of the blind check [Hz].
_BETWEEN_ORDERS_HZ = (7.37, 9.13, 11.71)


@dataclass(frozen=True)
class Fault:
    """One fault of one size.

    Parameters
    ----------
    name, size : str
        Fault and its size in words.
    change : callable
        ``(campaign, rng) -> campaign`` with the fault.
    ids : tuple of str
        Effects of the library that are this fault: a diagnosis that names one of them, or its
        class, has reported it. Of an error of practice also classes, ids and checks of findings.
    """

    name: str
    size: str
    change: Change
    ids: tuple[str, ...] = ()


def faults_of(kind: str) -> tuple[Fault, ...]:
    """Faults of a kind of campaign.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.

    Returns
    -------
    tuple of Fault
        Scale, time, samples, runs, then those of the kind.
    """
    return (
        *_faults_of_scale(),
        *_faults_of_time(),
        *_faults_of_samples(),
        *_faults_of_runs(),
        *_faults_of_the_kind(kind),
    )


def _faults_of_scale() -> Iterator[Fault]:
    """Signs, units and gains."""
    yield Fault("sign of the load turned", "-", partial(_load_scaled, factor=-1.0))
    for unit in (1e3, 1e6):
        change = partial(_signal_changed, change=partial(_scaled, factor=unit))
        yield Fault("unit of a channel", f"{unit:g}", change)
    for unit in (1e3, 1e6):
        yield Fault("unit of an input", f"{unit:g}", partial(_load_scaled, factor=1.0 / unit))
    for unit in (1e3, 1e6):
        yield Fault("unit of time", f"{unit:g}", partial(_time_scaled, factor=unit))
    for gain in (0.05, 0.3):
        change = partial(_signal_changed, change=partial(_scaled, factor=1.0 + gain))
        yield Fault("gain of a channel", f"{gain:.0%}", change, ("sensor_gain",))
    for gain in (0.05, 0.3):
        yield Fault("gain of an input", f"{gain:.0%}", partial(_load_scaled, factor=1.0 + gain))


def _faults_of_time() -> Iterator[Fault]:
    """Clocks and rates."""
    for delay in _DELAYS:
        change = partial(_last_run_drifting, drift=delay)
        yield Fault("clock of one file drifts", f"{delay * 1e3:g} ms", change)
    for delay in _DELAYS:
        change = partial(_delayed, delay=delay)
        yield Fault("constant delay", f"{delay * 1e3:g} ms", change, ("sensor_delay", "delay"))
    yield Fault("sampled too slowly", "each fourth sample", partial(_thinned, every=4))


def _faults_of_samples() -> Iterator[Fault]:
    """Single samples, tones and the declared noise."""
    yield Fault("clipped", "70 %", partial(_signal_changed, change=_clipped))
    for floors in (2.0, 20.0):
        yield Fault("quantised", f"{floors:g} floors", partial(_quantised, floors=floors))
    yield Fault("stuck", "5 %", partial(_signal_changed, change=_stuck))
    for share in _SHARES:
        change = partial(_signal_changed, change=partial(_zeroed, share=share))
        yield Fault("dropouts as zeros", f"{share:.1%}", change)
    for share in _SHARES:
        change = partial(_signal_changed, change=partial(_with_last_value, share=share))
        yield Fault("dropouts as last value", f"{share:.1%}", change)
    for share in _SHARES:
        change = partial(_signal_changed, change=partial(_with_spikes, share=share))
        yield Fault("outliers", f"{share:.1%}", change)
    for name, frequency in (("mains hum", _MAINS_HZ), ("other tone", None)):
        for floors in (2.0, 10.0):
            change = partial(_with_tone, frequency_hz=frequency, floors=floors)
            yield Fault(name, f"{floors:g} floors", change)
    for factor in (0.1, 10.0):
        change = partial(_channels_scaled, field="noise_std", factor=factor)
        yield Fault("declared noise", f"x{factor:g}", change)


def _faults_of_runs() -> Iterator[Fault]:
    """Runs that are not what their names say."""
    for floors in (0.0, 1.0):
        change = partial(_first_run_copied, floors=floors)
        yield Fault("run copied", f"{floors:g} floors of new noise", change)
    yield Fault("signals of two runs exchanged", "-", _runs_exchanged)


def _faults_of_the_kind(kind: str) -> Iterator[Fault]:
    """Faults that only some kinds can have."""
    if kind == "element":
        change = partial(_rig_changed, values={"periodic": True, "period_samples": 500})
        yield Fault("period stated", "500", change)
        return
    yield from _faults_of_lone_channels()
    yield from _faults_of_loads()
    angle = "carrier_angle"
    yield Fault("two sensors exchanged", "-", _two_sensors_exchanged)
    yield Fault("all sensors one place on", "-", _sensors_moved_on)
    backwards = partial(_input_scaled, name=angle, factor=-1.0)
    yield Fault("angle counted the other way", "-", backwards)
    if kind == "carrier":
        for zero_deg in (2.0, 10.0):
            change = partial(_input_moved, name=angle, by=float(np.deg2rad(zero_deg)))
            yield Fault("zero of the angle", f"{zero_deg:g} degrees", change)
        for size_deg in (1.0, 5.0):
            change = partial(_encoder_eccentric, size=float(np.deg2rad(size_deg)))
            yield Fault("eccentric encoder", f"{size_deg:g} degrees", change)
        degrees = float(np.rad2deg(1.0))
        in_degrees = partial(_input_scaled, name=angle, factor=degrees)
        yield Fault("unit of the angle", "57.3", in_degrees)
        for factor in (1.1, 1e3):
            change = partial(_channels_scaled, field="radius", factor=factor)
            yield Fault("radius off", f"x{factor:g}", change)
        yield Fault("number of planets", "4", partial(_rig_changed, values={"n_planets": 4}))
    else:
        for factor in (1.1, 1e3):
            yield Fault("arm off", f"x{factor:g}", partial(_rig_scaled, name="R_x", factor=factor))
        change = partial(_rig_scaled, name="zeroing_samples", factor=4)
        yield Fault("zeroing samples", "x4", change)


def _faults_of_lone_channels() -> Iterator[Fault]:
    """Faults of one channel of several."""
    changes: dict[str, Callable[[Campaign, Run, str], FloatArray]] = {
        "polarity of a channel": lambda campaign, run, name: -run.signals[name],
        "dead channel": lambda campaign, run, name: 0.0 * run.signals[name],
        "two channels on one cable": lambda campaign, run, name: run.signals[_first(campaign)],
        "crosstalk": lambda campaign, run, name: (
            run.signals[name] + 0.1 * run.signals[_first(campaign)]
        ),
        "sensor on the ground": _moved_by_loads,
        "channel AC-coupled": lambda campaign, run, name: (
            run.signals[name] - _low_passed(run, name, 4.0)
        ),
        "channel filtered": lambda campaign, run, name: _low_passed(run, name, 0.3),
    }
    for name, change in changes.items():
        yield Fault(name, "-", partial(_third_channel, change=change))


def _faults_of_loads() -> Iterator[Fault]:
    """Faults of the loads beside their sign and gain."""
    yield Fault("radial loads exchanged", "-", _loads_exchanged)
    yield Fault("loads of one run of the other sign", "-", _last_run_turned)
    for share in (0.01, 0.05):
        change = partial(_torque_zero, share=share)
        yield Fault("zero of the torque", f"{share:.0%}", change)


def _first(campaign: Campaign) -> str:
    return campaign.channels[0].name


def _third_channel(
    campaign: Campaign,
    rng: np.random.Generator,
    *,
    change: Callable[[Campaign, Run, str], FloatArray],
) -> Campaign:
    """The third channel, or the last of fewer, changed in every run."""
    name = campaign.channels[min(2, len(campaign.channels) - 1)].name
    return _runs(campaign, lambda run: _with_signal(run, name, change(campaign, run, name)))


def _moved_by_loads(campaign: Campaign, run: Run, name: str) -> FloatArray:
    """Signal of a bracket that stands on the floor, which torque and radial load move."""
    noise = max(_noise_of(channel) for channel in campaign.channels)
    largest = {load: _largest(campaign, load) for load in ("torque", "ntl_z")}
    moved = run.signals[name]
    for load, floors in (("torque", 15.0), ("ntl_z", 8.0)):
        if largest[load] > 0.0:
            moved = moved + floors * noise * run.inputs[load] / largest[load]
    return moved


def _largest(campaign: Campaign, name: str) -> float:
    return max(float(np.abs(run.inputs[name]).max()) for run in campaign.runs)


def _low_passed(run: Run, name: str, time: float) -> FloatArray:
    """Low-pass of first order with a time constant [s], from the first value on."""
    values = run.signals[name]
    step = float(np.median(np.diff(run.time)))
    share = step / (time + step)
    filtered, _ = lfilter([share], [1.0, share - 1.0], values, zi=[(1.0 - share) * values[0]])
    return np.asarray(filtered, dtype=np.float64)


def _loads_exchanged(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """The two radial loads in each other's columns."""
    y, z = _RADIAL
    return _runs(campaign, lambda run: _with_inputs(run, {y: run.inputs[z], z: run.inputs[y]}))


def _last_run_turned(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """Loads of the run with the largest radial load of the other sign."""
    sizes = [float(np.abs(run.inputs["ntl_z"]).max()) for run in campaign.runs]
    turned = campaign.runs[int(np.argmax(sizes))].name
    return _runs(
        campaign,
        lambda run: (
            _with_inputs(run, {name: -run.inputs[name] for name in _RADIAL})
            if run.name == turned
            else run
        ),
    )


def _torque_zero(campaign: Campaign, rng: np.random.Generator, *, share: float) -> Campaign:
    """Torque whose zero is off by a share of its largest value."""
    by = share * _largest(campaign, "torque")
    return _input_moved(campaign, rng, name="torque", by=by)


def _input_moved(campaign: Campaign, rng: np.random.Generator, *, name: str, by: float) -> Campaign:
    """One input of every run moved by a constant."""
    return _runs(campaign, lambda run: _with_inputs(run, {name: run.inputs[name] + by}))


def _encoder_eccentric(campaign: Campaign, rng: np.random.Generator, *, size: float) -> Campaign:
    """Carrier angle that is off once a turn."""
    phase = float(rng.uniform(0.0, 2.0 * np.pi))

    def read(run: Run) -> Run:
        angle = run.inputs["carrier_angle"]
        return _with_inputs(run, {"carrier_angle": angle + size * np.sin(angle + phase)})

    return _runs(campaign, read)


def _runs(campaign: Campaign, change: Callable[[Run], Run]) -> Campaign:
    return replace(campaign, runs=tuple(change(run) for run in campaign.runs))


def _with_signal(run: Run, name: str, values: FloatArray) -> Run:
    return replace(run, signals={**run.signals, name: values})


def _with_inputs(run: Run, inputs: Mapping[str, FloatArray]) -> Run:
    return replace(run, inputs={**run.inputs, **inputs})


def _noise_of(channel: Channel) -> float:
    """Declared noise of a channel; zero where none is declared."""
    return float(channel.noise_std or 0.0)


def _input_scaled(
    campaign: Campaign, rng: np.random.Generator, *, name: str, factor: float
) -> Campaign:
    """One input of every run times a factor."""
    return _runs(campaign, lambda run: _with_inputs(run, {name: factor * run.inputs[name]}))


def _load_scaled(campaign: Campaign, rng: np.random.Generator, *, factor: float) -> Campaign:
    """The input that loads times a factor: torque, or the drive of an element."""
    names = tuple(campaign.contract.inputs)
    load = "torque" if "torque" in names else names[0]
    return _input_scaled(campaign, rng, name=load, factor=factor)


def _channels_scaled(
    campaign: Campaign, rng: np.random.Generator, *, field: str, factor: float
) -> Campaign:
    """What every channel declares under one key times a factor."""

    def scaled(channel: Channel) -> Channel:
        """Channel with the key scaled; zero where it declares none."""
        values: dict[str, Any] = {field: factor * float(getattr(channel, field) or 0.0)}
        return replace(channel, **values)

    return replace(campaign, channels=tuple(map(scaled, campaign.channels)))


def _signal_changed(
    campaign: Campaign, rng: np.random.Generator, *, change: SignalChange
) -> Campaign:
    """The third channel, or the last of fewer, changed in every run by its signal alone."""
    return _third_channel(
        campaign, rng, change=lambda campaign, run, name: change(run.signals[name].copy(), rng)
    )


def _scaled(values: FloatArray, rng: np.random.Generator, *, factor: float) -> FloatArray:
    return factor * values


def _time_scaled(campaign: Campaign, rng: np.random.Generator, *, factor: float) -> Campaign:
    return _runs(campaign, lambda run: replace(run, time=factor * run.time))


def _late(run: Run, delay: FloatArray) -> Run:
    """Signals late by a delay [s], one for every sample; missing before the first one."""
    at = run.time - delay
    signals = {name: at_other_times(run.time, signal, at) for name, signal in run.signals.items()}
    return replace(run, signals=signals)


def _delayed(campaign: Campaign, rng: np.random.Generator, *, delay: float) -> Campaign:
    """Signals of all runs late by `delay` [s]."""
    return _runs(campaign, lambda run: _late(run, np.full(run.time.size, delay)))


def _last_run_drifting(campaign: Campaign, rng: np.random.Generator, *, drift: float) -> Campaign:
    """Signals of the last run late by a delay that grows from zero to `drift` [s]."""
    last = campaign.runs[-1]
    growing = drift * (last.time - last.time[0]) / np.ptp(last.time)
    return replace(campaign, runs=(*campaign.runs[:-1], _late(last, growing)))


def _clipped(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Signal that ends at 70 % of its range."""
    middle = 0.5 * (values.max() + values.min())
    half = 0.5 * np.ptp(values)
    return np.clip(values, middle - 0.7 * half, middle + 0.7 * half)


def _stuck(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Signal that holds one value for a twentieth of the record."""
    first = int(rng.integers(values.size // 3, values.size // 2))
    values[first : first + values.size // 20] = values[first]
    return values


def _zeroed(values: FloatArray, rng: np.random.Generator, *, share: float) -> FloatArray:
    """Signal with zeros in place of a share of its samples."""
    values[_lost_samples(values, rng, share)] = 0.0
    return values


def _with_last_value(values: FloatArray, rng: np.random.Generator, *, share: float) -> FloatArray:
    """Signal with the sample before in place of a share of its samples."""
    lost = _lost_samples(values, rng, share)
    values[lost] = values[lost - 1]
    return values


def _lost_samples(values: FloatArray, rng: np.random.Generator, share: float) -> NDArray[np.int64]:
    """Numbers of a share of the samples, at least one, never the first; ascending."""
    count = max(1, int(share * values.size))
    return np.sort(rng.choice(np.arange(1, values.size), count, replace=False))


def _with_spikes(values: FloatArray, rng: np.random.Generator, *, share: float) -> FloatArray:
    """Signal with a share of its samples one to three ranges off."""
    hit = rng.choice(values.size, max(1, int(share * values.size)), replace=False)
    size = np.ptp(values) * rng.uniform(1.0, 3.0, hit.size)
    values[hit] += size * rng.choice((-1.0, 1.0), hit.size)
    return values


def _quantised(campaign: Campaign, rng: np.random.Generator, *, floors: float) -> Campaign:
    """All channels on grids of a step in noise floors."""

    def on_grids(run: Run) -> Run:
        """Run with its signals rounded to their grids."""
        signals = dict(run.signals)
        for channel in campaign.channels:
            step = floors * _noise_of(channel)
            signals[channel.name] = step * np.round(signals[channel.name] / step)
        return replace(run, signals=signals)

    return _runs(campaign, on_grids)


def _with_tone(
    campaign: Campaign, rng: np.random.Generator, *, frequency_hz: float | None, floors: float
) -> Campaign:
    """A tone on all channels by its amplitude in noise floors, at no drive's frequency or one."""
    hertz = _undriven_frequency(campaign) if frequency_hz is None else frequency_hz

    def humming(run: Run) -> Run:
        """Run with the tone, of another phase in each channel."""
        signals = dict(run.signals)
        for channel in campaign.channels:
            phase = 2.0 * np.pi * hertz * run.time + rng.uniform(0.0, 2.0 * np.pi)
            tone = floors * _noise_of(channel) * np.sin(phase)
            signals[channel.name] = signals[channel.name] + tone
        return replace(run, signals=signals)

    return _runs(campaign, humming)


def _undriven_frequency(campaign: Campaign) -> float:
    """First frequency [Hz] between the orders at which no input of the first run has a line.

    At a driven frequency a tone is part of the response. A drive of all frequencies leaves the
    first.
    """
    run = campaign.runs[0]
    undriven = (hertz for hertz in _BETWEEN_ORDERS_HZ if not is_driven(run, hertz))
    return next(undriven, _BETWEEN_ORDERS_HZ[0])


def _first_run_copied(campaign: Campaign, rng: np.random.Generator, *, floors: float) -> Campaign:
    """The first run once more, under another name and condition, with new noise in floors."""
    first = campaign.runs[0]
    signals = {
        channel.name: first.signals[channel.name]
        + floors * _noise_of(channel) * rng.standard_normal(first.time.size)
        for channel in campaign.channels
    }
    copy = replace(
        first, name="copy", file="copy.parquet", condition="another day", signals=signals
    )
    return replace(campaign, runs=(*campaign.runs, copy))


def _runs_exchanged(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """Signals of the first two runs of equal length exchanged; unchanged where there are none."""
    for number, first in enumerate(campaign.runs):
        for other in range(number + 1, len(campaign.runs)):
            second = campaign.runs[other]
            if first.time.size == second.time.size:
                runs = list(campaign.runs)
                runs[number] = _with_signals_of(first, second)
                runs[other] = _with_signals_of(second, first)
                return replace(campaign, runs=tuple(runs))
    return campaign


def _with_signals_of(run: Run, other: Run) -> Run:
    return replace(run, signals=other.signals, predictions=other.predictions)


def _thinned(campaign: Campaign, rng: np.random.Generator, *, every: int) -> Campaign:
    """One sample of every `every` of each run."""
    return _runs(campaign, lambda run: run.thinned(every))


def _two_sensors_exchanged(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """Signals of the first two sensors exchanged; of a mounting those that move most."""
    names = [channel.name for channel in campaign.channels]
    first = 2 if campaign.kind == "mounting" else 0
    moved = names.copy()
    moved[first] = names[first + 1]
    moved[first + 1] = names[first]
    return _sensors_moved(campaign, moved)


def _sensors_moved_on(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """Signal of every sensor under the name of the one before."""
    names = [channel.name for channel in campaign.channels]
    return _sensors_moved(campaign, [*names[1:], names[0]])


def _sensors_moved(campaign: Campaign, moved: list[str]) -> Campaign:
    """Every channel with the signal of another; `moved` holds these in the channels' order."""
    sources = dict(zip((channel.name for channel in campaign.channels), moved, strict=True))
    return _runs(
        campaign,
        lambda run: replace(
            run, signals={name: run.signals[source] for name, source in sources.items()}
        ),
    )


def _rig_changed(
    campaign: Campaign, rng: np.random.Generator, *, values: Mapping[str, Any]
) -> Campaign:
    return replace(campaign, rig={**campaign.rig, **values})


def _rig_scaled(
    campaign: Campaign, rng: np.random.Generator, *, name: str, factor: float
) -> Campaign:
    return _rig_changed(campaign, rng, values={name: campaign.rig[name] * factor})

"""Errors of measuring practice, beside the faults of a chain in :mod:`studies.fault_table`.

Every error has the findings that report it: ids (``wiring/...``) or checks. A finding that says
where the error is (channel, run, load) reports it too, though not by its kind.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import filtfilt, lfilter

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from studies.clean_campaigns import beside_columns
from studies.fault_outcomes import Curves
from studies.fault_table import Fault

FloatArray = NDArray[np.float64]
#: A change of one run: ``(campaign, run, rng) -> run``.
_RunChange = Callable[[Campaign, Run, np.random.Generator], Run]

_ANGLE = "carrier_angle"
_CHANNEL = (
    "wiring/channel", "wiring/channel_gain", "wiring/channel_zero", "wiring/curved_channel",
    "wiring/crosstalk", "wiring/sensor_on_ground", "gain",
)  # fmt: skip
_RUN = (
    "wiring/run", "wiring/run_of_load", "run_variation", "wiring/run_order", "wiring/input_gain",
)  # fmt: skip
_CLOCK = ("wiring/clock", "clock", "delay", "sensor_delay", "clock/delay", "sampling_gap")
_FILTER = ("wiring/filtered_channel", *_CLOCK)
_LOAD = ("wiring/load_zero", "wiring/input_gain", "quantised")
_RIG = ("bound", "prior", "unit", "wiring/rig_length")
_DRIFT = (
    "drift", "thermal_drift", "run_variation", "wiring/run", "housing/offset/time", "wiring/drift",
)  # fmt: skip


def practice_faults(kind: str, curves: Curves) -> tuple[Fault, ...]:
    """Errors of measuring practice for a kind of campaign.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier, for the prediction of another simulator.

    Returns
    -------
    tuple of Fault
        Of loads, channels, runs and columns, then those of the kind.
    """
    return (
        *_of_loads(),
        *_of_channels(),
        *_of_runs(),
        *_of_columns(curves),
        *(_of_element() if kind == "element" else _of_machine(kind)),
    )


def unforeseen_faults() -> tuple[Fault, ...]:
    """Five errors for which the diagnosis has no rule, the same for every kind.

    Returns
    -------
    tuple of Fault
        Of channels, of one run and of the load.
    """
    return (
        Fault("stretch logged twice", "10 %", _first(_logged_twice), (*_RUN, *_CLOCK)),
        Fault("range switched in a run", "x1.3", _first(_range_switched), (*_CHANNEL, *_RUN)),
        Fault("halves of a run exchanged", "-", _first(_halves_exchanged), (*_RUN, *_CLOCK)),
        Fault("load cell with hysteresis", "5 %", _each(_load_with_play), (*_LOAD, *_CLOCK)),
        Fault("channel picks up the rate of the load", "20 %", _each(_induced), _CHANNEL),
    )


def _of_loads() -> Iterator[Fault]:
    """Errors of the input that loads."""
    yield Fault("load late and filtered", "0.3 s", _each(_load_lags), (*_FILTER, *_LOAD))
    yield Fault("zero of the load", "5 %", _each(_load_moved), _LOAD)
    yield Fault("load quantised", "5 %", _each(_load_coarse), _LOAD)
    yield Fault("load noisy", "5 %", _each(_load_noisy), (*_LOAD, "wiring/load_noise"))
    yield Fault("load 10 % up in one run", "10 %", _first(_load_larger), (*_LOAD, *_RUN))
    yield Fault("gain of the load drifts", "10 %", _each(_load_drifts), (*_LOAD, *_RUN))


def _of_channels() -> Iterator[Fault]:
    """Errors of channels and of their samples."""
    jitter = (*_CLOCK, "uneven_steps", "wiring/jitter")
    yield Fault("sampling jitter", "half a step", _each(_jittered), jitter)
    yield Fault("resampled by a spline", "0.45", _each(_resampled), ("declared_noise",))
    yield Fault("soft saturation", "1.2", _saturated, (*_CHANNEL, "clipping"))
    yield Fault("reading wraps around", "70 %", _each(_wrapped), (*_CHANNEL, "wrapped"))
    yield Fault("channels detrended", "-", _each(_detrended), ("wiring/ac_coupled", *_DRIFT))
    yield Fault("gain drifts in one run", "10 %", _first(_gain_drifts), (*_CHANNEL, *_RUN))


def _of_runs() -> Iterator[Fault]:
    """Errors of whole runs and of their names."""
    yield Fault("conditions shuffled", "-", _conditions_shuffled)
    yield Fault("order of the runs reversed", "-", _reversed)
    yield Fault("names of runs repeated", "-", _same_names, ("refused",))
    yield Fault("a run at rest", "-", _with_run_at_rest, ("wiring/at_rest",))
    yield Fault("block of samples lost", "40 samples", _first(_block_lost), (*_CLOCK, *_RUN))
    yield Fault("clock of one run fast", "1 %", _first(_fast_clock), (*_CLOCK, *_RUN))


def _of_columns(curves: Curves) -> Iterator[Fault]:
    """Prediction of another simulator in place of the model."""
    yield Fault("columns, right", "-", partial(_columns, curves=curves))
    late = partial(_columns, curves=curves, late=1)
    yield Fault("columns late", "1 sample", late, _CLOCK)
    scaled = partial(_columns, curves=curves, factor=1e3)
    yield Fault("columns in mm", "1000", scaled, ("unit", "prior", "bound"))


def _of_machine(kind: str) -> Iterator[Fault]:
    """Errors that only machines which turn can have."""
    ground = ("wiring/sensor_on_ground", *_CHANNEL)
    yield Fault("sensor on the ground", "15 floors", _on_ground, ground)
    copied = ("wiring/copied_channel", "copy", *_CHANNEL)
    yield Fault("two channels on one cable", "-", _each(_copied), copied)
    yield Fault("dead channel", "-", _each(_dead), ("wiring/dead_channel", "stuck", *_CHANNEL))
    encoder = ("wiring/encoder", "wiring/angle_zero")
    yield Fault("eccentric encoder", "1 degree", partial(_eccentric, degrees=1.0), encoder)
    turned_back = ("wiring/angle_direction", *_RUN, *_CLOCK)
    yield Fault("turned back halfway", "-", _first(_turned_back), turned_back)
    yield Fault("drift with the torque", "12 floors", _warming, _DRIFT)
    signs = ("wiring/torque_sign", *_RUN)
    yield Fault("sign of the radial load in one run", "-", _radial_turned, signs)
    yield Fault("radial loads exchanged", "-", _each(_radial_exchanged), ("wiring/load_axes",))
    yield Fault("cut within a revolution", "-", _each(_cut))
    aliased = ("tone", "sampling_rate", "wiring/aliased_order")
    yield Fault("mesh tone aliased", "order 99", _mesh_tone, aliased)
    zero = ("wiring/angle_zero", "wiring/sensor_angle")
    yield Fault("zero of the angle", "10 degrees", _each(_angle_moved), zero)
    if kind == "carrier":
        yield Fault("eccentric encoder", "5 degrees", partial(_eccentric, degrees=5.0), encoder)
        for degrees in (2.0, 8.0):
            turned = partial(_sensor_turned, degrees=degrees)
            ids = ("wiring/sensor_angle", "probe_angle", "channel/angle/none", *_CHANNEL)
            yield Fault("sensor turned", f"{degrees:g} degrees", turned, ids)
        return
    for name, key, factor in (
        ("inertia in kg mm^2", "housing_inertia", 1e6),
        ("inertia", "housing_inertia", 1e3),
        ("mass in tonnes", "housing_mass", 1e-3),
        ("main bearing", "main_bearing_x", 1.2),
        ("axial stiffness", "bushing_axial_stiffness", 1e-3),
    ):
        rig = partial(_rig, key=key, factor=factor)
        # A stiffness that is not as declared is a law of the library too.
        law = "axial_bushing_stiffness" if key == "bushing_axial_stiffness" else key
        yield Fault(name, f"x{factor:g}", rig, (*_RIG, key, law, "refused"))
    yield Fault("zeroed under load", "30 %", _each(_zeroed_late), ("zeroing",))
    yield Fault("speed in 1/min", "9.55", _each(_speed_in_rpm), ("unit", "speed"))


def _of_element() -> Iterator[Fault]:
    """Errors of a test of one element."""
    yield Fault("mass of the fixture in the force", "10 %", _each(_fixture), ("prior", "bound"))
    yield Fault("play of the sensor", "4 floors", _each(_sensor_with_play), ("stuck", "repeated"))
    yield Fault("linear drift", "15 floors", _each(_linear_drift), _DRIFT)
    yield Fault("mass in grams", "1000", partial(_rig, key="mass", factor=1e3), (*_RIG, "refused"))
    rectified = (*_CHANNEL, "wiring/torque_sign", "rectified")
    yield Fault("absolute value logged", "-", _each(_rectified), rectified)


def _each(change: _RunChange) -> Callable[[Campaign, np.random.Generator], Campaign]:
    """The same change of every run."""
    return lambda campaign, rng: replace(
        campaign, runs=tuple(change(campaign, run, rng) for run in campaign.runs)
    )


def _first(change: _RunChange) -> Callable[[Campaign, np.random.Generator], Campaign]:
    """A change of the first run alone."""
    return lambda campaign, rng: replace(
        campaign, runs=(change(campaign, campaign.runs[0], rng), *campaign.runs[1:])
    )


def _signal(run: Run, name: str, values: FloatArray) -> Run:
    return replace(run, signals={**run.signals, name: values})


def _input(run: Run, name: str, values: FloatArray) -> Run:
    return replace(run, inputs={**run.inputs, name: values})


def _load(campaign: Campaign) -> str:
    names = tuple(campaign.contract.inputs)
    return "torque" if "torque" in names else names[0]


def _size(campaign: Campaign) -> float:
    """Size of the load that is 100 %."""
    largest = max(float(np.abs(run.inputs[_load(campaign)]).max()) for run in campaign.runs)
    return float(campaign.rig.get("nominal_torque") or largest)


def _channel(campaign: Campaign, number: int) -> str:
    return campaign.channels[min(number, len(campaign.channels) - 1)].name


def _floor(campaign: Campaign, name: str) -> float:
    """Declared noise of a channel."""
    return next(float(one.noise_std or 0.0) for one in campaign.channels if one.name == name)


def _rows(run: Run, rows: slice) -> Run:
    """Some samples of a run."""

    def taken(columns: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        return {name: values[rows] for name, values in columns.items()}

    return replace(
        run,
        time=run.time[rows],
        inputs=taken(run.inputs),
        signals=taken(run.signals),
        predictions=taken(run.predictions),
    )


def _low_passed(values: FloatArray, step: float, time: float) -> FloatArray:
    share = step / (time + step)
    start = [(1.0 - share) * values[0]]
    return np.asarray(lfilter([share], [1.0, share - 1.0], values, zi=start)[0])


def _played(values: FloatArray, half: float) -> FloatArray:
    """Values behind a play of a half width."""
    behind = np.empty_like(values)
    last = float(values[0])
    for number, value in enumerate(values.tolist()):
        last = min(max(last, value - half), value + half) if np.isfinite(value) else last
        behind[number] = last
    return behind


def _ramp(run: Run) -> FloatArray:
    """From zero to one over a run."""
    return np.asarray((run.time - run.time[0]) / np.ptp(run.time))


def _load_lags(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    step = mean_step(run.time)
    time = 3.0 * step if campaign.kind == "element" else 0.3
    name = _load(campaign)
    slow = _low_passed(run.inputs[name], step, time)
    return _input(run, name, np.interp(run.time - time, run.time, slow))


def _load_moved(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _load(campaign)
    return _input(run, name, run.inputs[name] + 0.05 * _size(campaign))


def _load_coarse(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name, step = _load(campaign), 0.05 * _size(campaign)
    return _input(run, name, step * np.round(run.inputs[name] / step))


def _load_noisy(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _load(campaign)
    noise = 0.05 * _size(campaign) * rng.standard_normal(run.time.size)
    return _input(run, name, run.inputs[name] + noise)


def _load_larger(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _load(campaign)
    return _input(run, name, 1.1 * run.inputs[name])


def _load_drifts(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _load(campaign)
    return _input(run, name, run.inputs[name] * (1.0 + 0.1 * _ramp(run)))


def _load_with_play(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _load(campaign)
    return _input(run, name, _played(run.inputs[name], 0.05 * _size(campaign)))


def _jittered(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    at = run.time + rng.uniform(-0.5, 0.5, run.time.size) * mean_step(run.time)
    signals = {name: np.interp(at, run.time, values) for name, values in run.signals.items()}
    return replace(run, signals=signals)


def _resampled(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    coarse = np.linspace(run.time[0], run.time[-1], int(0.45 * run.time.size))
    signals = {
        name: CubicSpline(coarse, np.interp(coarse, run.time, values))(run.time)
        for name, values in run.signals.items()
    }
    return replace(run, signals=signals)


def _saturated(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    name = _channel(campaign, 2)
    end = 1.2 * max(float(np.nanmax(np.abs(run.signals[name]))) for run in campaign.runs)
    return _each(lambda _, run, __: _signal(run, name, end * np.tanh(run.signals[name] / end)))(
        campaign, rng
    )


def _detrended(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    def without_line(values: FloatArray) -> FloatArray:
        known = np.isfinite(values)
        line = np.polyfit(run.time[known], values[known], 1)
        return np.asarray(values - np.polyval(line, run.time))

    signals = {name: without_line(values) for name, values in run.signals.items()}
    return replace(run, signals=signals)


def _gain_drifts(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _channel(campaign, 0)
    return _signal(run, name, run.signals[name] * (1.0 + 0.1 * _ramp(run)))


def _wrapped(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    """A counter of too few bits: beyond 70 % of the largest value the reading begins anew."""
    name = _channel(campaign, 1)
    end = 0.7 * max(float(np.nanmax(np.abs(one.signals[name]))) for one in campaign.runs)
    return _signal(run, name, (run.signals[name] + end) % (2.0 * end) - end)


def _range_switched(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _channel(campaign, 1)
    gain = np.where(_ramp(run) < 0.5, 1.0, 1.3)
    return _signal(run, name, run.signals[name] * gain)


def _halves_exchanged(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    half = run.time.size // 2
    signals = {
        name: np.concatenate([values[half:], values[:half]]) for name, values in run.signals.items()
    }
    return replace(run, signals=signals)


def _logged_twice(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    """A buffer that was written twice: all channels repeat a tenth of the run, the next is lost."""
    n = run.time.size // 10
    again = slice(6 * n, 7 * n)
    signals = {name: values.copy() for name, values in run.signals.items()}
    for values in signals.values():
        values[again] = values[5 * n : 6 * n]
    return replace(run, signals=signals)


def _induced(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    """A cable beside the motor's: the rate of the load, a fifth of the channel's size."""
    name = _channel(campaign, 1)
    loads = [one.inputs[_load(campaign)] for one in campaign.runs]
    sizes = [np.std(np.diff(load)) for load in loads]
    largest = float(max(sizes)) or 1.0
    level = max(float(np.nanstd(one.signals[name])) for one in campaign.runs)
    rate = np.diff(run.inputs[_load(campaign)], prepend=run.inputs[_load(campaign)][0])
    return _signal(run, name, run.signals[name] + 0.2 * level * rate / largest)


def _conditions_shuffled(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    names = [run.condition for run in campaign.runs]
    pairs = zip(campaign.runs, [*names[1:], names[0]], strict=True)
    return replace(campaign, runs=tuple(replace(run, condition=name) for run, name in pairs))


def _reversed(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    return replace(campaign, runs=campaign.runs[::-1])


def _same_names(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    name = campaign.runs[0].name
    return replace(campaign, runs=tuple(replace(run, name=name) for run in campaign.runs))


def _with_run_at_rest(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    first = campaign.runs[0]
    n = first.time.size
    inputs = {name: np.full(n, 1.0 if name == _ANGLE else 0.0) for name in first.inputs}
    signals = {name: _floor(campaign, name) * rng.standard_normal(n) for name in first.signals}
    rest = replace(
        first, name="rest", file="rest.csv", condition="rest", inputs=inputs, signals=signals
    )
    return replace(campaign, runs=(*campaign.runs, rest))


def _block_lost(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    """A logger that lost samples in the middle and wrote on without a gap."""
    n = run.time.size
    lost, half = min(40, n // 10), n // 2
    end = np.full(lost, np.nan)
    signals = {
        name: np.concatenate([values[:half], values[half + lost :], end])
        for name, values in run.signals.items()
    }
    return replace(run, signals=signals)


def _fast_clock(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    return replace(run, time=run.time[0] + 1.01 * (run.time - run.time[0]))


def _columns(
    campaign: Campaign,
    rng: np.random.Generator,
    *,
    curves: Curves,
    late: int = 0,
    factor: float = 1.0,
) -> Campaign:
    """Columns of another simulator, some samples late and times a factor."""

    def changed(values: FloatArray) -> FloatArray:
        moved = np.concatenate([np.repeat(values[:1], late), values[: values.size - late]])
        return np.asarray(factor * moved)

    with_columns = beside_columns(campaign, curves)
    return _each(
        lambda _, run, __: replace(
            run, predictions={name: changed(values) for name, values in run.predictions.items()}
        )
    )(with_columns, rng)


def _on_ground(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """A bracket that stands on the floor moves with the loads."""
    name = _channel(campaign, 1)
    floor = _floor(campaign, name)
    radial = max(float(np.abs(run.inputs["ntl_z"]).max()) for run in campaign.runs) or 1.0

    def moved(_: Campaign, run: Run, __: np.random.Generator) -> Run:
        by_torque = 15.0 * floor / _size(campaign) * run.inputs["torque"]
        by_load = 8.0 * floor / radial * run.inputs["ntl_z"]
        return _signal(run, name, run.signals[name] + by_torque + by_load)

    return _each(moved)(campaign, rng)


def _copied(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    return _signal(run, _channel(campaign, 1), run.signals[_channel(campaign, 0)].copy())


def _dead(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _channel(campaign, 2)
    return _signal(run, name, _floor(campaign, name) * rng.standard_normal(run.time.size))


def _eccentric(campaign: Campaign, rng: np.random.Generator, *, degrees: float) -> Campaign:
    size = float(np.deg2rad(degrees))
    return _each(
        lambda _, run, __: _input(
            run, _ANGLE, run.inputs[_ANGLE] + size * np.sin(run.inputs[_ANGLE] + 0.7)
        )
    )(campaign, rng)


def _turned_back(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    """The machine turns back and the encoder, which knows no direction, counts on."""
    n = run.time.size
    half = n // 2
    back = np.concatenate([np.arange(half), half - 1 - np.arange(n - half)])
    signals = {
        name: values[back] + 0.3 * _floor(campaign, name) * rng.standard_normal(n)
        for name, values in run.signals.items()
    }
    inputs = {name: values[back] for name, values in run.inputs.items()}
    angle = inputs[_ANGLE]
    counted = angle[0] + np.cumsum(np.abs(np.diff(angle, prepend=angle[0])))
    return replace(run, signals=signals, inputs={**inputs, _ANGLE: counted})


def _warming(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """Every channel drifts with the slow part of the torque, by sizes of its own."""
    sizes = {
        channel.name: 12.0 * _floor(campaign, channel.name) * rng.uniform(0.5, 1.5)
        for channel in campaign.channels
    }

    def warmed(_: Campaign, run: Run, __: np.random.Generator) -> Run:
        torque = np.concatenate([[0.0], run.inputs["torque"]])
        slow = _low_passed(torque, mean_step(run.time), 20.0)[1:] / _size(campaign)
        signals = {name: values + sizes[name] * slow for name, values in run.signals.items()}
        return replace(run, signals=signals)

    return _each(warmed)(campaign, rng)


def _radial_turned(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    sizes = [float(np.abs(run.inputs["ntl_z"]).max()) for run in campaign.runs]
    turned = int(np.argmax(sizes))

    def changed(number: int, run: Run) -> Run:
        radial = {name: -run.inputs[name] for name in ("ntl_y", "ntl_z")}
        return replace(run, inputs={**run.inputs, **radial}) if number == turned else run

    return replace(campaign, runs=tuple(changed(k, run) for k, run in enumerate(campaign.runs)))


def _radial_exchanged(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    y, z = run.inputs["ntl_y"], run.inputs["ntl_z"]
    return replace(run, inputs={**run.inputs, "ntl_y": z, "ntl_z": y})


def _cut(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    return _rows(run, slice(0, int(rng.uniform(0.55, 0.8) * run.time.size)))


def _mesh_tone(campaign: Campaign, rng: np.random.Generator) -> Campaign:
    """Tooth mesh without a filter before sampling."""
    phases = rng.uniform(0.0, 2.0 * np.pi, len(campaign.channels))

    def humming(_: Campaign, run: Run, __: np.random.Generator) -> Run:
        torque = run.inputs["torque"] / _size(campaign)
        signals = {
            channel.name: run.signals[channel.name]
            + 4.0
            * _floor(campaign, channel.name)
            * torque
            * np.sin(99.0 * run.inputs[_ANGLE] + phase)
            for channel, phase in zip(campaign.channels, phases, strict=True)
        }
        return replace(run, signals=signals)

    return _each(humming)(campaign, rng)


def _angle_moved(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    return _input(run, _ANGLE, run.inputs[_ANGLE] + np.deg2rad(10.0))


def _sensor_turned(campaign: Campaign, rng: np.random.Generator, *, degrees: float) -> Campaign:
    channels = list(campaign.channels)
    channels[1] = replace(channels[1], angle=float(channels[1].angle or 0.0) + np.deg2rad(degrees))
    return replace(campaign, channels=tuple(channels))


def _rig(campaign: Campaign, rng: np.random.Generator, *, key: str, factor: float) -> Campaign:
    """A value of the rig times a factor; unchanged where it is not declared."""
    if key not in campaign.rig:
        return campaign
    value = campaign.rig[key]
    scaled = (
        type(value)([factor * one for one in value])
        if isinstance(value, (list, tuple))
        else factor * value
    )
    return replace(campaign, rig={**campaign.rig, key: scaled})


def _zeroed_late(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    """A record that begins under load: the rest before it is cut away."""
    rest = _rows(run, slice(int(0.3 * run.time.size), None))
    n = int(campaign.rig["zeroing_samples"])
    signals = {name: values - values[:n].mean() for name, values in rest.signals.items()}
    return replace(rest, signals=signals)


def _speed_in_rpm(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    return _input(run, "speed", 9.5493 * run.inputs["speed"])


def _fixture(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    """A force cell that carries a fixture of mass too."""
    name, load = _channel(campaign, 0), _load(campaign)
    step = mean_step(run.time)
    by_motion = load == "displacement"
    motion = run.inputs[load] if by_motion else run.signals[name]
    force = run.signals[name] if by_motion else run.inputs[load]
    # Smoothed without a delay: noise differentiated twice would be all there is.
    slow = filtfilt([0.6], [1.0, -0.4], np.nan_to_num(motion))
    acceleration = np.gradient(np.gradient(slow, step), step)
    size = 0.1 * float(np.std(motion if by_motion else force))
    added = size / max(float(np.std(acceleration)), 1e-30) * acceleration
    changed = force + added
    return _signal(run, name, changed) if by_motion else _input(run, load, changed)


def _sensor_with_play(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _channel(campaign, 0)
    return _signal(run, name, _played(run.signals[name], 4.0 * _floor(campaign, name)))


def _linear_drift(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _channel(campaign, 0)
    return _signal(run, name, run.signals[name] + 15.0 * _floor(campaign, name) * _ramp(run))


def _rectified(campaign: Campaign, run: Run, rng: np.random.Generator) -> Run:
    name = _channel(campaign, 0)
    return _signal(run, name, np.abs(run.signals[name]))

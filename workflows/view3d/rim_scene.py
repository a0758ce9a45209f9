"""What a sensor read of the rim as it passed, measured and simulated, the gap between in colour."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from carrierflex.geometry.view import rounded_magnification
from carrierflex.workflows.view3d.rim_motion_files import RimMotion, RimSignal
from carrierflex.workflows.view3d.scene import (
    Control,
    Entry,
    FloatArray,
    Label,
    Scene,
    SceneObject,
    band,
    circle,
    closed,
    directions,
    pin_labels,
    pins,
)

#: Largest displacement drawn, over the radius.
_DRAWN = 0.5
#: Points of a line in the picture.
_N = 180
_CONTROL = Control("carrier angle", "deg", 0.0, tuple(float(v) for v in range(0, 361, 10)))
_MEASURED = "#222222"
_SIMULATED = "#2b6cb0"
_SENSOR = "#c05621"
#: Length of a sensor's mark and of the way to its name, over the radius.
_MARK, _NAME = (1.04, 1.2), 1.3


@dataclass(frozen=True, eq=False)
class _State:
    """One sensor in one run beside one model: what is drawn of it."""

    entry: Entry
    measured: FloatArray
    simulated: FloatArray
    gap: FloatArray
    rms: float
    mark: FloatArray


def rim_scene(motion: RimMotion) -> Scene:
    """Scene of the motion of a carrier's rim.

    A line closes around the carrier: what one sensor read at each of the carrier's angles, drawn at
    the place of the rim that stood before it then. The sensor stays, the line turns with the
    carrier.

    Parameters
    ----------
    motion : RimMotion
        Mean turns of all sensors and runs.
    """
    rest = motion.radius * directions(np.linspace(0.0, 2.0 * np.pi, _N, endpoint=False))
    states = list(_states(motion, rest))
    n = len(states)
    measured = np.array([state.measured for state in states])
    simulated = np.array([state.simulated for state in states])
    at_rest = np.tile(rest, (2, 1))
    ribbon = SceneObject(
        "gap",
        band(_N),
        at_rest,
        np.concatenate([measured, simulated], axis=1) - at_rest,
        np.array([np.tile(state.gap, 2) for state in states]),
        follows=False,
        turns=True,
    )
    mark = SceneObject(
        "sensor",
        np.array([[0, 1]]),
        np.zeros((2, 3)),
        np.array([state.mark for state in states]),
        colour=_SENSOR,
        follows=False,
        width=0.015 * motion.radius,
    )
    sensors = {signal.channel: signal.sensor_angle for signal in motion.signals}
    return Scene(
        title=f"rim of {motion.campaign}, measured and simulated",
        words="The carrier turns, the sensors stay. x points downwind along the axis, z up.",
        control=_CONTROL,
        entries=tuple(state.entry for state in states),
        objects=(
            ribbon,
            _line("measured", measured, rest, _MEASURED),
            _line("simulated", simulated, rest, _SIMULATED),
            mark,
            circle(motion.radius, n, turns=True),
            *pins(motion.radius, motion.n_planets, n, turns=True),
        ),
        labels=(
            *pin_labels(motion.radius, motion.n_planets, turns=True),
            *(_sensor_label(name, angle, motion.radius) for name, angle in sensors.items()),
        ),
        first=int(np.argmax([state.rms for state in states])),
        eye=(-1.0, 1.4, 0.5),
    )


def _states(motion: RimMotion, rest: FloatArray) -> Iterator[_State]:
    """Every signal beside the baseline, and beside the effects where there are any."""
    for signal in motion.signals:
        yield _state(motion, signal, signal.simulated, "baseline", rest)
        if signal.with_effects is not None:
            yield _state(motion, signal, signal.with_effects, "with effects", rest)


def _state(
    motion: RimMotion, signal: RimSignal, model: FloatArray, name: str, rest: FloatArray
) -> _State:
    scale, unit = (1e6, "µm") if motion.unit == "m" else (1.0, motion.unit)
    largest = max(_largest(signal.measured), _largest(signal.simulated)) or 1.0
    factor = rounded_magnification(_DRAWN * motion.radius / largest)
    # Of the baseline in both states: the colours show what the effects gain.
    limit = _largest(signal.measured - signal.simulated) or 1.0
    rms = float(np.sqrt(np.mean((signal.measured - model) ** 2)))
    words = (
        f"{signal.direction.capitalize()} displacement at sensor {signal.channel}, mean of the "
        f"revolutions, drawn {factor:,.0f} times larger. Black: measured; blue: {name}; between "
        f"them the gap, RMS {rms * scale:.3g} {unit}."
    )
    return _State(
        entry=Entry(
            name=f"{signal.run}, {signal.channel}: {name}",
            words=words,
            legend=f"measured less simulated, {unit}",
            limit=limit * scale,
        ),
        measured=_drawn(signal, signal.measured, factor, rest),
        simulated=_drawn(signal, model, factor, rest),
        gap=_around(signal, signal.measured - model) / limit,
        rms=rms,
        mark=motion.radius * np.array(_MARK)[:, None] * directions(np.array(signal.sensor_angle)),
    )


def _around(signal: RimSignal, turn: FloatArray) -> FloatArray:
    """Readings at the rim's points, shape (_N,): the sensor at v reads the point ``v - theta``."""
    point = np.linspace(0.0, 2.0 * np.pi, _N, endpoint=False)
    theta = (signal.sensor_angle - point) % (2.0 * np.pi)
    spectrum = np.fft.rfft(turn) / turn.size
    spectrum[1:] *= 2.0
    order = np.arange(spectrum.size)
    return np.asarray((np.exp(1j * np.outer(theta, order)) @ spectrum).real)


def _drawn(signal: RimSignal, turn: FloatArray, factor: float, rest: FloatArray) -> FloatArray:
    """Points of the rim moved by what the sensor read of them, shape (_N, 3)."""
    radius = np.linalg.norm(rest, axis=1, keepdims=True)
    way = np.array([1.0, 0.0, 0.0]) if signal.direction == "axial" else rest / radius
    return rest + factor * _around(signal, turn)[:, None] * way


def _line(name: str, points: FloatArray, rest: FloatArray, colour: str) -> SceneObject:
    width = 0.008 * float(np.linalg.norm(rest[0]))
    return SceneObject(
        name, closed(_N), rest, points - rest,
        colour=colour, follows=False, turns=True, width=width,
    )  # fmt: skip


def _sensor_label(name: str, angle: float, radius: float) -> Label:
    x, y, z = _NAME * radius * directions(np.array(angle))
    return Label(name, (float(x), float(y), float(z)))


def _largest(values: FloatArray) -> float:
    return float(np.abs(values).max())

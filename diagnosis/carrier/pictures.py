"""What models of a carrier leave over one turn: overlays and polar plots for the report."""

from collections.abc import Mapping, Sequence

import numpy as np

from carrierflex.diagnosis.comparison.overlay import (
    GAP,
    LAW,
    REMAINDER,
    Overlay,
    Panel,
    Picture,
    Trace,
)
from carrierflex.diagnosis.comparison.problem import ComplexArray, Effects, FloatArray, IntArray
from carrierflex.geometry.parameters import FEWEST_PLANETS

#: Angles of one turn [rad].
_TURN_ANGLES = np.linspace(0.0, 2.0 * np.pi, 181)
_READING = (
    "Displacement at a sensor while the carrier turns once: mean of the revolutions, orders 0 to "
    "{highest}; outwards from the zero circle is positive. An offset is a larger or smaller "
    "circle, a tilt of the carrier a circle off the centre (order 1), flexible pins have {planets} "
    "lobes. Numbers at the edge: that pin passes the sensor."
)
_NUMBER_WORDS = ("three", "four", "five", "six", "seven", "eight")
#: Sensors and runs drawn at most.
_MOST_PANELS = 6


def model_overlays(
    measured: FloatArray, gaps: FloatArray, runs: Sequence[str], channels: Sequence[str]
) -> tuple[Overlay, ...]:
    """Measured and simulated mean turn of every sensor in every run with a revolution."""
    axis = (np.rad2deg(_TURN_ANGLES), "carrier angle", "deg")
    return tuple(
        Overlay(run, channel, *axis, measured[r, c], measured[r, c] - gaps[r, c])
        for r, run in enumerate(runs)
        for c, channel in enumerate(channels)
        if np.isfinite(measured[r, c]).all()
    )


def mean_turns(orders: ComplexArray, run_of_revolution: IntArray, n_runs: int) -> FloatArray:
    """Mean turns ``Re(sum_n Y(n) exp(j n theta))`` of every run, shape (n_runs, C, 181) [m]."""
    waves = np.exp(1j * np.outer(np.arange(orders.shape[-1]), _TURN_ANGLES))
    turns = np.full((n_runs, orders.shape[1], _TURN_ANGLES.size), np.nan)
    for r in range(n_runs):
        revolutions = orders[run_of_revolution == r]
        revolutions = revolutions[np.isfinite(revolutions).all(axis=(1, 2))]
        if len(revolutions):
            turns[r] = (revolutions.mean(axis=0) @ waves).real
    return turns


def pins_passing(sensor_angle: float, n_planets: int) -> dict[str, float]:
    """Carrier angles [rad] at which the pins pass a sensor, by the number of the pin."""
    return {
        str(pin + 1): float((sensor_angle - 2.0 * np.pi * pin / n_planets) % (2.0 * np.pi))
        for pin in range(n_planets)
    }


def polar_pictures(
    gap: FloatArray,
    law: FloatArray,
    effects: Effects,
    *,
    runs: Sequence[str],
    channels: Sequence[str],
    passing: Sequence[Mapping[str, float]],
    highest: int,
) -> tuple[Picture, ...]:
    """Polar plots of the run with the largest gap, sensor by sensor."""
    size = np.sqrt(np.mean(gap**2, axis=-1))
    if not np.isfinite(size).any():
        return ()
    complete = np.where(np.isfinite(size), size, -1.0)
    run, channel = map(int, np.unravel_index(np.argmax(complete), complete.shape))
    shown = [r for r in range(len(runs)) if np.isfinite(size[r]).all()]
    worth = np.flatnonzero(complete[run] >= 0.1 * complete[run, channel]).tolist()
    sensors = [(f"sensor {channels[c]}", gap[run, c], law[run, c], passing[c]) for c in worth]
    n_omitted = len(channels) - len(sensors[:_MOST_PANELS])
    planets = _NUMBER_WORDS[len(passing[channel]) - FEWEST_PLANETS]
    reading = _READING.format(highest=highest, planets=planets)
    if n_omitted:
        sensors_are = (
            "sensor with a smaller gap is" if n_omitted == 1 else ("sensors with a smaller gap are")
        )
        reading += f" {n_omitted} {sensors_are} not drawn."
    pictures = [_picture(f"Gap over one turn, run {runs[run]}", sensors, effects, reading)]
    if len(shown) > 1:
        by_run = [
            (f"run {runs[r]}", gap[r, channel], law[r, channel], passing[channel]) for r in shown
        ]
        title = f"Gap over one turn, sensor {channels[channel]}"
        caption = "The same at the sensor with the largest gap, run by run."
        pictures.append(_picture(title, by_run, effects, caption))
    return tuple(pictures)


def _picture(
    title: str,
    rows: Sequence[tuple[str, FloatArray, FloatArray, Mapping[str, float]]],
    effects: Effects,
    caption: str,
) -> Picture:
    panels = []
    for name, gap, law, passing in rows[:_MOST_PANELS]:
        # Copies: a view would keep the turns of all sensors in all runs.
        curves = {GAP: gap.copy(), LAW: law.copy(), REMAINDER: gap - law}
        roles = curves if effects else (GAP,)
        traces = tuple(Trace(role, _TURN_ANGLES, curves[role]) for role in roles)
        panels.append(Panel(name, traces, passing))
    axes = ("carrier angle", "deg", "displacement", "m")
    return Picture(title, caption, *axes, tuple(panels), is_polar=True)

"""Polar plots of a carrier for the report.

What the baseline leaves over one turn, and what the fitted effects explain.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.records.residual_orders import TURN_ANGLES, mean_turns
from carrierflex.diagnosis.carrier.records.sums import CarrierSums, ComplexArray
from carrierflex.diagnosis.comparison.overlay import GAP, LAW, LEFT, Overlay, Panel, Picture, Trace
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.geometry.parameters import FEWEST_PLANETS

_READING = (
    "Displacement at a sensor while the carrier turns once: mean of the revolutions, orders 0 to "
    "{highest}; outwards from the zero circle is positive. An offset is a larger or smaller "
    "circle, a tilt of the carrier a circle off the centre (order 1), flexible pins have {planets} "
    "lobes. Numbers at the edge: that pin passes the sensor."
)
_NUMBER_WORDS = ("three", "four", "five", "six", "seven", "eight")
#: Sensors and runs drawn at most.
_MOST_PANELS = 6
#: Share of the largest gap below which a sensor or a run is not drawn.
_WORTH_DRAWING = 0.1


def carrier_pictures(
    model: CarrierModel,
    records: CarrierSums,
    effects: Effects,
    gap: ComplexArray,
    left: ComplexArray,
    *,
    sensor_angles: Sequence[float],
) -> tuple[Picture, ...]:
    """Polar plots of a fitted model.

    Parameters
    ----------
    model : CarrierModel
        Runs and channels.
    records : CarrierSums
        Revolutions.
    effects : tuple of str
        Effects beside the baseline.
    gap, left : ndarray of complex, shape (R, C, n + 1)
        Order amplitudes of what the fitted set leaves without the effects, and with them.
    sensor_angles : sequence of float
        Housing angle of every channel [rad].

    Returns
    -------
    tuple of Picture
        See :func:`_carrier_polar`.
    """
    turns_of_gap, turns_of_law = (
        mean_turns(orders, records.run_of_revolution, len(model.runs))
        for orders in (gap, gap - left)
    )
    passing = [_pins_passing(angle, model.source.rig.n_planets) for angle in sensor_angles]
    return _carrier_polar(
        turns_of_gap,
        turns_of_law,
        effects,
        runs=model.runs,
        channels=model.channels,
        passing=passing,
        highest=gap.shape[-1] - 1,
    )


def _pins_passing(sensor_angle: float, n_planets: int) -> dict[str, float]:
    """Carrier angles [rad] at which the pins pass a sensor, by the number of the pin."""
    return {
        str(pin + 1): float((sensor_angle - 2.0 * np.pi * pin / n_planets) % (2.0 * np.pi))
        for pin in range(n_planets)
    }


def carrier_overlays(
    model: CarrierModel, measured: FloatArray, gaps: FloatArray
) -> tuple[Overlay, ...]:
    """Measured and simulated mean turn of every sensor in every run.

    Parameters
    ----------
    model : CarrierModel
        Runs and channels.
    measured, gaps : ndarray, shape (n_runs, C, 181)
        Measured signals over one turn, and the same less the simulated ones, :func:`mean_turns`;
        the overlays of two models share what was measured.

    Returns
    -------
    tuple of Overlay
        Runs without a complete revolution are left out.
    """
    angles = np.rad2deg(TURN_ANGLES)
    return tuple(
        Overlay(
            run,
            channel,
            angles,
            "carrier angle",
            "deg",
            measured[r, c],
            measured[r, c] - gaps[r, c],
        )
        for r, run in enumerate(model.runs)
        for c, channel in enumerate(model.channels)
        if np.isfinite(measured[r, c]).all()
    )


def _carrier_polar(
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
    run = int(complete.max(axis=1).argmax())
    channel = int(complete[run].argmax())
    shown = [r for r in range(len(runs)) if np.isfinite(size[r]).all()]
    worth = [
        c
        for c in range(len(channels))
        if complete[run, c] >= _WORTH_DRAWING * complete[run, channel]
    ]
    sensors = [(f"sensor {channels[c]}", gap[run, c], law[run, c], passing[c]) for c in worth]
    n_omitted = len(channels) - len(sensors[:_MOST_PANELS])
    note = (
        f" {n_omitted} sensor{'s' * (n_omitted > 1)} with a smaller gap "
        f"{'is' if n_omitted == 1 else 'are'} not drawn."
        if n_omitted
        else ""
    )
    planets = _NUMBER_WORDS[len(passing[channel]) - FEWEST_PLANETS]
    reading = _READING.format(highest=highest, planets=planets)
    pictures = [_picture(f"Gap over one turn, run {runs[run]}", sensors, effects, reading + note)]
    if len(shown) > 1:
        by_run = [
            (f"run {runs[r]}", gap[r, channel], law[r, channel], passing[channel]) for r in shown
        ]
        title = f"Gap over one turn, sensor {channels[channel]}"
        pictures.append(
            _picture(
                title, by_run, effects, "The same at the sensor with the largest gap, run by run."
            )
        )
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
        traces = [Trace(GAP, TURN_ANGLES, gap.copy())]
        if effects:
            traces += [Trace(LAW, TURN_ANGLES, law.copy()), Trace(LEFT, TURN_ANGLES, gap - law)]
        panels.append(Panel(name, tuple(traces), passing))
    return Picture(
        title=title,
        caption=caption,
        x_name="carrier angle",
        x_unit="deg",
        y_name="displacement",
        y_unit="m",
        panels=tuple(panels),
        is_polar=True,
    )

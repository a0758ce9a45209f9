"""Gap of a mounting along the motion that holds most of it, and what fitted effects make of it."""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.overlay import (
    GAP,
    LAW,
    Panel,
    Picture,
    Trace,
    is_function,
    strip_means,
)
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.mounting.gap_map import PATTERNS, pattern_matrix
from carrierflex.diagnosis.mounting.model import Choice, MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord

#: Runs drawn at most, and points of a cloud.
_MOST_RUNS = 3
_MOST_POINTS = 1500


def mounting_pictures(
    model: MountingModel,
    records: Sequence[MountingRecord],
    effects: Effects,
    theta: FloatArray,
    choice: Choice,
) -> tuple[Picture, ...]:
    """Measured less linear prediction over the measured motion, one run of each condition.

    Largest gaps first.

    Parameters
    ----------
    model : MountingModel
        Parameters and simulator.
    records : sequence of MountingRecord
        Runs.
    effects : tuple of str
        Effects beside the baseline.
    theta : ndarray, shape (p,)
        Parameters of both.
    choice : mapping of str to int
        Channel of each effect of one sensor.

    Returns
    -------
    tuple of Picture
        One: the motion pattern with the largest gap; none where the motion leaves the model.
    """
    names, matrix = pattern_matrix(model.sensors, model.channels)
    base = theta[: len(model.parameters(()))]
    rows = []
    for record in records:
        before, after = (
            model.predicted(record, *own, choice) for own in (((), base), (effects, theta))
        )
        if not (np.isfinite(before).all() and np.isfinite(after).all()):
            return ()
        complete = np.isfinite(record.measured).all(axis=1)
        rows.append(
            [
                (values @ matrix.T)[complete]
                for values in (record.measured, record.measured - before, after - before)
            ]
        )
    k = int(np.argmax(np.sum([np.square(gap).sum(axis=0) for _, gap, _ in rows], axis=0)))
    largest: dict[str, tuple[float, Panel]] = {}
    for record, (motion, gap, law) in zip(records, rows, strict=True):
        size = float(gap[:, k].std()) if len(gap) > 1 and np.ptp(motion[:, k]) > 0.0 else -1.0
        if size > largest.get(record.condition, (0.0,))[0]:
            largest[record.condition] = (
                size,
                _panel(record, motion[:, k], gap[:, k], law[:, k] if effects else None),
            )
    panels = [
        panel for _, panel in sorted(largest.values(), key=lambda entry: -entry[0])[:_MOST_RUNS]
    ]
    return (_picture(names[k], effects, tuple(panels)),) if panels else ()


def _panel(
    record: MountingRecord, motion: FloatArray, gap: FloatArray, law: FloatArray | None
) -> Panel:
    chosen = slice(None, None, max(1, -(-motion.size // _MOST_POINTS)))
    traces = [Trace(GAP, motion[chosen], gap[chosen], np.gradient(motion, record.step)[chosen])]
    if law is not None:
        traces.append(
            Trace(
                LAW,
                *(
                    strip_means(motion, law)
                    if is_function(motion, law)
                    else (motion[chosen], law[chosen])
                ),
            )
        )
    return Panel(f"run {record.name}", tuple(traces))


def _picture(name: str, effects: Effects, panels: tuple[Panel, ...]) -> Picture:
    law = (
        f"Orange: what the fitted effects ({set_name(effects)}) add to it. "
        if effects
        else "No effect was accepted. "
    )
    motion = f"{name} motion" if name in PATTERNS else f"motion at {name}"
    return Picture(
        title=f"Unexplained {motion}",
        caption=(
            "Coloured points: measured less predicted by the baseline, along the measured "
            f"{motion}. {law}A spring bends one line; friction, fluid and delay open a loop; "
            "another load than the one that moves it makes a cloud."
        ),
        x_name=motion,
        x_unit="m",
        y_name="unexplained",
        y_unit="m",
        panels=panels,
        shade_name="speed",
        shade_unit="m/s",
    )

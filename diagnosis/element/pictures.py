"""Force-space loops of an element for the report.

The force that the baseline leaves, and the fitted law, along the motion.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

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
from carrierflex.diagnosis.comparison.problem import BASELINE, Effects, FloatArray
from carrierflex.diagnosis.element.model import ElementModel, values_by_effect
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.signatures import Column, column_values, known_force

#: Runs drawn at most, and points of a cloud: enough for its shape, few enough for the file.
_MOST_RUNS = 3
_MOST_POINTS = 2000
#: Points at each end of the range, which an even choice would miss although they tell most about a
#: law.
_END_POINTS = 150


def element_loops(
    model: ElementModel, records: Sequence[ElementRecord], effects: Effects, theta: FloatArray
) -> tuple[Picture, ...]:
    """Unexplained force over deflection and over speed, the largest run of each condition.

    ``f_left = f_measured - (m q'' + C1 q' + K1 q + f0 + contained effects)`` along the measured
    motion, in the trusted band; the law is the force of the effects along the same motion.
    Over the speed too, unless the fitted law is a function of the deflection.
    """
    values = values_by_effect(model.parameters(effects), theta)

    def force_of(record: ElementRecord, effect: str) -> FloatArray:
        return _effect_force(model, record, effect, values)

    largest: dict[str, tuple[float, ElementRecord, FloatArray]] = {}
    for record in records:
        q, v, a = record.motion
        base = values[BASELINE]
        # A given mass is in the known force already.
        baseline = base.get("m", 0.0) * a + base["C1"] * v + base["K1"] * q + base["f0"]
        for effect in model.contained:
            baseline = baseline + force_of(record, effect)
        lacking = record.where_flat(known_force(model, record) - baseline)
        size = float(np.std(lacking[record.counts]))
        if size > largest.get(record.condition, (-1.0,))[0]:
            largest[record.condition] = (size, record, lacking)
    chosen = sorted(largest.values(), key=lambda entry: -entry[0])[:_MOST_RUNS]
    runs = [
        (
            record,
            lacking,
            np.sum([force_of(record, effect) for effect in effects], axis=0) if effects else None,
        )
        for _, record, lacking in chosen
    ]
    pictures = [_picture(model, runs, effects, against=0)]
    if not all(law is not None and is_function(record.motion[0], law) for record, _, law in runs):
        pictures.append(_picture(model, runs, effects, against=1))
    return tuple(pictures)


def _effect_force(
    model: ElementModel,
    record: ElementRecord,
    effect: str,
    values: Mapping[str, Mapping[str, float]],
) -> FloatArray:
    parameters = values[effect]
    if effect == "sensor_delay":
        return parameters["delay"] * column_values(model, record, Column(effect, "delay", {}, ()))
    if effect == "backlash":
        # Its column is per unit of the stiffness that is missing within the gap.
        return values[BASELINE]["K1"] * column_values(
            model, record, Column(effect, "K1", parameters, ())
        )
    return model.signature(record, effect, parameters)


def _chosen_points(samples: NDArray[np.int64], x: FloatArray) -> NDArray[np.int64]:
    """Every n-th index, and those at both ends of x."""
    by_size = samples[np.argsort(x[samples])]
    every = samples[:: -(-samples.size // _MOST_POINTS)]
    return np.unique(np.concatenate([every, by_size[:_END_POINTS], by_size[-_END_POINTS:]]))


def _picture(
    model: ElementModel,
    runs: Sequence[tuple[ElementRecord, FloatArray, FloatArray | None]],
    effects: Effects,
    *,
    against: int,
) -> Picture:
    """Clouds over deflection (0) or speed (1), shaded by the other of the two."""
    names = (("deflection", model.units[1]), ("speed", f"{model.units[1]}/s"))
    panels = []
    for record, lacking, law in runs:
        samples = _chosen_points(np.flatnonzero(record.counts), record.motion[against])
        x, shade = record.motion[against][samples], record.motion[1 - against][samples]
        traces = [Trace(GAP, x, lacking[samples], shade)]
        if law is not None:
            curve = record.motion[against][record.counts], law[record.counts]
            traces.append(
                Trace(LAW, *(strip_means(*curve) if is_function(*curve) else (x, law[samples])))
            )
        panels.append(Panel(f"run {record.name}", tuple(traces)))
    named = set_name(effects)
    law_text = (
        f"Orange: the fitted law ({named}). "
        if effects
        else "No effect was accepted: no law is drawn. "
    )
    return Picture(
        title=f"Unexplained force over {names[against][0]}",
        caption=(
            "Coloured points: measured force less inertia, linear spring, linear damper and "
            "constant force of the baseline "
            f"along the measured motion. {law_text}A spring law is one line over deflection, a "
            "damper law one line over speed; dry friction and relaxation open a loop."
        ),
        x_name=names[against][0],
        x_unit=names[against][1],
        y_name="unexplained force",
        y_unit=model.units[0],
        panels=tuple(panels),
        shade_name=names[1 - against][0],
        shade_unit=names[1 - against][1],
    )

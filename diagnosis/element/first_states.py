"""Deflection and speed at the first sample of a driven run.

A derivative in a band needs both sides of a sample. Where a drive sets in with the first sample,
the mass is at rest and accelerates at once; the band makes a speed of that, whose decay would be a
gap at the beginning of the run.
"""

from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import BASELINE, FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord

#: Share of a period of the motion that a parabola follows, and samples it needs.
_QUARTER = 0.25
_FEWEST_SAMPLES = 6
#: Periods of the motion over which starts are compared.
_COMPARED_PERIODS = 10.0
#: Square that another start leaves of that of the measured one, where it is taken.
_CLEARLY_LESS = 0.9


def with_likely_start(model: ElementModel, record: ElementRecord) -> ElementRecord:
    """Record with the start under which the linear element follows its first periods best.

    The measured one, that of a parabola through the first samples, or rest.

    Parameters
    ----------
    model : ElementModel
        Model with its scale.
    record : ElementRecord
        Run under a force or a moving base.
    """
    if record.in_steady_state:
        return record
    q, v = record.motion[:2]
    omega = float(v.std() / q.std())
    n = int(_COMPARED_PERIODS * 2.0 * np.pi / (omega * record.step))
    starts = [record.measured_start, *_early_states(record, omega)]
    squares = [_missed(model, replace(record, start=start), n) for start in starts]
    best = int(np.argmin(squares))
    if best and squares[best] < _CLEARLY_LESS * squares[0]:
        return replace(record, start=starts[best])
    return record


def _early_states(record: ElementRecord, omega: float) -> list[tuple[float, float]]:
    """Start by a parabola through the first samples, and at rest under a force that changes."""
    n = max(_FEWEST_SAMPLES, round(_QUARTER * 2.0 * np.pi / (omega * record.step)))
    t = record.step * np.arange(min(n, record.response.size))
    first = record.response[: t.size]
    moving, resting = (
        np.linalg.lstsq(np.array([t**k for k in powers]).T, first, rcond=None)[0]
        for powers in ((0, 1, 2), (0, 2, 3))
    )
    return [(float(moving[0]), float(moving[1])), (float(resting[0]), 0.0)]


def _missed(model: ElementModel, record: ElementRecord, n: int) -> float:
    """Square that the linear element leaves of the first samples; infinite where it runs away."""
    plain = replace(model, contained=())
    values = {name: getattr(model.scale, name) for name in ("m", "K1", "C1", "f0")}
    parameters = [p for p in plain.parameters(()) if p.effect == BASELINE]
    theta = np.array([np.clip(values[p.name], p.lower, p.upper) for p in parameters])
    residual: FloatArray = (record.response - plain.predicted(record, (), theta))[:n]
    return float(residual @ residual) if np.isfinite(residual).all() else float("inf")

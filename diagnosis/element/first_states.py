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
from carrierflex.identification.campaign.signals import HALF_WINDOW

#: Share of a period of the motion that a polynomial follows, and samples it needs.
_QUARTER = 0.25
_FEWEST_SAMPLES = 6
_FEWEST_COMPARED = 12
#: Periods of the motion over which starts are compared: a force that the element lacks hardly
#: moves it in half of one.
_COMPARED_PERIODS = 0.5
#: Weights of what the measured start, rest, and the starts of polynomials of degree two and three
#: leave: rest is likely where it leaves less than twice as much, polynomials follow noise.
_WEIGHTS = np.array([1.0, 0.5, 2.0, 2.0])


def with_likely_start(model: ElementModel, record: ElementRecord) -> ElementRecord:
    """Driven record with the start under which the linear element follows its beginning best.

    The measured one, rest, or that of a polynomial through the first samples.
    """
    if record.in_steady_state:
        return record
    q, v = record.motion[:2]
    omega = float(v.std() / q.std())
    n = max(_FEWEST_COMPARED, int(_COMPARED_PERIODS * 2.0 * np.pi / (omega * record.step)))
    starts = [record.measured_start, *_early_states(record, omega)]
    # The drive is known between its samples by those on either side.
    early = record.beginning(n + HALF_WINDOW)
    squares = [_missed(model, replace(early, start=start), n) for start in starts]
    return replace(record, start=starts[int(np.argmin(_WEIGHTS * squares))])


def _early_states(record: ElementRecord, omega: float) -> list[tuple[float, float]]:
    """Start at rest, and by polynomials of degree two and three through the first samples."""
    n = max(_FEWEST_SAMPLES, round(_QUARTER * 2.0 * np.pi / (omega * record.step)))
    first = record.response[:n]
    t = record.step * np.arange(first.size)
    states = [(float(first[0]), 0.0)]
    for degree in (2, 3):
        columns = np.array([t**power for power in range(degree + 1)]).T
        q_0, v_0, *_ = np.linalg.lstsq(columns, first, rcond=None)[0].tolist()
        states.append((q_0, v_0))
    return states


def _missed(model: ElementModel, record: ElementRecord, n: int) -> float:
    """Square that the linear element leaves of the first samples; infinite where it runs away."""
    plain = replace(model, contained=())
    values = {name: getattr(model.scale, name) for name in ("m", "K1", "C1", "f0")}
    parameters = [p for p in plain.parameters(()) if p.effect == BASELINE]
    theta = np.array([np.clip(values[p.name], p.lower, p.upper) for p in parameters])
    residual: FloatArray = (record.response - plain.predicted(record, (), theta))[:n]
    return float(residual @ residual) if np.isfinite(residual).all() else float("inf")

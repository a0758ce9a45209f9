"""What a delay does to an element whose runs are all driven at one frequency.

The element is ``D = K1 - m w² + i w C1``, force over deflection. A deflection that is written the
time tau late is ``x e^(-i w tau)``, and ``D e^(i w tau)`` fits the records as well as D does:

    C1' = C1 + tau (K1 - m w²),   K1' - m' w² = K1 - m w² - tau w² C1   (first order in tau).

A force that is late turns D the other way. At a second frequency the same delay asks for another
damping, and shows.
"""

from collections.abc import Sequence

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord


def delay_words(model: ElementModel, records: Sequence[ElementRecord], theta: FloatArray) -> str:
    """Words on what half a sample between force and deflection does to the damping.

    Parameters
    ----------
    model : ElementModel
        Baseline with its scale.
    records : sequence of ElementRecord
        Runs, driven at one frequency.
    theta : ndarray, shape (p,)
        Parameters of a set, the baseline's first.
    """
    named = zip(model.parameters(()), theta, strict=False)
    values = {"m": model.mass or 0.0} | {own.name: float(value) for own, value in named}
    speed_ratio = model.scale.speed / model.scale.deflection
    tau = 0.5 * max(record.step for record in records)
    change = abs(tau * (values["K1"] - values["m"] * speed_ratio**2))
    unit = model.unit_of((1, -1, 1))
    return (
        "one frequency drives all runs: a delay between force and deflection reads as damping "
        f"and shows in no record; half a sample ({1e3 * tau:.3g} ms) moves C1 by {change:.3g} "
        f"{unit}, tau (K1 - m w²)"
    )

"""A floor that is believable where no noise was declared and nothing repeats.

The plateau of a spectrum is the noise of a record that was not filtered. After a low-pass filter
the plateau is what the filter let through, and a gap of such a floor is thousands of times it.
"""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.limits import element_limits
from carrierflex.diagnosis.element.classes.table import ElementTable, element_table
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord

#: Square that the best class leaves, over the plateau's, above which the plateau is not the noise:
#: an RMS of three, which no colour of a sensor's noise makes.
_BELIEVABLE = 9.0
FLOOR_NOTE = (
    "the noise floor cannot be known from these records (the plateau of the spectrum lies far "
    "below what no class can learn, as after a low-pass filter): what no class learns is taken as "
    "the floor, and the verdict rests on shares"
)


def believable_noise(
    model: ElementModel, records: Sequence[ElementRecord], noise: FloatArray
) -> tuple[FloatArray, str, ElementTable | None]:
    """Variance of the noise by run, raised to what no class can learn where the plateau is absurd.

    Parameters
    ----------
    model : ElementModel
        Baseline and library.
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance from the plateau of the spectrum.

    Returns
    -------
    tuple of (ndarray, str, ElementTable or None)
        Variances; what the records cannot say, empty where the plateau is believed; then also the
        table of the classes, which holds for these variances.
    """
    own = element_table(model, records, noise, element_limits())
    if own is None:
        return noise, "", None
    if is_believed(own):
        return noise, "", own
    least, floor = _least_and_floor(own)
    return np.asarray(noise * least / max(floor, 1e-300)), FLOOR_NOTE, None


def is_believed(own: ElementTable) -> bool:
    """Whether the plateau that a table was made with is taken for the noise."""
    least, floor = _least_and_floor(own)
    return least <= _BELIEVABLE * floor


def _least_and_floor(own: ElementTable) -> tuple[float, float]:
    """Squares that the best class leaves, and those that the noise alone would."""
    scores = own.scores
    least = min([scores.ceiling().total, *(scores.of((name,)).total for name in own.table.classes)])
    return least, float(own.table.floor.sum())

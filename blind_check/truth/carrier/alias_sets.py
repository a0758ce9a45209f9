"""Which classes of causes the sensors of a case do not tell from those that it holds.

By the truth's own equations: a cause is another class's signal as well where the forms of that
class, at values of their own, leave no more of it than errors of the sensors may leave. Lobes of as
many waves as planets read ``cos n(v - theta)``; at four sensors a quarter turn apart ``n v`` and
``(n - 4) v`` are one pattern. The first wave of three lobes is a tilt at the planets' order there,
and the second and third alone tell the two apart.
"""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS, drawn_form
from carrierflex.blind_check.truth.carrier.signals import RimRecord
from carrierflex.blind_check.truth.linear_refit import LinearBaseline
from carrierflex.blind_check.truth.noise import root_mean_square

FloatArray = NDArray[np.float64]

#: Draws of each form, whose sums are the signals of a class: five values of a form at most, the
#: same in every case.
_DRAWS, _SEED = 8, 4
#: One sample of so many is looked at: orders up to 12 keep four a period.
_THINNED = 3


def alias_sets(
    alone: Mapping[str, Sequence[FloatArray]],
    records: Sequence[RimRecord],
    baseline: LinearBaseline,
    most: float,
) -> tuple[tuple[str, ...], ...]:
    """Sets of frames and patterns that these records may not tell from the truth's.

    Parameters
    ----------
    alone : mapping of str to sequence of ndarray
        Signal of each cause [m], shape (n_channels, n) by run.
    records : sequence of RimRecord
        What acts.
    baseline : LinearBaseline
        What is refitted beside the causes.
    most : float
        RMS that another class may leave of a cause [m].

    Returns
    -------
    tuple of tuple of str
        Each sorted; without the truth's own set.
    """
    shape_of = {name: OTHER_FORMS[name].shape for name in alone}
    others = sorted({form.shape for form in OTHER_FORMS.values()} - set(shape_of.values()))
    remaining = {shape: _baseline_with_class(shape, records, baseline) for shape in others if alone}
    choices = [
        [
            shape_of[name],
            *(shape for shape in others if _residual_rms(remaining[shape], alone[name]) <= most),
        ]
        for name in alone
    ]
    sets = {tuple(sorted(ids)) for ids in product(*choices) if len(set(ids)) == len(ids)}
    return tuple(sorted(sets - {tuple(sorted(shape_of.values()))}))


def _baseline_with_class(
    shape: str, records: Sequence[RimRecord], baseline: LinearBaseline
) -> LinearBaseline:
    """Baseline with the signals of a class, at every value of its forms."""
    rng = np.random.default_rng(_SEED)
    forms = [name for name, form in OTHER_FORMS.items() if form.shape == shape]
    drawn = [(name, drawn_form(name, rng)) for name in forms for _ in range(_DRAWS)]
    columns = []
    for record, regressors in zip(records, baseline.columns, strict=True):
        signals = [OTHER_FORMS[name].signal(record, values) for name, values in drawn]
        n_channels = record.sensors.shape[0]
        known = regressors.reshape(n_channels, record.time.size, -1)[:, ::_THINNED]
        rows = [_thinned(signal).reshape(-1, 1) for signal in signals]
        columns.append(np.concatenate([known.reshape(len(rows[0]), -1), *rows], axis=1))
    return LinearBaseline(columns, baseline.own_offset)


def _residual_rms(extended: LinearBaseline, signals: Sequence[FloatArray]) -> float:
    """RMS that a baseline leaves of signals [m]."""
    residuals = extended.residuals([_thinned(signal) for signal in signals])
    return root_mean_square(np.concatenate([residual.reshape(-1) for residual in residuals]))


def _thinned(signal: FloatArray) -> FloatArray:
    return signal[:, ::_THINNED]

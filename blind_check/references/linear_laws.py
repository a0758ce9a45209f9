"""Two references on the screen's columns: best single law by BIC, and sparse regression.

Both know the library, the baseline and the signals that a diagnosis screens with, and nothing of
held-out records, alias classes or noise: what is left after the baseline's regressors are taken out
is fitted by least squares.

    BIC = n ln(RSS / n) + k ln n,  k the columns of the laws, and one for each law that has shapes.

References
----------
.. [1] G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6 (1978) 461.
.. [2] S. L. Brunton, J. L. Proctor, J. N. Kutz, "Discovering governing equations from data by
   sparse identification of nonlinear dynamical systems", PNAS 113 (2016) 3932.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.estimation.scaled_least_squares import (
    normal_inverse,
    normal_solution,
)

#: Thresholds of the sparse regression: part of the residual's square that a law must carry.
_THRESHOLDS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class _Law:
    """Columns of a law at its best shape, and how many unknowns that takes."""

    columns: tuple[int, ...]
    n_unknowns: int


def best_single_law(table: GramTable, n_samples: float) -> tuple[str, ...]:
    """Law that lowers the BIC most; empty where none lowers it.

    Parameters
    ----------
    table : GramTable
        Products of the laws' columns.
    n_samples : float
        Samples of all channels.
    """
    gram = _residual_gram(table)
    laws = _laws(table, gram)
    values: dict[tuple[str, ...], float] = {(): _bic(gram, [], n_samples)}
    values |= {(name,): _bic(gram, [law], n_samples) for name, law in laws.items()}
    return min(values, key=lambda names: values[names])


def sparse_laws(table: GramTable, n_samples: float) -> tuple[str, ...]:
    """Laws that sequentially thresholded least squares keeps, the threshold chosen by BIC.

    All laws are fitted together; those that carry less than the threshold of the residual's square
    are dropped, and the rest is fitted again until none is.

    Parameters
    ----------
    table : GramTable
        Products of the laws' columns.
    n_samples : float
        Samples of all channels.
    """
    gram = _residual_gram(table)
    laws = _laws(table, gram)
    values: dict[tuple[str, ...], float] = {(): _bic(gram, [], n_samples)}
    for threshold in _THRESHOLDS:
        chosen = _thresholded(gram, laws, threshold)
        values[chosen] = _bic(gram, [laws[name] for name in chosen], n_samples)
    return min(values, key=lambda names: values[names])


#: Answers of every reference by its name.
REFERENCES = {"best_single_law": best_single_law, "sparse_regression": sparse_laws}


def _residual_gram(table: GramTable) -> FloatArray:
    """Products of target and laws once the baseline is taken out of all."""
    base, gram = table.base, table.total
    return np.asarray(gram - gram[:, base] @ normal_inverse(gram[np.ix_(base, base)]) @ gram[base])


def _laws(table: GramTable, gram: FloatArray) -> dict[str, _Law]:
    """Every law of the library at the shape that alone leaves least."""
    laws = {}
    for name, law in table.library.items():
        best = min(law.variants, key=lambda columns: _residual_square(gram, columns.tolist()))
        laws[name] = _Law(tuple(best.tolist()), best.size + (len(law.variants) > 1))
    return laws


def _residual_square(gram: FloatArray, columns: Sequence[int]) -> float:
    """Sum of squares that a fit of some columns leaves of the target."""
    index = list(columns)
    return float(gram[0, 0] - gram[0, index] @ _fit(gram, index))


def _fit(gram: FloatArray, columns: Sequence[int]) -> FloatArray:
    """Least squares of the target on some columns."""
    index = list(columns)
    return normal_solution(gram[np.ix_(index, index)], gram[index, 0])


def _bic(gram: FloatArray, laws: Sequence[_Law], n_samples: float) -> float:
    columns = [column for law in laws for column in law.columns]
    remaining = max(_residual_square(gram, columns), _ROUNDING * gram[0, 0])
    n_unknowns = sum(law.n_unknowns for law in laws)
    return float(n_samples * np.log(remaining / n_samples) + n_unknowns * np.log(n_samples))


def _thresholded(gram: FloatArray, laws: Mapping[str, _Law], threshold: float) -> tuple[str, ...]:
    """Laws that are kept at one threshold."""
    chosen = tuple(sorted(laws))
    while chosen:
        columns = [column for name in chosen for column in laws[name].columns]
        amounts = dict(zip(columns, _fit(gram, columns).tolist(), strict=True))
        carried = {name: _square(gram, laws[name].columns, amounts) for name in chosen}
        fewer = tuple(name for name in chosen if carried[name] >= threshold * gram[0, 0])
        if fewer == chosen:
            break
        chosen = fewer
    return chosen


def _square(gram: FloatArray, columns: Sequence[int], amounts: Mapping[int, float]) -> float:
    """Sum of squares of what some columns carry in a fit."""
    index = list(columns)
    values = np.array([amounts[column] for column in index])
    return float(values @ gram[np.ix_(index, index)] @ values)

"""Weights of the columns of a carrier's signals, and their derivatives, summed up term by term."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class WeightedColumn:
    """Weight of one column in some runs.

    Parameters
    ----------
    owner : str
        Effect, or the prediction of another simulator.
    parameter : int
        Number of the owner's parameter.
    runs : slice
        Runs in which it acts.
    column : int
        Number of the column.
    weight : float
        Factor of the column.
    slopes : mapping of int to float
        Derivatives of the weight by the number of the unknown among those of the run.
    """

    owner: str
    parameter: int
    runs: slice
    column: int
    weight: float
    slopes: Mapping[int, float]


@dataclass(frozen=True, eq=False)
class WeightTable:
    """Weights of the columns in use, summed up term by term; u columns, q unknowns of a run.

    Unknowns that are another run's own are left out: with hundreds of runs they are nearly all.

    Parameters
    ----------
    columns : ndarray of int, shape (u,)
        Numbers of the columns, ascending, the target first.
    unknowns : ndarray of int, shape (n_runs, q)
        Numbers of the unknowns that act in every run.
    values : ndarray, shape (n_runs, n_channels, u)
        Weights.
    slopes : ndarray, shape (n_runs, n_channels, q, u)
        Their derivatives by the unknowns of the run.
    """

    columns: IntArray
    unknowns: IntArray
    values: FloatArray
    slopes: FloatArray

    @property
    def used(self) -> tuple[IntArray, FloatArray]:
        """Columns and their weights without the derivatives, which are many times as large."""
        return self.columns, self.values

    @property
    def residual(self) -> FloatArray:
        """Weights of what is left of the target, shape (n_runs, n_channels, u)."""
        left = -self.values
        left[..., 0] += 1.0
        return left

    def add(self, terms: Iterable[WeightedColumn], channels: int | slice) -> None:
        """Add terms to some channels."""
        for term in terms:
            place = int(np.searchsorted(self.columns, term.column))
            self.values[term.runs, channels, place] += term.weight
            for unknown, slope in term.slopes.items():
                self.slopes[term.runs, channels, unknown, place] += slope

    def amplify(self, channel: int | slice, gain: float, unknown: int) -> None:
        """Read a channel ``1 + gain`` times as large; `unknown` is the number of the gain."""
        self.slopes[:, channel] *= 1.0 + gain
        self.slopes[:, channel, unknown] = self.values[:, channel]
        self.values[:, channel] *= 1.0 + gain


def acts(term: WeightedColumn) -> bool:
    """Whether a term has a weight or a derivative."""
    return term.weight != 0.0 or any(term.slopes.values())

"""Columns of one group of a class as a function of a run."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from carrierflex.diagnosis.comparison.problem import FloatArray

Run = TypeVar("Run")


@dataclass(frozen=True, eq=False)
class GroupColumns(Generic[Run]):
    """How the columns of one group are made of a run, and their penalty.

    Parameters
    ----------
    id : str
        Group.
    columns : callable
        Gives the columns of a run, the number of the column first.
    penalty : ndarray, shape (n_columns, n_columns)
        Penalty of unit mean diagonal.
    is_nonnegative : bool
        Whether coefficients are >= 0.
    """

    id: str
    columns: Callable[[Run], FloatArray]
    penalty: FloatArray
    is_nonnegative: bool = False

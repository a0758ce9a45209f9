"""One table for all classes: products of target, baseline, class and law columns by block."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.estimation.scaled_least_squares import full_inverse, normal_inverse

IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ColumnGroup:
    """Columns that are penalised together."""

    columns: IntArray  # Places in the table, shape (n,)
    #: Penalty ``c' P c`` of their coefficients, of unit mean diagonal, shape (n, n)
    penalty: FloatArray
    is_nonnegative: bool = False  # Whether the coefficients are >= 0


@dataclass(frozen=True, eq=False)
class LawColumns:
    """A law of the library: one column, or several, for each of its shapes."""

    id: str  # Effect
    variants: tuple[IntArray, ...]  # Places of the columns of each shape
    n_parameters: int  # Parameters of the law


@dataclass(frozen=True, eq=False)
class GramTable:
    """Products of all columns by block; every fit and score is a small solve on them.

    Columns in this order: the target, `n_base` regressors of the baseline, then groups and laws.
    """

    gram: FloatArray  # Products of the columns by block, shape (n_blocks, n, n)
    n_base: int  # Regressors of the baseline
    groups: Mapping[str, ColumnGroup]  # Columns by name of the group
    classes: Mapping[str, tuple[str, ...]]  # Groups of each class
    surface: str  # Class that contains others (coupled); empty where none
    ceiling: tuple[str, ...]  # Groups of the union of all classes
    laws: Mapping[str, tuple[LawColumns, ...]]  # Laws that lie in each class
    #: Sum of squares that noise alone leaves; NaN where it is not known, shape (n_blocks,)
    floor: FloatArray
    folds: IntArray  # Fold in which each block is held out, shape (n_blocks,)
    scale: FloatArray  # Factor that each column was multiplied by, shape (n,)
    #: Classes that share out one coupled cause where an answer holds them all: a damping ``h(x)
    #: g(v)`` is neither a ``g(v)`` nor an ``h(x) v``, and their sum no sum of laws. The coupled
    #: class takes their place where one of its products leaves less than their sum.
    coupled_parts: frozenset[str] = frozenset()
    #: The one of them that holds a function of one argument, ``g(v)``: it gives way to one of both,
    #: product or sum, that takes half of what it leaves. Empty where there is none.
    uncoupled_part: str = ""
    #: Groups of the coupled class in as few columns as the sum of its parts, by what they are: a
    #: power of the speed other than the first, times any function of the place
    products: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    #: Quadratic penalty of the baseline's regressors by what is known of them beforehand; empty
    #: where nothing is, shape (n_base,)
    base_penalty: FloatArray = field(default_factory=lambda: np.empty(0))
    #: Places of the laws' columns whose coefficient is at least zero: play softens a spring at rest
    #: and never stiffens it
    one_way: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    @property
    def library(self) -> dict[str, LawColumns]:
        """Laws by id, each once."""
        return {law.id: law for laws in self.laws.values() for law in laws}

    @cached_property
    def total(self) -> FloatArray:
        """Products over all blocks, shape (n, n)."""
        return np.asarray(self.gram.sum(axis=0))

    @cached_property
    def training(self) -> FloatArray:
        """Products over the blocks outside each fold, shape (n_folds, n, n)."""
        folds = range(int(self.folds.max()) + 1)
        return np.array([self.total - self.gram[self.folds == fold].sum(axis=0) for fold in folds])

    @property
    def sizes(self) -> dict[str, int]:
        """Columns of each class."""
        return {
            name: sum(self.groups[group].columns.size for group in members)
            for name, members in self.classes.items()
        }

    def is_in_surface(self, name: str) -> bool:
        """Whether the coupled class holds all of a class: itself, and what it contains."""
        return bool(self.surface) and set(self.classes[name]) <= set(self.classes[self.surface])

    @property
    def base(self) -> IntArray:
        """Places of the baseline's regressors."""
        return np.arange(1, 1 + self.n_base)


def discrepancy_shift(table: GramTable, J: FloatArray, *, independent_samples: float) -> FloatArray:
    """Shift of parameters that are fitted beside a discrepancy of no known form, shape (p,).

    ``F = J theta + sum_j c_j phi_j + noise``, ``c_j ~ N(0, tau_j²)`` over the columns phi of all
    classes, ``tau_j² = d² / (n pi rms_j²)``: together the n columns make, beyond what the
    parameters take up (the mean share pi), the mean square d² that the fit leaves above the floor
    [1]_. The shift of theta against the fit without them shows how far the answer depends on the
    discrepancy's form; the posterior would be drawn to a discrepancy of mean zero [2]_.

    `J` are the derivatives of the target by the parameters as coefficients of the columns, shape
    (n_columns, p); of `independent_samples` the noise is independent, N_eff: the floor of a sample
    is taken N / N_eff times. Zero where the fit leaves no more than the floor, and for a parameter
    without a derivative.

    References
    ----------
    .. [1] M. C. Kennedy, A. O'Hagan, "Bayesian calibration of computer models", J. R. Statist.
       Soc. B 63 (2001) 425-464.
    .. [2] J. Brynjarsdottir, A. O'Hagan, "Learning about physical parameters: the importance of
       model discrepancy", Inverse Problems 30 (2014) 114007.
    """
    G = table.total
    columns = np.concatenate([table.groups[name].columns for name in table.ceiling])
    columns = columns[np.diag(G)[columns] > 0.0]
    # Zero for a parameter without a derivative.
    A_inverse = normal_inverse(J.T @ G @ J)
    coupling = J.T @ G[:, columns]
    fitted = A_inverse @ (J.T @ G[:, 0])
    floor = float(table.floor.sum())
    above_floor = G[0, 0] - fitted @ (J.T @ G[:, 0]) - floor
    if not above_floor > 0.0:
        return np.zeros(J.shape[1])
    products = G[np.ix_(columns, columns)]
    energy = np.diag(products)
    remaining = products - coupling.T @ A_inverse @ coupling
    share_beyond = float(np.mean(np.diag(remaining) / energy))
    tau_square = above_floor / (columns.size * share_beyond * energy)
    ridge = floor / independent_samples / tau_square
    target = G[columns, 0] - coupling.T @ fitted
    c = full_inverse(remaining + np.diag(ridge)) @ target
    return np.asarray(-A_inverse @ (coupling @ c))


class TableRows:
    """Rows of a table along one run, and where they stand: target and baseline, groups, laws."""

    def __init__(
        self,
        target: FloatArray,
        base: FloatArray,
        filtered: Callable[[FloatArray], FloatArray] = lambda rows: rows,
    ) -> None:
        """First rows: the target, shape (1, ...), and the regressors of the baseline.

        What `filtered` makes of them is held, and of all rows that are added.
        """
        self._filtered = filtered
        self.rows = [filtered(target), filtered(base)]
        #: Regressors of the baseline.
        self.n_base = len(base)
        self.groups: dict[str, ColumnGroup] = {}
        self.laws: dict[str, tuple[IntArray, ...]] = {}

    def add_group(
        self, name: str, rows: FloatArray, penalty: FloatArray, *, is_nonnegative: bool = False
    ) -> None:
        """Add the rows of a group, shape (n, ...)."""
        self.groups[name] = ColumnGroup(self._indices(rows), penalty, is_nonnegative)

    def add_law(self, name: str, rows: FloatArray) -> None:
        """Add the rows of a law, shape (n_shapes, n_columns, ...)."""
        indices = self._indices(rows.reshape(-1, *rows.shape[2:]))
        self.laws[name] = tuple(indices.reshape(rows.shape[:2]))

    def _indices(self, rows: FloatArray) -> IntArray:
        first = sum(map(len, self.rows))
        self.rows.append(self._filtered(rows))
        return np.arange(first, first + len(rows))

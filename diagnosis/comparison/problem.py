"""Segments, parameters, sums and cells: what a comparison problem is made of."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Annotated, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.effect_parameters import PolarPair
from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.simulation.force_effect import ForceEffect

#: Owner of the parameters of the baseline.
BASELINE = "baseline"

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]
Effects = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Segment:
    """A block of one run: the smallest part of the record that is fitted or scored as a whole."""

    #: run, condition: its run and that run's condition
    run: str
    condition: str
    block: int  # Number of the block in the run, from 0
    n_samples: int  # Samples that count, over all channels


@dataclass(frozen=True)
class Parameter(FitParameter):
    """One unknown of a set of effects."""

    effect: str = field(kw_only=True)  # Owner: an effect id or ``baseline``
    #: Standard deviation of the Gaussian prior; infinite: none
    prior_std: float = field(default=np.inf, kw_only=True)
    #: Mean of the prior: zero where the effect may be absent, or what is known of it
    prior_mean: float = field(default=0.0, kw_only=True)
    #: The run it belongs to; None where all runs share it. A run's own parameters are fitted again
    #: on part of a held-out condition, as no other condition knows them.
    run: str | None = field(default=None, kw_only=True)
    #: Whether another parameter of zero switches the effect off
    shape: bool = field(default=False, kw_only=True)
    #: The vector of which this parameter and its neighbour are the components; it is published by
    #: size and angle
    pair: PolarPair | None = field(default=None, kw_only=True)
    #: Relative standard deviation by the declared gains of the signals
    gain_std: float = field(default=0.0, kw_only=True)
    #: Whether its lower bound is a limit of what the records tell, or a state, and may be reached
    may_reach_lower: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        """No check of the bounds: those of a baseline's fixed value are equal."""

    @property
    def is_free(self) -> bool:
        """Whether it is fitted; else its value is held."""
        return self.lower < self.upper


def bounds_of(parameters: Sequence[Parameter]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of parameters."""
    return np.array([one.lower for one in parameters]), np.array([one.upper for one in parameters])


@dataclass(frozen=True, eq=False)
class SegmentSums:
    """Gauss-Newton sums of every segment at one parameter set.

    Zero where a segment was not requested.
    """

    matrix: FloatArray  # ``J.T J``; q is p where `unknowns` is not given, shape (n_segments, q, q)
    right_side: FloatArray  # ``J.T r``, shape (n_segments, q)
    square: FloatArray  # ``r.T r``, shape (n_segments,)
    #: Numbers of the unknowns that act in every segment; without, all do. Where runs have unknowns
    #: of their own, the other runs' are left out, shape (n_segments, q).
    unknowns: NDArray[np.int64] | None = None
    n_unknowns: int = 0  # p, where `unknowns` is given

    def full_right_side(self) -> FloatArray:
        """``J.T r`` of all unknowns, shape (n_segments, p).

        Of hundreds of runs with unknowns of their own it holds zeros, a hundred sets of effects
        0.2 GB of them.
        """
        if self.unknowns is None:
            return self.right_side
        full = np.zeros((len(self.right_side), self.n_unknowns))
        np.put_along_axis(full, self.unknowns, self.right_side, axis=1)
        return full

    def n_segments_of_each(self) -> NDArray[np.int64]:
        """Segments in which each unknown acts, shape (p,)."""
        if self.unknowns is None:
            return np.asarray(np.count_nonzero(np.einsum("sqq->sq", self.matrix), axis=0))
        return np.bincount(self.unknowns.ravel(), minlength=self.n_unknowns)

    def total_matrix(self, chosen: BoolArray | None = None) -> FloatArray:
        """``J.T J`` over the chosen segments, or all, shape (p, p)."""
        which = slice(None) if chosen is None else chosen
        if self.unknowns is None:
            return np.asarray(self.matrix[which].sum(axis=0))
        total = np.zeros((self.n_unknowns, self.n_unknowns))
        unknowns = self.unknowns[which]
        np.add.at(total, (unknowns[:, :, None], unknowns[:, None, :]), self.matrix[which])
        return total


class _SignatureColumn(Protocol):
    """One signature: its effect, and which of several of that effect it is one of."""

    @property
    def effect(self) -> str: ...
    @property
    def variant(self) -> tuple[float, ...]: ...


Column = TypeVar("Column", bound=_SignatureColumn)


@dataclass(frozen=True, eq=False)
class Signatures(Generic[Column]):
    """Products of the unexplained force (or signal), baseline regressors and laws' signatures.

    Fits start from least squares on them. Columns in this order: the target, `n_base` baseline
    regressors, one or several columns of each variant of each law. Where the problem is dynamic
    they live in force space.
    """

    gram: FloatArray  # Products of the columns over all records, shape (n, n)
    n_base: int  # Regressors of the baseline
    columns: tuple[Column, ...]  # Signatures behind them

    def solutions(
        self,
        effects: Effects,
        bounds: Callable[[Column], tuple[float, float]],
        base_lower: float | FloatArray = -np.inf,
        *,
        solve: Callable[..., FloatArray],
    ) -> list[tuple[FloatArray, list[tuple[Column, float]]]]:
        """Least-squares values of baseline and columns over the variants of effects, best first.

        `bounds` are those of a column's value, `base_lower` the lower ones of the baseline's;
        `solve` gives values from products, right side, lower and upper bounds.
        """
        first = 1 + self.n_base
        by_effect = []
        for effect in effects:
            variants: dict[tuple[float, ...], list[int]] = {}
            for k, column in enumerate(self.columns):
                if column.effect == effect:
                    variants.setdefault(column.variant, []).append(k)
            by_effect.append(list(variants.values()) or [[]])
        fits = []
        for choice in product(*by_effect):
            chosen = [k for variant in choice for k in variant]
            rows = [*range(1, first), *(first + k for k in chosen)]
            columns = [self.columns[k] for k in chosen]
            limits = np.tile([-np.inf, np.inf], (len(rows), 1))
            limits[: self.n_base, 0] = base_lower
            limits[self.n_base :] = np.reshape([bounds(column) for column in columns], (-1, 2))
            matrix, right = self.gram[np.ix_(rows, rows)], self.gram[rows, 0]
            solution = solve(matrix, right, *limits.T)
            square = self.gram[0, 0] - solution @ (2.0 * right - matrix @ solution)
            values = zip(columns, solution[self.n_base :].tolist(), strict=True)
            fits.append((square, (solution[: self.n_base], list(values))))
        fits.sort(key=lambda fit: fit[0])
        return [fit for _, fit in fits[:6]]


@dataclass(frozen=True, eq=False)
class GapCell:
    """One cell of the gap map."""

    channel_pattern: Annotated[str, "Channel or sensor pattern"]
    order: Annotated[
        float,
        "Shaft order, or line number of a periodic drive; frequency over the lowest of "
        "the map otherwise",
    ]
    run: Annotated[str, "Run"]
    mean_square: Annotated[float, "Mean square of the gap"]
    coherent: Annotated[
        float, "Mean square of the gap less that of the noise floor (may be negative)"
    ]
    share: Annotated[float, "Share of the whole coherent gap"]
    share_ci95: Annotated[tuple[float, float], "Interval of the share"]
    p_value: Annotated[
        float, "Probability without a gap, adjusted for the number of cells (Benjamini-Yekutieli)"
    ]
    frequency_hz: Annotated[tuple[float, float] | None, "Band of the cell [Hz]"] = None


def total_products(table: FloatArray, block: NDArray[np.int64]) -> FloatArray:
    """Products of the rows of a table over the samples of its blocks, shape (n_rows, n_rows).

    `block` is that of every sample, negative where it belongs to none.
    """
    rows = table[:, block >= 0].reshape(len(table), -1)
    return np.asarray(rows @ rows.T)


def shape_starts(effects: Mapping[str, ForceEffect], name: str) -> tuple[float, ...]:
    """Shapes that the screen tries, over their scale; that scale alone for a law of the user's."""
    return effects[name].shape_starts if name in effects else (1.0,)

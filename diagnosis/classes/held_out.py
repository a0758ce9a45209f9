"""What sets of classes leave on blocks that they were not fitted to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.fits import (
    ClassModel,
    class_model,
    coefficients,
    products_of,
    squares_left,
    squares_of_each,
)
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray
from carrierflex.diagnosis.comparison.problem import FloatArray

Classes = tuple[str, ...]
#: Products of some columns outside each fold; and of each fold its blocks with theirs.
FoldProducts = tuple[FloatArray, list[tuple[IntArray, FloatArray]]]


@dataclass(frozen=True, eq=False)
class HeldOutSquares:
    """Held-out result of one model.

    Parameters
    ----------
    squares : ndarray, shape (n_blocks,)
        Sum of squares left in each block by the fit to the other folds.
    groups, ridges : tuple
        Groups of columns, and the weights of their penalties that the folds chose.
    further : ndarray of int, optional
        Columns of laws.
    """

    squares: FloatArray
    groups: tuple[str, ...]
    ridges: tuple[float, ...]
    further: IntArray | None = None

    @cached_property
    def total(self) -> float:
        """Sum over the blocks."""
        return float(self.squares.sum())


@dataclass(frozen=True, eq=False)
class ClassScores:
    """Held-out squares of every set of classes that was asked for; each is computed once.

    Parameters
    ----------
    table : GramTable
        Products.
    constants : ClassConstants
        Limits.
    known : dict
        Results so far, by sorted class ids.
    chosen : dict
        Products of the columns asked for last, outside each fold and of its blocks: the weights of
        a penalty are tried one after the other.
    """

    table: GramTable
    constants: ClassConstants
    known: dict[Classes, HeldOutSquares] = field(default_factory=dict)
    chosen: dict[bytes, FoldProducts] = field(default_factory=dict)

    def of(self, classes: Sequence[str]) -> HeldOutSquares:
        """Held-out squares of a set of classes; of the baseline for the empty set."""
        key = tuple(sorted(classes))
        if key not in self.known:
            self.known[key] = self._scored(key)
        return self.known[key]

    @cached_property
    def plain(self) -> "ClassScores":
        """Scores of the same classes without the members that bend their laws."""
        table = replace(self.table, classes={**self.table.classes, **self.table.plain})
        shared = {
            key: held for key, held in self.known.items() if set(self.table.plain).isdisjoint(key)
        }
        return ClassScores(table, self.constants, shared)

    @cached_property
    def products(self) -> "ClassScores":
        """Scores of the same classes, and of the products of the coupled class as if they were."""
        table = replace(self.table, classes={**self.table.classes, **self.table.products})
        return ClassScores(table, self.constants, self.known)

    @cached_property
    def without_baseline(self) -> "ClassScores":
        """Scores of the same classes beside nothing."""
        return ClassScores(replace(self.table, n_base=0), self.constants)

    def ceiling(self) -> HeldOutSquares:
        """Held-out squares of the union of all classes."""
        key = ("union",)
        if key not in self.known:
            groups = self.table.ceiling
            self.known[key] = self._best(groups, [(r,) * len(groups) for r in self._ridges])
        return self.known[key]

    def fitted(self, classes: Sequence[str]) -> HeldOutSquares:
        """Squares of every block with the fit of a set of classes to all of them, none held out."""
        key = (*sorted(classes), "fitted")
        if key not in self.known:
            held = self.of(classes)
            model = self.model(held)
            squares = squares_left(products_of(self.table.gram, model), self._fit(model))
            self.known[key] = HeldOutSquares(squares, held.groups, held.ridges)
        return self.known[key]

    def beyond_laws(self, classes: Sequence[str], group: str) -> HeldOutSquares:
        """Held-out squares of some classes with one group more, which is no class."""
        key = (*sorted(classes), f"group {group}")
        if key not in self.known:
            beside = self.of(classes)
            options = [(*beside.ridges, ridge) for ridge in self._ridges]
            self.known[key] = self._best((*beside.groups, group), options)
        return self.known[key]

    def with_law(self, classes: Sequence[str], columns: IntArray) -> HeldOutSquares:
        """Held-out squares of some classes and a law's columns beside them."""
        key = (*sorted(classes), f"columns {columns.tolist()}")
        if key not in self.known:
            beside = self.of(classes)
            model = class_model(
                self.table,
                beside.groups,
                beside.ridges,
                jitter=self.constants.jitter,
                further=columns,
            )
            squares = self._held_out([model])[0]
            self.known[key] = HeldOutSquares(squares, beside.groups, beside.ridges, columns)
        return self.known[key]

    def model(self, held: HeldOutSquares) -> ClassModel:
        """Model of a result."""
        return class_model(
            self.table,
            held.groups,
            held.ridges,
            jitter=self.constants.jitter,
            further=held.further,
        )

    def amplitudes(self, held: HeldOutSquares) -> dict[int, float]:
        """Coefficient of every column of a result in the fit to all blocks, by its place.

        Column k of the table is the raw column times scale[k], the target times scale[0]: of the
        raw columns, in the unit of the target.
        """
        model, scale = self.model(held), self.table.scale
        c = self._fit(model)
        raw = c * scale[model.columns] / scale[0]
        return dict(zip(model.columns.tolist(), raw.tolist(), strict=True))

    def _fit(self, model: ClassModel) -> FloatArray:
        """Coefficients of a model in the fit to all blocks."""
        return coefficients(products_of(self.table.total, model), model)

    @property
    def _ridges(self) -> tuple[float, ...]:
        return self.constants.ridges

    def _scored(self, key: Classes) -> HeldOutSquares:
        groups = tuple(dict.fromkeys(name for own in key for name in self.table.classes[own]))
        if len(key) < 2:
            ridges = self._ridges if any(map(self._is_smoothed, key)) else self._ridges[:1]
            return self._best(groups, [(ridge,) * len(groups) for ridge in ridges])
        alone = {own: self._ridge(own) for own in key}
        factors = self.constants.pair_ridges
        starts = [{own: factor * ridge for own, ridge in alone.items()} for factor in factors]
        found, weights = self._best_weights(key, groups, starts)
        # Alone a class may bend to what is its partner's: beside it, it is smoothed as the two ask.
        for own in filter(self._is_smoothed, key):
            others = [weights | {own: ridge} for ridge in self._ridges if ridge != weights[own]]
            if others:
                better, own_weights = self._best_weights(key, groups, others)
                if better.total < found.total:
                    found, weights = better, own_weights
        return found

    def _best_weights(
        self, key: Classes, groups: tuple[str, ...], options: Sequence[dict[str, float]]
    ) -> tuple[HeldOutSquares, dict[str, float]]:
        """Result of the weights by class that leave least, and these weights."""
        by_ridges = {self._shared(key, weights): weights for weights in options}
        found = self._best(groups, list(by_ridges))
        return found, by_ridges[found.ridges]

    def _is_smoothed(self, own: str) -> bool:
        """Whether a class has a penalty; without one it is the same at every weight of it."""
        return any(self.table.groups[name].penalty.any() for name in self.table.classes[own])

    def _ridge(self, own: str) -> float:
        """Weight of the penalty that a class alone asks for."""
        return self.of((own,)).ridges[0]

    def _shared(self, key: Classes, ridges: Mapping[str, float]) -> tuple[float, ...]:
        """Weights of all groups of a set; of one that several classes hold the smallest."""
        by_group: dict[str, float] = {}
        for own in key:
            for name in self.table.classes[own]:
                by_group[name] = min(ridges[own], by_group.get(name, np.inf))
        return tuple(by_group.values())

    def _best(
        self, groups: tuple[str, ...], options: Sequence[tuple[float, ...]]
    ) -> HeldOutSquares:
        """Result of the ridges that leave least."""
        jitter = self.constants.jitter
        models = [class_model(self.table, groups, ridges, jitter=jitter) for ridges in options]
        results = [
            HeldOutSquares(squares, groups, ridges)
            for squares, ridges in zip(self._held_out(models), options, strict=True)
        ]
        return min(results, key=lambda result: result.total)

    def _held_out(self, models: Sequence[ClassModel]) -> FloatArray:
        """Held-out squares of models whose penalties alone differ, shape (n_models, n_blocks)."""
        training, held_out = self._products(models[0])
        squares = np.empty((len(models), len(self.table.folds)))
        for outside, (held, blocks) in zip(training, held_out, strict=True):
            C = np.array([coefficients(outside, model) for model in models])
            squares[:, held] = squares_of_each(blocks, C)
        return squares

    def _products(self, model: ClassModel) -> FoldProducts:
        """Products of a model's columns outside each fold, and of each block."""
        key = model.columns.tobytes()
        if key not in self.chosen:
            self.chosen.clear()
            table = self.table
            held_out = []
            for fold in table.fold_numbers:
                held = np.flatnonzero(table.folds == fold)
                held_out.append((held, products_of(table.gram, model, held)))
            self.chosen[key] = (products_of(table.training, model), held_out)
        return self.chosen[key]

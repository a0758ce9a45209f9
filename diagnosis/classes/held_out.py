"""What sets of classes leave on blocks that they were not fitted to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs
from scipy.optimize import nnls

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.estimation.scaled_least_squares import normal_solution

#: Rounding of a product of columns of unit energy.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class ClassModel:
    """Columns of one fit, their penalty and which coefficients are at least zero."""

    columns: IntArray  # Places in the table, the baseline's first, shape (n,)
    penalty: FloatArray  # Quadratic penalty, shape (n, n)
    is_nonnegative: np.ndarray  # Coefficients that are >= 0, shape (n,)

    def with_base(self, n_base: int) -> "ClassModel":
        """The same columns without the baseline's."""
        rest = slice(n_base, None)
        return ClassModel(self.columns[rest], self.penalty[rest, rest], self.is_nonnegative[rest])


def products_of(gram: FloatArray, model: ClassModel) -> FloatArray:
    """Products of the target and a model's columns, from those of all columns of a table.

    Products (..., n_table, n_table), the target first, to (..., 1 + n, 1 + n).
    """
    columns = np.concatenate([[0], model.columns])
    places = gram.shape[-1] * columns[:, None] + columns
    return gram.reshape(*gram.shape[:-2], -1).take(places, axis=-1, mode="clip")


def coefficients(products: FloatArray, model: ClassModel) -> FloatArray:
    """Coefficients c that minimise ``|target - columns c|² + c' P c``, some c >= 0.

    The free coefficients are projected out of the products first; what remains is a small problem
    of non-negative least squares. `products`, shape (1 + n, 1 + n), are those of the target and
    the model's columns (:func:`products_of`); c is in the order of these, shape (n,).

    References
    ----------
    .. [1] C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems" (1974), chapter 23.
    """
    if not model.columns.size:
        return np.empty(0)
    A = products[1:, 1:] + model.penalty
    b = products[1:, 0]
    # Those that may be negative stand first.
    order = np.argsort(model.is_nonnegative, kind="stable")
    n_free = int(np.count_nonzero(~model.is_nonnegative))
    if n_free == b.size:
        return _solved(_factor(A), b)
    if not n_free:
        return _nonnegative(A, b)
    if order[n_free - 1] >= n_free:
        A, b = A[order[:, None], order], b[order]
    factor = _factor(A[:n_free, :n_free])
    coupling = _solved(factor, A[:n_free, n_free:])
    schur = A[n_free:, n_free:] - A[n_free:, :n_free] @ coupling
    bound = _nonnegative(schur, b[n_free:] - coupling.T @ b[:n_free])
    c = np.empty(b.size)
    c[order[n_free:]] = bound
    c[order[:n_free]] = _solved(factor, b[:n_free]) - coupling @ bound
    return c


def _free_coefficients(products: FloatArray, penalty: FloatArray) -> FloatArray:
    """Coefficients of fits that all may be negative, shape (..., n).

    Products (..., 1 + n, 1 + n) and penalties (..., n, n).
    """
    A = products[..., 1:, 1:] + penalty
    b = np.broadcast_to(products[..., 1:, 0], A.shape[:-1])
    try:
        return np.asarray(np.linalg.solve(A, b[..., None])[..., 0])
    except np.linalg.LinAlgError:
        # Columns that are zero in the records of a fit take the coefficient zero.
        c = np.empty(A.shape[:-1])
        for at in np.ndindex(A.shape[:-2]):
            c[at] = _solved(_factor(A[at]), b[at])
        return c


def squares_left(products: FloatArray, c: FloatArray) -> FloatArray:
    """Sum of squares that coefficients leave, shape (...)."""
    weights = np.concatenate([[1.0], -c])
    return np.asarray((products @ weights) @ weights)


def _squares_of_each(products: FloatArray, C: FloatArray) -> FloatArray:
    """Sums of squares that several fits leave of the same products, shape (n_fits, n_blocks)."""
    weights = np.column_stack([np.ones(len(C)), -C])
    rows = (products.reshape(-1, weights.shape[1]) @ weights.T).reshape(*products.shape[:2], -1)
    return np.einsum("bif,fi->fb", rows, weights)


def _factor(A: FloatArray) -> FloatArray:
    """Lower Cholesky factor; a rounding more on the diagonal where A is singular to rounding."""
    # LAPACK directly: a table is hundreds of small solves, of which checks take half of the time.
    factor, failed = dpotrf(A, lower=1)
    if not failed:
        return np.asarray(factor)
    # Columns that are zero in the records of a fit take the coefficient zero.
    rounding = _ROUNDING * (float(np.diag(A).max()) or 1.0)
    for lift in (rounding * 100.0**k for k in range(7)):
        factor, failed = dpotrf(A + lift * np.eye(len(A)), lower=1)
        if not failed:
            return np.asarray(factor)
    raise ArithmeticError(
        f"these records do not determine the {len(A)} motions and loads that a diagnosis compares; "
        "check 'angle_deg' of [[channels]] and the units of the inputs"
    )


def _solved(factor: FloatArray, b: FloatArray) -> FloatArray:
    """``A^-1 b`` from the lower factor of A."""
    return np.asarray(dpotrs(factor, b, lower=1)[0])


def _nonnegative(A: FloatArray, b: FloatArray) -> FloatArray:
    """Minimiser of ``c' A c / 2 - b' c`` for c >= 0."""
    size = np.sqrt(np.maximum(np.diag(A), _ROUNDING))
    L = _factor(A / np.outer(size, size))
    right = dtrtrs(L, b / size, lower=1)[0]
    return nnls(L.T, right, maxiter=30 * b.size)[0] / size


Classes = tuple[str, ...]
#: Products of some columns outside each fold, and in each block.
_FoldProducts = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class HeldOutSquares:
    """Held-out result of one model."""

    #: Sum of squares left in each block by the fit to the other folds, shape (n_blocks,)
    squares: FloatArray
    #: groups, ridges: groups of columns, and the weights of their penalties that the folds chose
    groups: tuple[str, ...]
    ridges: tuple[float, ...]
    further: IntArray | None = None  # Columns of laws

    @cached_property
    def total(self) -> float:
        """Sum over the blocks."""
        return float(self.squares.sum())


@dataclass(frozen=True, eq=False)
class ClassScores:
    """Held-out squares of every set of classes that was asked for; each is computed once."""

    table: GramTable  # Products
    constants: ClassConstants  # Limits
    #: Results so far, by sorted class ids
    known: dict[Classes, HeldOutSquares] = field(default_factory=dict)
    #: Products of the columns asked for last, outside each fold and of its blocks: the weights of a
    #: penalty are tried one after the other
    chosen: dict[bytes, _FoldProducts] = field(default_factory=dict)
    #: The same of all columns without the baseline, once they are made
    base_products: list[_FoldProducts] = field(default_factory=list)

    def of(self, classes: Sequence[str]) -> HeldOutSquares:
        """Held-out squares of a set of classes; of the baseline for the empty set."""
        key = tuple(sorted(classes))
        if key not in self.known:
            self.known[key] = self._scored(key)
        return self.known[key]

    @cached_property
    def products(self) -> "ClassScores":
        """Scores of the same classes, and of the products of the coupled class as if they were."""
        table = replace(self.table, classes={**self.table.classes, **self.table.products})
        return replace(self, table=table)

    @cached_property
    def without_baseline(self) -> "ClassScores":
        """Scores of the same classes beside nothing."""
        as_read = [(self.table.training, self.table.gram)]
        return ClassScores(replace(self.table, n_base=0), self.constants, base_products=as_read)

    def ceiling(self) -> HeldOutSquares:
        """Held-out squares of the union of all classes."""
        key = ("union",)
        if key not in self.known:
            groups, ridges = self.table.ceiling, self.constants.ridges
            self.known[key] = self._best(groups, [(ridge,) * len(groups) for ridge in ridges])
        return self.known[key]

    def fitted(self, classes: Sequence[str]) -> HeldOutSquares:
        """Squares of every block with the fit of a set of classes to all of them, none held out."""
        key = (*sorted(classes), "fitted")
        if key not in self.known:
            result = self.of(classes)
            model = self.model(result)
            squares = squares_left(products_of(self.table.gram, model), self._fit(model))
            self.known[key] = HeldOutSquares(squares, result.groups, result.ridges)
        return self.known[key]

    def with_laws(
        self, classes: Sequence[str], options: Sequence[IntArray]
    ) -> list[HeldOutSquares]:
        """Held-out squares of some classes and the columns of each of some laws beside them."""
        names = tuple(sorted(classes))
        keys = [(*names, f"columns {columns.tolist()}") for columns in options]
        asked = {
            key: columns
            for key, columns in zip(keys, options, strict=True)
            if key not in self.known
        }
        if asked:
            partners = self.of(classes)
            results = [replace(partners, further=columns) for columns in asked.values()]
            squares = self._held_out_each([self.model(result) for result in results])
            for key, result, of_law in zip(asked, results, squares, strict=True):
                self.known[key] = replace(result, squares=of_law)
        return [self.known[key] for key in keys]

    def with_law(self, classes: Sequence[str], columns: IntArray) -> HeldOutSquares:
        """Held-out squares of some classes and a law's columns beside them."""
        return self.with_laws(classes, [columns])[0]

    def model(self, result: HeldOutSquares) -> ClassModel:
        """Model of a result."""
        return self.model_of(result.groups, result.ridges, result.further)

    def model_of(
        self, groups: Sequence[str], ridges: Sequence[float], further: IntArray | None = None
    ) -> ClassModel:
        """Model of the baseline with some groups, each at its own ridge, and columns of laws."""
        table, jitter = self.table, self.constants.jitter
        members = [table.groups[name] for name in groups]
        laws = np.empty(0, dtype=np.int64) if further is None else further
        columns = np.concatenate([table.base, laws, *(member.columns for member in members)])
        penalty = np.zeros((columns.size, columns.size))
        nonnegative = np.zeros(columns.size, dtype=bool)
        first = table.n_base + laws.size
        nonnegative[table.n_base : first] = np.isin(laws, table.one_way)
        energy = table.total[columns, columns].max(initial=0.0)
        diagonal = np.full(columns.size, jitter)
        diagonal[: table.n_base] = _ROUNDING * energy
        if table.base_penalty.size:
            diagonal[: table.n_base] += table.base_penalty[: table.n_base]
        diagonal[table.n_base : first] = jitter * energy
        for member, ridge in zip(members, ridges, strict=True):
            span = slice(first, first + member.columns.size)
            penalty[span, span] = ridge * member.penalty
            nonnegative[span] = member.is_nonnegative
            first = span.stop
        penalty[np.diag_indices(columns.size)] += diagonal
        return ClassModel(columns, penalty, nonnegative)

    def amplitudes(self, result: HeldOutSquares) -> dict[int, float]:
        """Coefficient of every column of a result in the fit to all blocks, by its place.

        Column k of the table is the raw column times scale[k], the target times scale[0]: of the
        raw columns, in the unit of the target.
        """
        model, scale = self.model(result), self.table.scale
        c = self._fit(model)
        raw = c * scale[model.columns] / scale[0]
        return dict(zip(model.columns.tolist(), raw.tolist(), strict=True))

    def size_change(self, result: HeldOutSquares) -> tuple[float, float]:
        """Relative standard deviation of the size of the classes' part over the blocks.

        And the square that a size of its own in every block takes. The part is what the fit to all
        blocks has beyond the baseline's regressors, which are fitted again beside its sizes.
        """
        model, n = self.model(result), self.table.n_base
        c = self._fit(model)
        products = products_of(self.table.gram, model)
        total = products.sum(axis=0)
        base = slice(1, 1 + n)
        # Of what lies in the baseline's regressors a class takes any amount.
        g = np.concatenate([np.zeros(1 + n), c[n:]])
        g[base] = -normal_solution(total[base, base], total[base] @ g)
        part = products @ g
        energy = part @ g
        if not energy.sum() > 0.0:
            return 0.0, 0.0
        # Normal equations: the baseline's regressors, then the part in each block.
        A = np.diag(np.concatenate([np.zeros(n), energy]))
        A[:n, :n] = total[base, base]
        A[:n, n:] = part[:, base].T
        A[n:, :n] = part[:, base]
        remaining = products @ np.concatenate([[1.0], -c])
        b = np.concatenate([remaining[:, base].sum(axis=0), remaining @ g])
        change = normal_solution(A, b)
        sizes = 1.0 + change[n:]
        mean = np.average(sizes, weights=energy)
        deviation = np.sqrt(np.average((sizes - mean) ** 2, weights=energy)) / abs(mean)
        return float(deviation), float(b @ change)

    def _fit(self, model: ClassModel) -> FloatArray:
        """Coefficients of a model in the fit to all blocks."""
        return coefficients(products_of(self.table.total, model), model)

    def _scored(self, key: Classes) -> HeldOutSquares:
        groups = tuple(dict.fromkeys(name for member in key for name in self.table.classes[member]))
        if len(key) < 2:
            ridges = self.constants.ridges[: None if any(map(self._is_smoothed, key)) else 1]
            return self._best(groups, [(ridge,) * len(groups) for ridge in ridges])
        # Weights that each class alone asks for.
        alone = {member: self.of((member,)).ridges[0] for member in key}
        factors = self.constants.pair_ridges
        starts = [{member: factor * ridge for member, ridge in alone.items()} for factor in factors]
        result, weights = self._best_weights(key, groups, starts)
        # Alone a class may bend to what is its partner's: beside it, it is smoothed as the two ask.
        for member in filter(self._is_smoothed, key):
            others = [weights | {member: r} for r in self.constants.ridges if r != weights[member]]
            if others:
                better, better_weights = self._best_weights(key, groups, others)
                if better.total < result.total:
                    result, weights = better, better_weights
        return result

    def _best_weights(
        self, key: Classes, groups: tuple[str, ...], options: Sequence[dict[str, float]]
    ) -> tuple[HeldOutSquares, dict[str, float]]:
        """Result of the weights by class that leave least, and these weights."""
        by_ridges = {self._shared(key, weights): weights for weights in options}
        result = self._best(groups, list(by_ridges))
        return result, by_ridges[result.ridges]

    def _is_smoothed(self, class_id: str) -> bool:
        """Whether a class has a penalty; without one it is the same at every weight of it."""
        return any(self.table.groups[name].penalty.any() for name in self.table.classes[class_id])

    def _shared(self, key: Classes, ridges: Mapping[str, float]) -> tuple[float, ...]:
        """Weights of all groups of a set; of one that several classes hold the smallest."""
        by_group: dict[str, float] = {}
        for class_id in key:
            for name in self.table.classes[class_id]:
                by_group[name] = min(ridges[class_id], by_group.get(name, np.inf))
        return tuple(by_group.values())

    def _best(
        self, groups: tuple[str, ...], options: Sequence[tuple[float, ...]]
    ) -> HeldOutSquares:
        """Result of the ridges that leave least."""
        models = [self.model_of(groups, ridges) for ridges in options]
        results = [
            HeldOutSquares(squares, groups, ridges)
            for squares, ridges in zip(self._held_out(models), options, strict=True)
        ]
        return min(results, key=lambda result: result.total)

    def _held_out(self, models: Sequence[ClassModel]) -> FloatArray:
        """Held-out squares of models whose penalties alone differ, shape (n_models, n_blocks)."""
        models = [model.with_base(self.table.n_base) for model in models]
        training, blocks = self._products(models[0])
        squares = np.empty((len(models), len(self.table.folds)))
        fits = (
            [[coefficients(outside, model) for model in models] for outside in training]
            if models[0].is_nonnegative.any()
            else _free_coefficients(training[:, None], np.array([one.penalty for one in models]))
        )
        for fold, C in enumerate(fits):
            scored = self.table.folds == fold
            squares[:, scored] = _squares_of_each(blocks[scored], np.array(C))
        return squares

    def _held_out_each(self, models: Sequence[ClassModel]) -> FloatArray:
        """Held-out squares of any models, shape (n_models, n_blocks)."""
        squares = np.empty((len(models), len(self.table.folds)))
        alike: dict[int, list[int]] = {}
        for k, model in enumerate(models):
            if model.is_nonnegative.any():
                squares[k] = self._held_out([model])[0]
            else:
                alike.setdefault(model.columns.size, []).append(k)
        for numbers in alike.values():
            squares[numbers] = self._held_out_of_one_size([models[k] for k in numbers])
        return squares

    def _held_out_of_one_size(self, models: Sequence[ClassModel]) -> FloatArray:
        """The same of models with as many columns each, all of which may be negative."""
        models = [model.with_base(self.table.n_base) for model in models]
        columns = np.array([[0, *model.columns] for model in models])
        rows, columns = columns[:, :, None], columns[:, None, :]
        penalty = np.array([model.penalty for model in models])
        training, blocks = self._beside_baseline()
        squares = np.empty((len(models), len(self.table.folds)))
        for fold, outside in enumerate(training):
            c = _free_coefficients(outside[rows, columns], penalty)
            weights = np.column_stack([np.ones(len(c)), -c])
            for number in np.flatnonzero(self.table.folds == fold):
                weighted = (blocks[number][rows, columns] @ weights[..., None])[..., 0]
                squares[:, number] = (weighted * weights).sum(axis=1)
        return squares

    def _products(self, model: ClassModel) -> _FoldProducts:
        """Products of the columns of a model without the baseline, outside each fold and by block.

        The baseline is fitted outside each fold.
        """
        key = model.columns.tobytes()
        if key not in self.chosen:
            self.chosen.clear()
            training, blocks = self._beside_baseline()
            self.chosen[key] = products_of(training, model), products_of(blocks, model)
        return self.chosen[key]

    def _beside_baseline(self) -> _FoldProducts:
        """Products of all columns outside each fold, and of its blocks, without the baseline.

        Its fit outside a fold, ``(A_bb + D)^-1 A_b``, is the same beside every class and law: the
        rest of a fit is a smaller problem on ``A - A_b' (A_bb + D)^-1 A_b`` (Schur's complement).
        """
        if not self.base_products:
            table, base = self.table, slice(1, 1 + self.table.n_base)
            penalty = self.model_of((), ()).penalty
            training, blocks = table.training.copy(), table.gram.copy()
            for fold, outside in enumerate(training if table.n_base else ()):
                fit = _solved(_factor(outside[base, base] + penalty), outside[base])
                taken, both = np.matmul(outside[:, base], fit), np.empty_like(outside)
                outside -= taken
                for block in map(blocks.__getitem__, np.flatnonzero(table.folds == fold)):
                    # Half of what is taken twice from both sides.
                    half = block[:, base] - 0.5 * fit.T @ block[base, base]
                    block -= np.add(np.matmul(half, fit, out=taken), taken.T, out=both)
            self.base_products.append((training, blocks))
        return self.base_products[0]

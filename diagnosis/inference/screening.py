"""S1: which effects explain what the baseline leaves, in force space where the problem is dynamic.

The residual force is ``e = f_known - (M q'' + D q' + K q)``; with P the projection that takes out
the baseline's regressors, the share of it that the signatures S of an effect explain is ``R² = |P_S
e|² / |P e|²`` (for one signature ``(e' P s)² / (e' P e · s' P s)``), and their surviving share is
``|P s| / |s|``.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from carrierflex.diagnosis.comparison.problem import (
    BLACK_BOX,
    BoolArray,
    FeatureBlocks,
    FloatArray,
    Signatures,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.identification.estimation.scaled_least_squares import (
    DEPENDENT,
    column_lengths,
    normal_inverse,
    normal_solution,
)

#: Ridge of the flexible model, as a share of each column's square.
_RIDGE = 1e-4


@dataclass(frozen=True, eq=False)
class ScreenedEffect:
    """How one effect fares in the screen.

    Parameters
    ----------
    id : str
        Effect.
    r_squared : float
        Share of the residual it explains, best variant.
    surviving : float
        Share of its signature that the baseline does not absorb.
    variant : tuple of float
        Shape parameters of the best variant.
    """

    id: str
    r_squared: float
    surviving: float
    variant: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Screen:
    """Result of the screen.

    Parameters
    ----------
    effects : tuple of ScreenedEffect
        Best first.
    correlation : ndarray, shape (n_effects, n_effects)
        Correlation of the projected signatures (largest canonical one where an effect has several).
    """

    effects: tuple[ScreenedEffect, ...]
    correlation: FloatArray

    def of(self, effect: str) -> ScreenedEffect:
        """Entry of one effect."""
        return next(screened for screened in self.effects if screened.id == effect)

    def survivors(self, thresholds: Thresholds) -> tuple[str, ...]:
        """Effects that go on: all within `keep_within` of the best.

        At least `keep_at_least` of them.
        """
        visible = [
            screened
            for screened in self.effects
            if screened.surviving >= thresholds.surviving_share
        ]
        best = visible[0].r_squared if visible else 0.0
        kept = [
            screened.id
            for screened in visible
            if screened.r_squared >= best - thresholds.keep_within
        ]
        return tuple(
            kept
            if len(kept) >= thresholds.keep_at_least
            else [e.id for e in visible[: thresholds.keep_at_least]]
        )

    def correlated(self, first: str, second: str) -> float:
        """Correlation of the projected signatures of two effects."""
        names = [screened.id for screened in self.effects]
        return float(self.correlation[names.index(first), names.index(second)])


def screen(
    signatures: Signatures, *, beside: Mapping[str, tuple[float, ...]] | None = None
) -> Screen:
    """Rank the effects by the share of the residual they explain.

    Parameters
    ----------
    signatures : Signatures
        Columns of the problem.
    beside : mapping of str to tuple of float, optional
        Effects (with the variant) that join the baseline first.

    Returns
    -------
    Screen
        Best first.
    """
    gram = signatures.gram.sum(axis=0)
    first = 1 + signatures.n_base
    joined = [
        first + k
        for k, (name, variant) in enumerate(
            zip(signatures.effects, signatures.variants, strict=True)
        )
        if (beside or {}).get(name) == variant
    ]
    projected = projected_gram(gram, [*range(1, first), *joined])
    best: dict[str, tuple[float, tuple[int, ...]]] = {}
    for columns in variant_columns(signatures):
        name = signatures.effects[columns[0] - 1 - signatures.n_base]
        if name == BLACK_BOX:
            continue
        share = _explained(projected, columns)
        if name not in best or share > best[name][0]:
            best[name] = (share, columns)
    order = sorted(best, key=lambda name: -best[name][0])
    entries = tuple(
        ScreenedEffect(
            name,
            best[name][0],
            _surviving(gram, projected, best[name][1]),
            signatures.variants[best[name][1][0] - 1 - signatures.n_base],
        )
        for name in order
    )
    correlation = np.array(
        [[_canonical(projected, best[a][1], best[b][1]) for b in order] for a in order]
    )
    return Screen(entries, correlation.reshape(len(order), len(order)))


def explainable_fraction(signatures: Signatures) -> float:
    """Share of the residual that a flexible model explains on segments it was not fitted to.

    Segments are left out one quarter at a time (interleaved); the model is a ridge on the flexible
    features and the best signatures, so that it can do no less than the library.

    Parameters
    ----------
    signatures : Signatures
        Columns of the problem.

    Returns
    -------
    float
        ``1 - MSE(flexible) / MSE(baseline)`` on held-out segments; negative where the flexible
        model only learns noise.
    """
    n_base = signatures.n_base
    base = list(range(1, 1 + n_base))
    flexible = base + [
        k + 1 + n_base for k, name in enumerate(signatures.effects) if name == BLACK_BOX
    ]
    group = np.arange(len(signatures.gram)) % 4
    remaining = {"base": 0.0, "flexible": 0.0}
    for fold in np.unique(group):
        train, test = (
            signatures.gram[group != fold].sum(axis=0),
            signatures.gram[group == fold].sum(axis=0),
        )
        remaining["base"] += _left_over(train, test, base, 0.0)
        if signatures.features is None:
            remaining["flexible"] += _left_over(train, test, flexible, _RIDGE)
        else:
            held_out = group == fold
            remaining["flexible"] += _left_over_beside_blocks(
                (train, _sums_of_blocks(signatures.features, ~held_out)),
                (test, _sums_of_blocks(signatures.features, held_out)),
                flexible,
            )
    return 1.0 - remaining["flexible"] / remaining["base"] if remaining["base"] > 0.0 else 0.0


def _left_over(train: FloatArray, test: FloatArray, columns: list[int], ridge: float) -> float:
    gram = train[np.ix_(columns, columns)]
    solution = normal_solution(gram, train[columns, 0], ridge=ridge)
    return float(
        test[0, 0]
        - 2.0 * solution @ test[columns, 0]
        + solution @ test[np.ix_(columns, columns)] @ solution
    )


def _sums_of_blocks(features: FeatureBlocks, chosen: BoolArray) -> FeatureBlocks:
    """Products over the chosen groups of segments, shapes (C, n, m) and (C, m, m)."""
    return FeatureBlocks(features.cross[chosen].sum(axis=0), features.square[chosen].sum(axis=0))


def _left_over_beside_blocks(
    train: tuple[FloatArray, FeatureBlocks],
    test: tuple[FloatArray, FeatureBlocks],
    columns: list[int],
) -> float:
    """What the ridge on columns and blocks of features leaves of the test's target.

    The features of a block see those of no other block, so that they are eliminated one block after
    the other: ``(G - sum_c X_c F_c^-1 X_c') b = g - sum_c X_c F_c^-1 f_c`` in columns of unit
    length, with the ridge on every diagonal.
    """
    gram, blocks = train
    length = column_lengths(gram)[columns]
    inner = gram[np.ix_(columns, columns)] / np.outer(length, length)
    inner += _RIDGE * np.eye(len(columns))
    right = gram[columns, 0] / length
    eliminated = []
    for cross, square in zip(blocks.cross, blocks.square, strict=True):
        own = column_lengths(square)
        factor = cho_factor(square / np.outer(own, own) + _RIDGE * np.eye(own.size))
        mixed = cross[columns] / np.outer(length, own)
        solved = cho_solve(factor, np.column_stack([mixed.T, cross[0] / own]))
        inner -= mixed @ solved[:, :-1]
        right = right - mixed @ solved[:, -1]
        eliminated.append((own, solved))
    scaled = np.linalg.lstsq(inner, right, rcond=DEPENDENT)[0] if columns else right
    values = scaled / length
    measured, others = test
    left = measured[0, 0] - 2.0 * values @ measured[columns, 0]
    left += values @ measured[np.ix_(columns, columns)] @ values
    for c, (own, solved) in enumerate(eliminated):
        amounts = (solved[:, -1] - solved[:, :-1] @ scaled) / own
        seen = others.cross[c, 0] - values @ others.cross[c, columns]
        left += amounts @ others.square[c] @ amounts - 2.0 * amounts @ seen
    return float(left)


def variant_columns(signatures: Signatures) -> list[tuple[int, ...]]:
    """Columns of every variant of every effect, by their number in the Gram matrix.

    Parameters
    ----------
    signatures : Signatures
        Columns of the problem.

    Returns
    -------
    list of tuple of int
        In the order of the signatures.
    """
    groups: dict[tuple[str, tuple[float, ...]], list[int]] = {}
    for k, key in enumerate(zip(signatures.effects, signatures.variants, strict=True)):
        groups.setdefault(key, []).append(k + 1 + signatures.n_base)
    return [tuple(columns) for columns in groups.values()]


def projected_gram(gram: FloatArray, columns: list[int]) -> FloatArray:
    """Gram matrix after some columns are taken out of all others (Schur complement).

    Parameters
    ----------
    gram : ndarray, shape (n, n)
        Products of all columns.
    columns : list of int
        Columns that are taken out, as the baseline's.

    Returns
    -------
    ndarray, shape (n, n)
        Products of what is left of the columns.
    """
    if not columns:
        return gram
    inverse = normal_inverse(gram[np.ix_(columns, columns)])
    return gram - gram[:, columns] @ inverse @ gram[columns, :]


def _explained(projected: FloatArray, columns: tuple[int, ...]) -> float:
    gram, right = projected[np.ix_(columns, columns)], projected[list(columns), 0]
    if projected[0, 0] <= 0.0:
        return 0.0
    return float(
        right @ np.linalg.pinv(gram, rcond=DEPENDENT, hermitian=True) @ right / projected[0, 0]
    )


def _surviving(gram: FloatArray, projected: FloatArray, columns: tuple[int, ...]) -> float:
    before = sum(gram[k, k] for k in columns)
    return (
        float(np.sqrt(max(sum(projected[k, k] for k in columns), 0.0) / before))
        if before > 0.0
        else 0.0
    )


def _canonical(projected: FloatArray, first: tuple[int, ...], second: tuple[int, ...]) -> float:
    """Largest canonical correlation of two groups of projected columns."""
    roots = [_inverse_root(projected[np.ix_(group, group)]) for group in (first, second)]
    return float(np.linalg.norm(roots[0] @ projected[np.ix_(first, second)] @ roots[1], 2))


def _inverse_root(gram: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(gram)
    keep = values > DEPENDENT * max(values.max(), np.finfo(float).tiny)
    return (vectors[:, keep] / np.sqrt(values[keep])) @ vectors[:, keep].T

"""The plain methods that a diagnosis is set beside, on columns whose truth is known."""

import numpy as np
import pytest

from carrierflex.blind_check.references.linear_laws import best_single_law, sparse_laws
from carrierflex.diagnosis.classes.gram_table import GramTable, LawColumns

N = 4000


def table_of(amounts, *, noise=0.05, seed=0):
    """Target made of laws a, b (two shapes, the second one true) and c beside a baseline."""
    rng = np.random.default_rng(seed)
    base, a, b, c = rng.standard_normal((4, N))
    other_shape = 0.5 * b + rng.standard_normal(N)
    target = 3.0 * base + noise * rng.standard_normal(N)
    target = target + sum(
        amounts.get(name, 0.0) * law for name, law in zip("abc", (a, b, c), strict=True)
    )
    rows = np.array([target, base, a, other_shape, b, c])
    gram = np.array([block @ block.T for block in np.split(rows, 4, axis=1)])
    shapes = {"a": (2,), "b": (3, 4), "c": (5,)}
    laws = tuple(
        LawColumns(name, tuple(np.array([k]) for k in columns), 1)
        for name, columns in shapes.items()
    )
    return GramTable(
        gram=gram,
        n_base=1,
        groups={},
        classes={},
        surface="",
        ceiling=(),
        laws={"every": laws},
        floor=np.full(4, np.nan),
        folds=np.arange(4),
        scale=np.ones(len(rows)),
    )


@pytest.mark.parametrize("name", ["a", "b", "c"])
def test_one_law_is_named_by_both(name):
    table = table_of({name: 0.3})
    assert best_single_law(table, N) == (name,)
    assert sparse_laws(table, N) == (name,)


def test_nothing_is_named_where_the_baseline_leaves_noise():
    for seed in range(5):
        assert best_single_law(table_of({}, seed=seed), N) == ()
        assert sparse_laws(table_of({}, seed=seed), N) == ()


def test_of_two_laws_the_single_one_is_the_larger_and_the_sparse_set_holds_both():
    table = table_of({"a": 0.3, "c": -0.2})
    assert best_single_law(table, N) == ("a",)
    assert sparse_laws(table, N) == ("a", "c")

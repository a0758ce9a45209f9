"""A linear toy problem with classes of random columns: every branch of the rule is reached."""

from itertools import combinations

import numpy as np

from carrierflex.diagnosis.classes.answer import class_answer
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import Drive, decide
from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable, LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares

N_BLOCKS, N_SAMPLES = 24, 60
SIZE = 3
#: Blocks of sets whose remainders are given.
N_KNOWN = 8


def toy_columns(seed=0):
    """Columns of three classes a, b, c and of a surface that holds them and six further columns."""
    rng = np.random.default_rng(seed)
    n = N_BLOCKS * N_SAMPLES
    return {
        name: rng.standard_normal((SIZE if name != "more" else 6, n))
        for name in ("a", "b", "c", "more")
    }


def toy_table(signal, columns, *, noise=0.1, seed=1, laws=None):
    """Table of a signal with white noise; `columns` as :func:`toy_columns`, the base a constant.

    `laws` are columns by class.
    """
    rng = np.random.default_rng(seed)
    n = N_BLOCKS * N_SAMPLES
    target = signal + noise * rng.standard_normal(n)
    rows = [target[None], np.ones((1, n)), *columns.values()]
    first, groups = 2, {}
    for name, values in columns.items():
        numbers = np.arange(first, first + len(values))
        groups[name] = ColumnGroup(numbers, np.eye(len(values)))
        first += len(values)
    known = {name: () for name in (*columns, "surface")}
    for name, values in (laws or {}).items():
        known[name] = (LawColumns(f"law_{name}", (np.array([first]),), 1),)
        rows.append(values[None])
        first += 1
    table = np.concatenate(rows)
    scale = 1.0 / np.sqrt(np.sum(table**2, axis=1))
    gram = np.array(
        [block @ block.T for block in np.split(table * scale[:, None], N_BLOCKS, axis=1)]
    )
    classes = {name: (name,) for name in columns if name != "more"}
    return GramTable(
        gram=gram,
        n_base=1,
        groups=groups,
        classes=classes | {"surface": tuple(columns)},
        surface="surface",
        ceiling=tuple(columns),
        laws=known,
        floor=np.full(N_BLOCKS, noise**2 * N_SAMPLES * scale[0] ** 2),
        folds=np.arange(N_BLOCKS) % 4,
        scale=scale,
    )


def known_scores(causes, classes, *, fitted=np.inf, limits=None):
    """Held-out squares of all sets in floors: one of noise, and what the classes leave of causes.

    `classes` tell for each class what it leaves of the causes that it shows at all; of a cause a
    set leaves what its best class does. Every set leaves `fitted` floors of the records that it is
    fitted to.
    """

    def remaining_squares(names):
        by_cause = (
            size * min([1.0, *(classes[name].get(cause, 1.0) for name in names)])
            for cause, size in causes.items()
        )
        return HeldOutSquares(np.full(N_KNOWN, (1.0 + sum(by_cause)) / N_KNOWN), (), ())

    known = {
        names: remaining_squares(names)
        for size in range(len(classes) + 1)
        for names in combinations(sorted(classes), size)
    }
    table = GramTable(
        gram=np.full((N_KNOWN, 1, 1), fitted / N_KNOWN),
        n_base=0,
        groups={},
        classes={},
        surface="",
        ceiling=(),
        laws={},
        floor=np.full(N_KNOWN, 1.0 / N_KNOWN),
        folds=np.arange(N_KNOWN) % 4,
        scale=np.ones(1),
    )
    scores = ClassScores(table, limits or ClassConstants(), known)
    return scores, Shares(scores.of(()).squares, table.floor, scores.constants)


def answer_of_scores(scores, candidates, *, shows_laws=True, floor_is_known=True, **options):
    """Answer among some classes under a drive, without measured shapes."""
    drive = Drive(tuple(candidates), **options)
    shares, decision = decide(scores, drive, floor_is_known=floor_is_known)
    return class_answer(
        scores,
        shares,
        decision,
        candidates,
        shape_of=lambda *_: (None, None),
        shows_laws=shows_laws,
    )

"""Laws of the library held against the class that the records show."""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.classes.gram_table import IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares


@dataclass(frozen=True, eq=False)
class NearestLaw:
    """Law of a class that explains most.

    Parameters
    ----------
    id : str
        Law; empty where the class holds none.
    columns : ndarray of int
        Places of its columns, at its best shape.
    held : HeldOutSquares, optional
        Its result in place of the class.
    is_equal : bool
        Whether the records cannot tell it from the class.
    """

    id: str
    columns: IntArray
    held: HeldOutSquares | None
    is_equal: bool


def nearest_law(scores: ClassScores, shares: Shares, own: str, beside: Classes) -> NearestLaw:
    """Law that takes the place of a class best.

    Parameters
    ----------
    scores : ClassScores
        Held-out squares.
    shares : Shares
        Gap and scatter.
    own : str
        Class whose place the law takes.
    beside : tuple of str
        Other classes of the answer, which stay.

    Returns
    -------
    NearestLaw
        Best of ``share - 0.005 n_parameters`` over the laws and their shapes.
    """
    limits = scores.constants
    found: list[tuple[float, str, IntArray, HeldOutSquares]] = []
    for law in scores.table.laws.get(own, ()):
        columns, held = _best_shape(scores, beside, law)
        value = shares.of(held) - limits.law_parameter * law.n_parameters
        found.append((value, law.id, columns, held))
    if not found:
        return NearestLaw("", np.empty(0, dtype=np.int64), None, False)
    _, name, columns, held = max(found, key=lambda entry: entry[0])
    with_class = scores.of((own, *beside))
    behind = shares.gain(with_class, held)
    error = limits.standard_errors * shares.gain_error(with_class, held)
    is_equal = behind <= max(limits.law_named, error) and _explains(shares, held)
    is_equal = is_equal and not _is_small(scores, shares, own, beside)
    is_equal = is_equal and not _is_coupled(scores, shares, own, name, beside)
    is_equal = is_equal and not _is_curved(scores, shares, own, beside)
    is_equal = is_equal and not _is_in_curved(scores, own, beside)
    return NearestLaw(name, columns, held, is_equal)


def _is_small(scores: ClassScores, shares: Shares, own: str, beside: Classes) -> bool:
    """Whether a class adds less to others than tells one law of it from another.

    All laws are as near as the limits go to a class that adds no more than these.
    """
    added = shares.gain(scores.of((own, *beside)), scores.of(beside))
    return bool(beside) and added < scores.constants.second_cause


def _is_coupled(scores: ClassScores, shares: Shares, own: str, law: str, beside: Classes) -> bool:
    """Whether a class stands for a part of a coupled cause, whose laws are not its own.

    An orifice whose opening changes along the way damps by the square of the speed, and is no law
    of the speed.
    """
    table = scores.table
    # A surface takes up whatever a law beside it leaves, and is named where its parts leave more:
    # what lies in one of them alone is no law of it.
    if table.surface in beside:
        return True
    if own == table.surface:
        parts = [name for name in table.classes if name != own and table.is_in_surface(name)]
        return sum(law in [known.id for known in table.laws[name]] for name in parts) == 1
    answer = (own, *beside)
    if own in table.coupled_parts and table.coupled_parts <= set(answer):
        return True
    if not table.is_in_surface(own):
        return False
    others = [name for name in beside if not table.is_in_surface(name)]
    # In fewer columns than the surface a product of place and speed is seen where it is small.
    products = [scores.products.of((name, *others)) for name in table.products]
    coupled = min([scores.of((table.surface, *others)), *products], key=lambda held: held.total)
    return shares.is_clear_gain(coupled, scores.of(answer), scores.constants.law_parameter)


def _is_curved(scores: ClassScores, shares: Shares, own: str, beside: Classes) -> bool:
    """Whether the class would be curved: by no small part, or where nothing else explains as much.

    A spring in series with a dashpot is all but a Maxwell branch, and the branch leaves little.
    """
    table, limits = scores.table, scores.constants
    group = table.beyond_laws.get(own)
    if group is None:
        return False
    answer = (own, *beside)
    held, curved = scores.of(answer), scores.beyond_laws(answer, group)
    error = limits.standard_errors * shares.gain_error(curved, held)
    if shares.gain(curved, held) > max(limits.least_curved, error):
        return True
    others = [scores.of((*answer, name)).total for name in table.classes if name not in answer]
    return curved.total < min([held.total, *others])


def _is_in_curved(scores: ClassScores, own: str, beside: Classes) -> bool:
    """Whether a class beside the law leaves no more without it where its own laws are curved.

    A nonlinear spring in series with a dashpot leaves to a linear memory what looks like a damper.
    """
    held = scores.of((own, *beside))
    groups = [group for name, group in scores.table.beyond_laws.items() if name in beside]
    return any(scores.beyond_laws(beside, group).total <= held.total for group in groups)


def _explains(shares: Shares, held: HeldOutSquares) -> bool:
    """Whether a result leaves so little that a law can be the whole of the cause."""
    return shares.is_at_floor(held) or shares.of(held) >= shares.constants.law_explains


def _best_shape(
    scores: ClassScores, beside: Classes, law: LawColumns
) -> tuple[IntArray, HeldOutSquares]:
    """Shape of a law that leaves least."""
    results = [(columns, scores.with_law(beside, columns)) for columns in law.variants]
    return min(results, key=lambda result: result[1].total)

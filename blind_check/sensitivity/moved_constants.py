"""Answers by class of one campaign with every constant moved, one at a time.

What a constant does not reach is not made again: limits of the decision work on held-out squares
that stand; a constant that leaves the runs, or the table of products, equal bit for bit to the
usual ones changes nothing further on. Measured shapes are left out: no answer that is compared here
holds them.
"""

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from carrierflex.blind_check.labels import CasePlan
from carrierflex.blind_check.sensitivity.listed_constants import (
    Constant,
    listed_constants,
    replacement,
)
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.answer import answer_of_table
from carrierflex.diagnosis.element.classes.limits import element_limits
from carrierflex.diagnosis.element.classes.table import (
    ElementRuns,
    ElementTable,
    element_runs,
    table_of,
)
from carrierflex.diagnosis.element.problem import ElementProblem
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.campaign import Campaign

#: What every constant is multiplied by.
FACTORS = (0.8, 1.2)
#: Answer where the records are too short, or the diagnosis ends with an error.
NO_ANSWER = "no answer"
#: Limits that the table reads, and those that the held-out squares read beside it; the decision
#: alone reads every other one.
OF_TABLE = ("n_folds", "fewest_blocks", "separable_from_drive")
OF_SCORES = ("ridges", "pair_ridges", "jitter")
_OF_RUNS = ("fewest_blocks", "separable_from_drive")
_CLASSES = "diagnosis.element.classes."
#: Read once the table stands.
_AFTER_TABLE = (_CLASSES + "answer",)
#: Holds weights of the penalties, as the first of `OF_SCORES` does.
_LIMITS = _CLASSES + "limits"
#: Read until the runs stand, and by no column of theirs.
_BEFORE_COLUMNS = (
    "diagnosis.element.records",
    "diagnosis.element.linear",
    _CLASSES + "drive_in_time",
    _CLASSES + "floor",
    _CLASSES + "motion",
    _CLASSES + "nearest_motion",
    _CLASSES + "noise_colour",
    _CLASSES + "starting_states",
)
_REFUSED = (ValueError, ArithmeticError, AssertionError)


def answers_of_case(plan: CasePlan) -> Mapping[str, Any]:
    """Answer of one case as it is, and every answer that a moved constant changes.

    Parameters
    ----------
    plan : CasePlan
        Case of kind element.

    Returns
    -------
    mapping
        ``answer``, and ``changed``: the other answer by "module.name" and factor.
    """
    campaign, _ = case_campaign(plan)
    return changed_answers(campaign, listed_constants())


def changed_answers(campaign: Campaign, constants: Sequence[Constant]) -> Mapping[str, Any]:
    """Answer of a campaign, and the other answers of moved constants.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind element.
    constants : sequence of Constant
        Each is moved by every factor.

    Returns
    -------
    mapping
        As :func:`answers_of_case`.
    """
    usual = usual_case(campaign)
    changed = {}
    for constant in constants:
        for factor in FACTORS:
            with moved(constant, factor):
                other = usual.answer_beside(constant)
            if other != usual.answer:
                changed[f"{constant.module}.{constant.name} x{factor}"] = other
    return {"answer": usual.answer, "changed": changed}


@dataclass(frozen=True, eq=False)
class UsualCase:
    """A campaign with what its answer is made of, before any constant is moved.

    Parameters
    ----------
    campaign : Campaign
        Its records.
    answer : str
        Its answer in words.
    problem : ElementProblem, optional
        Runs, model and noise; None, as the other two, where there is no answer.
    runs : ElementRuns, optional
        What the columns are made of.
    table : ElementTable, optional
        Products and held-out squares.
    """

    campaign: Campaign
    answer: str
    problem: ElementProblem | None = None
    runs: ElementRuns | None = None
    table: ElementTable | None = None

    def answer_beside(self, constant: Constant) -> str:
        """Answer while a constant is moved; what it does not reach is not made again."""
        if self.problem is None or self.runs is None or self.table is None:
            return plain_answer(self.campaign)
        limits = element_limits()
        if constant.module in _AFTER_TABLE:
            return _in_words(self.problem, self.table)
        is_weight = constant.module == _LIMITS
        if is_weight or (constant.is_field and constant.name not in OF_TABLE):
            is_of_scores = is_weight or constant.name in OF_SCORES
            known = {} if is_of_scores else self.table.scores.known
            return _in_words(self.problem, _scored(self.table, limits, known))
        try:
            problem = self._problem_beside(constant)
            runs = element_runs(problem.model, problem.records, problem.noise, limits)
            if runs is None:
                return NO_ANSWER
            table = self._table_beside(constant, problem, runs, limits)
        except _REFUSED:
            return NO_ANSWER
        return _in_words(problem, _scored(table, limits, self._known_of(table)))

    def _known_of(self, table: ElementTable) -> dict[tuple[str, ...], HeldOutSquares]:
        """Held-out squares that hold for a table too: those of columns that are equal."""
        assert self.table is not None
        usual, known = self.table.table, self.table.scores.known
        if is_same(table.table, usual):
            return known
        equal = equal_groups(usual, table.table)
        if equal is None:
            return {}
        return {
            key: held
            for key, held in known.items()
            if held.further is None and equal.issuperset(held.groups)
        }

    def _problem_beside(self, constant: Constant) -> ElementProblem:
        """Records, model and noise; classes change the noise only where it is not measured."""
        assert self.problem is not None
        is_of_classes = constant.is_field or constant.module.startswith(_CLASSES)
        if is_of_classes and self.problem.noise_is_measured:
            return self.problem
        return _element_problem(self.campaign)

    def _table_beside(
        self,
        constant: Constant,
        problem: ElementProblem,
        runs: ElementRuns,
        limits: ClassConstants,
    ) -> ElementTable:
        """The usual table where nothing that its columns are made of has changed."""
        assert self.problem is not None
        assert self.table is not None
        is_of_runs = constant.module in _BEFORE_COLUMNS or constant.name in _OF_RUNS
        same_scale = is_same(problem.model.scale, self.problem.model.scale)
        if is_of_runs and same_scale and is_same(runs, self.runs):
            return self.table
        return table_of(problem.model, runs, limits)


def usual_case(campaign: Campaign) -> UsualCase:
    """A campaign with its answer and what that is made of."""
    limits = element_limits()
    try:
        problem = _element_problem(campaign)
        runs = element_runs(problem.model, problem.records, problem.noise, limits)
    except _REFUSED:
        return UsualCase(campaign, NO_ANSWER)
    if runs is None:
        return UsualCase(campaign, NO_ANSWER)
    table = table_of(problem.model, runs, limits)
    return UsualCase(campaign, _in_words(problem, table), problem, runs, table)


def plain_answer(campaign: Campaign) -> str:
    """Answer of a campaign as a diagnosis makes it, all of it."""
    try:
        answer = _element_problem(campaign).class_answer()
    except _REFUSED:
        return NO_ANSWER
    return in_words(answer) if answer else NO_ANSWER


@contextmanager
def moved(constant: Constant, factor: float) -> Iterator[None]:
    """Put a moved constant in the place of its own, in all modules that read it.

    Parameters
    ----------
    constant : Constant
        Which.
    factor : float
        What it is multiplied by.
    """
    name, value = replacement(constant, factor)
    own = sys.modules[f"carrierflex.{constant.module}"]
    usual = getattr(own, name)
    readers = [own]
    if not name.startswith("_"):
        readers += [
            module
            for path, module in list(sys.modules.items())
            if path.startswith("carrierflex.diagnosis") and vars(module).get(name) is usual
        ]
    try:
        for module in readers:
            setattr(module, name, value)
        yield
    finally:
        for module in readers:
            setattr(module, name, usual)


def is_same(first: Any, second: Any) -> bool:
    """Whether two results are equal to the last bit, arrays and dataclasses member by member."""
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        return first.shape == second.shape and first.tobytes() == second.tobytes()
    if is_dataclass(first):
        return all(
            is_same(getattr(first, own.name), getattr(second, own.name)) for own in fields(first)
        )
    if isinstance(first, Mapping):
        return first.keys() == second.keys() and all(
            is_same(value, second[key]) for key, value in first.items()
        )
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(is_same, first, second))
    return bool(first == second)


def equal_groups(first: GramTable, second: GramTable) -> frozenset[str] | None:
    """Groups whose products among each other, with target and baseline, are the same in two tables.

    None where the baseline, the blocks or their floor are others.
    """
    if not (is_same(first.folds, second.folds) and is_same(first.floor, second.floor)):
        return None

    def agree(names: Iterable[str]) -> bool:
        both = [_products(table, names) for table in (first, second)]
        return is_same(*both)

    if first.n_base != second.n_base or not agree(()):
        return None
    equal = [
        name
        for name, group in first.groups.items()
        if is_same(group.penalty, second.groups[name].penalty)
        and group.is_nonnegative == second.groups[name].is_nonnegative
        and agree((name,))
    ]
    return frozenset(equal if agree(equal) else ())


def _products(table: GramTable, names: Iterable[str]) -> FloatArray:
    """Products by block of target, baseline and some groups."""
    places = [np.arange(1 + table.n_base), *(table.groups[name].columns for name in names)]
    chosen = np.concatenate(places)
    return np.asarray(table.gram[:, chosen[:, None], chosen])


def _element_problem(campaign: Campaign) -> ElementProblem:
    problem, _ = problem_of(campaign, None)
    assert isinstance(problem, ElementProblem)
    return problem


def _scored(
    table: ElementTable,
    limits: ClassConstants,
    known: dict[tuple[str, ...], HeldOutSquares],
) -> ElementTable:
    """Table under some limits, with the held-out squares that hold for them."""
    return replace(table, scores=ClassScores(table.table, limits, known))


def _in_words(problem: ElementProblem, table: ElementTable) -> str:
    try:
        answer = answer_of_table(
            table, problem.model, problem.noise_note, lambda scores, own, held, law: None
        )
    except _REFUSED:
        return NO_ANSWER
    return in_words(answer)


def in_words(answer: ClassAnswer) -> str:
    """State, classes, ties and named laws in one line."""
    sets = [tuple(sorted(finding.id for finding in answer.classes)), *map(tuple, answer.ties)]
    classes = " or ".join(" + ".join(ids) for ids in sorted(sets))
    laws = sorted(finding.law for finding in answer.classes if finding.law_named)
    return ": ".join(text for text in (answer.state, classes, ", ".join(laws)) if text)

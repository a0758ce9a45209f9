"""A campaign with all that its answer by class is made of, and its answer beside moved constants.

An answer is made in steps: records, scale of the element, runs in force space, filters, columns
with their products, held-out squares, decision. A constant is read in some of them. Steps before
the first of these are not made again; where a step that has read the constant gives what it usually
gives, bit for bit, neither are those behind it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from carrierflex.blind_check.sensitivity.listed_constants import Constant
from carrierflex.blind_check.sensitivity.read_steps import Reads
from carrierflex.blind_check.sensitivity.reused_products import (
    KnownColumns,
    has_same_filters,
    known_columns,
    table_beside,
)
from carrierflex.blind_check.sensitivity.sameness import equal_groups, is_same
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.element.classes.answer import answer_of_table
from carrierflex.diagnosis.element.classes.floor import is_believed
from carrierflex.diagnosis.element.classes.limits import element_limits
from carrierflex.diagnosis.element.classes.table import (
    CountedRuns,
    ElementRuns,
    ElementTable,
    counted_runs,
    runs_with_bases,
    table_of,
    weights_of,
)
from carrierflex.diagnosis.element.problem import ElementProblem
from carrierflex.diagnosis.element.records import element_records
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.campaign import Campaign

#: Answer where the records are too short, or the diagnosis ends with an error.
NO_ANSWER = "no answer"
_REFUSED = (ValueError, ArithmeticError, AssertionError)


@dataclass(frozen=True, eq=False)
class Made:
    """Steps between the records of a campaign and its answer.

    Parameters
    ----------
    problem : ElementProblem
        Records, model and noise.
    counted : CountedRuns
        Runs in force space.
    runs : ElementRuns
        The same with filters and bases.
    table : ElementTable
        Products and held-out squares.
    columns : KnownColumns
        What the products are of.
    """

    problem: ElementProblem
    counted: CountedRuns
    runs: ElementRuns
    table: ElementTable
    columns: KnownColumns


@dataclass(frozen=True, eq=False)
class UsualCase:
    """A campaign with what its answer is made of, before any constant is moved.

    Parameters
    ----------
    campaign : Campaign
        Its records.
    answer : str
        Its answer in words.
    made : Made, optional
        Its steps; None where there is no answer, or a noise that its classes have raised.
    """

    campaign: Campaign
    answer: str
    made: Made | None = None

    def answer_beside(self, constant: Constant) -> str:
        """Answer while a constant is moved; what it does not reach is not made again."""
        if self.made is None:
            return _remade_answer(self.campaign)
        reads = Reads(constant)
        try:
            if reads.is_of_problem:
                return self._beside_problem(self.made, reads)
            return self._beside_steps(self.made, self.made.problem, reads)
        except _REFUSED:
            return NO_ANSWER

    def _beside_problem(self, made: Made, reads: Reads) -> str:
        """Answer where records, or the scale of the element, may have changed."""
        usual = made.problem
        if reads.only_records and is_same(element_records(self.campaign), usual.records):
            return self.answer
        problem = element_problem_of(self.campaign)
        same_records = is_same(problem.records, usual.records)
        same_scale = is_same(problem.model.scale, usual.model.scale)
        same_noise = is_same(problem.noise, usual.noise)
        if same_records and same_scale and same_noise and not reads.is_behind_problem:
            return self.answer
        if problem.table is not None:
            return _in_words(problem, problem.table)
        return self._beside_steps(made, problem, reads)

    def _beside_steps(self, made: Made, problem: ElementProblem, reads: Reads) -> str:
        """Answer where runs in force space, or what is made of them, may have changed."""
        limits = element_limits()
        if reads.is_of_answer_alone:
            known = {} if reads.is_of_scores else made.table.scores.known
            asked = replace(made.table, loops={}) if reads.is_of_loops else made.table
            return self._told(problem, _scored(asked, limits, known))
        counted: CountedRuns | None = made.counted
        if reads.is_of_counted:
            counted = counted_runs(problem.model, problem.records, problem.noise, limits)
        if counted is None:
            return NO_ANSWER
        same_runs = is_same(counted.records, made.counted.records)
        weights = made.runs.weights
        if reads.is_of_weights or not same_runs:
            weights = weights_of(problem.model, counted, problem.records, problem.noise)
        same_filters = (
            same_runs
            and is_same(weights, made.runs.weights)
            and is_same(problem.model.scale, made.problem.model.scale)
            and not reads.is_of_folds
            and (not reads.is_of_filter or has_same_filters(made.columns, weights))
        )
        table, equal = None, None
        if same_filters and not reads.is_of_columns and is_same(counted.size, made.counted.size):
            table = made.table
        runs = None if table else runs_with_bases(counted, weights)
        if runs and same_filters:
            beside = table_beside(made.table, made.columns, problem.model, runs, limits)
            table, equal = beside or (None, None)
        if table is made.table and not reads.is_of_answer:
            return self._told(problem, table) if reads.is_of_floor else self.answer
        if table is None:
            assert runs is not None
            table = table_of(problem.model, runs, limits)
            equal = equal_groups(made.table.table, table.table)
        known = made.table.scores.known
        if table is not made.table:
            known = _known_of(known, equal)
        return self._told(problem, _scored(table, limits, known))

    def _told(self, problem: ElementProblem, table: ElementTable) -> str:
        """Answer of a table, of another noise where no class learns what this one leaves."""
        if not problem.noise_is_measured and not is_believed(table):
            return _remade_answer(self.campaign)
        return _in_words(problem, table)


def usual_case(campaign: Campaign) -> UsualCase:
    """A campaign with its answer and what that is made of."""
    limits = element_limits()
    try:
        problem = element_problem_of(campaign)
        counted = counted_runs(problem.model, problem.records, problem.noise, limits)
    except _REFUSED:
        return UsualCase(campaign, NO_ANSWER)
    if counted is None:
        return UsualCase(campaign, NO_ANSWER)
    weights = weights_of(problem.model, counted, problem.records, problem.noise)
    runs = runs_with_bases(counted, weights)
    table = problem.table or table_of(problem.model, runs, limits)
    answer = _in_words(problem, table)
    if not (problem.noise_is_measured or problem.table):
        return UsualCase(campaign, answer)
    made = Made(problem, counted, runs, table, known_columns(problem.model, runs))
    return UsualCase(campaign, answer, made)


def in_words(answer: ClassAnswer) -> str:
    """State, classes, ties and named laws in one line."""
    sets = [tuple(sorted(finding.id for finding in answer.classes)), *map(tuple, answer.ties)]
    classes = " or ".join(" + ".join(ids) for ids in sorted(sets))
    laws = sorted(finding.law for finding in answer.classes if finding.law_named)
    return ": ".join(text for text in (answer.state, classes, ", ".join(laws)) if text)


def are_opposed(first: str, second: str) -> bool:
    """Whether two answers in words name classes and allow no set of them both."""
    sets = [_allowed_sets(words) for words in (first, second)]
    return all(sets) and sets[0].isdisjoint(sets[1])


def _allowed_sets(words: str) -> frozenset[str]:
    """Sets of classes that an answer in words holds possible; empty where it names none."""
    classes = words.partition(": ")[2].partition(": ")[0]
    return frozenset(classes.split(" or ")) if classes else frozenset()


def element_problem_of(campaign: Campaign) -> ElementProblem:
    """Comparison problem of a campaign of kind element."""
    problem, _ = problem_of(campaign, None)
    assert isinstance(problem, ElementProblem)
    return problem


def _remade_answer(campaign: Campaign) -> str:
    """Answer of a campaign with all steps made again."""
    try:
        problem = element_problem_of(campaign)
        table = problem.class_table
    except _REFUSED:
        return NO_ANSWER
    return NO_ANSWER if table is None else _in_words(problem, table)


def _known_of(
    known: Mapping[tuple[str, ...], HeldOutSquares], equal: frozenset[str] | None
) -> dict[tuple[str, ...], HeldOutSquares]:
    """Held-out squares that hold for another table too: those of groups that are equal.

    None where the baseline, its blocks or their folds are others.
    """
    if equal is None:
        return {}
    return {
        key: held
        for key, held in known.items()
        if held.further is None and equal.issuperset(held.groups)
    }


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
            table, problem.model, problem.noise_note, lambda table: lambda *_: (None, None)
        )
    except _REFUSED:
        return NO_ANSWER
    return in_words(answer)

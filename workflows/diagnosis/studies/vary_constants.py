"""How many answers by class every constant changes that is moved by a fifth, either way.

Cases of the blind check of kind element; writes CASE.json for every case, which a later call takes
up, and constants.md: every constant that can change an answer, with its value, its reason, how many
answers it changed (state, classes, ties, laws) and, in brackets, how many of them to other classes:
to one that allows none of the sets that the usual answer does. A good answer: at most two per cent.

What other noise changes in the same truth under the same drive stands below the table. A later call
moves constants that were added or changed since, while a case's answer is what it was. After a
change of the rules name another folder.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import CasePlan
from carrierflex.blind_check.sensitivity.listed_constants import Constant, listed_constants
from carrierflex.blind_check.sensitivity.moved_constants import (
    FACTORS,
    N_REPEATS,
    answers_of_case,
    values_of,
)
from carrierflex.blind_check.sensitivity.usual_case import are_opposed
from carrierflex.files.json_files import save_json
from carrierflex.workflows.diagnosis.studies.kept_cases import kept_case, make_missing, write_table
from carrierflex.workflows.support.executors import work_executor
from carrierflex.workflows.support.outputs import prepared_folder
from carrierflex.workflows.support.progress import Stages

#: What the file of a case holds.
_KEYS = ("answer", "moved", "changed", "repeated")
#: Share of the answers that a moved constant may change.
_MOST_CHANGED = 0.02


def main(
    *,
    out: Path,
    seed: int = 1,
    cases: int = 200,
    workers: int = 1,
    standing: bool = False,
    quiet: bool = False,
) -> None:
    """Move every constant and count the answers that change.

    Cases are made in the order of their numbers, which says nothing about their content: those
    that stand are a fair part of the whole at any time.

    Parameters
    ----------
    out : Path
        Folder for the answers and the table; cases that stand there are not done again.
    seed : int
        Seed of the cases.
    cases : int
        Number of cases.
    workers : int
        Processes.
    standing : bool
        Make no case; table of those that stand.
    quiet : bool
        Show no progress.
    """
    folder = prepared_folder(out)
    plans = case_plans("element", cases, seed)
    files = [folder / f"{seed}-{plan.name}.json" for plan in plans]
    if not standing:
        stages = Stages(1, quiet)
        with stages.stage("moving the constants"), work_executor(workers) as executor:
            stands = partial(_stands, values=values_of(listed_constants()))
            make_missing(plans, files, _write_answers, executor, stages, stands)
    made = [_kept(file) for file in files if file.is_file()]
    write_table(folder / "constants.md", _table(made))


def _kept(path: Path) -> dict[str, Any]:
    """Answers of a case that stands."""
    return kept_case(path, "answers of a case", lambda own: {key: own[key] for key in _KEYS})


def _stands(path: Path, values: Mapping[str, Any]) -> bool:
    """Whether a case stands with all constants at these values, and with its repeats."""
    if not path.is_file():
        return False
    own = _kept(path)
    return own["moved"] == values and len(own["repeated"]) == N_REPEATS


def _write_answers(plan: CasePlan, path: Path) -> None:
    kept = _kept(path) if path.is_file() else None
    with threadpool_limits(limits=1):
        answers = answers_of_case(plan, kept)
    save_json(path, answers)


def _table(cases: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Rows in the order of the modules; constants that change nothing below them."""
    changed = Counter(name for case in cases for name in case["changed"])
    opposed = Counter(
        name
        for case in cases
        for name, words in case["changed"].items()
        if are_opposed(case["answer"], words)
    )
    counts = {
        constant: [
            (changed[name], opposed[name]) for name in (f"{constant.path} x{f}" for f in FACTORS)
        ]
        for constant in listed_constants()
    }
    yield f"Answers changed (in brackets: to other classes), of {len(cases)} cases."
    yield ""
    yield "| constant | value | " + " | ".join(f"x {factor}" for factor in FACTORS) + " | reason |"
    yield "|---|---|" + "---|" * len(FACTORS) + "---|"
    for constant, own in counts.items():
        if any(map(max, own)):
            yield _row(constant, own)
    still = [_name(constant) for constant, own in counts.items() if not any(map(max, own))]
    yield ""
    yield f"{len(still)} of {len(counts)} change nothing: {', '.join(still)}."
    beyond = [
        f"{_name(constant)} ({max(count for count, _ in own)})"
        for constant, own in counts.items()
        if max(count for count, _ in own) > _MOST_CHANGED * len(cases)
    ]
    yield ""
    yield f"{len(beyond)} change more than {_MOST_CHANGED:.0%}: {', '.join(beyond) or 'none'}."
    yield ""
    yield _repeated_words(cases)


def _repeated_words(cases: Sequence[Mapping[str, Any]]) -> str:
    """What a repeated measurement changes, beside which a moved constant is to be seen."""
    pairs = [(case["answer"], other) for case in cases for other in case["repeated"]]
    changed = sum(usual != other for usual, other in pairs)
    to_others = sum(are_opposed(usual, other) for usual, other in pairs)
    share = changed / max(len(pairs), 1)
    return (
        f"Other noise, in the same truth under the same drive, changes {changed} ({to_others}) of "
        f"{len(pairs)}: {share:.1%}."
    )


def _name(constant: Constant) -> str:
    return f"`{constant.module.rpartition('.')[2]}.{constant.name}`"


def _row(constant: Constant, counts: Sequence[tuple[int, int]]) -> str:
    told = " | ".join(f"{count} ({to_others})" for count, to_others in counts)
    return f"| {_name(constant)} | {_value(constant.value)} | {told} | {constant.reason} |"


def _value(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.min():.3g} to {value.max():.3g}, {value.size}"
    if isinstance(value, tuple):
        return ", ".join(f"{own:.3g}" for own in value)
    return f"{value:.3g}"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

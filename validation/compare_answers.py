"""Table of two sets of answers to the same sealed cases: paired figures, and what one alone finds.

    python -m validation.compare_answers A.jsonl B.jsonl --truth FOLDER/truth [--lines FILE.csv]

A and B are files of `run_tree`. Differences are A minus B, with the 95 % interval of paired
proportions. `--lines` writes one line a case.
"""

import argparse
import csv
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carrierflex.blind_check.labels import KINDS, NOTHING, OUTSIDE, Label
from carrierflex.blind_check.scoring.scoring import wilson
from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis
from validation.paired_score import (
    ScoredAnswer,
    is_clear,
    paired_difference,
    read_answer,
    read_labels,
    scored_answer,
    textbook_laws,
    with_classes,
)
from validation.run_tree import read_lines

MEASURED = "measured"


@dataclass(frozen=True, eq=False)
class Pair:
    """One case with both answers."""

    family: str
    label: Label
    first: ScoredAnswer
    second: ScoredAnswer

    @property
    def is_clear(self) -> bool:
        """Whether the case has to be answered rightly."""
        return is_clear(self.label)

    @property
    def has_cause(self) -> bool:
        """Whether a class holds what is missing."""
        return self.label.family not in (NOTHING, OUTSIDE) and bool(self.label.effects)


def read_pairs(first: Path, second: Path, truth: Path) -> list[Pair]:
    """Cases that both files answer.

    Parameters
    ----------
    first, second : Path
        Answers of `run_tree`.
    truth : Path
        Folder of the labels.
    """
    labels = {case: with_classes(label) for case, label in read_labels(truth).items()}
    others = {row["case"]: row for row in read_lines(second)}
    pairs = []
    for row in read_lines(first):
        label, other = labels.get(row["case"]), others.get(row["case"])
        if label is None or other is None:
            continue
        scored = [
            scored_answer(label, read_answer(line, path.with_suffix("")))
            for line, path in ((row, first), (other, second))
        ]
        pairs.append(Pair(row["family"], label, *scored))
    return sorted(pairs, key=lambda pair: pair.label.case)


Outcome = Callable[[ScoredAnswer], bool | None]


def _figures() -> Iterator[tuple[str, Callable[[Pair], bool], Outcome]]:
    """Name, cases that count, outcome of an answer; None where an answer has no such outcome."""
    yield "class right", lambda pair: True, lambda answer: answer.is_class_right
    yield "class right, gap >= 2 floors or none", lambda p: p.is_clear, lambda o: o.is_class_right
    yield (
        "class right, gap >= 2 floors, cause inside",
        lambda pair: pair.is_clear and pair.has_cause,
        lambda answer: answer.is_class_right,
    )
    yield (
        "class right, gap < 2 floors",
        lambda pair: not pair.is_clear,
        lambda answer: answer.is_class_right,
    )
    yield (
        "true class in the answer or a tie, gap >= 2 floors",
        lambda pair: pair.is_clear and pair.has_cause,
        lambda answer: answer.outcome in ("right", "tie"),
    )
    yield "law right, alone or in a tie", _has_law, lambda answer: answer.is_law_right
    yield (
        "law right, gap >= 2 floors",
        lambda pair: _has_law(pair) and pair.is_clear,
        lambda answer: answer.is_law_right,
    )
    yield (
        "law right, nearest laws of the classes counted",
        _has_law,
        lambda answer: bool(answer.is_law_right or answer.is_nearest_right),
    )
    yield "a law named", lambda pair: True, lambda answer: bool(answer.laws)
    yield "false law", lambda pair: True, lambda answer: answer.is_law_false
    yield "textbook truth, another law named", _has_law, lambda answer: answer.is_law_other
    yield (
        "nothing missing: class or law named",
        _of(NOTHING),
        lambda answer: not answer.is_class_right,
    )
    yield "outside: class or law named", _of(OUTSIDE), lambda answer: not answer.is_class_right
    yield "tie of classes", lambda pair: True, lambda answer: answer.has_class_tie
    yield "tie of laws", lambda pair: True, lambda answer: answer.has_law_tie
    yield (
        "abstained or silent, gap >= 2 floors",
        lambda pair: pair.is_clear and pair.has_cause,
        lambda answer: answer.outcome in ("abstained", "silent"),
    )
    yield "verdict 'at_noise_floor'", lambda pair: True, lambda answer: answer.says_noise
    yield (
        "verdict 'at_noise_floor', gap >= 2 floors",
        lambda pair: pair.is_clear and pair.has_cause,
        lambda answer: answer.says_noise,
    )
    yield (
        "verdict 'at_noise_floor', nothing missing",
        _of(NOTHING),
        lambda answer: answer.says_noise,
    )
    yield "line off the orders named", lambda pair: True, lambda answer: answer.names_line
    yield "failed", lambda pair: True, lambda answer: answer.outcome == "error"


def _of(family: str) -> Callable[[Pair], bool]:
    return lambda pair: pair.label.family == family


def _has_law(pair: Pair) -> bool:
    return bool(textbook_laws(pair.label))


def paired_table(pairs: Sequence[Pair], names: tuple[str, str]) -> str:
    """Markdown table of the paired figures of some cases.

    Parameters
    ----------
    pairs : sequence of Pair
        Cases.
    names : tuple of str
        Names of both sets of answers.
    """
    first, second = names
    lines = [
        f"| figure | cases | {first} | {second} | only {first} | only {second} "
        "| difference, points (95 %) |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, counts, outcome in _figures():
        hits_of_both = [
            (bool(a), bool(b))
            for pair in pairs
            if counts(pair)
            and (a := outcome(pair.first)) is not None
            and (b := outcome(pair.second)) is not None
        ]
        if not hits_of_both:
            continue
        hits = [a for a, _ in hits_of_both], [b for _, b in hits_of_both]
        difference, low, high = (100.0 * value for value in paired_difference(*hits))
        only = sum(a > b for a, b in hits_of_both), sum(a < b for a, b in hits_of_both)
        lines.append(
            f"| {name} | {len(hits_of_both)} | {_share(hits[0])} | {_share(hits[1])} | {only[0]} "
            f"| {only[1]} | {difference:+.1f} ({low:+.1f} to {high:+.1f}) |"
        )
    both = [pair.first for pair in pairs], [pair.second for pair in pairs]
    for name, chosen in (
        (
            "rho inside its interval",
            lambda answer: () if answer.rho_hit is None else (answer.rho_hit,),
        ),
        ("parameters inside their interval", lambda answer: answer.parameter_hits),
    ):
        shares = [
            _interval_share([hit for answer in answers for hit in chosen(answer)])
            for answers in both
        ]
        lines.append(f"| {name} |  | {shares[0]} | {shares[1]} |  |  |  |")
    seconds = [_seconds([answer.seconds for answer in answers]) for answers in both]
    lines.append(f"| processor time, median (mean) [s] |  | {seconds[0]} | {seconds[1]} |  |  |  |")
    return "\n".join(lines)


def _share(hits: Sequence[bool]) -> str:
    return f"{sum(hits)} ({100.0 * sum(hits) / len(hits):.1f} %)"


def _interval_share(hits: Sequence[bool]) -> str:
    if not hits:
        return "none given"
    low, high = wilson(sum(hits), len(hits))
    return (
        f"{sum(hits)} of {len(hits)} ({100.0 * sum(hits) / len(hits):.0f} %, "
        f"{100.0 * low:.0f} to {100.0 * high:.0f})"
    )


def _seconds(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.2f} ({statistics.fmean(values):.2f})"


def found_alone(pair: Pair) -> list[str]:
    """What the first answer of a case finds and the second does not.

    Parameters
    ----------
    pair : Pair
        A case; swapped, it tells what the second alone finds.
    """
    first, second = pair.first, pair.second
    findings = []
    if first.names_line and not second.names_line:
        findings.append("a line off the shaft's orders")
    if len(pair.label.classes) > 1 and first.causes_found > second.causes_found:
        findings.append("a further cause")
    if first.is_class_right and not second.is_class_right:
        findings.append(f"the class ({second.outcome} otherwise)")
    if first.is_law_right and not second.is_law_right:
        if second.has_class_tie or second.has_law_tie:
            findings.append("the law, other tied")
        elif second.laws:
            findings.append("the law, other names another")
        elif second.outcome in ("abstained", "silent"):
            findings.append("the law, other without a class")
        else:
            nearest = "right" if second.is_nearest_right else "not right"
            findings.append(f"the law, other names its class (nearest law {nearest})")
    if second.is_law_false and not first.is_law_false:
        findings.append("no false law")
    if first.says_noise and not second.says_noise:
        truth = "nothing missing" if not pair.has_cause else "a cause"
        findings.append(
            f"'noise' where there is {pair.label.family if truth != 'a cause' else truth}"
        )
    return findings


def found_table(pairs: Sequence[Pair], names: tuple[str, str]) -> str:
    """Markdown table of what one answer alone finds, counted by family.

    Parameters
    ----------
    pairs : sequence of Pair
        Cases.
    names : tuple of str
        Names of both sets of answers.
    """
    counts: Counter[tuple[str, str, str]] = Counter()
    for pair in pairs:
        swapped = Pair(pair.family, pair.label, pair.second, pair.first)
        for name, ordered in zip(names, (pair, swapped), strict=True):
            for what in found_alone(ordered):
                counts[(name, what, pair.family)] += 1
    lines = ["| found by | what | cases | by family |", "|---|---|---|---|"]
    for name, what in dict.fromkeys((name, what) for name, what, _ in sorted(counts)):
        numbers = {f: n for (a, b, f), n in sorted(counts.items()) if (a, b) == (name, what)}
        families = ", ".join(f"{family} {count}" for family, count in numbers.items())
        lines.append(f"| {name} | {what} | {sum(numbers.values())} | {families} |")
    return "\n".join(lines)


def verdict_table(pairs: Sequence[Pair], names: tuple[str, str]) -> str:
    """Markdown table of the verdict words of both answers."""
    counts = Counter((pair.first.verdict, pair.second.verdict) for pair in pairs)
    columns = sorted({second for _, second in counts})
    lines = [
        f"| {names[0]} \\ {names[1]} | " + " | ".join(columns) + " |",
        "|---" * (len(columns) + 1) + "|",
    ]
    for row in sorted({first for first, _ in counts}):
        cells = " | ".join(str(counts[(row, column)] or "") for column in columns)
        lines.append(f"| {row} | {cells} |")
    return "\n".join(lines)


def differing_cases(pairs: Sequence[Pair], names: tuple[str, str]) -> str:
    """Markdown table of the cases whose classes, laws or verdict differ."""
    lines = [
        f"| case | family | gap | truth | {names[0]} | {names[1]} |",
        "|---|---|---|---|---|---|",
    ]
    for pair in pairs:
        both = pair.first, pair.second
        distinct = {(one.answer, one.laws, one.says_noise, one.names_line) for one in both}
        if len(distinct) > 1:
            texts = [_words(answer) for answer in both]
            label = pair.label
            truth = " + ".join(label.effects) or label.family
            lines.append(
                f"| {label.case} | {pair.family} | {label.gap_over_floor:.1f} | {truth} "
                f"| {texts[0]} | {texts[1]} |"
            )
    return "\n".join(lines)


def _words(answer: ScoredAnswer) -> str:
    laws = " + ".join(answer.laws) or "no law"
    line = "; a line off the orders" if answer.names_line else ""
    return f"{answer.outcome}: {answer.answer}{line}; {laws}; {answer.verdict}"


def measured_table(first: Path, second: Path, names: tuple[str, str]) -> str:
    """Markdown table of the measured records that both files answer."""
    others = {row["case"]: row for row in read_lines(second) if row["kind"] == MEASURED}
    lines = [f"| record | {names[0]} | {names[1]} | seconds |", "|---|---|---|---|"]
    for row in read_lines(first):
        other = others.get(row["case"])
        if other is None:
            continue
        cells = [
            _record_words(line, path.with_suffix("") / line["case"])
            for line, path in ((row, first), (other, second))
        ]
        seconds = f"{row['seconds']:.2f}, {other['seconds']:.2f}"
        lines.append(f"| {row['case']} | {cells[0]} | {cells[1]} | {seconds} |")
    return "\n".join(lines) if len(lines) > 2 else ""


def _record_words(row: dict[str, Any], folder: Path) -> str:
    if row["error"] is not None:
        return f"error: {row['error']}"
    document = read_diagnosis(folder / DIAGNOSIS_FILE)
    classes = [
        f"`{named['id']}` {named['share']:.3f}"
        + (f", {named['law']} {named['law_share']:.3f}" if named["law"] else "")
        for named in document["classes"] or ()
    ]
    ties = [" + ".join(ids) for ids in document["class_ties"] or ()]
    words = [
        document["verdict"] + (" (incomplete)" if document["incomplete"] else ""),
        " + ".join(classes) or "no class",
    ]
    if ties:
        words.append("tied with " + " or ".join(ties))
    words.append("law " + (" + ".join(document["effects"]) or "none"))
    far = document.get("how_far") or {}
    if far.get("rho") is not None:
        words.append(f"rho {far['rho']:.3f}")
    return "; ".join(words)


def write_case_lines(pairs: Sequence[Pair], path: Path, names: tuple[str, str]) -> None:
    """Write one line a case with both answers (CSV)."""
    fields = (
        "outcome",
        "answer",
        "laws",
        "nearest_laws",
        "verdict",
        "has_class_tie",
        "has_law_tie",
        "is_law_right",
        "is_law_false",
        "names_line",
        "causes_found",
        "rho_hit",
        "parameter_hits",
        "seconds",
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        head = ["case", "kind", "family", "drive", "gap_over_floor", "causes", "classes", "laws"]
        writer.writerow([*head, *(f"{name} {field}" for name in names for field in fields)])
        for pair in pairs:
            label = pair.label
            row: list[Any] = [label.case, label.kind, pair.family, label.drive]
            row += [f"{label.gap_over_floor:.3g}", " + ".join(label.effects)]
            row += [" + ".join(label.classes), " + ".join(textbook_laws(label))]
            for answer in (pair.first, pair.second):
                row += [_cell(getattr(answer, field)) for field in fields]
            writer.writerow(row)


def _cell(value: Any) -> Any:
    if value is None:
        return ""
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, float):
        return f"{value:.3g}"
    if isinstance(value, tuple):
        hits = all(isinstance(item, bool) for item in value)
        return f"{sum(value)}/{len(value)}" if value and hits else " + ".join(map(str, value))
    return value


def report(pairs: Sequence[Pair], names: tuple[str, str], *, is_long: bool) -> str:
    """Page of all tables.

    Parameters
    ----------
    pairs : sequence of Pair
        Cases.
    names : tuple of str
        Names of both sets of answers.
    is_long : bool
        With a table for every family and the list of the cases that differ.
    """
    texts = ["## All kinds", paired_table(pairs, names)]
    for kind in KINDS:
        of_kind = [pair for pair in pairs if pair.label.kind == kind]
        if not of_kind:
            continue
        texts += [f"## Kind {kind}: {len(of_kind)} cases", paired_table(of_kind, names)]
        texts += [found_table(of_kind, names), verdict_table(of_kind, names)]
        texts.append(_family_table(of_kind, names))
    if is_long:
        texts += ["## Cases that differ", differing_cases(pairs, names)]
    return "\n\n".join(texts) + "\n"


def _family_table(pairs: Sequence[Pair], names: tuple[str, str]) -> str:
    lines = [
        f"| family | cases | class right {names[0]} | {names[1]} | law right {names[0]} "
        f"| {names[1]} | false law {names[0]} | {names[1]} | seconds {names[0]} | {names[1]} |",
        "|---" * 10 + "|",
    ]
    for family in dict.fromkeys(pair.family for pair in pairs):
        of_family = [pair for pair in pairs if pair.family == family]
        cells = [f"{family}", f"{len(of_family)}"]
        cells += [str(sum(answer.is_class_right for answer in side)) for side in _sides(of_family)]
        of_laws = [pair for pair in of_family if _has_law(pair)]
        cells += [
            f"{sum(bool(answer.is_law_right) for answer in side)} of {len(of_laws)}"
            if of_laws
            else "-"
            for side in _sides(of_laws)
        ]
        cells += [str(sum(answer.is_law_false for answer in side)) for side in _sides(of_family)]
        cells += [
            f"{statistics.median(answer.seconds for answer in side):.2f}"
            for side in _sides(of_family)
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _sides(pairs: Sequence[Pair]) -> tuple[list[ScoredAnswer], list[ScoredAnswer]]:
    return [pair.first for pair in pairs], [pair.second for pair in pairs]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("first", type=Path, help="answers A (.jsonl)")
    parser.add_argument("second", type=Path, help="answers B (.jsonl)")
    parser.add_argument("--truth", type=Path, required=True, help="folder of the labels")
    parser.add_argument("--names", nargs=2, help="names of A and B in the tables")
    parser.add_argument("--lines", type=Path, help="file for one line a case (.csv)")
    parser.add_argument("--short", action="store_true", help="without the cases that differ")
    chosen = parser.parse_args()
    names = tuple(chosen.names or (chosen.first.stem, chosen.second.stem))
    pairs = read_pairs(chosen.first, chosen.second, chosen.truth)
    if pairs:
        print(report(pairs, names, is_long=not chosen.short))
    measured = measured_table(chosen.first, chosen.second, names)
    if measured:
        print("## Measured records\n\n" + measured)
    if chosen.lines is not None:
        write_case_lines(pairs, chosen.lines, names)


if __name__ == "__main__":
    main()

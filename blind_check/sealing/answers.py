"""Answers of any tool to the sealed campaigns: one JSON file (docs/validation.md).

An answer holds what the score reads of a diagnosis, under the same names.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carrierflex.blind_check.sealing.verdicts import ERROR, Verdict
from carrierflex.diagnosis.inference.results import (
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMING,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
)
from carrierflex.files.json_files import read_json, save_json
from carrierflex.files.shown_values import shown

FORMAT = "carrierflex-answers"
VERSION = 1
_EXPECTED = "answers to a blind check"
_MOST_BYTES = 20_000_000
#: Numbers of this size are none of an answer's.
_LARGEST = 1e300
#: Verdicts that an answer may give.
VERDICTS = (*NAMING, CLASS_NAMED, NONE_OF_THESE, AT_NOISE_FLOOR, NOT_DIAGNOSABLE, ERROR)


@dataclass(frozen=True)
class Answers:
    """Answers of one tool.

    Parameters
    ----------
    tool : str
        Name and version.
    cases : mapping of str to Verdict
        Answer by case.
    """

    tool: str
    cases: Mapping[str, Verdict]


def write_answers(path: Path, answers: Answers) -> None:
    """Write answers as any tool would."""
    content = {"format": FORMAT, "version": VERSION, "tool": answers.tool}
    save_json(path, content | {"cases": {k: _entry(v) for k, v in answers.cases.items()}})


def read_answers(path: Path, cases: Iterable[str]) -> Answers:
    """Read the answers of a tool.

    Parameters
    ----------
    path : Path
        File.
    cases : iterable of str
        Cases of the check; one without an answer counts as an error.

    Returns
    -------
    Answers
        One answer to each case.

    Raises
    ------
    ValueError
        Where the file is no such file, answers a case that the check does not hold, or an answer
        has an unknown key or a value of another form; one line that names the file and the case.
    """
    content = read_json(path, _EXPECTED, _MOST_BYTES)
    known = isinstance(content, dict) and content.get("format") == FORMAT
    if not known or content.get("version") != VERSION:
        raise ValueError(f"{path}: not {_EXPECTED}; expected format '{FORMAT}', version {VERSION}")
    tool, entries = content.get("tool"), content.get("cases")
    if not isinstance(tool, str) or not isinstance(entries, dict):
        raise ValueError(f"{path}: keys 'tool' and 'cases'; expected a name and answers by case")
    names = list(cases)
    odd = sorted(set(entries) - set(names))
    if odd:
        raise ValueError(f"{path}: answers {shown(odd[0])}, which is no case of this check")
    missing = Verdict({"verdict": ERROR, "reason": "no answer"}, math.nan)
    return Answers(
        tool,
        {
            name: _verdict(entries[name], f"{path}: {name}") if name in entries else missing
            for name in names
        },
    )


def _entry(verdict: Verdict) -> dict[str, Any]:
    """Answer as it stands in a file."""
    document = verdict.document
    entry: dict[str, Any] = {"verdict": document["verdict"], "seconds": verdict.seconds}
    entry |= {key: document[key] for key in ("effects", "aliases", "class_ties") if key in document}
    if "classes" in document:
        entry["classes"] = [claim["id"] for claim in document["classes"] or ()]
    far = document.get("how_far") or {}
    entry |= {key: far[key] for key in ("rho", "rho_ci95") if far.get(key) is not None}
    parameters = document.get("parameters") or {}
    if parameters:
        keys = ("value", "std", "unit", "ci95")
        entry["parameters"] = {
            effect: {
                name: {key: claim[key] for key in keys if key in claim}
                for name, claim in values.items()
            }
            for effect, values in parameters.items()
        }
    return entry


def _verdict(entry: Any, where: str) -> Verdict:
    """Answer as the score reads it."""
    if not isinstance(entry, dict):
        raise ValueError(f"{where}: {shown(entry)}; expected a table of keys")
    unknown = sorted(set(entry) - set(_CHECKS))
    if unknown:
        raise ValueError(f"{where}: unknown key {shown(unknown[0])}; expected {', '.join(_CHECKS)}")
    for key, value in entry.items():
        is_right, expected = _CHECKS[key]
        if not is_right(value):
            raise ValueError(f"{where}: {key} is {shown(value)}; expected {expected}")
    document: dict[str, Any] = {
        key: entry.get(key, []) for key in ("effects", "aliases", "class_ties")
    }
    document["parameters"] = entry.get("parameters", {})
    if "classes" in entry:
        document["classes"] = [{"id": name} for name in entry["classes"]]
    document["how_far"] = {"rho": entry.get("rho"), "rho_ci95": entry.get("rho_ci95", (None, None))}
    document["verdict"] = entry.get("verdict") or _implied(document)
    return Verdict(document, float(entry.get("seconds") or math.nan))


def _implied(document: Mapping[str, Any]) -> str:
    """Verdict of an answer that gives none."""
    if document["effects"]:
        return NAMED
    return CLASS_NAMED if document.get("classes") else AT_NOISE_FLOOR


def _is_names(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) for name in value)


def _is_sets(value: Any) -> bool:
    return isinstance(value, list) and all(_is_names(names) for names in value)


def _is_number(value: Any) -> bool:
    return value is None or (
        isinstance(value, (int, float))
        and not isinstance(value, bool)
        and -_LARGEST < value < _LARGEST
    )


def _is_interval(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(_is_number(end) for end in value)


def _is_parameter(value: Any) -> bool:
    if not isinstance(value, dict) or not {"value", "std", "unit"} <= set(value):
        return False
    numbers = _is_number(value["value"]) and _is_number(value["std"])
    has_interval = value.get("ci95") is None or _is_interval(value["ci95"])
    return numbers and isinstance(value["unit"], str) and has_interval


def _is_parameters(value: Any) -> bool:
    return isinstance(value, dict) and all(
        isinstance(values, dict) and all(_is_parameter(entry) for entry in values.values())
        for values in value.values()
    )


_NAMES = "a list of names"
#: Check of every key of an answer, and what is expected in words.
_CHECKS: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "verdict": (lambda value: value in VERDICTS, f"one of {', '.join(VERDICTS)}"),
    "effects": (_is_names, _NAMES),
    "aliases": (_is_sets, "lists of names"),
    "classes": (_is_names, _NAMES),
    "class_ties": (_is_sets, "lists of names"),
    "rho": (_is_number, "a number"),
    "rho_ci95": (_is_interval, "two numbers"),
    "parameters": (_is_parameters, "value, std and unit by effect and name"),
    "seconds": (_is_number, "a number [s]"),
}

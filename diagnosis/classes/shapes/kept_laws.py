"""Which class of an answer is kept as a law, and under which name."""

import re
from collections.abc import Mapping

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    ClassAnswer,
    ClassFinding,
    MeasuredShape,
)
from carrierflex.simulation.element.tabulated_laws import TABULATED

_MOST_LETTERS = 40


def is_kept(finding: ClassFinding) -> bool:
    """Whether a class has a measured shape that a law file holds."""
    if finding.carrier_law is not None:
        return True
    shape = finding.shape
    if shape is None:
        return False
    is_law = shape.memory is not None or shape.surface is not None
    return bool(shape.parts) or is_law or finding.id in TABULATED


def kept_shape(
    answer: ClassAnswer, tables: Mapping[str, str], wanted: str | None
) -> tuple[str, MeasuredShape]:
    """Class whose measured curve is kept as a table, and the curve.

    Arguments and errors are those of :func:`kept_finding`.

    Returns
    -------
    tuple of (str, MeasuredShape)
        What tables call the class, and its shape.
    """
    name, finding = kept_finding(answer, tables, wanted)
    if finding.shape is None:
        raise named_by_law(name, finding)
    return name, finding.shape


def kept_finding(
    answer: ClassAnswer, tables: Mapping[str, str], wanted: str | None
) -> tuple[str, ClassFinding]:
    """Class of an answer that is kept as a table.

    Parameters
    ----------
    answer : ClassAnswer
        Answer by class.
    tables : mapping of str to str
        Classes that are kept as tables, and what tables call them.
    wanted : str, optional
        What a table calls the class; without, that of the largest share.

    Returns
    -------
    tuple of (str, ClassFinding)
        What tables call the class, and the class.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, or it has no table.
    """
    if answer.state not in (NAMED_CLASS, LEADING_CLASS) or not answer.classes:
        raise ValueError(f"no law to save: the answer by class is '{answer.state}'")
    known = {tables.get(finding.id, finding.id): finding for finding in answer.classes}
    name = wanted or max(known, key=lambda own: known[own].share)
    if name not in known:
        listed = ", ".join(known)
        raise ValueError(f"no law to save: '{name}' is not in the answer; expected {listed}")
    if name not in tables.values():
        raise ValueError(
            f"no law to save: the class '{name}' is not kept as a law; expected one of "
            f"{', '.join(dict.fromkeys(tables.values()))}"
        )
    return name, known[name]


def named_by_law(name: str, finding: ClassFinding) -> ValueError:
    """Error of a class without a measured shape of its own."""
    return ValueError(
        f"no law to save: '{name}' was named by its law {finding.law}, not by its shape; add that "
        "law to the model, its parameters are in diagnosis.json"
    )


def law_name(effect_class: str, campaign: str) -> str:
    """Id of a kept law: small letters, digits and underscores."""
    slug = re.sub(r"[^a-z0-9]+", "_", campaign.lower()).strip("_")[:_MOST_LETTERS]
    return f"{effect_class.replace('/', '_')}_of_{slug or 'campaign'}"

"""Where each default dimension comes from, and how far it alone may be changed."""

import ast
import inspect
import textwrap
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from carrierflex.geometry.parameter_files import StageParameters

#: Steps of the search for a limit: the largest is this many times the value.
_LARGEST, _HALVINGS = 1e3, 30


def sources(parameters: type) -> dict[str, str]:
    """Source of every default of a parameter class: the text below its field.

    Parameters
    ----------
    parameters : type
        Dataclass whose fields have a docstring each.

    Returns
    -------
    dict
        Text on one line by field.
    """
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(parameters))).body
    assert isinstance(definition, ast.ClassDef)
    texts: dict[str, str] = {}
    for field, below in zip(definition.body, definition.body[1:], strict=False):
        if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
            continue
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            texts[field.target.id] = " ".join(str(below.value.value).split())
    return texts


def limits(stage: StageParameters, table: str) -> dict[str, tuple[float, float]]:
    """Range over which each dimension of a table may be changed while all others stay.

    Found by trying: the largest interval about the value in which nothing contradicts.

    Parameters
    ----------
    stage : StageParameters
        Dimensions that fit together.
    table : str
        ``carrier``, ``pin``, ``gear`` or ``main_shaft``.

    Returns
    -------
    dict
        Ends by key, in the unit of the key; equal ends where another dimension has to be changed
        with it.
    """
    rows = getattr(stage, table)
    return {
        field.name: (
            _end(stage, table, field.name, downwards=True),
            _end(stage, table, field.name, downwards=False),
        )
        for field in fields(rows)
        if isinstance(getattr(rows, field.name), float)
    }


def _end(stage: StageParameters, table: str, name: str, *, downwards: bool) -> float:
    """Last value in one direction at which the stage still fits together, to nine digits."""
    value = float(getattr(getattr(stage, table), name))
    if value == 0.0:
        return value
    # A share of the value, or a multiple of it.
    beyond = value / _LARGEST if downwards else value * _LARGEST
    if _fits(stage, table, {name: beyond}):
        return 0.0 if downwards else float("inf")
    inside, outside = value, beyond
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        if _fits(stage, table, {name: middle}):
            inside = middle
        else:
            outside = middle
    return inside


def _fits(stage: StageParameters, table: str, changes: Mapping[str, Any]) -> bool:
    try:
        replace(stage, **{table: replace(getattr(stage, table), **changes)})
    except ValueError:
        return False
    return True

"""Every constant that can change a class answer of an element, where it stands, and its reason.

Constants are found in the modules' own text: an upper-case name of a number, or of several, at the
start of a line, and the `#:` comment above it. A constant that is added is listed without a word
here; one that cannot change a verdict is named in `_NO_VERDICT` with what it does instead.
"""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from carrierflex.diagnosis.classes import constants as class_constants
from carrierflex.diagnosis.classes.constants import ClassConstants

_ROOT = "carrierflex."
#: Modules between the records of an element and the answer by class.
MODULES = (
    "identification.campaign.signals",
    "diagnosis.element.records",
    "diagnosis.element.linear",
    "diagnosis.element.classes.answer",
    "diagnosis.element.classes.columns",
    "diagnosis.element.classes.drive_in_time",
    "diagnosis.element.classes.floor",
    "diagnosis.element.classes.laws",
    "diagnosis.element.classes.limits",
    "diagnosis.classes.memory_columns",
    "diagnosis.element.classes.motion.force_records",
    "diagnosis.element.classes.motion.nearest_motion",
    "diagnosis.element.classes.motion.steady_motion",
    "diagnosis.element.classes.noise_colour",
    "diagnosis.classes.splines",
    "diagnosis.element.classes.smooth_loops",
    "diagnosis.element.classes.starting_states",
    "diagnosis.element.classes.table",
    "diagnosis.element.classes.weighting",
)
#: Names of numbers that are none of the decision's: degree of splines, memory, smallest numbers,
#: what only a kind without an element or the search for laws reads.
_NO_VERDICT = {
    "_AT_ONCE",
    "_CUBIC",
    "_CHUNK",
    "_ROUNDING",
    "_SMALLEST",
    "_BLURRED_SIGN",
    "N_BANDS",
    "band_samples",
}
#: A share above this one is moved by what it leaves of one: 1.2 times 0.97 is no share.
_ALL_BUT_ONE = 0.9


@dataclass(frozen=True, eq=False)
class Constant:
    """A constant of the decision.

    Parameters
    ----------
    module : str
        Module that holds it, below the import name.
    name : str
        Its name there, or the field of :class:`ClassConstants`.
    value : object
        Number, tuple of numbers or array.
    reason : str
        Its comment.
    """

    module: str
    name: str
    value: Any
    reason: str

    @property
    def is_field(self) -> bool:
        """Whether it is a field of the comparison's limits."""
        return self.module == _below_root(class_constants)

    @property
    def path(self) -> str:
        """Module and name."""
        return f"{self.module}.{self.name}"

    def moved(self, factor: float) -> Any:
        """Value times a factor; whole numbers move by one at least, 0.97 by what it leaves."""
        if isinstance(self.value, tuple):
            return tuple(_moved(value, factor) for value in self.value)
        return _moved(self.value, factor)


def listed_constants() -> tuple[Constant, ...]:
    """Constants in the order of their modules."""
    found = list(_fields())
    for name in MODULES:
        found += _of_module(importlib.import_module(_ROOT + name))
    return tuple(constant for constant in found if constant.name not in _NO_VERDICT)


def replacement(constant: Constant, factor: float) -> tuple[str, Any]:
    """Name that stands for a constant, and what to put in its place.

    Parameters
    ----------
    constant : Constant
        Which.
    factor : float
        What it is multiplied by.

    Returns
    -------
    tuple of (str, object)
        Of a field the class of limits, with the field filled in.
    """
    value = constant.moved(factor)
    if constant.is_field:
        return ClassConstants.__name__, partial(ClassConstants, **{constant.name: value})
    return constant.name, value


def _moved(value: Any, factor: float) -> Any:
    if isinstance(value, np.ndarray):
        largest = float(value.max())
        return value * (_moved(largest, factor) / largest)
    if isinstance(value, int):
        step = round((factor - 1.0) * value)
        return value + (step or int(np.sign(factor - 1.0)))
    if _ALL_BUT_ONE < value < 1.0:
        return 1.0 - factor * (1.0 - value)
    return factor * value


def _fields() -> Iterator[Constant]:
    """Fields of the limits, with the words of their docstring."""
    words = _parameters(inspect.getdoc(ClassConstants) or "")
    for field in fields(ClassConstants):
        module = _below_root(class_constants)
        yield Constant(module, field.name, field.default, words.get(field.name, ""))


def _parameters(text: str) -> dict[str, str]:
    """Words of every parameter of a NumPy docstring; several may share them."""
    found: dict[str, str] = {}
    names: list[str] = []
    for line in text.partition("----------\n")[2].splitlines():
        head = re.match(r"^(\w[\w, ]*) : ", line)
        if head:
            names = head[1].split(", ")
            continue
        for name in names:
            found[name] = f"{found.get(name, '')} {line.strip()}".strip()
    return found


def _of_module(module: ModuleType) -> Iterator[Constant]:
    text = inspect.getsource(module)
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign):
            continue
        targets = [name for name in ast.walk(node.targets[0]) if isinstance(name, ast.Name)]
        for target in targets:
            value = getattr(module, target.id, None)
            if target.id.isupper() and _is_number(value):
                reason = _comment_above(lines, node.lineno - 1)
                yield Constant(_below_root(module), target.id, value, reason)


def _is_number(value: Any) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(_is_number(own) for own in value)
    if isinstance(value, np.ndarray):
        return bool(np.issubdtype(value.dtype, np.number))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _comment_above(lines: list[str], line: int) -> str:
    """`#:` comment of an assignment; several constants below each other share one."""
    first = line - 1
    while first >= 0 and lines[first].strip() and not lines[first].startswith("#:"):
        first -= 1
    words: list[str] = []
    while first >= 0 and lines[first].startswith("#:"):
        words.insert(0, lines[first][2:].strip())
        first -= 1
    return " ".join(words)


def _below_root(module: ModuleType) -> str:
    return module.__name__.removeprefix(_ROOT)

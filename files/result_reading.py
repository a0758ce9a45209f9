"""JSON back to the objects it was written from: the way back of :func:`json_files.plain`."""

import dataclasses
import types
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np

from carrierflex.files.result_schemas import type_hints
from carrierflex.files.shown_values import shown


def restored(hint: Any, content: Any) -> Any:
    """Value of a type from what :func:`json_files.plain` made of it.

    Parameters
    ----------
    hint : type
        Dataclass, array, tuple, mapping, number, text, or one of these or None.
    content : object
        What JSON holds; null is NaN where a number is expected.

    Returns
    -------
    object
        Value of that type; fields that the content lacks have their defaults.

    Raises
    ------
    TypeError, ValueError, KeyError, AttributeError
        Where the content is of another type.

    Examples
    --------
    >>> restored(tuple[float, ...], [1.0, None])
    (1.0, nan)
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return restored(arguments[0], content)
    if origin in (Union, types.UnionType):
        if content is None:
            return None
        return restored(next(one for one in arguments if one is not type(None)), content)
    if origin is np.ndarray:
        return np.array(content, dtype=get_args(arguments[1])[0])
    if origin is tuple and arguments[-1] is not Ellipsis:
        pairs = zip(arguments, content, strict=True)
        return tuple(restored(one, item) for one, item in pairs)
    if origin in (tuple, Sequence):
        return tuple(restored(arguments[0], item) for item in content)
    if origin is Mapping:
        return {key: restored(arguments[1], item) for key, item in content.items()}
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _dataclass(hint, content)
    if hint is float and content is None:
        return float("nan")
    if hint is float and type(content) is int:
        return float(content)
    if hint in (float, str, int, bool) and type(content) is not hint:
        raise TypeError(f"found {shown(content)}; expected {_WORDS[hint]}")
    return content


def _dataclass(hint: Any, content: Mapping[str, Any]) -> Any:
    fields = dataclasses.fields(hint)
    # A field without a default has neither value nor factory: both are the same mark.
    needed = [field.name for field in fields if field.default is field.default_factory]
    for name in needed:
        if name not in content:
            raise KeyError(name)
    hints, given = type_hints(hint), [field.name for field in fields if field.name in content]
    return hint(**{name: restored(hints[name], content[name]) for name in given})


_WORDS = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}

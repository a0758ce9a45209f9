"""Options of a command, read from the source of its workflow without importing it.

A workflow imports finite elements, compilers and pictures before its `main` exists; its options
and their help stand in the source. So help and refused options cost the reading of a few files. A
test compares what is read here with what an import gives, for every command.
"""

import ast
import builtins
import importlib
import importlib.util
import inspect
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

_PROJECT = "carrierflex"
#: Libraries that annotations may name; all others are too slow to be imported for help.
_LIGHT = {*sys.stdlib_module_names, "cyclopts"}


@dataclass(frozen=True)
class WrittenCommand:
    """Signature and docstring of a workflow's `main`."""

    signature: inspect.Signature
    docstring: str


def written_command(module: str) -> WrittenCommand:
    """Signature and docstring of ``main`` in a module of this project.

    Parameters
    ----------
    module : str
        Dotted name.

    Raises
    ------
    LookupError
        Where an annotation or a default is neither a constant nor a name that leads to one.
    """
    source = _source(module)
    definition = _main_of(source)
    arguments = definition.args
    parameters = [
        *_parameters(source, arguments.args, arguments.defaults, _POSITIONAL),
        *_parameters(source, [arguments.vararg] if arguments.vararg else [], [], _VARIABLE),
        *_parameters(source, arguments.kwonlyargs, arguments.kw_defaults, _KEYWORD),
    ]
    return WrittenCommand(inspect.Signature(parameters), ast.get_docstring(definition) or "")


def written_names(module: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the positional and of the keyword parameters of ``main`` in a module.

    Their annotations and defaults are not looked at, and so nothing is imported.

    Parameters
    ----------
    module : str
        Dotted name.
    """
    arguments = _main_of(_source(module)).args
    positional = tuple(argument.arg for argument in arguments.args)
    return positional, tuple(argument.arg for argument in arguments.kwonlyargs)


_POSITIONAL = inspect.Parameter.POSITIONAL_OR_KEYWORD
_VARIABLE = inspect.Parameter.VAR_POSITIONAL
_KEYWORD = inspect.Parameter.KEYWORD_ONLY


@dataclass(frozen=True)
class _Source:
    """A module by the names that its statements define."""

    module: str
    statements: dict[str, ast.stmt]
    #: Module and name there by the name here; an empty name stands for the module itself.
    imported: dict[str, tuple[str, str]]


@dataclass(frozen=True)
class _Namespace:
    """A module or a class: attributes that are looked up when they are asked for."""

    source: _Source
    statements: dict[str, ast.stmt]

    def __getattr__(self, name: str) -> Any:
        if name in self.statements:
            return _defined(self.source, self.statements[name], name)
        return _named(self.source, name)


@cache
def _source(module: str) -> _Source:
    found = importlib.util.find_spec(module)
    if found is None or found.origin is None:
        raise LookupError(f"no module '{module}'")
    tree = ast.parse(Path(found.origin).read_text(encoding="utf-8"))
    imported: dict[str, tuple[str, str]] = {}
    for node in tree.body:
        if isinstance(node, ast.Import):
            imported |= {alias.asname or alias.name: (alias.name, "") for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            imported |= {
                alias.asname or alias.name: (node.module, alias.name) for alias in node.names
            }
    return _Source(module, _statements(tree.body), imported)


def _main_of(source: _Source) -> ast.FunctionDef:
    definition = source.statements["main"]
    if not isinstance(definition, ast.FunctionDef):
        raise LookupError(f"{source.module}: 'main' is no function")
    return definition


def _statements(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    """Statements of a module or a class by the name they define."""
    found: dict[str, ast.stmt] = {}
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found[node.name] = node
        for target in _targets(node):
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            found |= {name.id: node for name in names if isinstance(name, ast.Name)}
    return found


def _targets(node: ast.stmt) -> list[ast.expr]:
    if isinstance(node, ast.Assign):
        return node.targets
    return [node.target] if isinstance(node, ast.AnnAssign) else []


def _parameters(
    source: _Source, arguments: list[ast.arg], defaults: list[Any], kind: Any
) -> list[inspect.Parameter]:
    # Defaults of positional arguments belong to the last ones.
    padded = [None] * (len(arguments) - len(defaults)) + list(defaults)
    return [
        inspect.Parameter(
            argument.arg,
            kind,
            default=inspect.Parameter.empty if value is None else _value(source, value),
            annotation=_value(source, argument.annotation),
        )
        for argument, value in zip(arguments, padded, strict=True)
    ]


def _value(source: _Source, expression: ast.expr | None) -> Any:
    """Value of an expression of constants and of names that lead to some."""
    if expression is None:
        raise LookupError(f"{source.module}: a parameter has no annotation")
    names = {node.id for node in ast.walk(expression) if isinstance(node, ast.Name)}
    found = {name: _named(source, name) for name in names if not hasattr(builtins, name)}
    return eval(compile(ast.Expression(expression), source.module, "eval"), found)


def _named(source: _Source, name: str) -> Any:
    """What a name stands for in a module."""
    if name in source.statements:
        return _defined(source, source.statements[name], name)
    if name not in source.imported:
        raise LookupError(f"{source.module}: nothing defines '{name}'")
    module, attribute = source.imported[name]
    library = module.split(".")[0]
    if library in _LIGHT:
        loaded = importlib.import_module(module)
        return getattr(loaded, attribute) if attribute else loaded
    if library != _PROJECT:
        raise LookupError(f"{source.module}: '{name}' is of {library}, too slow to be imported")
    if importlib.util.find_spec(f"{module}.{attribute}") if _is_package(module) else None:
        inside = _source(f"{module}.{attribute}")
        return _Namespace(inside, inside.statements)
    return _named(_source(module), attribute)


def _is_package(module: str) -> bool:
    found = importlib.util.find_spec(module)
    return found is not None and found.submodule_search_locations is not None


def _defined(source: _Source, statement: ast.stmt, name: str) -> Any:
    if isinstance(statement, ast.ClassDef):
        return _Namespace(source, _statements(statement.body))
    if not isinstance(statement, ast.Assign | ast.AnnAssign) or statement.value is None:
        raise LookupError(f"{source.module}: '{name}' is no constant")
    value = _value(source, statement.value)
    target = _targets(statement)[0]
    if isinstance(target, ast.Tuple):
        places = [own.id for own in target.elts if isinstance(own, ast.Name)]
        return value[places.index(name)]
    return value

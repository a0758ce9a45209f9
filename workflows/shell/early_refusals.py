"""TOML files that options name, read before a workflow is imported.

A wrong key is then told after a third of a second and not after the import of finite elements,
compilers and pictures. What takes more than the file itself to be seen (files beside it,
equilibria, meshes) is told by the workflow, in the same words as ever: the readers are the same.
Before a reader whose module holds arrays the tables of the file are checked alone, so that what is
wrong with them is told without a library of arrays.
"""

import importlib
from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from carrierflex.workflows.shell.written_signatures import written_names

if TYPE_CHECKING:
    from carrierflex.files.toml_files import TomlKind


class _File(NamedTuple):
    """A kind of file by names below carrierflex; nothing of them is imported before it is read."""

    reader: str
    kind: str = ""
    """Where the reader's module holds arrays: the kind of file that is told apart first ..."""
    table: str = ""
    """... and its top table, where that holds none."""


#: File by option.
_FILES = {
    "parameters": _File("geometry.parameter_files:read_parameters"),
    "surfaces": _File(
        "geometry.cad_surface_files:read_cad_statements",
        "geometry.parameter_files:SURFACES_FILE",
        "geometry.cad_surface_tables:SurfacesDocument",
    ),
    "interfaces": _File("fe.matrices.interface_files:read_interfaces"),
    "law": _File(
        "simulation.law_files:read_law",
        "simulation.case_kinds:LAW_FILE",
        "simulation.law_tables:LawDocument",
    ),
    "map_": _File("identification.logs.map_files:read_map"),
    "mounting": _File(
        "simulation.mounting.case_files:read_mounting_case",
        "simulation.case_kinds:MOUNTING_CASE",
        "simulation.mounting.case_tables:MountingCaseDocument",
    ),
}


#: Options whose files are read early.
READ_EARLY = frozenset({*_FILES, "case", "campaign"})
#: Options that change what a refusal says and where, or take the place of the work.
_READ_FIRST = frozenset({"--help", "-h", "--version", "--verbose", "--log-file", "--threads"})


def refuse_early(given: Mapping[str, Any]) -> None:
    """Refuse what is wrong with the TOML files of a command's options.

    Parameters
    ----------
    given : mapping of str to object
        Values by the name of the workflow's parameter.

    Raises
    ------
    OSError, ValueError
        As the reader of the file.
    """
    own: dict[str, Callable[[Path], None]] = {
        "case": _read_case,
        "campaign": _read_campaign,
    }
    for option, value in given.items():
        if option not in READ_EARLY:
            continue
        for path in value if isinstance(value, list) else [value]:
            # What is missing is told by the workflow, after options that exclude one another.
            if path is None or not path.exists():
                continue
            if option in own:
                own[option](path)
            else:
                _read(path, _FILES[option])


def refuse_named(arguments: Sequence[str], workflow: str) -> None:
    """Refuse what is wrong with the TOML files of a command line whose options are unread yet.

    The library that reads options takes a quarter of the time of such a refusal. Files that are not
    found here (a positional one behind options) are seen by :func:`refuse_early` after it.

    Parameters
    ----------
    arguments : sequence of str
        Words behind the command.
    workflow : str
        Module of the command below ``carrierflex.workflows``.

    Raises
    ------
    OSError, ValueError
        As the reader of the file.
    """
    # What is said and logged is not known yet where these are given.
    if any(word.partition("=")[0] in _READ_FIRST for word in arguments):
        return
    positional, keyword = written_names(f"carrierflex.workflows.{workflow}")
    if positional[:1] and arguments and not arguments[0].startswith("-"):
        refuse_early({positional[0]: Path(arguments[0])})
    flags = {f"--{name.strip('_').replace('_', '-')}": name for name in keyword}
    for word, after in zip_longest(arguments, arguments[1:], fillvalue="-"):
        flag, equals, value = word.partition("=")
        value = value if equals else after
        if flag in flags and not value.startswith("-"):
            refuse_early({flags[flag]: Path(value)})


def _read(path: Path, file: _File) -> None:
    if file.kind:
        from carrierflex.files.toml_files import toml_document

        kind = _named(file.kind)
        _check(toml_document(path, kind), kind, file.table, path)
    _named(file.reader)(path)


def _check(document: Mapping[str, Any], kind: "TomlKind", table: str, path: Path) -> None:
    """Head of a document, and its tables where `table` names their model."""
    from carrierflex.files.toml_files import check_header, checked_document

    check_header(document, kind, str(path))
    if table:
        checked_document(document, _named(table), str(path))


def _named(name: str) -> Any:
    """What a name ``module:attribute`` below carrierflex stands for."""
    module, attribute = name.split(":")
    return getattr(importlib.import_module(f"carrierflex.{module}"), attribute)


def _read_case(path: Path) -> None:
    """Tables of a case; whether its loads make sense is seen when the case is made.

    `plan` takes a campaign's folder in its place.
    """
    if path.is_dir():
        _read_campaign(path)
        return
    from carrierflex.files.toml_files import toml_document
    from carrierflex.simulation.case_kinds import (
        CARRIER_CASE,
        MOUNTING_CASE,
        STAGE_CASE,
        STAGE_FORMAT,
    )

    document = toml_document(path, CARRIER_CASE)
    kind, table = CARRIER_CASE, "simulation.carrier.case_tables:CarrierCaseDocument"
    if document.get("format") == STAGE_FORMAT:
        kind, table = STAGE_CASE, "simulation.stage.stage_tables:StageCaseDocument"
    elif document.get("kind") == "mounting":
        kind, table = MOUNTING_CASE, "simulation.mounting.case_tables:MountingCaseDocument"
    _check(document, kind, table, path)


def _read_campaign(folder: Path) -> None:
    """campaign.toml alone; its records are read where it is sound."""
    from carrierflex.identification.campaign.document_files import read_campaign_header
    from carrierflex.identification.campaign.file_names import DOCUMENT_NAME

    if (folder / DOCUMENT_NAME).is_file():
        read_campaign_header(folder)

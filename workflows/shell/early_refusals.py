"""TOML files that options name, read before a workflow is imported.

A wrong key is then told after a third of a second and not after the import of finite elements,
compilers and pictures. What takes more than the file itself to be seen (files beside it,
equilibria, meshes) is told by the workflow, in the same words as ever: the readers are the same.
"""

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

#: Reader by option: its module below carrierflex, and its name there.
_READERS = {
    "parameters": "geometry.parameter_files:read_parameters",
    "surfaces": "geometry.cad_surface_files:read_cad_statements",
    "interfaces": "fe.matrices.interface_files:read_interfaces",
    "law": "simulation.element.law_files:read_law",
    "map_": "identification.logs.map_files:read_map",
    "mounting": "simulation.mounting.case_files:read_mounting_case",
}


#: Options whose files are read early.
READ_EARLY = frozenset({*_READERS, "case", "campaign"})


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
    for option, value in given.items():
        reader = _reader(option)
        if reader is None:
            continue
        for path in value if isinstance(value, list) else [value]:
            # What is missing is told by the workflow, after options that exclude one another.
            if path is not None and path.exists():
                reader(path)


def _reader(option: str) -> Callable[[Path], object] | None:
    own: dict[str, Callable[[Path], object]] = {"case": _read_case, "campaign": _read_campaign}
    if option in own:
        return own[option]
    if option not in _READERS:
        return None
    module, name = _READERS[option].split(":")
    return getattr(importlib.import_module(f"carrierflex.{module}"), name)


def _read_case(path: Path) -> None:
    """Tables of a case; whether its loads make sense is seen when the case is made."""
    from carrierflex.files.toml_files import read_toml, toml_document
    from carrierflex.simulation.case_kinds import (
        CARRIER_CASE,
        MOUNTING_CASE,
        STAGE_CASE,
        STAGE_FORMAT,
    )

    document = toml_document(path, CARRIER_CASE)
    if document.get("format") == STAGE_FORMAT:
        from carrierflex.simulation.stage.stage_tables import StageCaseDocument

        read_toml(path, STAGE_CASE, StageCaseDocument)
    elif document.get("kind") == "mounting":
        from carrierflex.simulation.mounting.case_tables import MountingCaseDocument

        read_toml(path, MOUNTING_CASE, MountingCaseDocument)
    else:
        from carrierflex.simulation.carrier.case_tables import CarrierCaseDocument

        read_toml(path, CARRIER_CASE, CarrierCaseDocument)


def _read_campaign(folder: Path) -> None:
    """campaign.toml alone; with it, what is wrong with the records."""
    from carrierflex.files.toml_files import toml_document
    from carrierflex.identification.campaign.campaign_document import (
        CAMPAIGN_FILE,
        DOCUMENT_NAME,
        campaign_header,
    )
    from carrierflex.simulation.element.drives import BASE

    path = folder / DOCUMENT_NAME
    if not path.is_file():
        return
    try:
        document = toml_document(path, CAMPAIGN_FILE)
        rig = document.get("rig")
        # On a moving base the columns of the records count too.
        if not (isinstance(rig, dict) and rig.get("drive") == BASE):
            campaign_header(document, str(path), [])
    except ValueError:
        from carrierflex.identification.campaign.campaign_files import read_campaign

        read_campaign(folder)
        raise

"""Derive what the printed tables of the 2012 paper say about the real machine.

Rim deflection, misalignment of main shaft and carrier, and the static saddle that no rigid motion
follows: each with the interval that the printed digits allow. Figures to hold a simulation or an
identification against.
"""

from pathlib import Path
from typing import Annotated, TypedDict

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.identification.carrier.printed_tables import DerivedFacts, derived_facts
from carrierflex.workflows.outputs import prepared_folder, save_figure


def main(*, out: Path) -> DerivedFacts:
    """Derive rim deflection, phi_PLC and static saddle from tables 4 and 5 of 2012.

    Parameters
    ----------
    out
        Folder to write: printed_tables.json and printed_tables.png.

    Returns
    -------
    DerivedFacts
        Values in SI units with the interval that the printed digits allow.
    """
    prepared_folder(out)
    facts = derived_facts()
    save_json(out / "printed_tables.json", {"facts": facts, "versions": versions()})

    from carrierflex.identification.view import printed_tables_figure

    save_figure(out / "printed_tables.png", printed_tables_figure(facts))
    return facts


class PrintedTablesDocument(TypedDict):
    """printed_tables.json, written by printed-tables."""

    facts: Annotated[DerivedFacts, "What the printed tables determine"]
    versions: Versions

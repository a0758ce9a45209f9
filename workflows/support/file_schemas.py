"""JSON Schemas of the TOML files that carrierflex reads, from the definitions that check the files.

A schema tells an editor the keys of a file, what each one states, its unit and its range. Beside
the words of JSON Schema there are two more: ``unit``, and ``expected``, the expectation in the
words of a refusal. What several keys must fulfil together (a pin that fits its bore) is in no
schema; it is checked when the file is read.
"""

import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from carrierflex.fe.matrices.interface_tables import InterfacesDocument
from carrierflex.files.toml_values import FileSchema
from carrierflex.geometry.cad_surface_tables import SurfacesDocument
from carrierflex.geometry.parameter_tables import ParameterTables
from carrierflex.identification.campaign.campaign_tables import (
    CarrierCampaignDocument,
    ElementCampaignDocument,
    MountingCampaignDocument,
)
from carrierflex.identification.logs.map_tables import (
    CarrierMapDocument,
    ElementMapDocument,
    MountingMapDocument,
)
from carrierflex.simulation.carrier.case_tables import CarrierCaseDocument
from carrierflex.simulation.element.law_tables import LawDocument
from carrierflex.simulation.mounting.case_tables import MountingCaseDocument
from carrierflex.simulation.stage.stage_tables import StageCaseDocument

_Campaign = Annotated[
    CarrierCampaignDocument | MountingCampaignDocument | ElementCampaignDocument,
    Field(discriminator="kind"),
]

_Map = Annotated[
    CarrierMapDocument | MountingMapDocument | ElementMapDocument,
    Field(discriminator="kind"),
]

#: Top table of every kind of file.
_DOCUMENTS: dict[str, Any] = {
    "carrier parameters": ParameterTables,
    "cad surfaces": SurfacesDocument,
    "matrix interfaces": InterfacesDocument,
    "campaign": _Campaign,
    "map": _Map,
    "carrier case": CarrierCaseDocument,
    "mounting case": MountingCaseDocument,
    "stage case": StageCaseDocument,
    "element law": LawDocument,
}

#: Names of the kinds of files.
FILE_KINDS = tuple(_DOCUMENTS)
#: Folder of the schemas as files, for the editors that TOML files name them to.
SCHEMA_FOLDER = Path(__file__).resolve().parents[1] / "data" / "schemas"


def file_schema(kind: str) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of one kind of file.

    Parameters
    ----------
    kind : str
        One of :data:`FILE_KINDS`.

    Raises
    ------
    ValueError
        Where there is no such kind.

    Examples
    --------
    >>> tables = file_schema("carrier parameters")["$defs"]
    >>> tables["PinParameters"]["properties"]["diameter"]["unit"]
    'm'
    """
    if kind not in _DOCUMENTS:
        raise ValueError(
            f"no kind of file is called '{kind}'; expected one of {', '.join(FILE_KINDS)}",
        )
    schema = TypeAdapter(_DOCUMENTS[kind]).json_schema(schema_generator=FileSchema)
    # The titles are the names of the classes, which say nothing to a user.
    schema.pop("title", None)
    return {"$schema": FileSchema.schema_dialect, "title": f"carrierflex: {kind}", **schema}


def schema_file(kind: str) -> Path:
    """File of a schema that comes with the package."""
    return SCHEMA_FOLDER / f"{kind.replace(' ', '-')}.json"


def schema_line(kind: str) -> str:
    """First comment of a TOML file that this program writes: it names the schema to editors."""
    return f"#:schema {schema_file(kind).as_uri()}"


def schema_text(kind: str) -> str:
    """A schema as it stands in its file."""
    return json.dumps(file_schema(kind), indent=1, ensure_ascii=False) + "\n"

"""JSON Schemas of the TOML files that are read and of the JSON files that are written.

Those of TOML files come from the definitions that check the files. Such a schema tells an editor
the keys of a file, what each one states, its unit and its range. Beside the words of JSON Schema
there are two more: ``unit``, and ``expected``, the expectation in the words of a refusal. What
several keys must fulfil together (a pin that fits its bore) is in no schema; it is checked when the
file is read. Those of JSON files come from the documents of :mod:`result_documents`,
:mod:`job_documents` and :mod:`study_documents`, which the tests hold every written file against.
"""

import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from carrierflex.fe.matrices.interface_tables import InterfacesDocument
from carrierflex.files.result_schemas import result_schema
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
from carrierflex.simulation.law_tables import LawDocument
from carrierflex.simulation.mounting.case_tables import MountingCaseDocument
from carrierflex.simulation.stage.stage_tables import StageCaseDocument
from carrierflex.workflows.support import result_documents as results
from carrierflex.workflows.support import study_documents as studies
from carrierflex.workflows.support.job_documents import SummaryDocument
from carrierflex.workflows.support.plan_documents import PlanDocument

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
    "law": LawDocument,
}

#: Document of every kind of JSON file, by the name of the file.
_RESULTS: dict[str, Any] = {
    "diagnosis": results.DiagnosisDocument,
    "rim motion": results.RimMotionDocument,
    "comparison": results.ComparisonDocument,
    "plan": PlanDocument,
    "identification": results.IdentificationDocument,
    "import": results.ImportDocument,
    "certificate": results.CertificateDocument,
    "summary": SummaryDocument,
    "inputs": studies.CurveInputsDocument,
    "couplings": studies.CouplingsDocument,
    "pin fit": studies.PinFitDocument,
    "order one": studies.OrderOneDocument,
    "table 5": studies.TableFiveDocument,
    "torsion": studies.TorsionDocument,
    "gear life": studies.GearLifeDocument,
    "linearised": studies.MountingLinearisedDocument | studies.StageLinearisedDocument,
    "figures": studies.FiguresDocument,
    "printed tables": studies.PrintedTablesDocument,
    "blind check": studies.BlindCheckDocument,
    "seals": studies.SealsDocument,
    "salts": studies.SaltsDocument,
    "labels": studies.LabelsDocument,
    "times": studies.TimesDocument,
    "answers": studies.AnswersDocument,
    "references": studies.ReferencesDocument,
}

#: What ``--json`` prints.
_SHOWN = "result"
#: Names of the kinds of files: TOML files that are read, JSON files that are written.
TOML_KINDS = tuple(_DOCUMENTS)
JSON_KINDS = (*_RESULTS, _SHOWN)
FILE_KINDS = TOML_KINDS + JSON_KINDS
#: Folder of the schemas as files, which the first line of a TOML file names to editors.
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
    if kind not in FILE_KINDS:
        raise ValueError(
            f"no kind of file is called '{kind}'; expected one of {', '.join(FILE_KINDS)}",
        )
    if kind == _SHOWN:
        # Late: it asks every workflow for the type of its result.
        from carrierflex.workflows.support.shown_documents import shown_schema

        schema = shown_schema({name: result_schema(own) for name, own in _RESULTS.items()})
    elif kind in _RESULTS:
        schema = result_schema(_RESULTS[kind])
    else:
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

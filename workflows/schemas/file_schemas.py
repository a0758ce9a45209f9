"""JSON Schemas of the TOML files that are read and of the JSON files that are written.

Those of TOML files come from the definitions that check the files. Such a schema tells an editor
the keys of a file, what each one states, its unit and its range. Beside the words of JSON Schema
there are two more: ``unit``, and ``expected``, the expectation in the words of a refusal. What
several keys must fulfil together (a pin that fits its bore) is in no schema; it is checked when the
file is read. Those of JSON files come from the documents beside the workflows that write them; the
tests hold every written file against its schema.
"""

import importlib
import inspect
import json
import types
from collections.abc import Callable
from typing import Annotated, Any, Union, get_origin

import numpy as np
from pydantic import Field, TypeAdapter

from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS
from carrierflex.fe.matrices.interface_tables import InterfacesDocument
from carrierflex.files.result_schemas import Schema, result_schema, type_hints
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
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.law_tables import LawDocument
from carrierflex.simulation.mounting.case_tables import MountingCaseDocument
from carrierflex.simulation.stage.stage_tables import StageCaseDocument
from carrierflex.workflows.diagnosis.calibrate_campaign import CALIBRATION
from carrierflex.workflows.diagnosis.gap_change import COMPARISON
from carrierflex.workflows.diagnosis.plan_campaign import PLAN
from carrierflex.workflows.diagnosis.record_difference import DIFFERENCE
from carrierflex.workflows.diagnosis.report_files import REPORT_DATA
from carrierflex.workflows.diagnosis.scored_check import (
    AnswersDocument,
    BlindCheckDocument,
    LabelsDocument,
    ReferencesDocument,
    SaltsDocument,
    SealsDocument,
    TimesDocument,
)
from carrierflex.workflows.fe.compare_couplings import CouplingsDocument
from carrierflex.workflows.fe.compute_curves import CurveInputsDocument, MeshErrorDocument
from carrierflex.workflows.fe.study_pin_fit import PinFitDocument
from carrierflex.workflows.fe.study_sensitivities import SensitivitiesDocument
from carrierflex.workflows.figures.draw_figures import FiguresDocument
from carrierflex.workflows.fleet.diagnose_fleet import EntryDocument, FleetDocument
from carrierflex.workflows.fleet.watch_turbine import WatchDocument
from carrierflex.workflows.identification.documents import IdentificationDocument
from carrierflex.workflows.identification.import_records import ImportDocument
from carrierflex.workflows.identification.infer_loads import LoadsDocument
from carrierflex.workflows.identification.read_printed_tables import PrintedTablesDocument
from carrierflex.workflows.main_job.job import SummaryDocument
from carrierflex.workflows.papers.gap_rows import PapersGapDocument
from carrierflex.workflows.reduction.check_certificate import CertificateDocument
from carrierflex.workflows.shell.commands import COMMANDS
from carrierflex.workflows.shell.shown_results import CommandRefusal, CommandResult, Range
from carrierflex.workflows.simulation.compute_torsion import TorsionDocument
from carrierflex.workflows.simulation.estimate_gear_life import GearLifeDocument
from carrierflex.workflows.simulation.linearise_mounting import MountingLinearisedDocument
from carrierflex.workflows.simulation.linearise_stage import StageLinearisedDocument
from carrierflex.workflows.simulation.rexs_case import RexsDocument
from carrierflex.workflows.simulation.simulate_table_5 import TableFiveDocument
from carrierflex.workflows.simulation.study_order_one import OrderOneDocument
from carrierflex.workflows.view3d.rim_motion_files import RIM_MOTION

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
    "diagnosis": DIAGNOSIS,
    "rim motion": RIM_MOTION,
    "report": REPORT_DATA,
    "comparison": COMPARISON | DIFFERENCE,
    "calibration": CALIBRATION,
    "fleet": FleetDocument,
    "batch": EntryDocument,
    "watch": WatchDocument,
    "plan": PLAN,
    "identification": IdentificationDocument,
    "loads": LoadsDocument,
    "import": ImportDocument,
    "certificate": CertificateDocument,
    "summary": SummaryDocument,
    "inputs": CurveInputsDocument,
    "mesh error": MeshErrorDocument,
    "couplings": CouplingsDocument,
    "pin fit": PinFitDocument,
    "sensitivities": SensitivitiesDocument,
    "order one": OrderOneDocument,
    "table 5": TableFiveDocument,
    "papers gap": PapersGapDocument,
    "torsion": TorsionDocument,
    "gear life": GearLifeDocument,
    "rexs": RexsDocument,
    "linearised": MountingLinearisedDocument | StageLinearisedDocument,
    "figures": FiguresDocument,
    "printed tables": PrintedTablesDocument,
    "blind check": BlindCheckDocument,
    "seals": SealsDocument,
    "salts": SaltsDocument,
    "labels": LabelsDocument,
    "times": TimesDocument,
    "answers": AnswersDocument,
    "references": ReferencesDocument,
}

#: What ``--json`` prints.
_SHOWN = "result"
#: Names of the kinds of files: TOML files that are read, JSON files that are written.
TOML_KINDS = tuple(_DOCUMENTS)
JSON_KINDS = (*_RESULTS, _SHOWN)
FILE_KINDS = TOML_KINDS + JSON_KINDS


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

        schema = _shown_schema()
    elif kind in _RESULTS:
        schema = result_schema(_RESULTS[kind])
    else:
        schema = TypeAdapter(_DOCUMENTS[kind]).json_schema(schema_generator=FileSchema)
    # The titles are the names of the classes, which say nothing to a user.
    schema.pop("title", None)
    return {"$schema": FileSchema.schema_dialect, "title": f"carrierflex: {kind}", **schema}


def schema_text(kind: str) -> str:
    """A schema as it stands in its file."""
    return json.dumps(file_schema(kind), indent=1, ensure_ascii=False) + "\n"


def _shown_schema() -> Schema:
    """Schema of what ``--json`` prints; the result of every command has one of its own."""
    schema = result_schema(CommandResult | CommandRefusal)
    by_command = []
    for name, command in COMMANDS.items():
        main = importlib.import_module(f"carrierflex.workflows.{command.workflow}").main
        shown = []
        if command.document:
            file = command.document.removesuffix(".json").replace("_", " ")
            schema["$defs"][command.document] = {
                "$id": command.document,
                **result_schema(_RESULTS[file]),
            }
            shown.append({"$ref": command.document})
        if not _always_writes(main, command.document):
            schema["$defs"][f"figures of {name}"] = {"$id": f"{name}-figures", **_figures(main)}
            shown.append({"$ref": f"{name}-figures"})
        by_command.append(
            {
                "if": {"properties": {"command": {"const": name}}},
                "then": {"properties": {"result": {"anyOf": shown}}},
            }
        )
    table = schema["$defs"]["CommandResult"]
    table["properties"]["command"]["enum"] = list(COMMANDS)
    table["allOf"] = by_command
    return schema


def _always_writes(main: Callable[..., Any], document: str) -> bool:
    """Whether a command writes its document whatever its options are."""
    signature = inspect.signature(main)
    out = signature.parameters.get("out")
    needs_folder = out is not None and out.default is inspect.Parameter.empty
    returned = type_hints(main)["return"]
    has_one_result = get_origin(returned) not in (Union, types.UnionType)
    return bool(document) and needs_folder and has_one_result


def _figures(main: Callable[..., Any]) -> Schema:
    """Schema of the figures of a workflow's result, from the type that it returns."""
    long_array = {key: value for key, value in result_schema(Range).items() if key != "required"}
    array = {"anyOf": [{"type": ["array", "number", "null"]}, long_array]}
    kind = {"type": "string", "description": "Kind of a value that is not made of numbers."}
    return result_schema(
        type_hints(main)["return"],
        given={np.ndarray: array, Effect: {"type": "object"}},
        other=kind,
    )

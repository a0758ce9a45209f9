"""A planetary stage in REXS as dimensions of the carrier and a stage case.

Every number states the component and attribute that it comes from, or the rule of its default; what
the file lacks is listed. A good answer: teeth, centre distance, plates, pins and bearings come from
the file, and the list names what to look up.
"""

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypedDict

from carrierflex.files.json_files import save_json
from carrierflex.files.shown_values import printable
from carrierflex.files.versions import Versions, software_name, versions
from carrierflex.files.whole_files import refuse_existing, whole_file
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.reduction.mode_count import DEFAULT_FREQUENCY
from carrierflex.simulation.rexs.planetary_stage import chosen_stage, planetary_stage
from carrierflex.simulation.rexs.rexs_files import read_rexs
from carrierflex.simulation.rexs.sourced_numbers import Value
from carrierflex.simulation.rexs.stage_values import StageValues, stage_values
from carrierflex.simulation.stage.stage_cases import StageRun, read_stage_case
from carrierflex.workflows.fe.compute_curves import GivenFile
from carrierflex.workflows.geometry.carrier_files import file_record
from carrierflex.workflows.outputs import prepared_folder, schema_line

#: Files that are written.
PARAMETERS, CASE, SOURCES = "parameters.toml", "stage.toml", "rexs.json"
#: Body files that the case names, by the body of carrierflex reduce, with its options.
_BODIES = {"carrier": "carrier", "pin": "pin", "shaft": "main_shaft"}
#: Housing angles of the axial sensors, as in the shipped cases [deg].
_SENSOR_ANGLES = (47.0, 137.0, 227.0, 317.0)


@dataclass(frozen=True)
class RexsCase:
    """Files of a stage that a REXS file made."""

    folder: Annotated[Path, "Where they are"]
    source: Annotated[str, "Program and version of REXS of the file"]
    values: Annotated[tuple[Value, ...], "Numbers of the parameter file and the case"]
    notes: Annotated[tuple[str, ...], "What else counts"]
    problems: Annotated[tuple[str, ...], "What to correct before the files are taken"]
    commands: Annotated[tuple[str, ...], "What to run next"]


class RexsDocument(TypedDict):
    """rexs.json, written by cases --rexs."""

    inputs: Annotated[Mapping[str, GivenFile], "The REXS file"]
    stage: Annotated[int, "Id of the planetary stage"]
    result: RexsCase
    versions: Versions


def main(rexs: Path, *, out: Path, stage: int | None = None) -> RexsCase:
    """Write dimensions and a case for the planetary stage of a REXS file.

    Parameters
    ----------
    rexs : Path
        REXS file (XML, JSON or ZIP).
    out : Path
        Folder to write: parameters.toml, stage.toml and rexs.json; existing ones are not replaced.
    stage : int, optional
        Id of the planetary stage, where there are several.

    Raises
    ------
    ValueError
        Where the file is refused or lacks what no default can stand for, or files exist already.
    """
    paths = [out / name for name in (PARAMETERS, CASE, SOURCES)]
    refuse_existing(*paths)
    model = read_rexs(rexs)
    component = chosen_stage(model, stage)
    units = _units()
    values = stage_values(
        planetary_stage(model, component), lambda table, key: units.get((table, key), "")
    )
    prepared_folder(out)
    origin = printable(f"REXS {model.version} of {model.application or 'unknown'}", 100)
    head = f"{component} of {printable(rexs.name)}, {origin}"
    for path, kind, lines in (
        (paths[0], "carrier parameters", _parameter_lines(values, head)),
        (paths[1], "stage case", _case_lines(values, head, component.name or str(component))),
    ):
        with whole_file(path) as temporary:
            text = "\n".join([schema_line(kind), *lines])
            temporary.write_text(f"{text}\n", encoding="utf-8")
    result = RexsCase(
        out,
        origin,
        (*values.dimensions, *(v for v in values.case if v.table != "gear")),
        values.notes,
        tuple(_problems(paths[0], paths[1])),
        tuple(_commands(rexs, out, values.scale)),
    )
    document: RexsDocument = {
        "inputs": {"rexs": GivenFile(**file_record({"rexs": rexs})["rexs"])},  # type: ignore[typeddict-item]
        "stage": component.id,
        "result": result,
        "versions": versions(),
    }
    save_json(paths[2], document)
    return result


def _units() -> dict[tuple[str, str], str]:
    """SI units of the keys of both files, by table and key."""
    from pydantic import TypeAdapter

    from carrierflex.files.toml_values import FileSchema
    from carrierflex.geometry.parameter_tables import ParameterTables
    from carrierflex.simulation.stage.stage_tables import StageCaseDocument

    units: dict[tuple[str, str], str] = {}
    for document in (StageCaseDocument, ParameterTables):
        schema = TypeAdapter(document).json_schema(schema_generator=FileSchema)
        tables: dict[str, Any] = {"": schema["properties"]}
        for name, entry in schema["properties"].items():
            if "$ref" in entry:
                tables[name] = schema["$defs"][entry["$ref"].rpartition("/")[2]]["properties"]
        for table, keys in tables.items():
            units |= {(table, key): entry.get("unit", "") for key, entry in keys.items()}
    return units


def _parameter_lines(values: StageValues, head: str) -> Iterator[str]:
    yield f"# Dimensions of {head}, in metres and radians; written by {software_name()}."
    yield "# Each number states its component and attribute, or the rule of its default."
    yield from _tables(values.dimensions)


def _case_lines(values: StageValues, head: str, name: str) -> Iterator[str]:
    yield f"# {head}; written by {software_name()}"
    yield "#"
    yield "# Each number states its component and attribute, or the rule of its default."
    yield 'format = "carrierflex-stage-case"'
    yield "version = 1"
    yield f"name = {_text(name)}"
    yield "seed = 1                      # chosen"
    yield from (_line(value) for value in values.case if not value.table)
    yield from _tables([value for value in values.case if value.table])
    yield ""
    yield "[bodies]                      # of carrierflex reduce --parameters parameters.toml"
    for key, body in _BODIES.items():
        yield f'{key} = "{body}.h5"'
    for angle in _SENSOR_ANGLES:
        yield ""
        yield "[[sensors]]                   # default: as in the shipped cases, no noise"
        yield f'name = "s{angle:03.0f}"'
        yield 'quantity = "axial_displacement"'
        yield f"angle_deg = {angle!r}"
    for run, source in zip(values.runs, values.run_sources, strict=True):
        yield from _run_lines(run, source)


def _run_lines(run: StageRun, source: str) -> Iterator[str]:
    yield ""
    yield "[[runs]]"
    yield f'name = "{run.name}"'
    yield f'condition = "{run.condition}"'
    yield f"torque = {run.load.torque!r}  # {source}"
    for key in ("ntl_y", "ntl_z"):
        yield f"{key} = {float(getattr(run.load, key))!r}  # external_load force_*_direction"


def _tables(values: Sequence[Value]) -> Iterator[str]:
    table = ""
    for value in values:
        if value.table != table:
            table = value.table
            yield ""
            yield f"[{table}]"
        yield _line(value)


def _line(value: Value) -> str:
    unit = f"{value.unit}; " if value.unit else ""
    return f"{value.key} = {value.number!r}  # {unit}{value.source}"


def _text(text: str) -> str:
    """A text as a TOML string on one line."""
    return '"' + printable(text, 200).replace("\\", "\\\\").replace('"', '\\"') + '"'


def _problems(parameters: Path, case: Path) -> Iterator[str]:
    """What the readers of both files refuse: defaults and dimensions that do not fit together."""
    readers: tuple[tuple[Path, Callable[[Path], object]], ...] = (
        (parameters, read_parameters),
        (case, read_stage_case),
    )
    for path, read in readers:
        try:
            read(path)
        except ValueError as error:
            yield str(error)


def _commands(rexs: Path, out: Path, scale: float) -> Iterator[str]:
    """Lines that lead from the files to a simulation; frequencies of use go with 1/scale."""
    limits = []
    for option, value in (("--size", DEFAULT_SIZE * scale), ("--up-to", DEFAULT_FREQUENCY / scale)):
        limits += [option, f"{float(f'{value:.2g}'):g}"]
    for body in _BODIES.values():
        files = ["--parameters", str(out / PARAMETERS), "--out", str(out / f"{body}.h5")]
        yield shlex.join(["carrierflex", "reduce", "--body", body, *files, *limits])
    results = ["--out", "CAMPAIGN", "--loads", "LOADS", "--rexs", str(rexs)]
    yield shlex.join(["carrierflex", "simulate", str(out / CASE), *results])

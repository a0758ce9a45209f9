"""What a file is: its kind, its main figures, what wrote it, and which commands take it.

Every file is read as the command that takes it reads it: with the same limits, in a process of its
own where its library can be brought down.
"""

import struct
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from carrierflex.files.archives import DAMAGED_ARCHIVE
from carrierflex.files.plain_files import plain_content
from carrierflex.files.shown_values import printable
from carrierflex.files.toml_files import TomlKind, toml_document

_TOML = TomlKind("a TOML file", most_bytes=1_000_000)
#: Kind of a TOML or JSON file by the format that it states, and commands that take it.
_FORMATS = {
    "carrierflex-map": ("map of a logger's columns", ("import LOG --map {} --out CAMPAIGN",)),
    "carrierflex-case": ("case", ("simulate {} --out CAMPAIGN", "plan {}")),
    "carrierflex-stage-case": ("case of the planetary stage", ("simulate {} --out CAMPAIGN",)),
    "carrierflex-surfaces": (
        "surfaces of a carrier from CAD or a mesh",
        ("curves --step STEP --surfaces {} --out CURVES",),
    ),
    "carrierflex-interfaces": (
        "units, nodes and pilots of given matrices or solids",
        ("reduce --stiffness K --mass M --interfaces {} --out BODY.h5",),
    ),
    "carrierflex-law": (
        "law that a diagnosis saved",
        ("simulate CASE --law {} --out CAMPAIGN", "diagnose CAMPAIGN --law {} --out GAP"),
    ),
    "carrierflex-diagnosis": (
        "diagnosis",
        ("report {} --out report.html", "compare {0.parent} LATER"),
    ),
    "carrierflex-report": (
        "what the page of a diagnosis is drawn from",
        ("report {0.parent} --out report.html",),
    ),
    "carrierflex-watch": (
        "watch of a turbine",
        ("watch RECORDS --baseline DIAGNOSIS --out {0.parent}",),
    ),
    "carrierflex-fleet": ("diagnoses of a fleet", ("batch CAMPAIGNS --out {0.parent}",)),
    "carrierflex-rim-motion": ("motion of a rim, measured and simulated", ("view {}",)),
    "carrierflex-answers": (
        "answers to a blind check",
        ("blind-check --score {} --out CHECK",),
    ),
}
#: What counts of a document of many keys.
_MAIN_KEYS = {
    "carrierflex-diagnosis": ("campaign", "kind", "unit", "verdict", "headline", "version"),
}
#: Results without a format, by the name of their schema: kind, key of what counts, commands.
_RESULTS = {
    "papers-gap": ("causes that explain the gap of the 2012 paper's tables", "gap", ()),
    "rexs": (
        "numbers of a case from REXS and their sources",
        "result",
        ("simulate {0.parent}/stage.toml --out CAMPAIGN",),
    ),
}
_PARAMETERS = ("carrier", "pin", "gear", "main_shaft")
#: Documents by which a folder of this program is described, the first that is there.
_OF_FOLDERS = (
    "campaign.toml",
    "summary.json",
    "calibration.json",
    "diagnosis.json",
    "blind_check.json",
    "identification.json",
    "loads.json",
    "plan.json",
    "comparison.json",
    "fleet.json",
    "watch.json",
    "papers_gap.json",
    "rexs.json",
    "deflection_curves.csv",
)
_STEP = (".step", ".stp")
_REXS = (".rexs", ".rexsj", ".rexsz")
_TEXT_LOGS = (".csv", ".txt", ".dat", ".asc", ".tsv")
_MOST_LISTED = 6


@dataclass(frozen=True, eq=False)
class FileDescription:
    """Kind of a file in words, figures by what they are, its writer, and commands that take it."""

    path: Path
    kind: str
    figures: Mapping[str, str]
    software: str = ""
    commands: tuple[str, ...] = ()


def main(file: Path) -> FileDescription:
    """Show what a file or folder is, its main figures, and which commands take it.

    Parameters
    ----------
    file
        Any file or folder that a command writes or reads: campaign, body, curves, diagnosis, case,
        map, dimensions, STEP, REXS, mesh, matrix, logger's file, page.

    Returns
    -------
    FileDescription
        Its kind; software is empty where the file does not state what wrote it.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is damaged, or of no kind that a command takes.
    """
    if not file.exists():
        raise FileNotFoundError(f"{file}: no such file or folder")
    if file.is_dir():
        return _folder(file)
    readers: dict[str, Callable[[Path], FileDescription]] = {
        ".toml": _toml,
        ".json": _json,
        ".h5": _hdf5,
        ".hdf5": _body_or_log,
        ".sid_fem": _foreign_body,
        ".sid": _foreign_body,
        ".fmu": _fmu,
        ".html": _page,
        ".csv": _csv,
        ".vtu": _vtu,
        ".png": _picture,
        ".asm": _text_of_ours,
        ".log": _text_of_ours,
    }
    suffix = file.suffix.lower()
    if suffix in _STEP:
        return _step(file)
    if suffix in _REXS:
        return _rexs(file)
    return readers.get(suffix, _foreign)(file)


def _folder(folder: Path) -> FileDescription:
    for name in _OF_FOLDERS:
        if (folder / name).is_file():
            break
    else:
        raise ValueError(
            f"{folder}: a folder with none of {', '.join(_OF_FOLDERS)}; expected a folder that a "
            "command wrote, or a file"
        )
    if name == "campaign.toml":
        return _campaign(folder)
    described = main(folder / name)
    return replace(described, path=folder, kind=f"folder with {name}: {described.kind}")


def _campaign(folder: Path) -> FileDescription:
    from carrierflex.files.versions import software_name
    from carrierflex.identification.campaign.document_files import read_campaign_header

    header = read_campaign_header(folder)
    files = [folder / run.file for run in header.runs]
    missing = [path.name for path in files if not path.is_file()]
    size = sum(path.stat().st_size for path in files if path.is_file())
    figures = {
        "name": header.name,
        "kind": header.contract.name,
        "runs": _listed(run.name for run in header.runs),
        "channels": _listed(channel.name for channel in header.channels),
        "run files": f"{size / 1e6:.3g} MB",
        "version of the format": str(header.version),
    }
    if missing:
        figures["missing run files"] = _listed(missing)
    commands = (
        "check {}",
        "plan {}",
        "diagnose {} --out GAP",
        "identify {} --model MODEL --out OUT",
    )
    software = software_name().split()[0] if header.simulated is not None else ""
    kind = "simulated campaign" if header.simulated is not None else "measured campaign"
    return FileDescription(folder, kind, figures, software, _lines(commands, folder))


def _toml(path: Path) -> FileDescription:
    document = toml_document(path, _TOML)
    stated = document.get("format")
    if stated == "carrierflex-campaign":
        return _campaign(path.parent)
    if stated in _FORMATS:
        kind, commands = _FORMATS[stated]
        return FileDescription(path, kind, _scalars(document), "", _lines(commands, path))
    if stated is None and document and set(document) <= set(_PARAMETERS):
        figures = {f"[{name}]": f"{len(table)} dimensions" for name, table in document.items()}
        commands = ("run --parameters {} --out OUT", "curves --parameters {} --out CURVES")
        return FileDescription(path, "dimensions of a carrier", figures, "", _lines(commands, path))
    raise ValueError(
        f"{path}: TOML of no kind that a command takes (format {stated!r}); expected one of "
        f"{', '.join(_FORMATS)}, or dimensions in tables {', '.join(_PARAMETERS)}"
    )


def _json(path: Path) -> FileDescription:
    from carrierflex.files.json_files import read_json
    from carrierflex.workflows.outputs import schema_file

    document = read_json(path, "a result of carrierflex")
    schema = path.stem.replace("_", "-")
    is_ours = isinstance(document, dict) and (
        str(document.get("format", "")).startswith("carrierflex-")
        or ("versions" in document and schema_file(schema).is_file())
    )
    if not is_ours:
        raise ValueError(f"{path}: JSON that no command writes; expected a result of carrierflex")
    stated = str(document.get("format", ""))
    kind, commands = _FORMATS.get(stated, (f"result '{schema}'", ()))
    if not stated and schema in _RESULTS:
        kind, inside, commands = _RESULTS[schema]
        counts = document.get(inside)
        document = {**document, **(counts if isinstance(counts, dict) else {}), inside: ""}
    versions = document.get("versions", {})
    written = versions.get("carrierflex") if isinstance(versions, dict) else None
    software = str(document.get("software") or (f"carrierflex {written}" if written else ""))
    main_keys = _MAIN_KEYS.get(stated, tuple(document))
    figures = _scalars({key: document[key] for key in main_keys if key in document})
    return FileDescription(path, kind, figures, software, _lines(commands, path))


def _hdf5(path: Path) -> FileDescription:
    from carrierflex.reduction.body_files import FORMAT, has_fields, read_body, read_certificate

    if not _told_of_hdf5(path, lambda stored: stored.attrs.get("format") == FORMAT):
        return _log(path)
    body, certificate = read_body(path), read_certificate(path)
    has_shapes = has_fields(path, "shapes")
    figures = {
        "body": body.name,
        "coordinates": f"{len(body.labels)}",
        "pilots": _listed(body.pilots),
        "sensors": _listed(body.sensor_names),
        "mass": f"{body.mass_properties.mass:.4g} kg",
        "certificate": "none" if certificate is None else "met" if certificate.met else "not met",
        "shapes for view": "yes" if has_shapes else "no",
        "stress for simulate --stress": "yes" if has_fields(path, "stresses") else "no",
    }
    view = ("view {}",) if has_shapes else ()
    commands = ("certificate {}", "export {} --format FORMAT --out FILE", *view)
    written = body.provenance.get("carrierflex")
    software = f"carrierflex {written}" if written else ""
    return FileDescription(path, "reduced body", figures, software, _lines(commands, path))


def _foreign_body(path: Path) -> FileDescription:
    """A reduced body that another program wrote, or this one for it."""
    from carrierflex.reduction.imports.foreign_bodies import read_any_body

    imported = read_any_body(path)
    body = imported.model
    figures = {
        "body": body.name,
        "coordinates": f"{len(body.labels)}",
        "pilots": _listed(body.pilots),
        "sensors": _listed(body.sensor_names),
        "mass": f"{body.mass_properties.mass:.4g} in the file's unit",
        **{f"note {number}": line for number, line in enumerate(imported.losses, start=1)},
    }
    commands = ("export {} --format FORMAT --out FILE",)
    return FileDescription(
        path, "reduced body of another program", figures, "", _lines(commands, path)
    )


def _body_or_log(path: Path) -> FileDescription:
    is_body = _told_of_hdf5(path, lambda stored: "massMatrix" in stored)
    return (_foreign_body if is_body else _log)(path)


def _told_of_hdf5(path: Path, told: Callable[[Any], bool]) -> bool:
    import h5py

    from carrierflex.files.hdf5_trial import try_hdf5

    try_hdf5(path)
    try:
        with h5py.File(path, "r") as stored:
            return told(stored)
    except (OSError, RuntimeError) as error:
        raise ValueError(f"{path}: not an HDF5 file: {' '.join(str(error).split())}") from error


def _csv(path: Path) -> FileDescription:
    with path.open("rb") as file:
        head = file.read(10)
    if head != b"theta_deg,":
        return _log(path)
    from carrierflex.fe.curve_files import read_curves, read_derivatives

    curves, derivatives = read_curves(path), read_derivatives(path)
    largest = {name: max(abs(curve.axial)) for name, curve in curves.items()}
    figures = {name: f"{value:.3g} m per unit load at most" for name, value in largest.items()}
    figures |= {
        "angles": str(next(iter(curves.values())).axial.size),
        "derivatives": str(len(derivatives)),
    }
    commands = ("view {}", "simulate CASE --curves {} --out CAMPAIGN")
    return FileDescription(path, "deflection curves of a rim", figures, "", _lines(commands, path))


def _log(path: Path) -> FileDescription:
    from carrierflex.identification.logs.log_files import read_log

    tables = read_log(path)
    figures = {}
    for number, table in enumerate(tables, start=1):
        name = "columns" if len(tables) == 1 else f"columns of clock {number}"
        figures[name] = _listed(table.names)
        figures[name.replace("columns", "rows")] = str(table.n_rows)
    commands = ("new-campaign --kind KIND --from {} --out map.toml",)
    return FileDescription(path, "file of a logger", figures, "", _lines(commands, path))


def _step(path: Path) -> FileDescription:
    from carrierflex.geometry.cad_mesh import step_faces
    from carrierflex.geometry.cad_surface_files import CadFrame

    faces = step_faces(path, CadFrame.of_the_file())
    figures = {"faces": str(len(faces)), "surface": f"{sum(face.area for face in faces):.4g} m^2"}
    commands = ("cad-surfaces {} --out surfaces.toml", "cad-faces {}")
    return FileDescription(path, "STEP file of one solid", figures, "", _lines(commands, path))


def _rexs(path: Path) -> FileDescription:
    from carrierflex.simulation.rexs.rexs_files import read_rexs

    model = read_rexs(path)
    figures = {
        "REXS": printable(model.version),
        "components": str(len(model.components)),
        "planetary stages": _listed(str(each.id) for each in model.of_type("planetary_stage")),
        "load cases": str(len(model.load_cases)),
    }
    commands = ("cases --rexs {} --out STAGE",) if model.of_type("planetary_stage") else ()
    software = printable(model.application)
    return FileDescription(path, "gearbox in REXS", figures, software, _lines(commands, path))


def _foreign(path: Path) -> FileDescription:
    """A mesh, a matrix or a logger's file, by its suffix; a deck may be both of the first."""
    from carrierflex.fe.matrices.matrix_files import SUFFIXES as MATRICES
    from carrierflex.geometry.given_meshes.solid_files import SUFFIXES as MESHES
    from carrierflex.identification.logs.log_formats import FORMAT_OF_SUFFIX

    suffix = path.suffix.lower()
    may_be_log = suffix in {*FORMAT_OF_SUFFIX, *_TEXT_LOGS} or suffix not in {*MESHES, *MATRICES}
    readers = [
        *([_mesh] if suffix in MESHES else []),
        *([_matrix] if suffix in MATRICES else []),
        *([_log] if may_be_log else []),
    ]
    if any(suffix in suffixes for suffixes in (MESHES, MATRICES)):
        readers.append(_text_of_ours)
    reasons = []
    for reader in readers:
        try:
            return reader(path)
        except ValueError as error:
            reasons.append(str(error).removeprefix(f"{path}: "))
    raise ValueError(f"{path}: {'; '.join(reasons)}")


def _mesh(path: Path) -> FileDescription:
    from carrierflex.geometry.given_meshes.solid_files import read_solid_mesh

    mesh = read_solid_mesh(path)
    counts: dict[str, int] = {}
    for kind, _, nodes in mesh.blocks:
        counts[kind] = counts.get(kind, 0) + len(nodes)
    lengths = mesh.points.max(axis=0) - mesh.points.min(axis=0)
    groups = {*(group for _, group, _ in mesh.blocks if group), *mesh.node_sets}
    figures = {
        "elements": ", ".join(f"{count} {kind}" for kind, count in counts.items()),
        "nodes": str(len(mesh.points)),
        "extent in the file's unit": " x ".join(f"{length:.4g}" for length in lengths),
        "groups": _listed(sorted(groups)),
    }
    commands = ("reduce --mesh {} --interfaces FILE.toml --out BODY.h5",)
    return FileDescription(path, "mesh of solids", figures, "", _lines(commands, path))


def _vtu(path: Path) -> FileDescription:
    from carrierflex.files.child_process import in_child

    n_nodes, n_cells = in_child(_sizes_of_vtu, path, about=path, what="meshio")
    figures = {"nodes": str(n_nodes), "cells": str(n_cells)}
    return FileDescription(path, "mesh for ParaView", figures)


def _sizes_of_vtu(path: Path) -> tuple[int, int]:
    import meshio

    from carrierflex.files.child_process import limited

    size = path.stat().st_size
    try:
        with limited(60 + size // 200_000, 500_000_000 + 100 * size):
            mesh = meshio.vtu.read(path)
    except Exception as error:
        raise ValueError(f"{path}: not a mesh (.vtu): {' '.join(str(error).split())}") from error
    assert mesh is not None
    return len(mesh.points), sum(len(block.data) for block in mesh.cells)


def _matrix(path: Path) -> FileDescription:
    from carrierflex.fe.matrices.matrix_files import read_matrix

    figures, reasons = {}, []
    for quantity in ("stiffness", "mass"):
        try:
            matrix = read_matrix(path, quantity)
        except ValueError as error:
            reasons.append(error)
            continue
        text = f"{matrix.A.shape[0]} rows, {matrix.A.nnz} entries"
        figures[f"as {quantity}"] = text + (", rows named" if matrix.dofs is not None else "")
    if not figures:
        raise reasons[0]
    commands = ("reduce --stiffness K --mass M --interfaces FILE.toml --out BODY.h5",)
    return FileDescription(path, "matrix of another program", figures, "", _lines(commands, path))


def _fmu(path: Path) -> FileDescription:
    from xml.etree import ElementTree

    try:
        with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as stored:
            root = ElementTree.fromstring(stored.read(10_000_000))
            binaries = [name for name in archive.namelist() if name.startswith("binaries/")]
    except (*DAMAGED_ARCHIVE, ValueError, RuntimeError) as error:
        raise ValueError(f"{path}: not an FMU ({' '.join(str(error).split())})") from error
    figures = {
        "FMI version": root.get("fmiVersion", ""),
        "model": root.get("modelName", ""),
        "variables": str(len(root.findall("ModelVariables/*"))),
        "binaries": _listed(sorted({name.split("/")[1] for name in binaries})),
    }
    is_ours = root.get("generationTool") == "carrierflex"
    software = next(
        (word.strip() for word in root.get("description", "").split(";") if "carrierflex" in word),
        root.get("generationTool", ""),
    )
    kind = "co-simulation unit" if is_ours else "FMU of another tool"
    return FileDescription(path, kind, figures, software)


def _page(path: Path) -> FileDescription:
    text = plain_content(path, "a page", 50_000_000)[:100_000].decode("utf-8", "replace")
    title = text.partition("<title>")[2].partition("</title>")[0].strip()
    if not title:
        raise ValueError(f"{path}: a page without a title; expected one that a command wrote")
    return FileDescription(path, "page for a browser", {"title": title})


def _picture(path: Path) -> FileDescription:
    with path.open("rb") as file:
        head = file.read(24)
    if not head.startswith(b"\x89PNG") or len(head) < 24:
        raise ValueError(f"{path}: not a picture (.png); its first bytes are {head[:8]!r}")
    width, height = struct.unpack(">II", head[16:])
    return FileDescription(path, "picture", {"size": f"{width} x {height} pixels"})


def _text_of_ours(path: Path) -> FileDescription:
    text = plain_content(path, "a text", 1_000_000_000)[:2000].decode("utf-8", "replace")
    if "carrierflex" not in text:
        if path.suffix.lower() == ".log":
            return _log(path)
        raise ValueError(f"{path}: not written by carrierflex")
    return FileDescription(path, "text that carrierflex wrote", {"first line": text.split("\n")[0]})


def _scalars(document: Mapping[str, Any]) -> dict[str, str]:
    """Numbers and words of a document's top level; lists and tables by their size."""
    figures = {}
    for key, value in document.items():
        if key in ("format", "software", "versions") or value in ("", [], {}, None):
            continue
        if isinstance(value, dict | list):
            figures[key] = f"{len(value)} {'entry' if len(value) == 1 else 'entries'}"
        else:
            figures[key] = f"{value:.6g}" if isinstance(value, float) else str(value)
    return figures


def _lines(commands: tuple[str, ...], path: Path) -> tuple[str, ...]:
    return tuple(f"carrierflex {command.format(path)}" for command in commands)


def _listed(names: Iterator[str] | Any) -> str:
    """Names in words: the first few and how many there are."""
    listed = list(names)
    shown = ", ".join(listed[:_MOST_LISTED])
    if len(listed) > _MOST_LISTED:
        return f"{len(listed)}: {shown}, ..."
    return f"{len(listed)}: {shown}" if listed else "none"

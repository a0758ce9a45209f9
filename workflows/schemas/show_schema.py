"""The JSON Schema of one kind of file, for editors and for other programs that check files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from carrierflex.files.whole_files import check_file_writable, refuse_foreign, whole_file

Name = Literal[
    "campaign",
    "map",
    "carrier-parameters",
    "cad-surfaces",
    "matrix-interfaces",
    "carrier-case",
    "mounting-case",
    "stage-case",
    "law",
    "diagnosis",
    "rim-motion",
    "report",
    "comparison",
    "calibration",
    "fleet",
    "batch",
    "watch",
    "plan",
    "identification",
    "loads",
    "import",
    "certificate",
    "summary",
    "inputs",
    "mesh-error",
    "couplings",
    "pin-fit",
    "sensitivities",
    "order-one",
    "table-5",
    "papers-gap",
    "torsion",
    "gear-life",
    "rexs",
    "linearised",
    "figures",
    "printed-tables",
    "blind-check",
    "seals",
    "salts",
    "labels",
    "times",
    "answers",
    "references",
    "result",
]


@dataclass(frozen=True)
class Schema:
    """A schema as text; `path` where it was written."""

    text: str
    path: Path | None = None


def main(name: Name, *, out: Path | None = None) -> Schema:
    """Show the JSON Schema of a kind of file: every key with its words, unit and range.

    Parameters
    ----------
    name
        Kind of file: a TOML file that is read, or a JSON file that is written, by its name
        ("pin-fit" is that of pin_fit.json); "result": what --json prints.
    out
        File to write (.json) with the schema; default: it is shown.

    Returns
    -------
    Schema
        Draft 2020-12.
    """
    from carrierflex.workflows.schemas.file_schemas import schema_text

    text = schema_text(name.replace("-", " "))
    if out is None:
        return Schema(text)
    check_file_writable(out)
    refuse_foreign(out, '"$schema"')
    with whole_file(out) as path:
        path.write_text(text, encoding="utf-8")
    return Schema(text, out)

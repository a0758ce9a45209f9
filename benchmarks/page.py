"""Write the tables of docs/performance.md from what ``make bench`` measured.

    python -m benchmarks.page [out/bench.json ...]

The rows of a file take the place of those of the same benchmarks in docs/performance.json, which is
the record of all of them; the tables of the page follow from that. Without a file the page alone is
written.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.report import shown_number
from benchmarks.run import BENCHMARKS
from carrierflex.files.json_files import save_json
from carrierflex.files.whole_files import whole_file

_DOCS = Path(__file__).parents[1] / "docs"
PAGE, RECORD = _DOCS / "performance.md", _DOCS / "performance.json"
#: Lines of the page between which the tables stand.
_BEGIN = "<!-- Written by python -m benchmarks.page from performance.json -->"
_END = "<!-- End of what was written -->"
_HEAD = (
    "| case | quantity | actual | peer | ratio | required | pass |\n|---|---|---|---|---|---|---|"
)


def with_results(record: Mapping[str, Any], results: Mapping[str, Any]) -> dict[str, Any]:
    """Record with the benchmarks of one file of ``make bench``, in the order of their list.

    Parameters
    ----------
    record : mapping
        Rows, machine, versions and date by benchmark.
    results : mapping
        Content of a file of ``make bench``.

    Raises
    ------
    ValueError
        Where the file is of a quick run, whose sizes are not those that figures are required of.
    """
    if results["quick"]:
        raise ValueError("its run was a quick one; expected a run of 'make bench' without QUICK=1")
    about = {name: results[name] for name in ("date", "machine", "versions")}
    finished = {
        name: about | {"rows": [row for row in results["rows"] if row["benchmark"] == name]}
        for name in results["seconds"]
    }
    merged = {**record, **finished}
    return {name: merged[name] for name in BENCHMARKS if name in merged}


def page_text(page: str, record: Mapping[str, Any]) -> str:
    """Page with the tables of a record in the place of those that it holds."""
    before, _, rest = page.partition(_BEGIN)
    _, _, after = rest.partition(_END)
    tables = "\n\n".join(_table(name, entry) for name, entry in record.items())
    rows = [row for entry in record.values() for row in entry["rows"]]
    return f"{before}{_BEGIN}\n\n{_head(rows, record)}\n\n{tables}\n\n{_END}{after}"


def _head(rows: Sequence[Mapping[str, Any]], record: Mapping[str, Any]) -> str:
    """How many required figures are reached, and which benchmarks the record lacks."""
    reached = [row["met"] for row in rows if row.get("met") is not None]
    lines = [f"{sum(reached)} of {len(reached)} required figures are reached."]
    if missing := [f"`{name}`" for name in BENCHMARKS if name not in record]:
        lines.append(f"Without a record of their full size: {', '.join(missing)}.")
    return "\n".join(lines)


def _table(name: str, entry: Mapping[str, Any]) -> str:
    """Heading, machine and rows of one benchmark."""
    machine = entry["machine"]
    about = (
        f"{machine['processor']}, {machine['cores']} cores, {machine['memory_gb']:.0f} GB; "
        f"load at the start: {machine['load']:.1f}"
    )
    rows = "\n".join(_row(row) for row in entry["rows"])
    return f"### `{name}`\n\n{about}.\n\n{_HEAD}\n{rows}"


def _row(row: Mapping[str, Any]) -> str:
    if row["state"] != "measured":
        cells = [row.get("peer") or "", row["state"], row["reason"], "", "", "", ""]
        return _cells(cells)
    unit = row["unit"]
    case = f"{row['case']} ({row['note']})" if row["note"] else row["case"]
    peer = row["peer"] or ""
    if row["peer_value"] is not None:
        peer = f"{peer}: {shown_number(row['peer_value'], unit)}"
    return _cells(
        [
            case,
            row["quantity"],
            "not finite" if row["value"] is None else shown_number(row["value"], unit),
            peer,
            "" if row["ratio"] is None else shown_number(row["ratio"]),
            (row["wanted"] or "").replace(">=", "at least").replace("<=", "at most"),
            {True: "yes", False: "no", None: ""}[row["met"]],
        ]
    )


def _cells(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def main(files: Sequence[str]) -> int:
    """Take the results of files into the record, and write the page; the exit code."""
    record: dict[str, Any] = json.loads(RECORD.read_text(encoding="utf-8"))
    for file in files:
        try:
            record = with_results(record, json.loads(Path(file).read_text(encoding="utf-8")))
        except (OSError, ValueError, KeyError) as error:
            print(f"{file}: {error}; expected a file of 'make bench'", file=sys.stderr)
            return 2
    save_json(RECORD, record)
    text = page_text(PAGE.read_text(encoding="utf-8"), record)
    with whole_file(PAGE) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

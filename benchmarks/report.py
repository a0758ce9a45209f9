"""The rows of all benchmarks as one table and one JSON file, with machine and versions."""

import importlib.metadata
import os
import platform
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from benchmarks.ratio import Absent, Failed, Ratio, Row
from carrierflex.files.json_files import save_json

#: Of the JSON file; one more where a key changes its meaning or goes.
SCHEMA = 1

#: Packages whose version can change a time or a result.
_PACKAGES = (
    "carrierflex",
    "numpy",
    "scipy",
    "numba",
    "mkl",
    "kvxopt",
    "scikit-fem",
    "gmsh",
    "pyarrow",
    "exudyn",
)


@dataclass
class Report:
    """Rows so far by benchmark; its file is written anew, whole, after each.

    Parameters
    ----------
    quick : bool
        Smaller meshes and shorter records.
    path : Path, optional
        JSON file; None writes none.
    """

    quick: bool
    path: Path | None = None
    rows: list[tuple[str, Row]] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    complete: bool = False
    date: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    machine: dict[str, Any] = field(default_factory=lambda: machine())
    versions: dict[str, str | None] = field(default_factory=lambda: versions())

    def add(self, benchmark: str, row: Row) -> None:
        """Keep a row."""
        self.rows.append((benchmark, row))
        self.save()

    def end(self, benchmark: str, seconds: float) -> None:
        """Keep how long a benchmark took [s]."""
        self.seconds[benchmark] = seconds
        self.save()

    def save(self) -> None:
        """Write the file, if one is asked for."""
        if self.path is not None:
            save_json(self.path, self.content())

    def content(self) -> dict[str, Any]:
        """What the JSON file holds."""
        return {
            "schema": SCHEMA,
            "quick": self.quick,
            "complete": self.complete,
            "date": self.date,
            "machine": self.machine,
            "versions": self.versions,
            "seconds": self.seconds,
            "rows": [{"benchmark": name, **_plain(row)} for name, row in self.rows],
        }

    @property
    def failed(self) -> list[str]:
        """Benchmarks that ended early."""
        return [name for name, row in self.rows if isinstance(row, Failed)]

    def caption(self) -> str:
        """Machine, versions and what the columns mean, in a few lines."""
        where = self.machine
        packages = (f"{name} {version or 'absent'}" for name, version in self.versions.items())
        lines = [
            f"{where['processor']}, {where['cores']} cores, {where['memory_gb']:.0f} GB, "
            f"load {where['load']:.1f} at the start; {self.date}",
            ", ".join(packages),
            "ratio: how many times ours is better than the peer in the same run",
            "wanted: of the ratio, or of the value where there is none; no failure if missed",
        ]
        if self.quick:
            lines.append("quick: small meshes, short records; what is wanted is of the full sizes")
        return "\n".join(lines)


def machine() -> dict[str, Any]:
    """Processor, cores, memory [GB], operating system and load average of the last minute."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count(),
        "memory_gb": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9,
        "system": platform.platform(),
        "load": os.getloadavg()[0],
    }


def _processor() -> str:
    """Model name as Linux tells it; elsewhere what Python knows."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    match = re.search(r"^model name\s*:\s*(.+)$", text, flags=re.MULTILINE)
    return match[1] if match else platform.processor() or platform.machine()


def versions() -> dict[str, str | None]:
    """Versions of Python, packages, CalculiX and this tree; None where one is absent."""
    by_name: dict[str, str | None] = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            by_name[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            by_name[name] = None
    by_name["CalculiX"] = _matched(r"Version (\S+)", "ccx", "-v")
    by_name["commit"] = _matched(r"(\S+)", "git", "describe", "--always", "--dirty")
    return by_name


def _matched(pattern: str, *command: str) -> str | None:
    """First group of `pattern` in what a command prints; None without the command or the match."""
    if shutil.which(command[0]) is None:
        return None
    folder = Path(__file__).parent
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    match = re.search(pattern, run.stdout)
    return match[1] if match else None


def _plain(row: Row) -> dict[str, Any]:
    """A row as JSON keeps it; a value that is not finite becomes null when written."""
    if isinstance(row, Absent):
        return {"state": "absent", "peer": row.peer, "reason": row.reason}
    if isinstance(row, Failed):
        return {"state": "failed", "reason": row.reason}
    return {
        "state": "measured",
        "case": row.case,
        "quantity": row.quantity.name,
        "unit": row.quantity.unit,
        "larger_is_better": row.quantity.larger_is_better,
        "value": row.value,
        "peer": row.peer or None,
        "peer_value": row.peer_value,
        "ratio": row.ratio,
        "wanted": None if row.wanted is None else str(row.wanted),
        "met": row.met,
        "note": row.note,
    }


def ratio_table(rows: Sequence[tuple[str, Row]]) -> Table:
    """One table of all rows, a heading for every benchmark; fits 80 columns by wrapping."""
    table = Table(box=None, pad_edge=False, expand=True)
    longest = max((len(benchmark) for benchmark, _ in rows), default=1)
    table.add_column("case, quantity", ratio=2, min_width=longest)
    table.add_column("ours", justify="right", no_wrap=True)
    table.add_column("peer", ratio=1, min_width=14)
    table.add_column("ratio", justify="right", no_wrap=True)
    table.add_column("wanted", no_wrap=True)
    heading = ""
    for benchmark, row in rows:
        if benchmark != heading:
            heading = benchmark
            table.add_row(f"[bold]{escape(benchmark)}[/]")
        table.add_row(*_cells(row))
    return table


def _cells(row: Row) -> tuple[str, ...]:
    if isinstance(row, Absent):
        return escape(row.reason), "", f"{escape(row.peer)} absent"
    if isinstance(row, Failed):
        return f"[red]{escape(row.reason)}[/]", "[red]failed[/]"
    unit = row.quantity.unit
    note = f"\n[dim]{escape(row.note)}[/]" if row.note else ""
    peer = (
        row.peer if row.peer_value is None else f"{row.peer} {shown_number(row.peer_value, unit)}"
    )
    return (
        f"{escape(row.case)}, {row.quantity.name}{note}",
        shown_number(row.value, unit),
        escape(peer),
        "" if row.ratio is None else shown_number(row.ratio),
        _wanted(row),
    )


def _wanted(row: Ratio) -> str:
    if row.wanted is None:
        return ""
    return f"{row.wanted} [green]yes[/]" if row.met else f"{row.wanted} [red]no[/]"


def shown_number(value: float, unit: str = "") -> str:
    """Three digits: fixed point where it is short, an exponent elsewhere."""
    text = f"{value:.3g}"
    if "e" in text and 1.0 <= abs(value) < 1e7:
        text = f"{value:.0f}"
    elif "e" in text:
        text = f"{value:.1e}"
    return f"{text} {unit}".rstrip()

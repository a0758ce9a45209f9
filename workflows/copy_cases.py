"""The bundled cases: what each one is, and a copy to start from."""

from dataclasses import dataclass
from pathlib import Path

from carrierflex.files.whole_files import refuse_existing, whole_file
from carrierflex.files.whole_folders import check_writable
from carrierflex.simulation.carrier.case_files import shipped_case


@dataclass(frozen=True)
class ShippedCases:
    """Names with their first comment; `folder` where copies were written."""

    titles: dict[str, str]
    folder: Path | None = None


def main(*names: str, out: Path | None = None) -> ShippedCases:
    """List the bundled cases, or copy them.

    Parameters
    ----------
    names
        Cases to copy with --out; default: all.
    out
        Folder to write: the copies; an existing file is not replaced. Default: the cases are
        listed.

    Returns
    -------
    ShippedCases
        Names and titles.

    Raises
    ------
    ValueError
        Where there is no such case, or a copy exists already.
    """
    known = sorted(path.stem for path in shipped_case().parent.glob("*.toml"))
    chosen = {name: shipped_case(name) for name in names or known}
    titles = {name: _title(path.read_text(encoding="utf-8")) for name, path in chosen.items()}
    if out is None:
        return ShippedCases(titles)
    check_writable(out)
    refuse_existing(*(out / f"{name}.toml" for name in chosen))
    from carrierflex.workflows.outputs import schema_line

    for name, path in chosen.items():
        first, _, rest = path.read_text(encoding="utf-8").partition("\n")
        kind = Path(first.removeprefix("#:schema ")).stem.replace("-", " ")
        with whole_file(out / f"{name}.toml") as copy:
            # The schema is named by its place in this installation.
            copy.write_text(f"{schema_line(kind)}\n{rest}", encoding="utf-8")
    return ShippedCases(titles, out)


def _title(text: str) -> str:
    """First comment that is not for editors."""
    for line in text.splitlines():
        if line.startswith("# "):
            return line[2:]
    return ""

"""The bundled cases: what each one is, and a copy to start from; a case of a REXS file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.files.whole_files import refuse_existing, whole_file
from carrierflex.files.whole_folders import check_writable
from carrierflex.simulation.carrier.case_files import shipped_case

if TYPE_CHECKING:
    from carrierflex.workflows.simulation.rexs_case import RexsCase


@dataclass(frozen=True)
class ShippedCases:
    """Names with their first comment; `folder` where copies were written."""

    titles: dict[str, str]
    folder: Path | None = None


def main(
    *names: str, out: Path | None = None, rexs: Path | None = None, stage: int | None = None
) -> ShippedCases | RexsCase:
    """List the bundled cases, or copy them; or make a case of a REXS file.

    Parameters
    ----------
    names
        Cases to copy with --out; default: all.
    out
        Folder to write: the copies; an existing file is not replaced. Default: the cases are
        listed. With rexs: parameters.toml, stage.toml and rexs.json.
    rexs
        REXS file of a gearbox (.rexs, .rexsj, .rexsz; ids of REXS 1.7): its planetary stage becomes
        dimensions of the carrier and a stage case. Each number states its component and attribute,
        or the default used; units are converted to SI.
    stage
        Id of the planetary stage in it, where there are several.

    Returns
    -------
    ShippedCases or RexsCase
        Names and titles; or the files of the stage.

    Raises
    ------
    ValueError
        Where there is no such case, the REXS file is refused, or a file exists already.
    """
    if rexs is not None:
        if names or out is None:
            raise ValueError(
                "--rexs makes a case of one file; expected --out FOLDER and no name of a case"
            )
        from carrierflex.workflows.simulation.rexs_case import main as rexs_case

        return rexs_case(rexs, out=out, stage=stage)
    if stage is not None:
        raise ValueError(f"--stage is {stage} without a REXS file; expected --rexs FILE too")
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

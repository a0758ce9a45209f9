"""From a logger's files to a map of their columns, with guesses to look at.

A good answer: every line of the map is right, and only what no file can tell stands as '?'.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from carrierflex.files.whole_files import check_file_writable, refuse_existing, whole_file

Kind = Literal["carrier", "mounting", "element"]
Drive = Literal["force", "displacement", "free_decay", "base"]


@dataclass(frozen=True)
class NewMap:
    """A map that was written.

    `open_keys` are the lines with a '?', `left_out` the columns that it does not take.
    """

    path: Path
    text: str
    left_out: tuple[str, ...]

    @property
    def open_keys(self) -> tuple[str, ...]:
        """Lines that the user has to fill in."""
        return tuple(line for line in self.text.splitlines() if '= "?"' in line)


def main(
    *,
    kind: Kind,
    from_: Annotated[list[Path], Parameter(name="--from", consume_multiple=True)],
    drive: Drive | None = None,
    out: Path = Path("map.toml"),
) -> NewMap:
    """Write a map of a logger's files with guesses: columns, units, clock, angles.

    Parameters
    ----------
    kind
        Of the campaign: carrier, mounting or element.
    from_
        Files: CSV or other text (any separator, decimal comma, preamble, encoding), Parquet, HDF5,
        MAT, TDMS, UFF, MDF, Excel, OpenFAST's output. Files with the same columns are runs; files
        with different columns belong to one run.
    drive
        Of an element; guessed from the columns.
    out
        File to write (.toml): the map; an existing one is not replaced.

    Returns
    -------
    NewMap
        The map; keys with '?' are to be filled in.

    Raises
    ------
    ValueError
        Where a file is refused, or the map exists already.
    """
    from carrierflex.identification.logs.map_guesses import map_guess
    from carrierflex.identification.logs.map_text import map_text
    from carrierflex.workflows.outputs import schema_line

    refuse_existing(out)
    check_file_writable(out)
    if drive is not None and kind != "element":
        raise ValueError(f"--drive is for kind element; {kind} has none")
    guess = map_guess(kind, from_, drive)
    text = map_text(guess, schema_line("map"))
    with whole_file(out) as path:
        path.write_text(text, encoding="utf-8")
    return NewMap(out, text, tuple(guess.others))

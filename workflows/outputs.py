"""Output folders of the workflows; tables and pictures in them: whole files or none."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.temporary_names import remove_abandoned
from carrierflex.files.whole_files import refuse_foreign, whole_file
from carrierflex.files.whole_folders import check_writable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURE_DPI = 130
#: What a picture of this program holds.
_DRAWN_BY = "Matplotlib"
#: Folder of the schemas as files, which the first line of a TOML file names to editors.
_SCHEMA_FOLDER = Path(__file__).resolve().parent / "data" / "schemas"


def prepared_folder(path: Path) -> Path:
    """Create the output folder and make sure that files can be written into it.

    Unfinished files that killed processes left in it are removed.

    Raises
    ------
    OSError
        Where the path is a file or cannot be written; the message is one line.
    """
    check_writable(path)
    remove_abandoned(path)
    return path


def save_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV table; numbers with nine digits.

    Raises
    ------
    FileExistsError
        Where a file is in the way that has no column of the first one's name.
    """
    refuse_foreign(path, header[0])
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(
            [cell if isinstance(cell, str) else f"{cell:.9g}" for cell in row] for row in rows
        )


def save_figure(path: Path, figure: "Figure") -> None:
    """Write a matplotlib figure as PNG.

    Raises
    ------
    OSError
        Where it cannot be written.
    ValueError
        Where it cannot be drawn; the message names the file.
    """
    refuse_foreign(path, _DRAWN_BY)
    with whole_file(path) as file:
        try:
            figure.savefig(file, dpi=_PICTURE_DPI)
        except (ValueError, ArithmeticError, RuntimeError) as error:
            reason = " ".join(str(error).split())
            raise ValueError(f"{path}: cannot be drawn ({reason})") from error


def save_image(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an RGB image, shape (height, width, 3), as PNG."""
    refuse_foreign(path, _DRAWN_BY)
    from matplotlib.image import imsave

    with whole_file(path) as file:
        imsave(file, image)


def schema_file(kind: str) -> Path:
    """File of a schema that comes with the package."""
    return _SCHEMA_FOLDER / f"{kind.replace(' ', '-')}.json"


def schema_line(kind: str) -> str:
    """First comment of a TOML file that this program writes: it names the schema to editors."""
    return f"#:schema {schema_file(kind).as_uri()}"

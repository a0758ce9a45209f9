"""Output folders of the workflows, and pictures written into them: whole files or none."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.temporary_names import remove_abandoned
from carrierflex.files.whole_files import whole_file
from carrierflex.files.whole_folders import check_writable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURE_DPI = 130


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
    """Write a CSV table; numbers with nine digits."""
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
    with whole_file(path) as file:
        try:
            figure.savefig(file, dpi=_PICTURE_DPI)
        except (ValueError, ArithmeticError, RuntimeError) as error:
            reason = " ".join(str(error).split())
            raise ValueError(f"{path}: cannot be drawn ({reason})") from error


def save_image(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an RGB image, shape (height, width, 3), as PNG."""
    from matplotlib.image import imsave

    with whole_file(path) as file:
        imsave(file, image)

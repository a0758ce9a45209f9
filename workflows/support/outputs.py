"""Output folders of the workflows, and pictures written into them: whole files or none."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURE_DPI = 130


def prepared_folder(path: Path) -> Path:
    """Create the output folder and make sure that files can be written into it.

    Raises
    ------
    OSError
        Where the path is a file or cannot be written; the message is one line.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / ".write-test"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise OSError(
            f"{path}: cannot write into this output folder ({error.strerror}); expected a writable "
            "--out"
        ) from error
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
    """Write a matplotlib figure as PNG."""
    with whole_file(path) as file:
        figure.savefig(file, dpi=_PICTURE_DPI)


def save_image(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an RGB image, shape (height, width, 3), as PNG."""
    from matplotlib.image import imsave

    with whole_file(path) as file:
        imsave(file, image)

"""Output folders of the workflows, and pictures written into them: whole files or none."""

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
            f"{path}: cannot write into this output folder ({error.strerror}); expected a writable --out"
        ) from error
    return path


def save_figure(path: Path, figure: "Figure") -> None:
    """Write a matplotlib figure as PNG."""
    with whole_file(path) as file:
        figure.savefig(file, dpi=_PICTURE_DPI)


def save_image(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an RGB image, shape (height, width, 3), as PNG."""
    from matplotlib.image import imsave

    with whole_file(path) as file:
        imsave(file, image)

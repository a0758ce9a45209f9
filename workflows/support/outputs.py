"""Writing results: whole files or none, inputs and versions beside them."""

import dataclasses
import importlib.metadata
import json
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Packages whose version can change a result.
_RECORDED_PACKAGES = ("carrierflex", "numpy", "scipy", "scikit-fem", "gmsh", "pygmsh")
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


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that can change a result."""
    return {"python": platform.python_version()} | {
        name: importlib.metadata.version(name) for name in _RECORDED_PACKAGES
    }


def provenance(**inputs: object) -> dict[str, str]:
    """Inputs (dataclasses spelled out) and versions as text, for files that record what made them."""
    return {name: json.dumps(plain(value)) for name, value in inputs.items()} | versions()


def plain(value: Any) -> Any:
    """Copy of `value` made of what JSON knows; floats that are not finite become null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)
        }
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value if isinstance(value, (str, int)) or value is None else str(value)


def save_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write `content` as indented JSON."""
    save_text(path, json.dumps(plain(content), indent=2, ensure_ascii=False) + "\n")


def save_text(path: Path, text: str) -> None:
    """Write text."""
    with whole_file(path) as file:
        file.write_text(text, encoding="utf-8")


def save_figure(path: Path, figure: "Figure") -> None:
    """Write a matplotlib figure as PNG."""
    with whole_file(path) as file:
        figure.savefig(file, dpi=_PICTURE_DPI)


def save_image(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an RGB image, shape (height, width, 3), as PNG."""
    from matplotlib.image import imsave

    with whole_file(path) as file:
        imsave(file, image)

"""A linear model's A, B, C, D with names and units, for MATLAB and numpy."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from carrierflex.files.versions import software_name
from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.exports.ordered_body import FRAME, UNITS
from carrierflex.reduction.state_space import StateSpace

#: Suffixes of both forms.
SUFFIXES = (".mat", ".npz")


def write_state_space(system: StateSpace, path: Path, *, frame: str = FRAME) -> None:
    """Write ``A``, ``B``, ``C``, ``D`` and the names and units of states, inputs and outputs.

    ``.mat`` holds one structure, ``model``; ``.npz`` the same entries as arrays, texts as arrays of
    text: nothing in it is pickled.

    Parameters
    ----------
    system : StateSpace
        The model.
    path : Path
        File of suffix .mat or .npz.
    frame : str
        In which frame its signals are, in words.

    Raises
    ------
    ValueError
        Where the suffix is another.
    """
    refuse_suffix(path)
    content: dict[str, Any] = {letter: getattr(system, letter) for letter in "ABCD"}
    for kind in ("state", "input", "output"):
        signals = getattr(system, f"{kind}s")
        content |= {
            f"{kind}_names": np.array(signals.names),
            f"{kind}_units": np.array(signals.units),
        }
    point = system.operating_point
    content |= {
        "operating_point_names": np.array(list(point), dtype=np.str_),
        "operating_point_values": np.array(list(point.values()), dtype=np.float64),
        "name": system.name,
        "units": UNITS,
        "frame": frame,
        "software": software_name(),
    }
    with whole_file(path) as temporary:
        if path.suffix == ".mat":
            cells = {
                key: value.astype(object) if _is_text(value) else value
                for key, value in content.items()
            }
            scipy.io.savemat(temporary, {"model": cells}, appendmat=False, oned_as="column")
            return
        with temporary.open("wb") as file:
            np.savez(file, **content)
        with zipfile.ZipFile(temporary, "a") as archive:
            # Texts stand in it four bytes a letter; the comment says whose file it is.
            archive.comment = UNITS.encode()


def refuse_suffix(path: Path) -> None:
    """Refuse a file that is neither .mat nor .npz; ValueError names it."""
    if path.suffix not in SUFFIXES:
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected {' or '.join(SUFFIXES)}")


def _is_text(value: object) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind == "U"

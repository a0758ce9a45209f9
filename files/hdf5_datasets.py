"""Parts of an HDF5 file, read only once their type and size have been looked at.

An HDF5 file states sizes that it need not store: a matrix that was never written takes no byte of
the file and gigabytes of memory, and so does a list whose entries all point to one long text.
"""

from collections.abc import Sequence

import h5py
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import shown

#: Bytes that one dataset may take in memory.
MOST_BYTES = 2_000_000_000
#: A dataset may state this many times the bytes that are stored of it (compression), and this many
#: bytes whatever is stored.
_PACKED, _SMALL = 100, 100_000
#: Characters of a name.
_LONGEST_NAME = 500
#: Names are read one by one where their list could take more than this [bytes].
_MOST_TEXT = 50_000_000


class PartError(ValueError):
    """A part of an HDF5 file is not what it should be; the message names the part."""


def numbers(
    group: h5py.Group, name: str, shape: tuple[int, ...], kinds: str = "fiu"
) -> NDArray[np.float64]:
    """Finite numbers of a dataset.

    Parameters
    ----------
    group : h5py.Group
        Where it stands.
    name : str
        Its name in the group.
    shape : tuple of int
        Expected shape.
    kinds : str
        Kinds of numpy types that are numbers here.

    Raises
    ------
    PartError
        Where it has another shape or type, is larger than what is stored, or holds a value that is
        not finite.
    """
    refuse_other_numbers(group, name, shape, kinds)
    dataset = _dataset(group, name)
    values = dataset[()]
    if not np.isfinite(values).all():
        raise PartError(f"{dataset.name} holds a value that is not finite")
    return np.asarray(values, dtype=np.float64)


def refuse_other_numbers(
    group: h5py.Group, name: str, shape: tuple[int, ...], kinds: str = "fiu"
) -> None:
    """Look at shape, type and size of a dataset as :func:`numbers` does, and read none of it.

    Raises
    ------
    PartError
        Where it has another shape or type, or is larger than what is stored.
    """
    dataset = _dataset(group, name)
    if dataset.shape != shape:
        raise PartError(f"{dataset.name} has shape {dataset.shape}; expected {shape}")
    if dataset.dtype.kind not in kinds:
        raise PartError(f"{dataset.name} holds {shown(dataset.dtype)}; expected numbers")
    _refuse_unstored(dataset)


def number_attribute(group: h5py.Group, name: str) -> float:
    """One finite real number of an attribute.

    Raises
    ------
    KeyError
        Where there is no such attribute.
    PartError
        Where it is no number, more than one, complex or not finite.
    """
    value = np.asarray(group.attrs[name])
    if value.size != 1 or value.dtype.kind not in "fiu" or not np.isfinite(value).all():
        raise PartError(f"attribute {name} of {group.name} is {shown(value)}; expected one number")
    return float(value.reshape(()))


def samples(group: h5py.Group, name: str) -> NDArray[np.generic]:
    """Content of a dataset as it stands, missing numbers too.

    Raises
    ------
    PartError
        Where it is larger than what is stored.
    """
    dataset = _dataset(group, name)
    _refuse_unstored(dataset)
    return np.asarray(dataset[()])


def length(group: h5py.Group, name: str, most: int) -> int:
    """Number of entries of a list.

    Raises
    ------
    PartError
        Where it is no list, or a longer one than `most`.
    """
    dataset = _dataset(group, name)
    if dataset.ndim != 1 or dataset.shape[0] > most:
        raise PartError(
            f"{dataset.name} has shape {dataset.shape}; expected a list of at most {most}"
        )
    return int(dataset.shape[0])


def names(group: h5py.Group, name: str) -> tuple[str, ...]:
    """Names in a list, which are text on one line.

    Raises
    ------
    PartError
        Where the list holds something else, names with control characters, or long ones.
    """
    dataset = _dataset(group, name)
    if dataset.shape[0] == 0:
        return ()
    if h5py.check_string_dtype(dataset.dtype) is None:
        raise PartError(f"{dataset.name} holds {shown(dataset.dtype)}; expected text")
    if dataset.dtype.kind == "S" and dataset.dtype.itemsize > 4 * _LONGEST_NAME:
        raise PartError(
            f"{dataset.name} holds texts of {dataset.dtype.itemsize} bytes; expected names"
        )
    _refuse_unstored(dataset)
    texts = dataset.asstr()
    # Several entries may point to the same long text: the first one that is long ends the reading.
    is_small = dataset.shape[0] * dataset.file.id.get_filesize() < _MOST_TEXT
    values = texts[:] if is_small else (texts[number] for number in range(dataset.shape[0]))
    return tuple(checked_name(text, dataset.name) for text in values)


def checked_name(text: str, where: str) -> str:
    """Name that can stand in a line of a deck.

    Raises
    ------
    PartError
        Where it holds control characters or line ends, or is long.
    """
    if len(text) > _LONGEST_NAME or not text.isprintable():
        raise PartError(
            f"{where} holds the name {shown(text)}; expected at most {_LONGEST_NAME} characters on "
            "one line"
        )
    return text


def _dataset(group: h5py.Group, name: str) -> h5py.Dataset:
    """Dataset of this file; links to other files are none."""
    steps: Sequence[str] = name.split("/")
    here = group
    for step in steps:
        if not isinstance(here.get(step, getlink=True), h5py.HardLink):
            raise PartError(f"{group.name.rstrip('/')}/{name} is missing or a link")
        here = here[step]
    if not isinstance(here, h5py.Dataset) or here.is_virtual or here.external:
        raise PartError(f"{group.name.rstrip('/')}/{name} is no dataset of this file")
    return here


def _refuse_unstored(dataset: h5py.Dataset) -> None:
    """Refuse a dataset that states far more than what the file stores of it."""
    declared = int(np.prod(dataset.shape, dtype=np.float64)) * dataset.dtype.itemsize
    stored = int(dataset.id.get_storage_size())
    if declared > min(MOST_BYTES, _PACKED * stored + _SMALL):
        raise PartError(
            f"{dataset.name} states {declared} bytes and stores {stored}; expected what is stored, "
            f"and at most {MOST_BYTES}"
        )

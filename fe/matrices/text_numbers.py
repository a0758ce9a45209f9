"""Numbers in text files of finite element programs: all at once, exactly as printed."""

import re
import warnings

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import shown

#: Exponents of Fortran's double precision, and separators of Abaqus.
_PLAIN = bytes.maketrans(b"Dd,", b"EE ")
_NUMBER = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([Ee][-+]?\d+)?")
#: Whole numbers above this are not exact as floats.
_LARGEST_WHOLE = 2.0**53


def numbers(text: bytes, what: str) -> NDArray[np.float64]:
    """All numbers of a text, separated by blanks, commas or line ends.

    Parameters
    ----------
    text : bytes
        Numbers only; exponents by E or D.
    what : str
        What they are, for the message.

    Returns
    -------
    ndarray, shape (k,)
        The nearest floats of what is printed.

    Raises
    ------
    ValueError
        Where something else stands between them.
    """
    plain = text.translate(_PLAIN)
    if not plain.strip():
        return np.zeros(0)
    try:
        with warnings.catch_warnings():
            # numpy tells text that it cannot read by a warning of what will be an error.
            warnings.simplefilter("error")
            return np.fromstring(plain, dtype=np.float64, sep=" ")
    except (ValueError, DeprecationWarning):
        odd = next((w for w in plain.split() if not _NUMBER.fullmatch(w)), b"")
        word = odd.decode("latin-1")[:60]
        raise ValueError(f"{what} hold {shown(word)}; expected numbers") from None


def number_table(text: bytes, width: int, what: str) -> NDArray[np.float64]:
    """Numbers of a table with `width` columns, shape (k, width).

    Raises
    ------
    ValueError
        Where they do not fill the rows.
    """
    values = numbers(text, what)
    if len(values) % width:
        raise ValueError(
            f"{what} hold {len(values)} numbers; expected {width} a line: the file may be cut short"
        )
    return values.reshape(-1, width)


def whole_numbers(values: NDArray[np.float64], what: str) -> NDArray[np.int64]:
    """Numbers that must be whole and not negative.

    Raises
    ------
    ValueError
        Where one is not.
    """
    sound = (values == np.floor(values)) & (values >= 0.0) & (values < _LARGEST_WHOLE)
    if not sound.all():
        odd = float(values[~sound][0])
        raise ValueError(f"{what} hold {odd:g}; expected whole numbers, not negative")
    return values.astype(np.int64)

"""What a comparison problem gives to be drawn in the report.

Its gap and the fitted law as curves, without any drawing library.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Roles of a curve: what the baseline leaves, what the fitted effects say, what they leave.
GAP = "gap"
LAW = "law"
LEFT = "left"
ROLES = (GAP, LAW, LEFT)
#: Neighbours along x of a law that is a function of it differ by less than this share of its
#: standard deviation on average; those of a loop change branch half of the time. The limit leaves
#: room for the end of the trusted band.
_NEIGHBOURS = 0.3
#: Strips over the range of x for the line of a law.
_STRIPS = 36


@dataclass(frozen=True, eq=False)
class Trace:
    """One curve or cloud of points.

    Parameters
    ----------
    role : str
        One of ROLES; sets colour and stroke.
    x, y : ndarray, shape (n,)
        Points, in the units of the picture; angles [rad] along x of a polar picture.
    shade : ndarray, shape (n,), optional
        A third quantity that colours the points.
    """

    role: str
    x: FloatArray
    y: FloatArray
    shade: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.role not in ROLES:
            raise ValueError(f"trace of role '{self.role}'; expected one of {', '.join(ROLES)}")
        shapes = {
            self.x.shape,
            self.y.shape,
            self.x.shape if self.shade is None else self.shade.shape,
        }
        if len(shapes) != 1 or self.x.ndim != 1:
            raise ValueError(
                f"trace '{self.role}' has arrays of shapes {sorted(shapes)}; expected one length n"
            )


@dataclass(frozen=True, eq=False)
class Panel:
    """Traces that share one pair of axes, with a title.

    Parameters
    ----------
    title : str
        What it shows.
    traces : tuple of Trace
        Curves.
    marks : mapping of str to float
        Places along x with a short text each; angles [rad] of a polar picture.
    """

    title: str
    traces: tuple[Trace, ...]
    marks: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Picture:
    """A group of panels with the same axes.

    Parameters
    ----------
    title, caption : str
        What is shown, and how to read it.
    x_name, x_unit, y_name, y_unit : str
        Quantity and unit of both axes.
    panels : tuple of Panel
        At least one.
    is_polar : bool
        Whether x is an angle around a circle and y is drawn outwards from a zero circle.
    shade_name, shade_unit : str
        Quantity and unit of the shade; empty where no trace has one.
    """

    title: str
    caption: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    panels: tuple[Panel, ...]
    is_polar: bool = False
    shade_name: str = ""
    shade_unit: str = ""


def is_function(x: FloatArray, y: FloatArray) -> bool:
    """Whether y follows x along one line: neighbours along x have nearly the same y."""
    sorted_y = y[np.argsort(x, kind="stable")]
    return bool(np.abs(np.diff(sorted_y)).mean() <= _NEIGHBOURS * y.std())


def strip_means(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means of x and y over strips of equal width along x, empty strips left out.

    A law's line without its scatter.

    The trusted band ends within the harmonics of the law, which blurs the law itself.
    """
    strip = np.minimum((_STRIPS * (x - x.min()) / np.ptp(x)).astype(int), _STRIPS - 1)
    counts = np.bincount(strip, minlength=_STRIPS)
    x_sum, y_sum = (np.bincount(strip, values, minlength=_STRIPS) for values in (x, y))
    used = counts > 0
    return x_sum[used] / counts[used], y_sum[used] / counts[used]

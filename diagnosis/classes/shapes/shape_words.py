"""A measured shape in an engineer's words."""

import numpy as np

from carrierflex.diagnosis.classes.results import BesideCurve
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    RESTORING_FORCE,
)

#: Classes whose curves are told in words of their own, beside those that are kept as tables.
HYSTERESIS = "hysteresis"
MEMORY = "memory"

#: Share of the largest value below which a curve counts as zero.
_ZERO = 0.05
#: Ratio of both sides from which a curve is called one-sided, or stronger on one side.
_ONE_SIDED, _STRONGER = 0.15, 0.8
#: Ratio of the slopes of the outer and the inner half from which a curve is called bent.
_CURVED = 1.3


def shape_words(
    name: str, x: FloatArray, y: FloatArray, band: FloatArray, units: tuple[str, str]
) -> str:
    """Curve of a class in words.

    Parameters
    ----------
    name : str
        Class.
    x, y : ndarray, shape (n,)
        Curve.
    band : ndarray, shape (n, 2)
        Its 95 % band.
    units : tuple of str
        Units of x and y.

    Returns
    -------
    str
        For example ``zero below 0.8 mm, stiffening above, one side only``.
    """
    if not np.abs(y).max() > 0.0:
        return "zero throughout"
    if name == RESTORING_FORCE:
        return _force_words(x, y, units)
    if name == DISSIPATION:
        return _dissipation_words(x, y, units)
    if name == HYSTERESIS:
        return _loop_words(x, y, units)
    if name == MEMORY:
        return _memory_words(x, y, units)
    if name == COUPLED_DAMPING:
        return _coupled_words(x, y, units)
    return f"changes by {_sized(float(np.ptp(y)), units[1])}"


def length_words(value: float, unit: str) -> str:
    """A deflection with its unit, in millimetres below a tenth of a metre."""
    return _sized(value, unit)


def surface_words(lower: BesideCurve, upper: BesideCurve, units: tuple[str, str]) -> str:
    """How the force over the speed differs from one deflection to another.

    Parameters
    ----------
    lower, upper : BesideCurve
        Force over the same speeds at two deflections, each named by its place.
    units : tuple of str
        Units of speed and force.

    Returns
    -------
    str
        For example ``loss at 0.2 m/s of 3 N at -1 mm and of 9 N at 1 mm``.
    """
    top = min(float(lower.x[-1]), -float(lower.x[0]))
    losses = [
        0.5 * float(np.interp(top, own.x, own.y) - np.interp(-top, own.x, own.y))
        for own in (lower, upper)
    ]
    first, second = (_sized(loss, units[1]) for loss in losses)
    return f"loss at {_sized(top, units[0])} of {first} {lower.name} and of {second} {upper.name}"


def _sized(value: float, unit: str) -> str:
    """Number with its unit; lengths below a tenth of a metre in millimetres."""
    if unit == "m" and abs(value) < 0.1:
        return f"{1e3 * value:.3g} mm"
    if unit == "m/s" and abs(value) < 0.1:
        return f"{1e3 * value:.3g} mm/s"
    if unit == "N" and abs(value) >= 1e3:
        return f"{1e-3 * value:.3g} kN"
    return f"{value:.3g} {unit}"


def _force_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    top = float(np.abs(y).max())
    right = float(np.abs(y[x > 0.0]).max(initial=0.0))
    left = float(np.abs(y[x < 0.0]).max(initial=0.0))
    words = []
    weaker, stronger = sorted((left, right))
    is_one_sided = stronger > 0.0 and weaker < _ONE_SIDED * stronger and x[0] < 0.0 < x[-1]
    side = x > 0.0 if right >= left else x < 0.0
    inside = side & (np.abs(y) < _ZERO * top)
    far = float(np.abs(x[inside]).max(initial=0.0))
    if far > 0.05 * float(np.abs(x).max()):
        words.append(f"zero below {_sized(far, units[0])}")
    outer = np.flatnonzero(side & (np.abs(x) >= far))
    bending = _bending(x[outer], y[outer])
    words.append(f"{bending} above" if words else bending)
    if is_one_sided:
        words.append("one side only")
    elif weaker < _STRONGER * stronger and x[0] < 0.0 < x[-1]:
        part = weaker / stronger
        words.append(f"{part:.0%} as strong on the other side")
    words.append(f"up to {_sized(top, units[1])}")
    return ", ".join(words)


def _bending(x: FloatArray, y: FloatArray) -> str:
    """Whether a force grows with deflection or falls, and how."""
    if x.size < 4:
        return "too short to say"
    order = np.argsort(np.abs(x))
    d, f = np.abs(x[order]), y[order] * np.sign(x[order])
    half = d.size // 2
    first = np.polyfit(d[: half + 1], f[: half + 1], 1)[0]
    second = np.polyfit(d[half:], f[half:], 1)[0]
    if f[-1] < 0.0:
        return "softening" if second < first else "softening, then straight"
    if second > _CURVED * first:
        return "stiffening"
    return "straight" if second > first / _CURVED else "stiffening ever less"


def _dissipation_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    top = float(np.abs(x).max())
    slow = np.abs(x) < 0.05 * top
    level = 0.5 * (float(np.interp(0.05 * top, x, y)) - float(np.interp(-0.05 * top, x, y)))
    end = 0.5 * (float(np.interp(top, x, y)) - float(np.interp(-top, x, y)))
    words = [f"{_sized(end, units[1])} at {_sized(top, units[0])}"]
    if abs(end) > 0.0 and level > 0.5 * end and slow.any():
        words.insert(0, f"step of {_sized(level, units[1])} at rest")
    elif abs(end) > 0.0:
        words.insert(0, "grows with speed" if end > 0.0 else "falls with speed")
    return ", ".join(words)


def _loop_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    middle = 0.5 * (x.max() + x.min())
    half = 0.5 * float(np.ptp(x))
    outwards, inwards = y[x > middle], y[x < middle]
    rising = np.gradient(x) > 0.0
    height = float(
        np.interp(middle, *_sorted(x[rising], y[rising]))
        - np.interp(middle, *_sorted(x[~rising], y[~rising]))
    )
    end = float(np.abs(y).max())
    words = [f"loop of {_sized(float(np.ptp(y)), units[1])} over {_sized(2.0 * half, units[0])}"]
    if end > 0.0 and height < 0.7 * float(np.ptp(y)):
        words.append("narrow in the middle" if height < 0.4 * np.ptp(y) else "rising to its ends")
    strong, weak = float(np.abs(outwards).max()), float(np.abs(inwards).max())
    if weak > 0.0 and abs(strong / weak - 1.0) > 0.05:
        words.append(
            f"{abs(strong / weak - 1.0):.0%} {'stronger' if strong > weak else 'weaker'} outwards"
        )
    return ", ".join(words)


def _sorted(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(x)
    return x[order], y[order]


def _memory_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    start = float(y[0])
    if start <= 0.0:
        return "no relaxation"
    half = float(x[int(np.argmax(y < 0.5 * start))])
    return f"relaxes from {_sized(start, units[1])}, half of it after {half:.3g} s"


def _coupled_words(x: FloatArray, y: FloatArray, units: tuple[str, str]) -> str:
    ends = 0.5 * float(y[0] + y[-1])
    middle = float(np.interp(0.5 * (x[0] + x[-1]), x, y))
    sense = "larger far from the middle" if ends > middle else "larger in the middle"
    return f"{sense}, by {_sized(float(np.ptp(y)), units[1])}"

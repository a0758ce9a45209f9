"""The measured shape of a class with its band, and the nearest law over it."""

from typing import TYPE_CHECKING

from carrierflex.diagnosis.classes.results import MeasuredShape
from carrierflex.diagnosis.report.svg import BLACK, BLUE, ORANGE, WIDTH, scaled_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEIGHT = 2.9


def shape_figure(shape: MeasuredShape, law: str) -> "Figure":
    """Curve of a class over the visited range.

    Parameters
    ----------
    shape : MeasuredShape
        Curve, band and law.
    law : str
        Name of the law in words.

    Returns
    -------
    matplotlib.figure.Figure
        One panel: curve, 95 % band, law.
    """
    from matplotlib.figure import Figure

    x_factor, x_unit = scaled_unit(float(abs(shape.x).max()), shape.units[0])
    y_factor, y_unit = scaled_unit(float(abs(shape.y).max()), shape.units[1])
    figure = Figure(figsize=(WIDTH, _HEIGHT), layout="constrained")
    panel = figure.subplots()
    x = x_factor * shape.x
    low, high = y_factor * shape.band.T
    is_curve = bool((x[1:] >= x[:-1]).all())
    if is_curve:
        panel.fill_between(x, low, high, color=BLUE, alpha=0.25, linewidth=0.0, label="95 % band")
    panel.plot(x, y_factor * shape.y, color=BLUE, linewidth=1.6, label=shape.name)
    for other in shape.beside:
        low, high = y_factor * other.band.T
        own = x_factor * other.x
        if is_curve:
            panel.fill_between(own, low, high, color=ORANGE, alpha=0.25, linewidth=0.0)
        panel.plot(own, y_factor * other.y, color=ORANGE, linewidth=1.6, label=other.name)
    if shape.law.size:
        panel.plot(x, y_factor * shape.law, color=BLACK, linestyle="--", linewidth=1.2, label=law)
    panel.set_xlabel(f"{shape.labels[0]} [{x_unit}]")
    panel.set_ylabel(f"{shape.labels[1]} [{y_unit}]")
    panel.legend(fontsize=8, frameon=False)
    return figure

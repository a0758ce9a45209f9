"""Fixed-interface modes in words, from the motion they make at the rim's sensor circle."""

import numpy as np

from carrierflex.reduction.reduced_model import ReducedModel

#: A second order is named where it has at least this share of the first's amplitude.
_SECOND_SHARE = 0.5


def mode_names(model: ReducedModel) -> tuple[str, ...]:
    """Name every modal coordinate by the direction and the nodal diameters of its rim motion.

    Returns
    -------
    tuple of str
        As in ``rim axial, 3 nodal diameters``; ``no rim sensors`` for bodies without the sensor
        circle.
    """
    modes = [i for i, label in enumerate(model.labels) if label.startswith("mode ")]
    axial = [i for i, name in enumerate(model.sensor_names) if name.startswith("rim_axial")]
    radial = [i for i, name in enumerate(model.sensor_names) if name.startswith("rim_radial")]
    if not axial or not radial:
        return tuple("no rim sensors" for _ in modes)
    return tuple(
        _name(model.sensor_rows[axial, mode], model.sensor_rows[radial, mode]) for mode in modes
    )


def _name(axial: np.ndarray, radial: np.ndarray) -> str:
    direction, motion = (
        ("axial", axial) if np.linalg.norm(axial) >= np.linalg.norm(radial) else ("radial", radial)
    )
    amplitude = np.abs(np.fft.rfft(motion))
    amplitude[1:] *= 2.0
    first, second = np.argsort(amplitude)[::-1][:2]
    name = f"rim {direction}, {_diameters(int(first))}"
    if amplitude[second] >= _SECOND_SHARE * amplitude[first]:
        name += f" and {_diameters(int(second))}"
    return name


def _diameters(order: int) -> str:
    return "all round" if order == 0 else f"{order} nodal diameter{'s' if order > 1 else ''}"

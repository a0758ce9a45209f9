"""Stress on the surface of the stage's carrier and pins over time.

Stress rows of a body go with its sensors through the joints with pins and main shaft, so that
``σ = S L c`` of the stage's coordinates c, and an imposed misalignment adds what it strains.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.pins import pin_angles
from carrierflex.reduction.pin_joints import pin_pilot
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.shapes.body_shapes import UNNAMED
from carrierflex.reduction.shapes.body_stresses import BodyStresses, turned_stresses
from carrierflex.reduction.shapes.stress_measures import von_mises
from carrierflex.simulation.stage.stage_model import StageModel

#: Names of a body's rows for stress begin so.
_STRESS_ROW = "stress_"
#: Nodes whose stress is looked at together.
_NODES = 500


@dataclass(frozen=True, eq=False)
class StressReader:
    """Stress of k nodes from the stage's coordinates.

    Parameters
    ----------
    rows : ndarray, shape (k, 6, n)
        Stress [Pa] for one unit of each coordinate; nothing for the carrier's angle.
    constant : ndarray, shape (k, 6)
        Stress of an imposed misalignment [Pa].
    """

    rows: NDArray[np.float64]
    constant: NDArray[np.float64]

    def stress(self, nodes: NDArray[np.int64], c: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stress [Pa] of some nodes over N instants, shape (len(nodes), 6, N); c (N, n)."""
        return self.rows[nodes] @ c.T + self.constant[nodes][:, :, None]


@dataclass(frozen=True, eq=False)
class PeakStress:
    """Largest equivalent stress of every node so far.

    Parameters
    ----------
    von_mises : ndarray, shape (k,)
        Largest equivalent stress [Pa].
    time : ndarray, shape (k,)
        When it acts [s].
    """

    von_mises: NDArray[np.float64]
    time: NDArray[np.float64]

    def or_later(
        self, reader: StressReader, time: NDArray[np.float64], c: NDArray[np.float64]
    ) -> "PeakStress":
        """The larger of these and those of N later instants: time (N,), coordinates c (N, n)."""
        size, at = self.von_mises.copy(), self.time.copy()
        for first in range(0, len(size), _NODES):
            nodes = np.arange(first, min(first + _NODES, len(size)))
            equivalent = von_mises(reader.stress(nodes, c))
            instant = equivalent.argmax(axis=1)
            largest = equivalent[np.arange(len(nodes)), instant]
            later = largest > size[nodes]
            size[nodes[later]], at[nodes[later]] = largest[later], time[instant[later]]
        return PeakStress(size, at)


def with_stress_rows(model: ReducedModel, stresses: BodyStresses, prefix: str = "") -> ReducedModel:
    """Copy of a body that reads its stresses as it reads its sensors, after them.

    What joins bodies carries the rows along; `prefix` keeps names of several bodies apart.

    Raises
    ------
    ValueError
        Where the rows are of a body of other coordinates.
    """
    k, components, n = stresses.S.shape
    if n != model.n_coordinates:
        raise ValueError(
            f"{model.name} has {model.n_coordinates} coordinates, its stress rows {n}; expected "
            "the rows of this body"
        )
    names = tuple(f"{_STRESS_ROW}{prefix}{i}" for i in range(k * components))
    return replace(
        model,
        sensor_names=(*model.sensor_names, *names),
        sensor_rows=np.concatenate([model.sensor_rows, stresses.S.reshape(k * components, n)]),
    )


def pins_with_stress_rows(
    pin: ReducedModel, stresses: BodyStresses, n_planets: int
) -> tuple[ReducedModel, ...]:
    """Pins for :func:`carrierflex.reduction.pin_joints.carrier_with_each_pin` that read stresses.

    Rows are along the carrier's axes once the pins are turned to their bores.

    Parameters
    ----------
    pin : ReducedModel
        Pin 1.
    stresses : BodyStresses
        Its stress rows.
    n_planets : int
        Number of pins.
    """
    return tuple(
        with_stress_rows(pin, turned_stresses(stresses, float(angle)), f"pin_{number}_")
        for number, angle in enumerate(pin_angles(n_planets), start=1)
    )


def surface_with_pins(carrier: BodyStresses, pin: BodyStresses, n_planets: int) -> BodyStresses:
    """Surface of carrier and pins in the order of their rows; the rows are with the stage.

    Surfaces of pin i are named as its pilots, and ``pin_i`` where pin 1 has no name.
    """
    surface = replace(carrier, S=carrier.S[:, :, :0])
    for number, angle in enumerate(pin_angles(n_planets), start=1):
        turned = turned_stresses(replace(pin, S=pin.S[:, :, :0]), float(angle))
        surfaces = [name.removeprefix("pin_1_") for name in pin.surface_names]
        names = (*(pin_pilot(number, name) for name in surfaces), f"pin_{number}")
        of_pin = np.where(turned.surface_of == UNNAMED, len(names) - 1, turned.surface_of)
        surface = BodyStresses(
            points=np.concatenate([surface.points, turned.points]),
            triangles=np.concatenate([surface.triangles, turned.triangles + len(surface.points)]),
            surface_names=(*surface.surface_names, *names),
            surface_of=np.concatenate([surface.surface_of, of_pin + len(surface.surface_names)]),
            singular=np.concatenate([surface.singular, turned.singular]),
            S=np.concatenate([surface.S, turned.S]),
        )
    return surface


def stress_reader(model: StageModel) -> StressReader:
    """Reader of a stage whose carrier has stress rows.

    They are those of :func:`with_stress_rows`.

    Raises
    ------
    ValueError
        Where it has none.
    """
    body = model.layout.body
    rows = [i for i, name in enumerate(body.model.sensor_names) if name.startswith(_STRESS_ROW)]
    if not rows:
        raise ValueError(
            f"{body.model.name} has no stress rows; expected a carrier of carrierflex reduce "
            "--stresses"
        )
    S = body.model.sensor_rows[rows] @ model.L[: body.model.n_coordinates]
    # A turn about the axis strains nothing; rounding of it would grow with the angle.
    S[:, 0] = 0.0
    constant = body.misalignment_reading[rows] @ model.effects.misalignment
    return StressReader(S.reshape(-1, 6, S.shape[1]), np.asarray(constant).reshape(-1, 6))


def no_stress_yet(reader: StressReader) -> PeakStress:
    """Peaks before the first instant."""
    k = len(reader.rows)
    return PeakStress(np.zeros(k), np.zeros(k))

"""Stress on the surface of the stage's carrier over time.

The carrier's stress rows go with its sensors through the joints with pins and main shaft, so that
``σ = S L c`` of the stage's coordinates c, and an imposed misalignment adds what it strains.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.shapes.body_stresses import BodyStresses
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


def with_stress_rows(model: ReducedModel, stresses: BodyStresses) -> ReducedModel:
    """Copy of a body that reads its stresses as it reads its sensors, after them.

    What joins bodies carries the rows along.

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
    names = tuple(f"{_STRESS_ROW}{i}" for i in range(k * components))
    return replace(
        model,
        sensor_names=(*model.sensor_names, *names),
        sensor_rows=np.concatenate([model.sensor_rows, stresses.S.reshape(k * components, n)]),
    )


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

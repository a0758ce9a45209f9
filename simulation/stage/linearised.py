"""The stage about an operating point.

Frequencies, frequency response, Campbell diagram; meshes frozen in contact.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.state_space import Signals, StateSpace, modal_state_space
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.modal_form import ModalStage, modal_stage
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.stage_model import stage_model

#: Roots slower than this share of the fastest are drive and generator motions, not vibrations.
_RIGID_HZ = 1e-3


@dataclass(frozen=True, eq=False)
class LinearisedModes:
    """Damped modes, by ascending frequency.

    Parameters
    ----------
    frequency_hz, damping_ratio : ndarray, shape (k,)
        Damped natural frequency and share of critical damping of the oscillating modes.
    shape : ndarray of complex, shape (n, k)
        Coordinates c of each, largest entry 1.
    """

    frequency_hz: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    shape: NDArray[np.complex128]


def linearised_modes(stage: ModalStage) -> LinearisedModes:
    """Eigenvalues of ``q'' + D q' + omega^2 q = 0``, Coriolis forces and generator in D, mean mesh.

    Frequencies are those of the carrier frame: a motion that stands still or whirls in the fixed
    frame appears one carrier frequency away.
    """
    n = len(stage.omega)
    roots, vectors = np.linalg.eig(_first_order(stage))
    elastic = np.flatnonzero(roots.imag > 2.0 * np.pi * _RIGID_HZ)
    elastic = elastic[np.argsort(roots[elastic].imag)]
    shape = stage.Phi @ (vectors[n:, elastic] / roots[elastic])
    shape = shape / shape[np.abs(shape).argmax(axis=0), np.arange(len(elastic))]
    return LinearisedModes(
        roots[elastic].imag / (2.0 * np.pi), -roots[elastic].real / np.abs(roots[elastic]), shape
    )


def _first_order(stage: ModalStage) -> NDArray[np.float64]:
    """Matrix of ``(omega q, q')``, nearly skew, so that its eigenvectors are nearly orthogonal.

    Shape (2 n, 2 n).
    """
    n = len(stage.omega)
    return np.block([[np.zeros((n, n)), np.diag(stage.omega)], [-np.diag(stage.omega), -stage.D]])


def frequency_response(
    stage: ModalStage,
    frequency_hz: NDArray[np.float64],
    force: NDArray[np.float64],
    reading: NDArray[np.float64],
) -> NDArray[np.complex128]:
    """Response of a reading to a harmonic force, ``r (-w^2 + j w D + omega^2)^-1 f``.

    Parameters
    ----------
    stage : ModalStage
        The stage.
    frequency_hz : ndarray, shape (k,)
        Frequencies, positive.
    force, reading : ndarray, shape (n,)
        Generalised force and reading row in the coordinates c.

    Returns
    -------
    ndarray of complex, shape (k,)
        Reading per unit force.

    Raises
    ------
    ValueError
        Where a frequency is not positive: the drive motion is free.
    """
    if not (frequency_hz > 0.0).all():
        raise ValueError(
            f"smallest frequency is {frequency_hz.min()} Hz; expected positive ones, the drive "
            "turns freely"
        )
    f, r = stage.Phi.T @ force, reading @ stage.Phi
    w = 2.0 * np.pi * frequency_hz
    return np.array(
        [r @ np.linalg.solve(np.diag(stage.omega**2 - x * x) + 1j * x * stage.D, f) for x in w]
    )


def stage_state_space(
    stage: ModalStage, readings: NDArray[np.float64], sensors: Sequence[str], name: str = "stage"
) -> StateSpace:
    """The stage in the carrier frame: changes of load in, readings of the rim out.

    Parameters
    ----------
    stage : ModalStage
        The stage at its speed.
    readings : ndarray, shape (p, n)
        Rows of the sensors [m] in the coordinates c.
    sensors : sequence of str
        Their names.
    name : str
        Of the model.

    Returns
    -------
    StateSpace
        Inputs torque, ntl_y, ntl_z of the carrier frame; the drive turns freely. Meshes are in
        contact with their mean stiffness, Coriolis forces and generator in the damping.
    """
    loads = stage.model.loads
    force = np.column_stack([loads.torque, loads.radial_y, loads.radial_z])
    return modal_state_space(
        name,
        stage.omega,
        stage.D,
        stage.Phi.T @ force,
        readings @ stage.Phi,
        inputs=Signals(("torque", "ntl_y", "ntl_z"), ("N m", "N", "N")),
        outputs=Signals(tuple(sensors), ("m",) * len(sensors)),
        operating_point={"speed [rad/s]": stage.model.speed},
    )


@dataclass(frozen=True, eq=False)
class CampbellDiagram:
    """Frequencies over speed, and the lines of excitation.

    Parameters
    ----------
    speed : ndarray, shape (s,)
        Carrier speed [rad/s].
    frequency_hz : ndarray, shape (s, k)
        Lowest k frequencies at each speed, ascending.
    order_hz : dict of str to ndarray, shape (s,)
        Frequencies of :func:`excitation_hz` at each speed.
    """

    speed: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    order_hz: dict[str, NDArray[np.float64]]

    def crossings(self, order: str) -> NDArray[np.float64]:
        """Speeds at which an excitation meets a mode [rad/s].

        Linearly interpolated, ascending.
        """
        gap = self.frequency_hz - self.order_hz[order][:, None]
        i, j = np.nonzero(gap[:-1] * gap[1:] < 0.0)
        share = gap[i, j] / (gap[i, j] - gap[i + 1, j])
        return np.sort(self.speed[i] + share * (self.speed[i + 1] - self.speed[i]))


def excitation_hz(
    speeds: Sequence[float], data: StageData, n_planets: int = 3
) -> dict[str, NDArray[np.float64]]:
    """Frequencies at which a stage excites itself [Hz], over the carrier's speed [rad/s].

    Once a turn, once a planet (``3P`` with three) and once a tooth of the ring.
    """
    turns = np.asarray(speeds, dtype=np.float64) / (2.0 * np.pi)
    teeth = data.gear.ring_teeth
    return {"1P": turns, f"{n_planets}P": n_planets * turns, "mesh": teeth * turns}


def campbell_diagram(
    body: StageBody,
    speeds: Sequence[float],
    *,
    data: StageData | None = None,
    effects: StageEffects | None = None,
    n_modes: int = 30,
) -> CampbellDiagram:
    """Campbell diagram of the stage for carrier speeds [rad/s]."""
    rows = []
    for speed in speeds:
        model = stage_model(body, data, effects=effects, speed=float(speed))
        roots = np.linalg.eigvals(_first_order(modal_stage(model)))
        frequency_hz = np.sort(roots.imag) / (2.0 * np.pi)
        rows.append(frequency_hz[frequency_hz > _RIGID_HZ][:n_modes])
    orders = excitation_hz(speeds, data or StageData(), body.n_planets)
    return CampbellDiagram(np.asarray(speeds, dtype=np.float64), np.array(rows), orders)

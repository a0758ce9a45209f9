"""A linear model as ``ẋ = A x + B u``, ``y = C x + D u``, every signal with its name and unit.

A model of second order goes into its modes, ``q̈ + ΦᵀDΦ q̇ + ω² q = Φᵀ F u`` and ``y = R Φ q``,
with the states ``ω_k q_k`` and ``q̇_k`` (without stiffness ``q_k`` in s⁻¹). All states have one
unit, A is skew but for the damping, motions without stiffness are exact integrators, and a mode is
left out by its two rows and columns.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.reduced_model import ReducedModel

Array = NDArray[np.float64]

#: Units of a pilot's force and moment.
_LOAD_UNITS = ("N", "N", "N", "N m", "N m", "N m")
#: Squared frequency over the largest, below which a motion meets no more than rounding.
_FREE = 1e-12


@dataclass(frozen=True)
class Signals:
    """Names and units of states, inputs or outputs.

    Parameters
    ----------
    names, units : tuple of str
        One each a row or column.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        if len(self.names) != len(self.units):
            raise ValueError(
                f"{len(self.names)} names and {len(self.units)} units; expected as many"
            )


@dataclass(frozen=True, eq=False)
class StateSpace:
    """A linear model of first order.

    Parameters
    ----------
    name : str
        Of the model.
    A, B, C, D : ndarray, shapes (n, n), (n, m), (p, n), (p, m)
        Matrices, SI units.
    states, inputs, outputs : Signals
        Names and units of the n states, m inputs and p outputs.
    operating_point : mapping of str to float
        What the model is linearised about, names with units; empty for a linear model.

    Raises
    ------
    ValueError
        Where shapes and names do not go together.
    """

    name: str
    A: Array
    B: Array
    C: Array
    D: Array
    states: Signals
    inputs: Signals
    outputs: Signals
    operating_point: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n, m, p = (len(signals.names) for signals in (self.states, self.inputs, self.outputs))
        shapes = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
        for letter, shape in shapes.items():
            if getattr(self, letter).shape != shape:
                raise ValueError(
                    f"{self.name}: {letter} has shape {getattr(self, letter).shape}; expected "
                    f"{shape}, one row or column a name"
                )

    def frequency_response(self, frequency_hz: Array) -> NDArray[np.complex128]:
        """Outputs per unit input, ``C (jω - A)⁻¹ B + D``, shape (k, p, m).

        Parameters
        ----------
        frequency_hz : ndarray, shape (k,)
            Frequencies [Hz].
        """
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        states = np.linalg.solve(s[:, None, None] * np.eye(len(self.A)) - self.A, self.B)
        return np.asarray(self.C @ states + self.D)

    def to_control(self) -> Any:
        """The model as ``control.StateSpace`` of the package python-control.

        Names of its signals are name and unit, ``hub_Tx [m]``.

        Raises
        ------
        ValueError
            Where the package is not installed.
        """
        try:
            import control
        except ImportError as error:
            raise ValueError(
                "to_control needs the package control; install it with pip install "
                "'carrierflex[control]'"
            ) from error
        labels = {
            kind: [
                # python-control reads a full stop as a path.
                f"{name} [{unit}]".replace(".", "_")
                for name, unit in zip(signals.names, signals.units, strict=True)
            ]
            for kind, signals in (
                ("states", self.states),
                ("inputs", self.inputs),
                ("outputs", self.outputs),
            )
        }
        return control.ss(self.A, self.B, self.C, self.D, name=self.name, **labels)


def modal_state_space(
    name: str,
    omega: Array,
    damping: Array,
    force: Array,
    reading: Array,
    *,
    inputs: Signals,
    outputs: Signals,
    operating_point: Mapping[str, float] | None = None,
) -> StateSpace:
    """First order form of ``q̈ + D q̇ + ω² q = f u``, ``y = r q``.

    Parameters
    ----------
    name : str
        Of the model.
    omega : ndarray, shape (n,)
        Angular frequencies [rad/s] of mass-normalised modes, 0 for a motion without stiffness.
    damping : ndarray, shape (n, n)
        ``Φᵀ D Φ`` [1/s], with gyroscopic terms where there are some.
    force : ndarray, shape (n, m)
        ``Φᵀ F``.
    reading : ndarray, shape (p, n)
        ``R Φ``.
    inputs, outputs : Signals
        Names and units of the m inputs and p outputs.
    operating_point : mapping of str to float, optional
        As of :class:`StateSpace`.
    """
    n = len(omega)
    # x = (s q, q̇) with s = ω; a free motion has s = 1/s and no spring.
    s = np.where(omega > 0.0, omega, 1.0)
    A = np.block([[np.zeros((n, n)), np.diag(s)], [-np.diag(omega**2 / s), -damping]])
    B = np.vstack([np.zeros_like(force), force])
    C = np.hstack([reading / s, np.zeros_like(reading)])
    modes = [
        f"mode {k} ({w / (2.0 * np.pi):.6g} Hz)" if w > 0.0 else f"free motion {k}"
        for k, w in enumerate(omega, start=1)
    ]
    states = [f"{mode}, {what}" for what in ("omega q", "dq/dt") for mode in modes]
    return StateSpace(
        name,
        A,
        B,
        C,
        np.zeros((len(C), B.shape[1])),
        Signals(tuple(states), ("kg^0.5 m/s",) * (2 * n)),
        inputs,
        outputs,
        operating_point or {},
    )


def body_state_space(model: ReducedModel) -> StateSpace:
    """A reduced body or joined group: loads at the pilots in, motion of pilots and sensors out.

    Pilots that are tied share their coordinates: each coordinate is one input and one output.

    Parameters
    ----------
    model : ReducedModel
        Body or assembly, free or held to the ground.

    Raises
    ------
    ValueError
        Where a motion has stiffness and no mass, or more motions are held than recorded.
    """
    components = {
        int(row): component
        for pilot in model.pilots
        for row, component in zip(model.rows_of(pilot), model.components_of(pilot), strict=True)
    }
    rows = list(components)
    omega_squared, Phi = dense_modes(model.K, model.M)
    if len(omega_squared) < model.n_coordinates:
        raise ValueError(
            f"{model.name}: {model.n_coordinates - len(omega_squared)} motions have stiffness and "
            "no mass, which are no states; expected mass in every coordinate: leave the pilots' "
            "components without mass out of the interfaces and reduce again"
        )
    n_free = model.n_free_motions
    elastic = np.abs(omega_squared[:n_free]) > _FREE * omega_squared[-1]
    if elastic.any():
        raise ValueError(
            f"{model.name}: {n_free - int(elastic.sum())} motions meet no stiffness, and {n_free} "
            "are free by its record; expected as many: reduce again, or state free_rigid_motions "
            "in its provenance"
        )
    # What nothing holds has a frequency of rounding.
    omega_squared[:n_free] = 0.0
    names, units = zip(
        *(model.labels[row].removesuffix("]").rsplit(" [", 1) for row in rows), strict=True
    )
    R = np.vstack([np.eye(model.n_coordinates)[rows], model.sensor_rows])
    return modal_state_space(
        model.name,
        np.sqrt(omega_squared),
        Phi.T @ model.D @ Phi,
        Phi[rows].T,
        R @ Phi,
        inputs=Signals(
            tuple(f"load at {name}" for name in names),
            tuple(_LOAD_UNITS[component] for component in components.values()),
        ),
        outputs=Signals(
            (*names, *model.sensor_names), (*units, *("m" for _ in model.sensor_names))
        ),
    )

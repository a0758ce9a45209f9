"""The mounting on its bushings as a co-simulation unit.

The unit's C code (``mounting_unit.c``) takes the steps of
:mod:`carrierflex.simulation.mounting.propagators` and
:mod:`carrierflex.simulation.mounting.kernel` on both blocks at once, with a propagator that it
makes for the step that the importing tool asks for.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from carrierflex.simulation.fmi.functional_mockup import (
    ContinuousState,
    UnitModel,
    Variable,
    coordinate_states,
)
from carrierflex.simulation.mounting.equations import Block, mounting_blocks
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.time_integration import mounting_model

Array = NDArray[np.float64]

_INPUTS = (
    Variable("torque", "N.m", "Torque on the main shaft about x"),
    Variable("ntl_y", "N", "Non-torque load at the coupling along y"),
    Variable("ntl_z", "N", "Non-torque load at the coupling along z"),
)
_OUTPUTS = tuple(
    Variable(
        name,
        "m",
        f"Displacement of the housing at sensor {name}, along {name[-1]}, from the equilibrium "
        "under gravity",
    )
    for name in SENSORS
)
_COORDINATES = {
    "theta_x": "Roll of the housing",
    "theta_y": "Pitch of the housing about the main bearing",
    "theta_z": "Yaw of the housing about the main bearing",
    "b_y": "Motion of the main bearing along y",
    "b_z": "Motion of the main bearing along z",
    "d_x": "Motion of the housing along x",
}
#: Elements of the vertical and of the horizontal block, in the order of their rows.
_ELEMENTS = (("starboard_z", "port_z"), ("both_y",))


def mounting_unit(
    rig: MountingRig, parameters: ParameterArray, *, step: float, loads: Array
) -> UnitModel:
    """The mounting with all bushing laws of a parameter set, ready to be written as a unit.

    Parameters
    ----------
    rig : MountingRig
        Geometry and masses.
    parameters : ndarray
        Flat parameter set.
    step : float
        Largest step that the unit takes [s].
    loads : ndarray, shape (n, 3)
        Extremes of torque [N m], ntl_y, ntl_z [N] that the step has to resolve.

    Returns
    -------
    UnitModel
        Inputs torque, ntl_y, ntl_z; outputs the six sensors with gains and zeros.

    Raises
    ------
    ValueError
        Where the step is not positive or too large for the bushings under these loads, a parameter
        is out of bounds, or sensors have a delay.
    """
    if not (np.isfinite(step) and step > 0.0):
        raise ValueError(f"step is {step} s; expected a positive number")
    mounting_model(rig, parameters, loads, step, step=step)
    if parameters[INDEX["delay"]] != 0.0:
        raise ValueError(
            f"sensor delay is {parameters[INDEX['delay']]} s; expected 0 in [truth] of a copy of "
            "the case, and the delay in the importing tool"
        )
    blocks = mounting_blocks(rig, parameters)
    A, B, N = zip(*(block.state_matrices() for block in blocks), strict=True)
    K3, K5, C3, Kp, Fy = (float(value) for value in blocks[0].law)
    n_s, n_e = sum(map(len, A)), sum(len(block.weights) for block in blocks)
    states = _states(blocks, has_friction=Kp > 0.0 and Fy > 0.0)
    padded = [_over_state(block, block.output) for block in blocks]
    gains = np.array([parameters[INDEX[f"gain_{name}"]] for name in SENSORS])
    C = gains[:, None] * np.hstack(padded)
    n_q = len(blocks[0].names)
    data: dict[str, int | float | Array] = {
        "N_S": n_s,
        "N_E": n_e,
        "N_Q": sum(len(block.names) for block in blocks),
        "LARGEST_STEP": float(step),
        "K3": K3,
        "K5": K5,
        "C3": C3,
        "Kp": Kp if Fy > 0.0 else 0.0,
        "Fy": Fy,
        "COORDINATES": np.concatenate(
            [np.arange(n_q), len(A[0]) + np.arange(len(blocks[1].names))]
        ),
        "A": block_diag(*A),
        "B": np.vstack(B),
        "N": block_diag(*N),
        "D": block_diag(*(_over_state(block, block.rows) for block in blocks)),
        "R": block_diag(*(_over_state(block, block.rows, rate=True) for block in blocks)),
        "C": C,
        "PRELOAD": np.concatenate([block.preload for block in blocks]),
        "Y_0": np.array([parameters[INDEX[f"zero_{name}"]] for name in SENSORS]),
    }
    return UnitModel(
        identifier="carrierflex_mounting",
        title="carrierflex mounting",
        description="Gearbox housing on two bushings and the main bearing, six motion sensors",
        inputs=_INPUTS,
        outputs=_OUTPUTS,
        states=states,
        dependencies={
            name: tuple(states[i].variable.name for i in np.flatnonzero(row))
            for name, row in zip(SENSORS, C, strict=True)
        },
        source=Path(__file__).with_suffix(".c"),
        data=data,
        memory=2 * n_e + 1,
        step=0.01,
    )


def _over_state(block: Block, rows: Array, *, rate: bool = False) -> Array:
    """Rows over the coordinates of a block as rows over its state; or over their rates."""
    n, n_q = len(block.state_matrices()[0]), len(block.names)
    before = n_q if rate else 0
    return np.pad(rows, ((0, 0), (before, n - n_q - before)))


def _states(blocks: tuple[Block, ...], *, has_friction: bool) -> tuple[ContinuousState, ...]:
    """States by block: coordinates, velocities, fluid branches; then friction of all elements."""
    states = []
    for block, elements in zip(blocks, _ELEMENTS, strict=True):
        motions = [
            coordinate_states(Variable(name, _unit(name), _COORDINATES[name]))
            for name in block.names
        ]
        n_fluid = len(block.state_matrices()[0]) - 2 * len(block.names)
        fluid = [
            coordinate_states(
                Variable(f"fluid_{element}", "m", f"Stretch of the fluid spring, bushing {element}")
            )
            for element in elements[:n_fluid]
        ]
        states += [position for position, _ in motions] + [velocity for _, velocity in motions]
        states += [position for position, _ in fluid]
        if n_fluid > len(elements):
            states += [velocity for _, velocity in fluid]
    if has_friction:
        for element in (name for names in _ELEMENTS for name in names):
            name = f"friction_{element}"
            words = f"Elasto-plastic force of bushing {element}"
            states.append(
                ContinuousState(
                    Variable(name, "N", words), Variable(f"der({name})", "N/s", f"{words}, rate")
                )
            )
    return tuple(states)


def _unit(name: str) -> str:
    return "rad" if name.startswith("theta") else "m"

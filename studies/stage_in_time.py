"""The stage through time by another integrator than the simulator's: truth of studies of the stage.

The simulator keeps energy with a midpoint rule and discrete gradients of the contacts; this is
Newmark's trapezoidal rule with the contact laws of the statics at the end of each step,

    ``(4/h^2 + 2/h D + omega^2) q_1 = F + 4/h^2 q_0 + 4/h v_0 + a_0 + D (2/h q_0 + v_0)``,

in the modes of the linear stage, its unknowns the channels' forces. The teeth's stiffness changes
with the angle, and turns the drive by ``-1/2 sum k'(theta) penetration^2``. Of the mount's damping
the turning mean acts.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.stage.contact_laws import mesh_stiffness_at
from carrierflex.simulation.stage.modal_form import modal_stage
from carrierflex.simulation.stage.predicted_readings import PredictedStage
from carrierflex.simulation.stage.quasi_static import rest_readings
from carrierflex.simulation.stage.readings import rim_reader, sensor_signals
from carrierflex.simulation.stage.response import StageRecord, quasi_static_start
from carrierflex.simulation.stage.stage_model import StageModel, stage_model
from carrierflex.simulation.stage.statics import (
    NotConvergedError,
    SteadyLoad,
    channel_forces,
    mesh_amplitudes,
)

Array = NDArray[np.float64]

#: Share of a turn before the one that is read.
_SETTLED = 0.15
#: Change of a channel's force over the largest that ends the iteration, and iterations at most.
_CONVERGED, _MOST_ITERATIONS = 1e-9, 40
#: Every how many steps a state is kept.
_STORED_EVERY = 8
#: Steps of an iteration after which they are halved: it goes to and fro between contacts.
_HALVED_FROM = 12


def record_in_time(model: StageModel, load: SteadyLoad, step: float, turns: float) -> StageRecord:
    """States of a stage from its static answer on.

    Parameters
    ----------
    model : StageModel
        The stage.
    load : SteadyLoad
        Load; the generator holds it at the model's speed.
    step : float
        [s].
    turns : float
        Length in turns of the carrier.

    Raises
    ------
    NotConvergedError
        Where the forces of a step find no balance.
    """
    stage, channels, loads = modal_stage(model), model.channels, model.loads
    h, D, Phi = step, stage.D, stage.Phi
    data = model.data
    A_inverse = np.linalg.inv(np.diag(4.0 / h**2 + stage.omega**2) + 2.0 / h * D)
    B = Phi.T @ channels.B
    Z = A_inverse @ B
    W = B.T @ Z
    wanted = data.ratio * model.speed - load.torque / (data.ratio * data.chain.generator_constant)
    constant = Phi.T @ (
        loads.torque * load.torque
        + loads.generator * data.chain.generator_constant * wanted
        + loads.constant
    )
    turning = Phi.T @ np.column_stack(
        [loads.weight_y, loads.weight_z, loads.radial_y, loads.radial_z]
    )
    c, rate = quasi_static_start(model, load)
    inverse = np.linalg.inv(Phi)
    q, v = inverse @ c, inverse @ rate
    real, imag = mesh_amplitudes(channels)
    orders = channels.mesh_teeth * np.arange(real.shape[1])

    def contact(delta: Array, angle: float) -> tuple[Array, Array]:
        """Channel forces and their tangent, with the drive's torque by the teeth."""
        turned = mesh_stiffness_at(real, imag, channels.mesh_teeth * angle)
        force, tangent = channel_forces(channels, delta, angle, turned)
        slope = (orders * (-real * np.sin(orders * angle) - imag * np.cos(orders * angle))).sum(1)
        penetration = np.maximum(delta[channels.meshes] - channels.gaps, 0.0)
        force[0] = -0.5 * float(channels.of_flanks(slope) @ penetration**2)
        return force, tangent

    def outer(angle: float) -> Array:
        """Loads at a carrier angle, in modes."""
        cos, sin = np.cos(angle), np.sin(angle)
        g, y, z = load.gravity, load.ntl_y, load.ntl_z
        at = np.array([-g * sin, -g * cos, cos * y + sin * z, cos * z - sin * y])
        return np.asarray(constant + turning @ at)

    lambda_, _ = contact(B.T @ q - channels.free, float(c[0]))
    a = outer(float(c[0])) + B @ lambda_ - D @ v - stage.omega**2 * q
    unit, row = np.eye(len(W)), Phi[0]
    before = lambda_
    n_steps = int(turns * 2.0 * np.pi / (model.speed * h))
    states, times = [], []
    for number in range(n_steps):
        angle = float(row @ (q + h * v))
        right = outer(angle) + 4.0 / h**2 * q + 4.0 / h * v + a + D @ (2.0 / h * q + v)
        q_free = A_inverse @ right
        delta_free = B.T @ q_free - channels.free
        lambda_, before = 2.0 * lambda_ - before, lambda_
        for iteration in range(_MOST_ITERATIONS):
            force, tangent = contact(delta_free + W @ lambda_, angle)
            change = -np.linalg.solve(unit - tangent @ W, lambda_ - force)
            lambda_ = lambda_ + (0.5 if iteration >= _HALVED_FROM else 1.0) * change
            if np.abs(change).max() <= _CONVERGED * np.abs(lambda_).max():
                break
        else:
            raise NotConvergedError(f"step {number} of {h:.1e} s finds no balance")
        after = q_free + Z @ lambda_
        v_after = 2.0 / h * (after - q) - v
        a = 4.0 / h**2 * (after - q) - 4.0 / h * v - a
        q, v = after, v_after
        if number % _STORED_EVERY == _STORED_EVERY - 1:
            states.append(Phi @ q)
            times.append((number + 1) * h)
    C, m = np.array(states), len(states)
    drive = np.tile([load.torque, wanted, load.ntl_y, load.ntl_z], (m, 1))
    return StageRecord(np.array(times), C, np.zeros_like(C), drive, np.zeros((m, 6)))


def series_in_time(
    stage: PredictedStage,
    sensors: Sequence[Sensor],
    loads: Sequence[tuple[float, float, float]],
    *,
    step: float,
    highest_order: int,
) -> NDArray[np.complex128]:
    """Orders of what sensors read over a turn after some of a turn to settle [m].

    Returns
    -------
    ndarray of complex, shape (n_loads, n_sensors, highest_order + 1)
        ``s(theta) = Re sum_k a_k exp(j k theta)`` by least squares: tooth meshes are left out.
    """
    model = stage_model(stage.body, stage.data, effects=stage.effects, speed=stage.speed)
    reader = rim_reader(model)
    zero = dict.fromkeys((sensor.name for sensor in sensors), 0.0)
    if stage.rest_angle is not None:
        zero |= rest_readings(model, sensors, stage.rest_angle, effects=stage.reading)
    series = []
    for torque, y, z in loads:
        record = record_in_time(model, SteadyLoad(torque, y, z), step, 1.0 + _SETTLED)
        signals = sensor_signals(model, record, sensors, effects=stage.reading, reader=reader)
        last = record.c[:, 0] > record.c[-1, 0] - 2.0 * np.pi
        theta = record.c[last, 0]
        waves = np.outer(theta, np.arange(highest_order + 1))
        columns = np.hstack([np.cos(waves), -np.sin(waves[:, 1:])])
        values = np.array([signals[s.name][last] - zero[s.name] for s in sensors])
        fit, *_ = np.linalg.lstsq(columns, values.T, rcond=None)
        amplitudes = fit[: highest_order + 1].T.astype(np.complex128)
        amplitudes[:, 1:] += 1j * fit[highest_order + 1 :].T
        series.append(amplitudes)
    return np.array(series)

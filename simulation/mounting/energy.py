"""Energy balance of a simulated run: work of the loads, dissipation, stored energy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.equations import Block
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.time_integration import marched, mounting_model, state_at_rest

Array = NDArray[np.float64]

#: Energy that a run's balance may leave over, as a share of the work done.
LARGEST_IMBALANCE = 1e-3
#: Longest interval [s] at which powers are added up by default: the shipped case is left with 1e-5
#: there.
_LONGEST_INTERVAL = 0.01


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Energies since the first sample [J], at every second sample.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time [s].
    work : ndarray, shape (n,)
        Work of torque and radial load.
    dissipated : ndarray, shape (n,)
        By dampers, deflection-dependent damping, fluid branches and friction.
    stored : ndarray, shape (n,)
        Kinetic and elastic energy beyond that of the first sample.
    """

    time: Array
    work: Array
    dissipated: Array
    stored: Array

    @property
    def error(self) -> float:
        """Largest ``|work - dissipated - stored|`` over the largest work done [-]."""
        return float(
            np.abs(self.work - self.dissipated - self.stored).max() / np.abs(self.work).max()
        )


def energy_balance(
    rig: MountingRig,
    parameters: ParameterArray,
    inputs: MountingInputs,
    *,
    step: float | None = None,
) -> EnergyBalance:
    """Simulate a run and add up its energies, each from its own formula.

    Powers are integrated by Simpson's rule over pairs of samples, so the samples must resolve the
    motion: inputs with an interval above 10 ms are refined to that; give finer ones where the
    balance is to be exact. Friction's loss is its force times the slip, exact within a step of one
    direction.

    Parameters
    ----------
    rig, parameters, inputs, step
        As for :func:`carrierflex.simulation.mounting.simulate.simulate`.

    Returns
    -------
    EnergyBalance
        At every second sample.
    """
    inputs = inputs.refined(max(1, int(np.ceil(inputs.step / _LONGEST_INTERVAL * (1.0 - 1e-9)))))
    model = mounting_model(rig, parameters, inputs.loads, inputs.step, step=step)
    march = state_at_rest(model, inputs.loads[0], float(inputs.grid[0]))
    marches = [march]
    for sample in range(1, len(inputs.loads)):
        _, march = marched(model, march, inputs.loads[sample - 1 : sample + 1])
        marches.append(march)
    count = (len(marches) - 1) // 2 + 1
    work = np.zeros(count)
    dissipated = np.zeros(count)
    stored = np.zeros(count)
    for row, block in enumerate(model.blocks):
        states = np.array([march.states[row] for march in marches])
        friction = np.array([march.memories[row][0] for march in marches])
        velocity = states[:, len(block.names) : 2 * len(block.names)]
        work += _simpson(np.sum(velocity * (inputs.loads @ block.G.T), axis=1), inputs.step)
        dissipated += _simpson(_damping_power(block, states), inputs.step)
        dissipated += _friction_loss(block, states, friction)[::2][:count]
        energy = _stored(block, states, friction)
        stored += (energy - energy[0])[::2][:count]
    return EnergyBalance(inputs.grid[::2][:count], work, dissipated, stored)


def _simpson(power: Array, step: float) -> Array:
    """Cumulative integral at every second sample."""
    pairs = (len(power) - 1) // 2
    before = power[: 2 * pairs : 2]
    middle = power[1 : 2 * pairs : 2]
    after = power[2 : 2 * pairs + 1 : 2]
    return np.concatenate([[0.0], np.cumsum(step / 3.0 * (before + 4.0 * middle + after))])


def _split(block: Block, states: Array) -> tuple[Array, Array, Array, Array]:
    """Coordinates, velocities, deflections and their rates."""
    n_q = len(block.names)
    q, v = states[:, :n_q], states[:, n_q : 2 * n_q]
    return q, v, block.preload + q @ block.rows.T, v @ block.rows.T


def _damping_power(block: Block, states: Array) -> Array:
    _, v, u, rate = _split(block, states)
    power = np.sum(v @ block.C * v, axis=1) + (block.law[2] * u**2 * rate**2) @ block.weights
    k, c, m = block.fluid
    branch = states[:, 2 * v.shape[1] :]
    if branch.size and m == 0.0:
        power += ((k * branch) ** 2 / c) @ block.weights
    elif branch.size:
        power += (c * (rate - branch[:, len(block.weights) :]) ** 2) @ block.weights
    return power


def _friction_loss(block: Block, states: Array, friction: Array) -> Array:
    """Yield force times slip; the slip is what of a stretch the spring Kp does not take up."""
    Kp = block.law[3]
    if Kp == 0.0:
        return np.zeros(len(states))
    _, _, u, _ = _split(block, states)
    slip = np.diff(u, axis=0) - np.diff(friction, axis=0) / Kp
    return np.concatenate([[0.0], np.cumsum((friction[1:] * slip) @ block.weights)])


def _stored(block: Block, states: Array, friction: Array) -> Array:
    q, v, u, _ = _split(block, states)
    K3, K5, _, Kp, _ = block.law
    energy = 0.5 * np.sum(v @ block.M * v, axis=1) + 0.5 * np.sum(q @ block.K * q, axis=1)
    energy += (K3 * u**4 / 4.0 + K5 * u**6 / 6.0) @ block.weights
    if Kp > 0.0:
        energy += (friction**2 / (2.0 * Kp)) @ block.weights
    k, _, m = block.fluid
    n_e, branch = len(block.weights), states[:, 2 * v.shape[1] :]
    if branch.size:
        energy += (0.5 * k * branch[:, :n_e] ** 2) @ block.weights
    if branch.size and m > 0.0:
        energy += (0.5 * m * branch[:, n_e:] ** 2) @ block.weights
    return energy

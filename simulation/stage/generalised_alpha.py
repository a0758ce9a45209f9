"""The stage through time by another integrator than its own: generalised-alpha.

Newmark's formulae with the equation of motion taken between the ends of a step (Chung and Hulbert),
Newton's method on the forces of the channels at the new end. Forces are the gradients of the
contact laws, not discrete gradients, and high modes are damped. It shares the laws with
:mod:`carrierflex.simulation.stage.response` and no step of its method: references that a
simulation shall be compared with come from here. Some forty times slower.

References
----------
.. [1] Chung, Hulbert, "A time integration algorithm for structural dynamics with improved numerical
   dissipation: the generalized-alpha method", Journal of Applied Mechanics 60, 1993.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.contact_laws import mesh_stiffness_at
from carrierflex.simulation.stage.modal_form import ModalStage, modal_stage
from carrierflex.simulation.stage.response import Drive, StageRecord, steps_per_sample
from carrierflex.simulation.stage.roller_contact import roller_load
from carrierflex.simulation.stage.stage_data import GRAVITY
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.statics import NotConvergedError, channel_forces, mesh_amplitudes

Array = NDArray[np.float64]
#: Share of the amplitude that the fastest modes keep a step.
_SPECTRAL_RADIUS = 0.8
#: Force beyond the balance that ends Newton's method, over the largest.
_CONVERGED = 1e-9
_MOST_ITERATIONS = 40
#: Steps of Newton's method are halved from here on.
_HALVED_FROM = 15
#: Difference of the carrier angle that the change of the mesh stiffness is taken over [rad].
_ANGLE_STEP = 1e-6


def run_by_generalised_alpha(
    model: StageModel,
    drive: Drive,
    start: tuple[Array, Array],
    *,
    duration: float,
    sample_rate: float,
    step: float,
    gravity: float = GRAVITY,
) -> StageRecord:
    """Record of a run without energies.

    As :func:`carrierflex.simulation.stage.response.run_stage`.

    Parameters
    ----------
    model : StageModel
        The stage.
    drive : callable
        Loads over time.
    start : tuple of ndarray, shapes (n,)
        Coordinates and rates at time zero.
    duration, sample_rate, step, gravity : float
        Length [s], kept states a second [1/s], longest step [s], [m/s^2].

    Raises
    ------
    ValueError
        Where the step does not resolve the mesh frequency.
    NotConvergedError
        Where the contact forces of a step find no balance.
    """
    every = steps_per_sample(
        model.speed, model.channels.mesh_teeth, sample_rate=sample_rate, step=step
    )
    h = 1.0 / (sample_rate * every)
    stepper = _stepper(modal_stage(model), h, gravity)
    n_kept = round(duration * sample_rate)
    time = np.asarray((1.0 + np.arange(n_kept)) / sample_rate, np.float64)
    loads = drive(np.asarray(np.arange(n_kept * every + 1) * h, np.float64))
    inverse = stepper.stage.Phi.T @ model.M
    state = stepper.begun(inverse @ start[0], inverse @ start[1], loads[0])
    states = []
    for k in range(1, len(loads)):
        state = stepper.step(state, loads[k])
        if k % every == 0:
            states.append((state.q, state.v))
    c = np.array([q for q, _ in states]) @ stepper.stage.Phi.T
    c_rate = np.array([v for _, v in states]) @ stepper.stage.Phi.T
    return StageRecord(time, c, c_rate, drive(time), np.zeros((n_kept, 6)))


@dataclass(frozen=True, eq=False)
class _State:
    """Modal coordinates, rates, accelerations and forces, shapes (n,); channel forces, (m,)."""

    q: Array
    v: Array
    a: Array
    force: Array
    channels: Array


@dataclass(frozen=True, eq=False)
class _Stepper:
    """Constants of a step: `A_inverse` of the modal equation, channels `B` in modes, loads `P`."""

    stage: ModalStage
    h: float
    gravity: float
    alpha_m: float
    alpha_f: float
    gamma: float
    beta: float
    A_inverse: Array
    B: Array
    P: Array

    def begun(self, q: Array, v: Array, load: Array) -> _State:
        """State at rest between the forces at time zero."""
        channels, *_ = self._channel_forces(self.B @ q, self.B @ v)
        force = self._external(self.B[0] @ q, load) + channels @ self.B
        a = force - self.stage.D @ v - self.stage.omega**2 * q
        return _State(q, v, a, force, channels)

    def step(self, old: _State, load: Array) -> _State:
        """State one step later, under the loads of that instant, shape (4,)."""
        h = self.h
        beta = self.beta
        gamma = self.gamma
        end_weight = 1.0 - self.alpha_f
        stiffness, D = self.stage.omega**2, self.stage.D
        # What the step would bring with no acceleration at its end.
        q = old.q + h * old.v + h**2 * (0.5 - beta) * old.a
        v = old.v + h * (1.0 - gamma) * old.a
        angle = float(self.B[0] @ (q + h**2 * beta * old.a))
        external = self._external(angle, load)
        known = (
            self.alpha_f * old.force
            + end_weight * external
            - self.alpha_m * old.a
            - D @ (end_weight * v + self.alpha_f * old.v)
            - stiffness * (end_weight * q + self.alpha_f * old.q)
        )
        free = self.A_inverse @ known
        a, channels = self._balanced(q, v, free, old.channels)
        return _State(
            q + h**2 * beta * a, v + h * gamma * a, a, external + channels @ self.B, channels
        )

    def _balanced(self, q: Array, v: Array, free: Array, guess: Array) -> tuple[Array, Array]:
        """Acceleration and channel forces at the end of the step, by Newton's method."""
        h = self.h
        beta = self.beta
        gamma = self.gamma
        answer = (1.0 - self.alpha_f) * self.A_inverse @ self.B.T
        W = self.B @ answer
        moved, fast = self.B @ (q + h**2 * beta * free), self.B @ (v + h * gamma * free)
        force, unit = guess, np.eye(len(guess))
        for iteration in range(_MOST_ITERATIONS):
            delta = moved + h**2 * beta * (W @ force)
            rate = fast + h * gamma * (W @ force)
            wanted, by_motion, by_rate = self._channel_forces(delta, rate)
            residual = force - wanted
            if np.abs(residual).max() <= _CONVERGED * np.abs(force).max():
                return free + answer @ force, force
            jacobian = unit - (h**2 * beta * by_motion + h * gamma * by_rate) @ W
            change = np.linalg.solve(jacobian, residual)
            force = force - (0.5 if iteration >= _HALVED_FROM else 1.0) * change
        raise NotConvergedError(
            f"contact forces of a step of {h:.3g} s leave {np.abs(residual).max():.2g} N after "
            f"{_MOST_ITERATIONS} iterations"
        )

    def _channel_forces(self, moved: Array, rate: Array) -> tuple[Array, Array, Array]:
        """Forces beyond the linear part of channels that `moved`, and tangents by motion and rate.

        Those of statics, the mount's damping, and the torques of passing teeth and rollers.
        """
        model = self.stage.model
        channels, angle = model.channels, float(moved[0])
        delta = moved - channels.free
        real, imag = mesh_amplitudes(channels)
        k, ahead = (
            mesh_stiffness_at(real, imag, channels.mesh_teeth * turned)
            for turned in (angle, angle + _ANGLE_STEP)
        )
        force, tangent = channel_forces(channels, delta, angle, k)
        by_rate = np.zeros_like(tangent)
        turning, R = channels.turning, channels.turned(angle)
        damping = R.T @ channels.C_fixed @ R
        by_rate[turning, turning] = channels.C_mean - damping
        tangent[turning, turning] -= model.speed * damping @ channels.quarter_turn
        force[turning] = (
            tangent[turning, turning] @ delta[turning] + by_rate[turning, turning] @ rate[turning]
        )
        squares = np.maximum(delta[channels.meshes] - channels.gaps, 0.0) ** 2
        force[0] = -0.5 * channels.of_flanks((ahead - k) / _ANGLE_STEP) @ squares
        load, unused = np.zeros(4), np.zeros((4, 4))
        for b in range(len(channels.rollers.directions)):
            rolling = slice(channels.rolling.start + 4 * b, channels.rolling.start + 4 * b + 4)
            force[0] -= roller_load(channels.rollers, b, delta[rolling], angle, load, unused)[0]
        return force, tangent, by_rate

    def _external(self, angle: float, load: Array) -> Array:
        """Modal forces of torque, generator, weight, radial load and constants, shape (n,)."""
        c, s = np.cos(angle), np.sin(angle)
        torque, wanted, y, z = load
        constant = self.stage.model.data.chain.generator_constant
        weight = -self.gravity * np.array([s, c])
        factors = np.array([torque, constant * wanted, *weight, c * y + s * z, c * z - s * y, 1.0])
        return np.asarray(factors @ self.P)


def _stepper(stage: ModalStage, h: float, gravity: float) -> _Stepper:
    rho, loads = _SPECTRAL_RADIUS, stage.model.loads
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (1.0 - alpha_m + alpha_f) ** 2
    A = (1.0 - alpha_f) * (gamma * h * stage.D + beta * h**2 * np.diag(stage.omega**2))
    A += (1.0 - alpha_m) * np.eye(len(A))
    scale = 1.0 / np.sqrt(A.diagonal())
    A_inverse = scale[:, None] * np.linalg.inv(A * np.outer(scale, scale)) * scale
    vectors = [loads.torque, loads.generator, loads.weight_y, loads.weight_z]
    vectors += [loads.radial_y, loads.radial_z, loads.constant]
    B = stage.model.channels.B.T @ stage.Phi
    P = np.array(vectors) @ stage.Phi
    return _Stepper(stage, h, gravity, alpha_m, alpha_f, gamma, beta, A_inverse, B, P)

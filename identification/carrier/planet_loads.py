"""Torque, rotor moment and pin loads from proximity sensors, with what they cannot see as interval.

A linear Gaussian inverse problem over the carrier angle: the readings are ``y = A(k) f + rest +
errors`` with the forces f on the rotating body and the recovery rows A of a pin fit k. Prior of f,
of the rigid motion and of the pin loads is an ensemble of stages in equilibrium; pin fit and
elasticity of the body are summed over a grid by their evidence.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage.hidden_stages import (
    HIDDEN,
    TURN_ANGLES,
    Bodies,
    StageEnsemble,
    reading_per_force,
)
from carrierflex.simulation.stage.stage_body import StageBody

Array = NDArray[np.float64]

#: Grid of pin fit and elasticity.
_GRID = (8, 5)
#: Orders that are fitted to a record: those of the loads and the planets' second and fourth.
_HIGHEST_ORDER = 12
#: Share of the stages that counts in the second pass, those of the nearest loads most.
_NEAREST = 0.25
#: Differences of torque and moment that count alike in that distance [N m]: with the torque changes
#: which clearances are closed.
_ALIKE = np.array([25e3, 80e3, 80e3])
#: Bodies of less than this share of the evidence are left out.
_NEGLIGIBLE = 0.02
#: Share of a stage's weight in its own prediction that is taken out: all, but for rounding.
_LARGEST_LEVERAGE = 1.0 - 1e-9
#: Carrier angles of a turn [rad].
TURN: Array = 2.0 * np.pi * np.arange(TURN_ANGLES) / TURN_ANGLES


@dataclass(frozen=True)
class ReadingErrors:
    """Standard deviations of what lies between the stage's motion and a reading; all are chosen."""

    zero: float = 1e-3
    """Of each sensor, the same in all runs [m]: it is hardly known."""
    bracket: float = 20e-6
    """Motion of each sensor's bracket and housing under load, in each run [m]."""
    saddle: float = 100e-6
    """Saddle of the housing's flange in each run [m]; 20 to 190 um in the 2012 paper's table 4."""
    face_tilt: float = 250e-6
    """Order 1 of the measured face at the sensors [m]."""
    radial_runout: float = 50e-6
    """Order 1 of the radial target [m]."""
    waves: float = 10e-6
    """Order n of face and target over ``1 / n^2`` [m]: 2.5 um at order 2, 1.1 at order 3."""
    gain: float = 0.01
    """Of each sensor."""
    angle: float = float(np.deg2rad(0.5))
    """Place of each sensor [rad]."""
    model: float = 1e-6
    """What statics and a mesh leave, at each sensor and angle [m]."""

    def additive(self, sensors: Sequence[Sensor], n_turns: int, theta: Array = TURN) -> Array:
        """Errors of one standard deviation that do not depend on the readings.

        Parameters
        ----------
        sensors : sequence of Sensor
            Sensors.
        n_turns : int
            Turns, of as many runs.
        theta : ndarray, shape (n_angles,)
            Carrier angles [rad].

        Returns
        -------
        ndarray, shape (n_turns * n_sensors * n_angles, n_errors)
            A column an error [m].
        """
        shape = (n_turns, len(sensors), len(theta))
        columns = []
        for s in range(len(sensors)):
            columns.append(np.zeros(shape))
            columns[-1][:, s] = self.zero
            for turn in range(n_turns):
                columns.append(np.zeros(shape))
                columns[-1][turn, s] = self.bracket
        for axial, first in ((True, self.face_tilt), (False, self.radial_runout)):
            for order in range(1, 7):
                size = first if order == 1 else self.waves / order**2
                for wave in (np.cos, np.sin):
                    columns.append(np.zeros(shape))
                    for s, sensor in enumerate(sensors):
                        if (sensor.quantity == AXIAL) == axial:
                            columns[-1][:, s] = size * wave(order * (sensor.angle - theta))
        for turn in range(n_turns):
            for wave in (np.cos, np.sin):
                columns.append(np.zeros(shape))
                for s, sensor in enumerate(sensors):
                    if sensor.quantity == AXIAL:
                        columns[-1][turn, s] = self.saddle * wave(2.0 * sensor.angle)
        return np.array([column.ravel() for column in columns]).T

    def proportional(self, readings: Array) -> Array:
        """Errors of gain and place, from what the sensors read, (n_turns, n_sensors, n_angles).

        A wave fixed to the carrier moves by ``-dy/dtheta`` where its sensor stands further on.
        """
        columns = []
        orders = np.arange(readings.shape[-1] // 2 + 1)
        orders[-1] = 0  # half of order 6 has no slope
        for s in range(readings.shape[1]):
            mine = readings[:, s]
            slope = np.fft.irfft(1j * orders * np.fft.rfft(mine, axis=-1), mine.shape[-1], axis=-1)
            for column in (self.gain * (mine - mine.mean()), -self.angle * slope):
                columns.append(np.zeros(readings.shape))
                columns[-1][:, s] = column
        return np.array([column.ravel() for column in columns]).T

    def covariance(self, sensors: Sequence[Sensor], readings: Array, noise: Array) -> Array:
        """Covariance of all errors of the readings of some turns, flattened [m^2].

        Parameters
        ----------
        sensors : sequence of Sensor
            Sensors.
        readings : ndarray, shape (n_turns, n_sensors, n_angles)
            Measured turns [m].
        noise : ndarray, shape (n_turns, n_sensors, n_angles, n_angles)
            Covariance of each measured turn [m^2].
        """
        E = np.hstack([self.additive(sensors, len(readings)), self.proportional(readings)])
        of_noise = scipy.linalg.block_diag(*noise.reshape(-1, TURN_ANGLES, TURN_ANGLES))
        return np.asarray(E @ E.T + of_noise + self.model**2 * np.eye(len(E)))


@dataclass(frozen=True, eq=False)
class MeasuredTurn:
    """A record as one turn at equal carrier angles.

    Parameters
    ----------
    readings : ndarray, shape (n_sensors, n_angles)
        Sum of the fitted orders [m].
    noise : ndarray, shape (n_sensors, n_angles, n_angles)
        Its covariance [m^2].
    """

    readings: Array
    noise: Array


def measured_turn(run: Run, names: Sequence[str]) -> MeasuredTurn:
    """Least-squares fit of the carrier's orders to a record.

    Parameters
    ----------
    run : Run
        Record with a carrier angle.
    names : sequence of str
        Channels.

    Raises
    ------
    ValueError
        Where the record holds less than one revolution, or too few samples of a channel.
    """
    angle = run.inputs["carrier_angle"]
    turns = float(np.ptp(angle)) / (2.0 * np.pi)
    if turns < 1.0:
        raise ValueError(
            f"run {run.name} holds {turns:.2g} revolutions of the carrier; expected one or more"
        )
    X, at = _orders(angle), _orders(TURN)
    readings, noise = [], []
    for name in names:
        signal = run.signals[name]
        good = np.isfinite(signal)
        if good.sum() < 2 * X.shape[1]:
            raise ValueError(
                f"run {run.name}: channel '{name}' holds {int(good.sum())} samples; expected "
                f"{2 * X.shape[1]} or more"
            )
        a, *_ = np.linalg.lstsq(X[good], signal[good], rcond=None)
        gap = signal[good] - X[good] @ a
        variance = gap @ gap / (good.sum() - X.shape[1])
        readings.append(at @ a)
        noise.append(variance * at @ np.linalg.pinv(X[good].T @ X[good]) @ at.T)
    return MeasuredTurn(np.array(readings), np.array(noise))


def _orders(angle: Array) -> Array:
    """Columns 1, cos, sin of the carrier angle's orders."""
    phase = np.outer(angle, np.arange(1, _HIGHEST_ORDER + 1))
    return np.hstack([np.ones((len(angle), 1)), np.cos(phase), np.sin(phase)])


@dataclass(frozen=True, eq=False)
class LoadEstimate:
    """Loads of a run with their standard deviations, and how well a stage explains its readings.

    Parameters
    ----------
    load, load_std : ndarray, shape (3,)
        Torque, rotor moment about y and z [N m].
    sharing, sharing_std : float
        Largest share of the tangential pin forces over a turn times the number of planets.
    pins, pins_std : ndarray, shape (n_planets, 4, n_angles)
        Loads of the pins.
    pin_fit : float
        Bending stiffness of a pin interface, its mean by evidence [N m/rad].
    misfit : float
        RMS of the readings' deviation from the best body's ensemble, in its standard deviations;
        about 1 where a stage of the ensemble could have made them.
    """

    load: Array
    load_std: Array
    sharing: float
    sharing_std: float
    pins: Array
    pins_std: Array
    pin_fit: float
    misfit: float

    @property
    def half_width(self) -> Array:
        """Half widths of the 95 % intervals of the pin loads, shape of `pins`."""
        return NORMAL_95 * self.pins_std

    @property
    def sharing_half_width(self) -> float:
        """Half width of the 95 % interval of the load sharing factor."""
        return NORMAL_95 * self.sharing_std

    @property
    def load_half_width(self) -> Array:
        """Half widths of the 95 % intervals of torque and rotor moment [N m], shape (3,)."""
        return NORMAL_95 * self.load_std


@dataclass(frozen=True, eq=False)
class _Candidate:
    """One pin fit and elasticity: recovery rows, mean and covariances of all stages' readings."""

    pin_fit: float
    A: Array
    y: Array
    C_yy: Array
    C_qy: Array


@dataclass(frozen=True, eq=False)
class LoadInference:
    """The ensemble, ready to be conditioned on readings.

    Parameters
    ----------
    ensemble : StageEnsemble
        Stages.
    turns : slice
        Turns whose readings are given: the known run's, or those of the known and another.
    q : ndarray, shape (N, m)
        Torque, moments, sharing factor and pin loads of every stage.
    candidates : tuple
        One a pin fit and elasticity.
    """

    ensemble: StageEnsemble
    turns: slice
    q: Array
    candidates: tuple[_Candidate, ...]

    def readings(self, A: Array) -> Array:
        """Readings of all stages with one body, shape (N, n_readings) [m]."""
        return self.ensemble.readings(A)[:, self.turns].reshape(len(self.q), -1)


def load_inference(
    ensemble: StageEnsemble,
    bodies: Sequence[tuple[float, StageBody]],
    sensors: Sequence[Sensor],
    *,
    of_known: bool = False,
) -> LoadInference:
    """Prepare the ensemble for the pair of the known run and another.

    Parameters
    ----------
    ensemble : StageEnsemble
        Drawn stages, with their turned copies where there are any.
    bodies : sequence of (float, StageBody)
        Pin fit and body of every candidate, as :func:`candidate_bodies` or a single one.
    sensors : sequence of Sensor
        Sensors of the ensemble.
    of_known : bool
        For the known run itself: its readings alone, and its pin loads.
    """
    wanted = 0 if of_known else 1
    pins = ensemble.pins[:, wanted]
    tangential = pins[:, :, 0]
    share = (tangential / tangential.sum(axis=1, keepdims=True)).max(axis=(1, 2))
    q = np.column_stack(
        [ensemble.loads[:, wanted], share * pins.shape[1], pins.reshape(len(pins), -1)]
    )
    inference = LoadInference(ensemble, slice(0, 1 + wanted), q, ())
    candidates = []
    for pin_fit, body in bodies:
        A = reading_per_force(body, sensors, TURN_ANGLES)
        Y = inference.readings(A)
        y = Y.mean(axis=0)
        C_yy, C_qy = (Y - y).T @ (Y - y) / len(q), (q - q.mean(axis=0)).T @ (Y - y) / len(q)
        candidates.append(_Candidate(pin_fit, A, y, C_yy, C_qy))
    return replace(inference, candidates=tuple(candidates))


def candidate_bodies(bodies: Bodies) -> tuple[tuple[float, StageBody], ...]:
    """Pin fit and body over the grid of pin fits and elasticities."""
    fit, elasticity = HIDDEN["pin_fit"], HIDDEN["elasticity"]
    return tuple(
        (fit.at(a), bodies.body(fit.at(a), elasticity.at(b)))
        for a in np.linspace(0.0, 1.0, _GRID[0])
        for b in np.linspace(0.0, 1.0, _GRID[1])
    )


def inferred_loads(inference: LoadInference, readings: Array, R: Array) -> LoadEstimate:
    """Condition the ensemble on readings: ``q + C_qy (C_yy + R)^-1 (y - mean)``.

    First all stages and bodies alike, which gives the loads roughly and the evidence of every body;
    then, for the bodies with evidence, the stages of loads near those, the nearest most. The
    variance is that of left-out stages' errors, ``e_j / (1 - h_j)``, and ``K R K^T`` of the
    readings' errors.

    Parameters
    ----------
    inference : LoadInference
        From :func:`load_inference`.
    readings : ndarray, shape (n_turns, n_sensors, n_angles)
        The known run and another, or the known run alone [m].
    R : ndarray
        Covariance of their errors, :meth:`ReadingErrors.covariance`.
    """
    y, q = readings.ravel(), inference.q
    logs, rough, chi = [], [], []
    for candidate in inference.candidates:
        factor = scipy.linalg.cho_factor(candidate.C_yy + R, lower=True)
        gap = y - candidate.y
        answer = scipy.linalg.cho_solve(factor, gap)
        logs.append(-0.5 * gap @ answer - np.log(np.diag(factor[0])).sum())
        rough.append(q[:, :3].mean(axis=0) + candidate.C_qy[:3] @ answer)
        chi.append(gap @ answer / len(y))
    weight = np.exp(np.array(logs) - max(logs))
    weight /= weight.sum()
    loads = weight @ np.array(rough)
    best = [k for k in np.argsort(-weight) if weight[k] >= _NEGLIGIBLE]
    near = _nearness(inference, best[0], loads, R)
    means, variances = [], []
    for k in best:
        Y = inference.readings(inference.candidates[k].A)
        mean, variance = _conditioned(Y, q, near, y, R, inference.ensemble.n_copies)
        means.append(mean)
        variances.append(variance)
    share = weight[best] / weight[best].sum()
    mean = share @ np.array(means)
    variance = share @ (np.array(variances) + (np.array(means) - mean) ** 2)
    std = np.sqrt(variance)
    fits = np.array([candidate.pin_fit for candidate in inference.candidates])
    return LoadEstimate(
        mean[:3],
        std[:3],
        float(mean[3]),
        float(std[3]),
        mean[4:].reshape(inference.ensemble.pins.shape[2:]),
        std[4:].reshape(inference.ensemble.pins.shape[2:]),
        float(np.exp(weight @ np.log(fits))),
        float(np.sqrt(chi[best[0]])),
    )


def _nearness(inference: LoadInference, k: int, loads: Array, R: Array) -> Array:
    """Weight of every stage by the distance of its loads, as readings would show them."""
    candidate, q = inference.candidates[k], inference.q
    gain = scipy.linalg.solve(candidate.C_yy + R, candidate.C_qy[:3].T, assume_a="pos")
    shown = q[:, :3].mean(axis=0) + (inference.readings(candidate.A) - candidate.y) @ gain
    distance = (((shown - loads) / _ALIKE) ** 2).sum(axis=1)
    reach = np.quantile(distance, _NEAREST)
    weight = np.maximum(1.0 - distance / (reach * (1.0 + 1e-9) + 1e-30), 0.0)
    return np.asarray(weight / weight.sum())


def _conditioned(
    Y: Array, q: Array, weight: Array, y: Array, R: Array, n_copies: int
) -> tuple[Array, Array]:
    """Mean and variance of q given y, of weighted stages; a stage is left out with its copies."""
    Y_mean, q_mean = weight @ Y, weight @ q
    dY, dq = Y - Y_mean, q - q_mean
    inverse = np.linalg.inv((dY.T * weight) @ dY + R)
    K = (dq.T * weight) @ dY @ inverse
    whitened = dY @ np.linalg.cholesky(inverse)
    # Copies of a stage side by side: shape (stages, copies, ...).
    w, of, gap = (
        a.reshape(n_copies, -1, *a.shape[1:]).swapaxes(0, 1)
        for a in (weight, whitened, dq - dY @ K.T)
    )
    H = w[:, None, :] * (1.0 + of @ of.swapaxes(1, 2))
    error = np.linalg.solve(np.eye(n_copies) - _LARGEST_LEVERAGE * H, gap)
    variance = np.einsum("jk,jkm->m", w, error**2)
    variance = variance + np.einsum("ij,jk,ik->i", K, R, K, optimize=True)
    return q_mean + K @ (y - Y_mean), variance

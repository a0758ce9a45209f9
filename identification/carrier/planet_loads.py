"""Torque, rotor moment and pin loads from proximity sensors, with what they cannot see as interval.

A nonlinear inverse problem, ``y = h(z) + errors``, with the hidden quantities of a stage and its
load as standard normal numbers z. Two methods in turn: an ensemble smoother with multiple data
assimilation leads drawn stages to the readings (Emerick and Reynolds 2013, *Computers &
Geosciences* 55), whatever clearances open and close on the way; statistical linearisation about
them gives mean and variance (Garcia-Fernandez et al. 2015, *IEEE Trans. Signal Process.* 63).
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage.hidden_stages import HEAD, PIN_LOADS, TURN_ANGLES, StagePair

Array = NDArray[np.float64]

#: Orders that are fitted to a record: those of the loads and the planets' second and fourth.
_HIGHEST_ORDER = 12
#: Passes of drawn stages, and factors of the errors' covariance in those that move them.
_PASSES, _TEMPERINGS = 8, (30.0, 10.0, 5.0, 3.0, 3.0)
#: Times that all passes are made, until a stage comes as near the readings as this.
_ENSEMBLES, _GOOD_MISFIT = 3, 1.5
#: Largest of the normal numbers that a stage is solved for.
_LARGEST = 4.0
#: Stages sent in one piece of work.
_PIECE = 16
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
        Bending stiffness of a pin interface, the mean of its logarithm [N m/rad].
    misfit : float
        RMS of the readings' deviation from the nearest stage, in standard deviations of their
        errors, ranges counted; about 1 where a stage could have made them. Standard deviations
        hold it as a factor.
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


class _UnstableError(ValueError):
    """Half of the stages of a pass reach no equilibrium."""


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Stages of a pass, a row each: normal numbers, readings, loads."""

    z: Array
    y: Array
    q: Array


@dataclass(frozen=True, eq=False)
class _Answer:
    """Loads by a linear fit to some stages, and the stages' misfits: the least, the median."""

    mean: Array
    variance: Array
    misfit: float
    median_misfit: float


def inferred_loads(
    forward: StagePair,
    readings: Array,
    R: Array,
    *,
    n_draws: int,
    rng: np.random.Generator,
    executor: Executor,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> LoadEstimate:
    """Loads given the readings, by eight passes of drawn stages, up to three times.

    The first pass draws within the ranges. In each of five more every stage moves by
    ``C_zy (C_yy + a R)^-1 (y + sqrt(a) e - h(z))``, where ``sum 1/a = 1`` and e is an error of
    covariance R. In the last two stages are drawn from the normal distribution so reached, and a
    linear fit to them, its deviations added to R, gives the next. The one of the two counts whose
    stages come nearer the readings: where a contact opens between them a linear fit leads away.
    Stages that end far from the readings are in another state of contact, and all passes begin
    anew. Standard deviations are multiplied by the misfit where it is above 1.

    Parameters
    ----------
    forward : StagePair
        Readings and loads of a stage.
    readings : ndarray, shape (n_turns, n_sensors, n_angles)
        The known run and another, or the known run alone [m].
    R : ndarray
        Covariance of their errors, :meth:`ReadingErrors.covariance`.
    n_draws : int
        Stages of all passes, each time.
    rng : numpy.random.Generator
        Source of the draws.
    executor : concurrent.futures.Executor
        Where stages are solved; the answer does not depend on it.
    note : callable
        Told the number of stages that are done, and their share.

    Raises
    ------
    ValueError
        Where no attempt ends: half of the stages of a pass or more reach no equilibrium, or they
        run away from the readings.
    """
    y, n = readings.ravel(), n_draws // _PASSES
    done = 0

    def solved(Z: Array) -> _Drawn:
        nonlocal done
        Z = np.clip(Z, -_LARGEST, _LARGEST)
        pieces = [Z[first : first + _PIECE] for first in range(0, len(Z), _PIECE)]
        rows = []
        for piece, answers in zip(pieces, executor.map(forward.each, pieces), strict=True):
            rows += [(z, *a) for z, a in zip(piece, answers, strict=True) if a is not None]
            done += len(piece)
            note(f"{done} stages", done / (_ENSEMBLES * _PASSES * n))
        if 2 * len(rows) <= len(Z):
            raise _UnstableError(
                f"{len(Z) - len(rows)} of {len(Z)} drawn stages reach no static equilibrium; "
                "expected fewer than half: check the body with carrierflex certificate"
            )
        return _Drawn(*(np.array(column) for column in zip(*rows, strict=True)))

    answers: list[_Answer] = []
    failure = ValueError(
        f"the drawn stages come nowhere near the readings in {_ENSEMBLES} attempts; expected "
        "readings of the body's own stage: check sensors and --known-torque"
    )

    def ensemble() -> None:
        drawn = solved(rng.standard_normal((n, forward.n_unknowns)))
        for tempering in _TEMPERINGS:
            lead = _moved(drawn, y, R, tempering, rng)
            # Stages that were left out are replaced by their neighbours' mixture.
            missing = n - len(lead)
            extra = rng.multivariate_normal(lead.mean(axis=0), np.cov(lead.T), missing)
            drawn = solved(np.vstack([lead, extra]))
        m, P = drawn.z.mean(axis=0), np.cov(drawn.z.T)
        for _ in range(_PASSES - 1 - len(_TEMPERINGS)):
            half = rng.multivariate_normal(np.zeros(len(m)), P, n // 2)
            drawn = solved(np.vstack([m + half, m - half]))
            m, P, mean, variance = _conditioned(drawn, y, R)
            misfits = _misfits(drawn, y, R)
            answers.append(_Answer(mean, variance, misfits.min(), float(np.median(misfits))))

    for _ in range(_ENSEMBLES):
        try:
            ensemble()
        except _UnstableError as error:
            failure = error
        except np.linalg.LinAlgError:
            pass  # stages that run away leave a covariance without inverse
        best = min(answers, key=lambda answer: answer.median_misfit, default=None)
        if best is not None and best.misfit <= _GOOD_MISFIT:
            break
    if best is None:
        raise failure
    mean, std = best.mean, max(1.0, best.misfit) * np.sqrt(best.variance)
    n_head = len(HEAD)
    shape = (-1, len(PIN_LOADS), TURN_ANGLES)
    return LoadEstimate(
        mean[:3],
        std[:3],
        float(mean[3]),
        float(std[3]),
        mean[n_head:].reshape(shape),
        std[n_head:].reshape(shape),
        float(np.exp(mean[4])),
        best.misfit,
    )


def _misfits(drawn: _Drawn, y: Array, R: Array) -> Array:
    """RMS deviation of the readings from each stage, in standard deviations, ranges counted."""
    gap = y - drawn.y
    cost = np.einsum("ij,ji->i", gap, np.linalg.solve(R, gap.T)) + (drawn.z**2).sum(axis=1)
    return np.sqrt(cost / len(y))


def _moved(drawn: _Drawn, y: Array, R: Array, tempering: float, rng: np.random.Generator) -> Array:
    """Stages moved towards the readings, each with errors drawn anew."""
    dz, dy = drawn.z - drawn.z.mean(axis=0), drawn.y - drawn.y.mean(axis=0)
    S = dy.T @ dy / (len(dy) - 1) + tempering * R
    errors = rng.multivariate_normal(np.zeros(len(y)), tempering * R, len(dy), method="cholesky")
    answer = scipy.linalg.solve(S, (y + errors - drawn.y).T, assume_a="pos")
    return np.asarray(drawn.z + (dz.T @ dy / (len(dy) - 1) @ answer).T)


def _conditioned(drawn: _Drawn, y: Array, R: Array) -> tuple[Array, Array, Array, Array]:
    """Mean and covariance of z, mean and variance of the loads, by a linear fit to the stages.

    With ``h = A z + b + e`` and ``q = C z + d + f`` of the fit and z standard normal.
    """
    n = drawn.z.shape[1]
    X = np.column_stack([drawn.z, np.ones(len(drawn.z))])
    V = np.hstack([drawn.y, drawn.q])
    fit, *_ = np.linalg.lstsq(X, V, rcond=None)
    deviations = V - X @ fit
    covariance = deviations.T @ deviations / max(len(X) - n - 1, 1)
    m, slope, offset = len(y), fit[:n].T, fit[n]
    A, C = slope[:m], slope[m:]
    # Prior covariance of z, loads with readings, less what the readings tell.
    S = A @ A.T + covariance[:m, :m] + R
    gain = scipy.linalg.solve(S, np.vstack([A.T, C @ A.T + covariance[m:, :m]]).T, assume_a="pos").T
    K, L = gain[:n], gain[n:]
    gap = y - offset[:m]
    P = np.eye(n) - K @ A
    of_loads = (C**2).sum(axis=1) + np.diag(covariance)[m:]
    variance = of_loads - np.einsum("ij,ij->i", L, C @ A.T + covariance[m:, :m])
    return K @ gap, 0.5 * (P + P.T), offset[m:] + L @ gap, np.maximum(variance, 0.0)

"""Hypotheses on tables 4 and 5 of the 2012 paper, their priors, likelihood and nested samples.

:mod:`carrierflex.workflows.papers.explain_gap` runs them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, ndtr, ndtri

from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.carrier.models import flexible_model
from carrierflex.identification.carrier.printed_tables import (
    FULL_TORQUE,
    LOAD_CASES,
    SENSOR_RADIUS,
    TABLE_4,
    derived_facts,
)
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage.condensed_stage import CondensedStage, Supports, condensed_stage
from carrierflex.simulation.stage.part_loads import PartLoads
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.simulation.study_order_one import SENSORS

#: Rotor moment that is called extreme [N m].
EXTREME_MOMENT = 300e3


@dataclass(frozen=True)
class MeasuredSharing:
    """Published figures of the gearbox family, with clearances and with preloaded bearings."""

    no_moment: float = 1.08
    """Guo and Keller, AGMA Fall Technical Meeting 2020: factor without rotor moment."""
    extreme_moment: float = 1.16
    """The same under extreme rotor moment."""
    preloaded: float = 1.10
    """The same: upper limit of the gearbox with preloaded bearings in all conditions."""
    upwind_row: float = 1.46
    """Keller, Guo, Zhang and Lucas, Wind Energy Science 3, 2018: most loaded upwind row of a
    planet over its expectation, pure torque."""


MEASURED = MeasuredSharing()

#: The four axial sensors, then the two radial ones, which neither model of the paper uses.
ALL_SENSORS = (
    *SENSORS,
    *(Sensor(f"r{deg:03d}", RADIAL, float(np.deg2rad(deg)), SENSOR_RADIUS) for deg in (40, 310)),
)
#: Loads of the paper's table 2, in its order.
LOADS = tuple(SteadyLoad(share * FULL_TORQUE, ntl_z=force) for share, force in LOAD_CASES.values())
#: What is compared: order 1 in LC1, LC2 and LC4 from table 5, what model 2 leaves in LC1 to LC4
#: from table 4 [m], and the load sharing factor without rotor moment.
NAMES = (
    "order 1, LC1",
    "order 1, LC2",
    "order 1, LC4",
    "M2 leaves, LC1",
    "M2 leaves, LC2",
    "M2 leaves, LC3",
    "M2 leaves, LC4",
    "load sharing",
)
_AMPLITUDES, _SHARING = slice(0, 3), 7
PUBLISHED = np.array(
    [
        *(phi.value * SENSOR_RADIUS for phi in derived_facts().phi_PLC.values()),
        *(model_2 for _, model_2 in TABLE_4.values()),
        MEASURED.no_moment,
    ]
)
#: Standard errors, stated nowhere: of the amplitudes [m] (three choices), of what model 2 leaves
#: [m], of the load sharing factor. Noise of a sensor [m].
AMPLITUDE_ERRORS = (3e-6, 6e-6, 15e-6)
SAMPLED_ERROR = 6e-6
RMS_ERROR, SHARING_ERROR, NOISE = 4e-6, 0.04, 5e-6
#: Steps of a random walk to a new point of the sampler.
_WALKS = 15
#: Widths of all priors over those of the table.
WIDTHS = (0.5, 1.0, 2.0)
#: Spread of one quantity between the windows of tables 4 and 5: LC2 is simulated with 0.085 mm,
#: fitted with 0.094.
WINDOW_SPREAD = 0.1
#: Errors of the data whose evidence is computed: of the amplitudes [m], spread of the windows.
CHOICES = (*((error, 0.0) for error in AMPLITUDE_ERRORS), (SAMPLED_ERROR, WINDOW_SPREAD))


@dataclass(frozen=True)
class Prior:
    """Normal distribution of a parameter, of its size or of its logarithm to base 10.

    The kind ``angle`` is any angle alike, ``range`` any value up to the deviation from the middle.
    """

    kind: str
    middle: float = 0.0
    deviation: float = 0.0

    def value(self, share: float, width: float) -> float:
        """Value below which the share of the distribution lies."""
        if self.kind == "angle":
            return 2.0 * np.pi * share
        # Of a size from the far tail: 0.5 + 0.5 share would round to 1, an infinite size.
        z = -ndtri(0.5 - 0.5 * share) if self.kind == "size" else ndtri(share)
        return self.at(float(z), width)

    def at(self, z: float, width: float) -> float:
        """Value so many standard deviations from the middle; an angle is its value."""
        if self.kind == "angle":
            return z % (2.0 * np.pi)
        if self.kind == "range":
            z = 2.0 * float(ndtr(z)) - 1.0
        value = self.middle + width * self.deviation * z
        if self.kind == "logarithm":
            return float(10.0**value)
        return abs(value) if self.kind == "size" else value

    def deviations(self, value: float) -> float:
        """Standard deviations of a value from the middle."""
        if self.kind == "angle":
            return value
        distance = np.log10(value) if self.kind == "logarithm" else value
        z = (distance - self.middle) / self.deviation
        return float(ndtri(np.clip(0.5 + 0.5 * z, 1e-9, 1.0 - 1e-9)) if self.kind == "range" else z)


#: Priors. Kink and face share one: neither has a source, and the paper's model reads 0.58 mrad.
_TILT, _ANGLE = Prior("size", 0.0, 1e-3), Prior("angle")
TILTED_FACE = {"phi_face": _TILT, "theta_face": _ANGLE}
TILTED_CARRIER = {"phi_PLC": _TILT, "theta_PLC": _ANGLE}
SUN = {
    "sun_radial": Prior("logarithm", 8.0, 0.7),
    "sun_friction": Prior("logarithm", -1.05, 0.2),
    "pin_offset": Prior("value", 0.0, 10e-6),
}
FLOATING = {"pin_offset": SUN["pin_offset"]}
BEARINGS = {
    "upwind_radial": Prior("logarithm", 9.5, 0.4),
    "downwind_radial": Prior("logarithm", 9.5, 0.4),
    "clearance": Prior("value", 1.0, 0.25),
}
MOUNTING = {
    "x": Prior("value", 0.1, 0.2),
    "axial_stiffness": Prior("logarithm", 6.3, 0.4),
    "tilt_stiffness": Prior("logarithm", 5.0, 0.7),
}
SADDLE = {name: Prior("value", 0.0, 100e-6) for name in ("at_rest", "by_torque", "by_load")}
#: "One order of magnitude smaller" than the carrier's 42 um (2012 paper, section 3.1).
HOUSING = {name: Prior("range", 0.0, 4e-6) for name in ("by_torque", "by_load")}
ZERO = {"at_rest": Prior("value", 0.0, 50e-6)}


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Causes with the priors of what is free in them.

    Parameters
    ----------
    name : str
        Word of the tables and files.
    priors : mapping of str to Prior
        Fields of :class:`Supports`; ``phi_face`` [rad]; saddle ``at_rest``, ``by_torque`` at full
        torque and ``by_load`` at 200 kN [m].
    fixed : Supports
        The rest of the stage.
    ground : bool
        Sensors stand on the ground.
    table_5 : str
        What the amplitudes of table 5 are of: the mean of ``four`` sensors, ``one`` of them, or the
        ``turning`` tilt of model 1.
    """

    name: str
    priors: Mapping[str, Prior]
    fixed: Supports = field(default_factory=Supports)
    ground: bool = False
    table_5: str = "four"

    def values(self, point: NDArray[np.float64], width: float) -> dict[str, float]:
        """Values at a point of the unit cube."""
        values = {
            name: prior.value(float(share), width)
            for share, (name, prior) in zip(point, self.priors.items(), strict=True)
        }
        return self._checked(values)

    def values_at(self, z: NDArray[np.float64], width: float) -> dict[str, float]:
        """Values so many standard deviations from the middle; an angle is its value."""
        return self._checked(
            {
                name: prior.at(float(at), width)
                for at, (name, prior) in zip(z, self.priors.items(), strict=True)
            }
        )

    @staticmethod
    def _checked(values: dict[str, float]) -> dict[str, float]:
        """Values with a clearance of no sign."""
        if "clearance" in values:
            values["clearance"] = abs(values["clearance"])
        return values

    def supports(self, values: Mapping[str, float]) -> Supports:
        """Supports with these values."""
        names = {entry.name for entry in fields(Supports)}
        changes: dict[str, Any] = {name: v for name, v in values.items() if name in names}
        return replace(self.fixed, **changes)


_SUN_AND_SADDLE = {**SUN, **SADDLE}
_KINK = {**TILTED_CARRIER, **BEARINGS, **MOUNTING}
_TIGHT = Supports(clearance=0.0)
FACE, GROUND, KINK = "tilted face", "sensors on the ground", "kink"
#: One or two a cause of order 1, then other supports of a kink, origins of the saddle, what table 5
#: is of.
HYPOTHESES = (
    Hypothesis(FACE, {**TILTED_FACE, **_SUN_AND_SADDLE}),
    Hypothesis("tilted face, sun floating", {**TILTED_FACE, **FLOATING, **SADDLE}),
    Hypothesis(GROUND, {**TILTED_CARRIER, **_SUN_AND_SADDLE}, ground=True),
    Hypothesis(KINK, {**_KINK, **_SUN_AND_SADDLE}),
    Hypothesis("kink, tight bearings", {**TILTED_CARRIER, **MOUNTING, **_SUN_AND_SADDLE}, _TIGHT),
    Hypothesis("kink, sun floating", {**_KINK, **FLOATING, **SADDLE}),
    Hypothesis("kink, no saddle", {**_KINK, **SUN}),
    Hypothesis("tilted face, saddle of the housing", {**TILTED_FACE, **SUN, **HOUSING}),
    Hypothesis("tilted face, saddle of zeroes", {**TILTED_FACE, **SUN, **ZERO}),
    Hypothesis("kink, saddle of the housing", {**_KINK, **SUN, **HOUSING}),
    Hypothesis("kink, saddle of zeroes", {**_KINK, **SUN, **ZERO}),
    Hypothesis(
        "kink, teeth do not resist tilt", {**_KINK, **_SUN_AND_SADDLE}, Supports(n_slices=1)
    ),
    Hypothesis("kink, table 5 of one sensor", {**_KINK, **_SUN_AND_SADDLE}, table_5="one"),
    Hypothesis(
        "kink, table 5 of the turning tilt", {**_KINK, **_SUN_AND_SADDLE}, table_5="turning"
    ),
)
#: One hypothesis a cause: their predictions are compared.
COMPARED = (FACE, GROUND, KINK)


@dataclass(frozen=True, eq=False)
class Comparison:
    """What the published numbers are in a stage.

    Parameters
    ----------
    stages : mapping of int to CondensedStage
        The stage by slices of the teeth.
    model_1, model_2 : ndarray, shape (4 A, 5) and (4 A, 7)
        Orthonormal columns of the signals that the models follow, angle by angle.
    tilt : ndarray, shape (2, A, 4)
        Signal of a tilt of the face by 1 rad about the carrier angles 0 and 90 deg [m].
    """

    stages: Mapping[int, CondensedStage]
    model_1: NDArray[np.float64]
    model_2: NDArray[np.float64]
    tilt: NDArray[np.float64]

    @property
    def n_angles(self) -> int:
        """Carrier angles of a turn."""
        return self.tilt.shape[1]

    def numbers(self, hypothesis: Hypothesis, values: Mapping[str, float]) -> NDArray[np.float64]:
        """Numbers of `NAMES`, then order 1 in LC3; NaN where contact does not settle."""
        supports = hypothesis.supports(values)
        out = self.stages[supports.n_slices].turn(supports, LOADS)
        return self.numbers_of(out, hypothesis, values)

    def numbers_of(
        self, out: NDArray[np.float64], hypothesis: Hypothesis, values: Mapping[str, float]
    ) -> NDArray[np.float64]:
        """The same from the outputs of a stage, shape (4, A, n_outputs)."""
        signals = self.signals(out, hypothesis, values)
        n_angles = signals.shape[1]
        stacked = signals.reshape(len(LOADS), -1)
        rest = stacked - stacked @ self.model_2 @ self.model_2.T
        model_2_rms = np.sqrt((rest**2).mean(axis=1) + NOISE**2)
        orders = 2.0 * np.abs(np.fft.rfft(signals, axis=1)[:, 1]) / n_angles
        order_1 = orders[:, 0] if hypothesis.table_5 == "one" else orders.mean(axis=1)
        if hypothesis.table_5 == "turning":
            turning = stacked @ self.model_1[:, -2:]
            order_1 = np.sqrt(2.0 * (turning**2).sum(axis=1) / stacked.shape[1])
        sharing = 3.0 * pin_loads(out[0]).load_share.max()
        return np.array([*order_1[[0, 1, 3]], *model_2_rms, sharing, order_1[2]])

    def signals(
        self, out: NDArray[np.float64], hypothesis: Hypothesis, values: Mapping[str, float]
    ) -> NDArray[np.float64]:
        """Signals of the axial sensors, shape (4, A, 4) [m]."""
        first = len(ALL_SENSORS) if hypothesis.ground else 0
        phi, theta = values.get("phi_face", 0.0), values.get("theta_face", 0.0)
        face = phi * (np.cos(theta) * self.tilt[0] + np.sin(theta) * self.tilt[1])
        signals = out[:, :, first : first + len(SENSORS)] + face
        saddle = np.array(
            [
                values.get("at_rest", 0.0)
                + values.get("by_torque", 0.0) * load.torque / FULL_TORQUE
                + values.get("by_load", 0.0) * load.ntl_z / 200e3
                for load in LOADS
            ]
        )
        # The pattern (+, -, +, -) of the law flange_warp at 47, 137, 227, 317 deg.
        pattern = np.cos(2.0 * np.array([s.angle - SENSORS[0].angle for s in SENSORS]))
        return np.asarray(signals + saddle[:, None, None] * pattern)


def pin_loads(out: NDArray[np.float64]) -> PartLoads:
    """Loads of the pins from outputs, shape (A, n_outputs)."""
    first = 2 * len(ALL_SENSORS)
    across = out[:, first : first + 12].reshape(len(out), 3, 4)
    axial = np.zeros((len(out), 3, 1))
    force, moment = (np.concatenate([axial, across[:, :, i : i + 2]], axis=2) for i in (0, 2))
    return PartLoads(np.zeros((len(out), 0)), force, moment)


def comparison(body: StageBody, n_angles: int = 9) -> Comparison:
    """Stage and models 1 and 2 of the paper at so many angles of a turn."""
    stages = {n: condensed_stage(body, ALL_SENSORS, n_angles, n) for n in (1, 2)}
    angles = stages[1].angles
    delta = default_curves()
    model = flexible_model(delta["delta_s"], delta["delta_f"])
    n = n_angles
    inputs = {"carrier_angle": angles, "torque": np.full(n, FULL_TORQUE), "time": angles}
    columns = np.stack(
        [model.design(inputs, Channel(s.name, AXIAL, "m", s.angle, s.radius)) for s in SENSORS],
        axis=1,
    )
    design = columns.reshape(4 * n, -1)
    design = design / np.linalg.norm(design, axis=0)
    tilt = np.moveaxis(columns[:, :, 3:5], 2, 0)
    return Comparison(stages, np.linalg.qr(design[:, :5])[0], np.linalg.qr(design)[0], tilt)


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of the posterior of a hypothesis.

    Parameters
    ----------
    hypothesis : Hypothesis
        The hypothesis.
    points : ndarray, shape (n, n_priors)
        Values of the parameters.
    numbers : ndarray, shape (n, 9)
        Numbers of `NAMES` and order 1 in LC3.
    log_volume : ndarray, shape (n,)
        Logarithm of the share of the prior that each point stands for.
    laplace_evidence : mapping of tuple to float
        Logarithm of the evidence by `CHOICES`, where it is Laplace's approximation; empty where
        it is the sum over the points.
    """

    hypothesis: Hypothesis
    points: NDArray[np.float64]
    numbers: NDArray[np.float64]
    log_volume: NDArray[np.float64]
    laplace_evidence: Mapping[tuple[float, float], float] = field(default_factory=dict)

    def log_weights(
        self, amplitude_error: float, window: float = 0.0, without: tuple[int, ...] = ()
    ) -> NDArray[np.float64]:
        """Logarithm of prior times likelihood of each point, shape (n,); their sum is the evidence.

        Parameters
        ----------
        amplitude_error : float
            Standard error of the amplitudes [m].
        window : float
            Spread of the amplitudes between the records of tables 4 and 5, share of them.
        without : tuple of int
            Data that are left out.
        """
        log_l = log_likelihoods(self.numbers, amplitude_error, window)
        return self.log_volume + np.delete(log_l, without, axis=1).sum(axis=1)

    def weights(self, without: tuple[int, ...] = ()) -> NDArray[np.float64]:
        """Share of each point in the posterior with the middle error, shape (n,)."""
        log_w = self.log_weights(SAMPLED_ERROR, without=without)
        weights = np.exp(log_w - log_w.max())
        return np.asarray(weights / weights.sum())

    def log_evidence(self, amplitude_error: float, window: float = 0.0) -> float:
        """Logarithm of the evidence."""
        if self.laplace_evidence:
            return self.laplace_evidence[amplitude_error, window]
        return float(logsumexp(self.log_weights(amplitude_error, window)))


def standard_errors(amplitude_error: float, window: float = 0.0) -> NDArray[np.float64]:
    """Standard errors of the data, shape (8,)."""
    error = np.full(len(NAMES), RMS_ERROR)
    error[_SHARING] = SHARING_ERROR
    error[_AMPLITUDES] = np.hypot(amplitude_error, window * PUBLISHED[_AMPLITUDES])
    return error


def log_likelihoods(
    numbers: NDArray[np.float64], amplitude_error: float, window: float = 0.0
) -> NDArray[np.float64]:
    """Log likelihood of each datum, shape (..., 8)."""
    error = standard_errors(amplitude_error, window)
    z = (numbers[..., : len(NAMES)] - PUBLISHED) / error
    return np.asarray(-0.5 * z**2 - np.log(error * np.sqrt(2.0 * np.pi)))


def sample(
    hypothesis: Hypothesis,
    compare: Comparison,
    width: float,
    rng: np.random.Generator,
    *,
    live_points: int = 100,
) -> Samples:
    """Nested samples of a hypothesis with the middle of the amplitudes' errors.

    Other errors weight the same points anew.

    Parameters
    ----------
    hypothesis : Hypothesis
        The hypothesis.
    compare : Comparison
        The stage.
    width : float
        Widths of the priors over those of the table.
    rng : numpy.random.Generator
        Of the sampler.
    live_points : int
        Live points of the sampler.
    """
    import dynesty

    n = len(hypothesis.priors)

    def log_likelihood(point: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        numbers = compare.numbers(hypothesis, hypothesis.values(point, width))
        if not np.isfinite(numbers).all():
            return -1e30, np.zeros(len(NAMES) + 1)
        return float(log_likelihoods(numbers, SAMPLED_ERROR).sum()), numbers

    sampler = dynesty.NestedSampler(
        log_likelihood,
        lambda u: u,
        n,
        nlive=live_points,
        sample="rwalk",
        walks=_WALKS,
        bootstrap=0,
        rstate=rng,
        blob=True,
    )
    sampler.run_nested(dlogz=0.1, print_progress=False)
    results = sampler.results
    values = [hypothesis.values(point, width) for point in results.samples]
    points = np.array([[value[name] for name in hypothesis.priors] for value in values])
    return Samples(hypothesis, points, np.array(results.blob), results.logwt - results.logl)


@dataclass(frozen=True)
class Run:
    """A hypothesis at one width of the priors."""

    hypothesis: Hypothesis
    width: float

    @property
    def file(self) -> str:
        """Name of its file."""
        words = self.hypothesis.name.replace(",", "").replace(" ", "_")
        return f"{words}-{self.width:g}.json"


#: All runs.
RUNS = tuple(Run(hypothesis, width) for hypothesis in HYPOTHESES for width in WIDTHS)

"""What of a stage may differ from its case, as effects at the rim whose columns the stage computes.

Ids are ``stage/<name>``. A cause of one quantity is solved at a few sizes of its range: what it
adds lies on straight lines between them, and a response near one allows for what they miss. Places
of the pins and the joint's tilt are linear: secants of the stage, updated by Broyden's rule where
records favour them.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.effect import Effect, tilt_pair
from carrierflex.simulation.carrier.effects.inside_stage import (
    GROUPS,
    JOINT_TILT,
    RESPONSE,
    RESPONSE_STD,
    effect_of_stage,
)
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.predicted_readings import (
    LoadPoints,
    PredictedStage,
    StageReadings,
    stage_readings,
)
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.statics import NotConvergedError

Array = NDArray[np.float64]

#: Bounds of a response.
_RESPONSE_BOUNDS = (0.5, 1.5)
#: Sizes between two that are tried where records favour a cause, rounds of it, and the share of the
#: gap's square that it must leave at most.
_BETWEEN, _ROUNDS, _FAVOURED = 8, 4, 0.75
#: Tilt of the joint [rad], 2012 paper, table 5, and place of a pin [m], three times the drawing's
#: tolerance, at which their secants are taken.
_TILT, _PIN_PLACE = 0.5e-3, 30e-6


@dataclass(frozen=True)
class SizedCause:
    """A quantity of the stage that may have another size.

    Parameters
    ----------
    table, key : str
        Where it stands in a stage case.
    unit : str
        SI unit.
    sizes : tuple of float
        Sizes at which the stage is solved, ascending; the range, and one beyond it.
    words : str
        Source of the range.
    is_factor : bool
        Whether sizes are multiples of the case's value.
    """

    table: str
    key: str
    unit: str
    sizes: tuple[float, ...]
    words: str
    is_factor: bool = False

    def value(self, stage: PredictedStage) -> float:
        """Value in a stage."""
        table = stage.effects if self.table == "effects" else getattr(stage.data, self.table)
        return float(getattr(table, self.key))

    def nodes(self, stage: PredictedStage) -> list[float]:
        """Sizes with the stage's own among them, ascending."""
        nominal = self.value(stage)
        factor = nominal if self.is_factor else 1.0
        return sorted({nominal, *(factor * size for size in self.sizes)})

    def changed(self, stage: PredictedStage, size: float) -> PredictedStage:
        """Stage with the quantity at a size."""
        return _with(stage, self.table, **{self.key: size})

    def known(self, value: float, std: float) -> "SizedCause":
        """Cause whose size is known: it is solved there and two standard deviations off."""
        # Beyond it, as fits start below the last size.
        sizes = (max(value - 2.0 * std, 0.0), value, value + (2.0 * std or 0.1 * value))
        return replace(self, sizes=tuple(sorted(set(sizes))), is_factor=False)


_DERIVED = "half to twice the derived value (load_sharing.md)"
_BEARING = "ISO 5753 group CN about the published 0.275 and 0.245 mm of diameter, and none"
_CLEARANCES = (0.0, 0.06e-3, 0.12e-3, 0.18e-3, 0.25e-3, 0.4e-3)
_BUSHING = "each bushing (order_one.md)"
_BONDED = "clearance of the fit over the length of the bore"
_QUILL = (1e6, 2e7, 6e7, 2e8, 6e8, 1.4e9, 3e9)
#: From a bushing that has come loose.
_AXIAL, _TILTING = (0.0, 0.5e6, 2e6, 8e6, 20.2e6, 40e6), (0.0, 1e4, 2e5, 8e5, 2e6)
_HALF_TO_TWICE, _TEETH, _PLAY = (0.5, 2.0, 3.0), (0.7, 1.4, 2.0), (0.3e-3, 0.75e-3, 1.5e-3)
_PER_METRE, _PER_RADIAN = "N/m", "N m/rad"
#: Causes of one quantity by name.
SIZED_CAUSES: Mapping[str, SizedCause] = {
    cause.key: cause
    for cause in (
        SizedCause("bearings", "sun_radial", _PER_METRE, _QUILL, "slender to shortest quill"),
        SizedCause("bearings", "upwind_clearance", "m", _CLEARANCES, _BEARING),
        SizedCause("bearings", "downwind_clearance", "m", _CLEARANCES, _BEARING),
        SizedCause("bearings", "upwind_radial", _PER_METRE, _HALF_TO_TWICE, _DERIVED, True),
        SizedCause("bearings", "downwind_radial", _PER_METRE, _HALF_TO_TWICE, _DERIVED, True),
        SizedCause("mesh", "sun_stiffness", _PER_METRE, _TEETH, _DERIVED, True),
        SizedCause("mesh", "ring_stiffness", _PER_METRE, _TEETH, _DERIVED, True),
        SizedCause("mounting", "axial_stiffness", _PER_METRE, _AXIAL, _BUSHING),
        SizedCause("mounting", "tilt_stiffness", _PER_RADIAN, _TILTING, _BUSHING),
        SizedCause("effects", "pin_fit_play", "rad", _PLAY, _BONDED),
    )
}


def _with(stage: PredictedStage, table: str, **values: object) -> PredictedStage:
    """Stage with other values in a table of its case."""
    if table == "effects":
        return replace(stage, effects=replace(stage.effects, **values))  # type: ignore[arg-type]
    changed = {table: replace(getattr(stage.data, table), **values)}
    return replace(stage, data=replace(stage.data, **changed))


def case_values(
    effect: str, values: Mapping[str, float], data: StageData, effects: StageEffects, n_planets: int
) -> tuple[str, dict[str, float | list[float]]]:
    """Table of a stage case and the keys in it that a cause of some size changes.

    Parameters
    ----------
    effect : str
        Cause, ``stage/<name>``.
    values : mapping of str to float
        Its values by published name: a size, or what is added to the case's tilt or places.
    data, effects : StageData, StageEffects
        Of the case.
    n_planets : int
        Planets of the stage.
    """
    name = effect.partition("/")[2]
    if name in SIZED_CAUSES:
        cause = SIZED_CAUSES[name]
        return cause.table, {cause.key: values[cause.key]}
    if name == JOINT_TILT:
        added = values["phi_PLC"] * np.exp(1j * values["theta_PLC"])
        size, angle = _tilted(effects, added)
        return "effects", {"phi_PLC": size, "theta_PLC_deg": float(np.rad2deg(angle))}
    amounts = np.array([values.get(f"pin_{k}", 0.0) for k in range(2, n_planets + 1)])
    return "effects", {"pin_offset": _moved_pins(effects, amounts)}


def _tilted(effects: StageEffects, added: complex) -> tuple[float, float]:
    """Size and angle [rad] of the joint's tilt with so much more."""
    tilt = effects.phi_PLC * np.exp(1j * effects.theta_PLC) + added
    return float(abs(tilt)), float(np.angle(tilt))


def _moved_pins(effects: StageEffects, amounts: Array) -> list[float]:
    """Places of the pins [m], all but the first moved by so much more."""
    positions = np.array(effects.of_planets("pin_offset", len(amounts) + 1))
    return (positions + np.append(0.0, amounts)).tolist()


@dataclass(frozen=True, eq=False)
class StagePrediction:
    """Readings of a stage and the causes that may change them.

    Parameters
    ----------
    readings : StageReadings
        Of the stage as its case has it.
    causes : tuple of Effect
        Effects whose signals the stage computes.
    not_solved : tuple of str
        Causes without equilibrium beside the case; they are left out.
    """

    readings: StageReadings
    causes: tuple[Effect, ...]
    not_solved: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class GapSeries:
    """Series of the gap of records under steady loads.

    Parameters
    ----------
    series : ndarray of complex, shape (n_runs, n_sensors, n_orders)
        What sensors read beyond the case [m].
    weights : ndarray, shape (n_runs, n_points)
        Share of every load point in the load of a run.
    is_axial : ndarray of bool, shape (n_sensors,)
        Sensors that share an offset, which each run has of its own.
    """

    series: NDArray[np.complex128]
    weights: Array
    is_axial: NDArray[np.bool_]

    def residual_square(self, added: StageReadings) -> float:
        """Sum of squares that is left where the stage reads so much more."""
        return float(np.sum((self._values(self.series) - self._added(added)) ** 2))

    def amounts(self, slopes: Sequence[StageReadings]) -> Array:
        """Amounts of several readings that leave least, shape (n,)."""
        columns = np.array([self._added(slope) for slope in slopes]).T
        fit, *_ = np.linalg.lstsq(columns, self._values(self.series), rcond=None)
        return np.asarray(fit)

    def _added(self, added: StageReadings) -> Array:
        # Sensors of the records come first; a plan tries more.
        series = added.series[:, : self.series.shape[1]]
        return self._values(np.tensordot(self.weights, series, axes=1))

    def _values(self, series: NDArray[np.complex128]) -> Array:
        """Numbers whose squares sum up to the mean square of the signals, offsets left out."""
        rest = series * np.where(np.arange(series.shape[2]) == 0, 1.0, np.sqrt(0.5))
        axial = rest[:, self.is_axial, 0]
        rest[:, self.is_axial, 0] = axial - axial.mean(axis=1, keepdims=True)
        return np.concatenate([rest.real.ravel(), rest.imag.ravel()])


def stage_prediction(
    stage: PredictedStage,
    sensors: Sequence[Sensor],
    points: LoadPoints,
    gap_of: Callable[[StageReadings], GapSeries] | None = None,
    executor: Executor | None = None,
    note: Callable[[str, float], None] = lambda text, share: None,
    impossible: Collection[str] = (),
    known: Mapping[str, tuple[float, float]] | None = None,
) -> StagePrediction:
    """Readings of a stage and of every cause, at the same load points.

    Parameters
    ----------
    stage : PredictedStage
        Stage as its case has it.
    sensors : sequence of Sensor
        Sensors of the campaign.
    points : LoadPoints
        Loads of the records.
    gap_of : callable, optional
        Gap of the records to readings. Causes that take some of it are solved again at the size
        that takes most, and between that and its neighbours: a secant search in the simulator.
    executor : concurrent.futures.Executor, optional
        Where stages are solved; here by default. Each begins at the equilibria of the case.
    note : callable
        Hears which cause is solved, and the share that is done.
    impossible : collection of str
        Effect ids that are not solved.
    known : mapping of str to (float, float), optional
        Value and standard deviation of a cause's quantity, by ``effect.parameter``.

    Raises
    ------
    NotConvergedError
        Where the stage of the case has no equilibrium.
    """
    readings, start = stage_readings(stage, sensors, points)
    names = [name for name in GROUPS if effect_of_stage(name) not in impossible]
    causes = {name: cause for name, cause in SIZED_CAUSES.items() if name in names}
    for name, cause in causes.items():
        size = (known or {}).get(f"{effect_of_stage(name)}.{cause.key}")
        causes[name] = cause.known(*size) if size else cause
    changes = {name: list(_changes(name, stage, causes.get(name))) for name in names}
    solve = partial(_difference, stage, tuple(sensors), readings, start)
    jobs = [(name, change) for name, of_name in changes.items() for change in of_name]
    results = (executor.map if executor else map)(solve, [change for _, change in jobs])
    solved: dict[str, list[StageReadings | None]] = {}
    for number, ((name, _), result) in enumerate(zip(jobs, results, strict=True)):
        solved.setdefault(name, []).append(result)
        note(name.replace("_", " "), (number + 1) / len(jobs))
    gap = gap_of(readings) if gap_of else None
    refine = partial(_refined, stage, solve, gap)
    sized = [(cause, _sizes(cause, stage, solved.pop(name))) for name, cause in causes.items()]
    finer = dict(zip(causes, (executor.map if executor else map)(refine, sized), strict=True))
    effects = {name: _of_sizes(cause, finer[name]) for name, cause in causes.items()}
    for name, slopes in solved.items():
        effects[name] = _of_directions(name, _updated(stage, solve, gap, (name, slopes)))
    not_solved = tuple(effect_of_stage(name) for name, one in effects.items() if one is None)
    return StagePrediction(readings, tuple(filter(None, effects.values())), not_solved)


@dataclass(frozen=True, eq=False)
class _Change:
    """A stage that differs from the case, and what its difference is divided by."""

    stage: PredictedStage
    step: float = 1.0


def _changes(name: str, stage: PredictedStage, cause: SizedCause | None) -> Iterator[_Change]:
    """Stages that a cause asks for; the case itself, which adds nothing, is not among them."""
    if cause is not None:
        for size in cause.nodes(stage):
            if size != cause.value(stage):
                yield _Change(cause.changed(stage, size))
        return
    step = _TILT if name == JOINT_TILT else _PIN_PLACE
    # All pins moved alike turn the carrier.
    n_directions = 2 if name == JOINT_TILT else stage.body.n_planets - 1
    for amounts in step * np.eye(n_directions):
        yield _Change(_moved(name, stage, amounts), step)


def _moved(name: str, stage: PredictedStage, amounts: Array) -> PredictedStage:
    """Stage with its joint tilted, or all pins but the first moved, by so much more."""
    effects = stage.effects
    if name == JOINT_TILT:
        size, angle = _tilted(effects, complex(*amounts))
        return _with(stage, "effects", phi_PLC=size, theta_PLC=angle)
    return _with(stage, "effects", pin_offset=tuple(_moved_pins(effects, amounts)))


def _difference(
    stage: PredictedStage,
    sensors: tuple[Sensor, ...],
    readings: StageReadings,
    start: Array,
    change: _Change,
) -> StageReadings | None:
    """Readings of a changed stage less those of the case, per step; None without equilibrium."""
    try:
        changed, _ = stage_readings(change.stage, sensors, readings.points, start)
    except NotConvergedError:
        return None
    return (changed - readings) * (1.0 / change.step)


@dataclass(frozen=True, eq=False)
class _Directions:
    """Signals per unit of each of several parameters."""

    slopes: tuple[StageReadings, ...]

    def __call__(self, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> Array:
        """Rows by parameter, shape (n_parameters, n)."""
        return np.array([slope.signal(sensor, inputs) for slope in self.slopes])


@dataclass(frozen=True, eq=False)
class _Sizes:
    """Signal of a response of one at a size, straight between sizes; nothing at the case's."""

    nodes: Array
    added: tuple[StageReadings, ...]
    nominal: float

    def __call__(
        self, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, size: float
    ) -> Array:
        """Row of the response, shape (1, n)."""
        return self.at(size).signal(sensor, inputs)[None]

    def at(self, size: float) -> StageReadings:
        """What is read more at a size."""
        shares = [float(np.interp(size, self.nodes, unit)) for unit in np.eye(self.nodes.size)]
        series = np.tensordot(shares, [one.series for one in self.added], axes=1)
        return replace(self.added[0], series=series)

    def with_size(self, size: float, added: StageReadings) -> "_Sizes":
        """With one size more."""
        number = int(np.searchsorted(self.nodes, size))
        others = self.added[:number], self.added[number:]
        nodes = np.insert(self.nodes, number, size)
        return _Sizes(nodes, (*others[0], added, *others[1]), self.nominal)

    def of_rig(self, rig: CarrierRig, largest_load: float) -> Array:
        """Sizes between which the signals are straight."""
        return self.nodes


def _updated(
    stage: PredictedStage,
    solve: Callable[[_Change], StageReadings | None],
    gap: GapSeries | None,
    named: tuple[str, Sequence[StageReadings | None]],
) -> Sequence[StageReadings | None]:
    """Slopes of a linear cause that meet the stage at the amounts that records favour.

    Broyden's update: ``S + (D(p) - S p) p' / p' p``, p the amounts.
    """
    name, given = named
    slopes = [slope for slope in given if slope is not None]
    if gap is None or len(slopes) < len(given):
        return given
    before = gap.residual_square(slopes[0] * 0.0)
    for _ in range(_ROUNDS):
        amounts = gap.amounts(slopes)
        linear = replace(slopes[0], series=np.tensordot(amounts, [s.series for s in slopes], 1))
        if gap.residual_square(linear) >= _FAVOURED * before:
            break
        solved = solve(_Change(_moved(name, stage, amounts)))
        if solved is None:
            break
        missed = (solved - linear).series
        factors = amounts / (amounts @ amounts)
        slopes = [
            replace(slope, series=slope.series + factor * missed)
            for slope, factor in zip(slopes, factors, strict=True)
        ]
    return slopes


def _of_directions(name: str, slopes: Sequence[StageReadings | None]) -> Effect | None:
    """Cause that is linear in its parameters; None where the stage was not solved."""
    solved = tuple(slope for slope in slopes if slope is not None)
    if len(solved) < len(slopes):
        return None
    if name == JOINT_TILT:
        parameters = tilt_pair("phi_PLC", "theta_PLC")
    else:
        farthest = 10.0 * _PIN_PLACE
        parameters = tuple(
            EffectParameter(f"pin_{k + 2}", "m", -farthest, farthest, _PIN_PLACE)
            for k in range(len(solved))
        )
    return _effect(name, parameters=parameters, pattern=_Directions(solved))


def _sizes(
    cause: SizedCause, stage: PredictedStage, differences: Sequence[StageReadings | None]
) -> _Sizes | None:
    """The sizes of a cause that were solved, and the case's own; None where none was."""
    nominal = cause.value(stage)
    others = [size for size in cause.nodes(stage) if size != nominal]
    added = {size: one for size, one in zip(others, differences, strict=True) if one is not None}
    if not added:
        return None
    added[nominal] = next(iter(added.values())) * 0.0
    nodes = sorted(added)
    return _Sizes(np.array(nodes), tuple(added[size] for size in nodes), nominal)


def _refined(
    stage: PredictedStage,
    solve: Callable[[_Change], StageReadings | None],
    gap: GapSeries | None,
    solved: tuple[SizedCause, _Sizes | None],
) -> _Sizes | None:
    """Sizes of a cause with those that records favour, where they favour any."""
    cause, sizes = solved
    if sizes is None or gap is None:
        return sizes
    before = gap.residual_square(sizes.added[0] * 0.0)
    for _ in range(_ROUNDS):
        ends = pairwise(sizes.nodes.tolist())
        tried = np.concatenate([np.linspace(a, b, _BETWEEN, endpoint=False)[1:] for a, b in ends])
        residuals = [gap.residual_square(sizes.at(size)) for size in tried.tolist()]
        size = float(tried[int(np.argmin(residuals))])
        if min(residuals) > _FAVOURED * before:
            break
        added = solve(_Change(cause.changed(stage, size)))
        if added is None:
            break
        sizes = sizes.with_size(size, added)
    return sizes


def _of_sizes(cause: SizedCause, sizes: _Sizes | None) -> Effect | None:
    """Cause of one quantity between the sizes that were solved."""
    if sizes is None:
        return None
    nodes = sizes.nodes
    response = EffectParameter(RESPONSE, "1", *_RESPONSE_BOUNDS, RESPONSE_STD)
    ends, scale = (float(nodes[0]), float(nodes[-1])), float(np.ptp(nodes))
    size = EffectParameter(
        cause.key,
        cause.unit,
        *ends,
        scale,
        shape=True,
        absent_at=sizes.nominal,
        may_reach_lower=ends[0] == 0.0,
    )
    return _effect(cause.key, parameters=(response, size), pattern=sizes, shape_nodes=sizes.of_rig)


def _effect(name: str, **of_cause: Any) -> Effect:
    words = name.replace("_", " ")
    return Effect(
        effect_of_stage(name),
        equation=f"s(stage with another {words}) - s(stage of the case)",
        signature="what the stage of the case reads with another value, under every load",
        **of_cause,
    )

"""Measured laws of a carrier: from an answer by class to a law, from a law to an effect."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from carrierflex.diagnosis.carrier.classes.class_rows import (
    UNDETERMINED,
    LoadFunction,
    load_functions,
    shapes,
)
from carrierflex.diagnosis.carrier.records.sums import ROUNDING, CarrierSums
from carrierflex.diagnosis.classes.decision import shape_of, way_of
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shapes import SIZE, law_of_class, visited_range_warning
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.measured_laws.carrier_laws import law_signal, refuse_other_rig
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    BY_BOTH,
    BY_TORQUE,
    LOADS_OF,
    NONE,
    RIM_PATTERNS,
    TIME,
    Columns,
)
from carrierflex.simulation.carrier.measured_laws.rim_patterns import offset as offset_columns
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.laws import CARRIER, Law, Wave

#: Units of the loads, in the order of the records' columns.
_UNITS: Mapping[str, str] = {"torque": "N m", "ntl_y": "N along y", "ntl_z": "N along z"}
#: Share of the largest load of a kind within which a load is that of the records: its ripple.
_RIPPLE = 0.02
#: Points of a table: of a cubic of the torque, of a parabola in time, and of a function of the
#: radial load that bends at 15 % of the largest one, all within a thousandth of their size.
_TORQUE_POINTS = 65
_TIME_POINTS = 33
_LOAD_POINTS = 129


def carrier_law_of_answer(answer: ClassAnswer, campaign: str, wanted: str | None = None) -> Law:
    """Measured shape of a frame and pattern of an answer; default: of the largest share."""
    names = {
        finding.id: shape_of(finding.id)
        for finding in answer.classes
        if shape_of(finding.id) in RIM_PATTERNS
    }
    # A class without pattern is refused by the list of all where the answer holds none.
    names = names or {pattern: pattern for pattern in RIM_PATTERNS}
    return law_of_class(answer, campaign, names, wanted, _refusal)


def _refusal(name: str, finding: ClassFinding) -> str:
    """Why a class with a pattern has no law."""
    if way_of(finding.id) != UNDETERMINED:
        return ""
    return (
        f"the load dependence of '{name}' cannot be determined from these records; expected three "
        "torques or more"
    )


def effects_of_laws(laws: Sequence[Law], campaign: Campaign) -> tuple[Effect, ...]:
    """Effects of measured laws: one parameter, the size, one where the shape is as measured."""
    effects = []
    for law in laws:
        refuse_other_rig(law, int(campaign.rig["n_planets"]), float(campaign.rig["sensor_radius"]))
        follows = " and ".join(way.replace("_", " ") for way in _followed(law))
        equation = f"size x measured tables of {law.effect_class}, which follows {follows}"
        pattern = partial(_signals, law)
        effects.append(Effect(law.name, equation, (SIZE,), "that of its tables", pattern))
    return tuple(effects)


def _followed(law: Law) -> tuple[str, ...]:
    """What its waves follow, each once."""
    return tuple(dict.fromkeys(wave.follows for wave in law.of(Wave)))


def _signals(law: Law, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
    """Signal of a law of size one, shape (1, n)."""
    return law_signal(law, sensor, inputs)[None]


def beyond_visited(
    law: Law, records: CarrierSums, runs: Sequence[str]
) -> tuple[CampaignWarning, ...]:
    """Warning where records leave the loads at which a law was measured; empty where none does."""
    followed = {load for follows in _followed(law) for load in LOADS_OF[follows]}
    warnings: list[tuple[float, CampaignWarning]] = []
    for column, (load, unit) in enumerate(_UNITS.items()):
        if load not in followed:
            continue
        values, table = records.loads[:, column], np.array(law.visited[load])
        near = _RIPPLE * _largest(law, load)
        away = np.maximum(table[0] - values, values - table[1])
        share = float(np.mean(away > near))
        if share > 0.0:
            warning = visited_range_warning(
                law,
                share=share,
                reached=values,
                table=table,
                unit=unit,
                run=runs[int(records.run_of_revolution[np.argmax(away)])],
            )
            warnings.append((share, warning))
    return (max(warnings, key=lambda entry: entry[0])[1],) if warnings else ()


def _largest(law: Law, load: str) -> float:
    """Largest load of a kind in the records that gave a law."""
    alike = ("ntl_y", "ntl_z") if load != "torque" else ("torque",)
    return max(abs(end) for name in alike for end in law.visited[name])


@dataclass(frozen=True, eq=False)
class VisitedLoads:
    """Loads of the records, and what they are counted in."""

    #: Torque [N m] and radial load [N] along y and z, of every revolution, shape (n, 3)
    loads: FloatArray
    scale: FloatArray  # Nominal torque, and the largest radial load twice, shape (3,)
    n_torques: int  # Torques that differ
    quantities: tuple[str, ...]  # Quantities of the sensors
    n_planets: int  # Planets
    sensor_radius: float  # Radius of the sensors [m]
    #: Sums of columns that the amplitudes of a group are of, by group, shape (n_patterns,
    #: n_columns)
    weights: Mapping[str, FloatArray]

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Least and largest load by name."""
        ends = zip(self.loads.min(axis=0).tolist(), self.loads.max(axis=0).tolist(), strict=True)
        return dict(zip(("torque", "ntl_y", "ntl_z"), ends, strict=True))


def law_of_carrier_class(
    scores: ClassScores, name: str, squares: HeldOutSquares, visited: VisitedLoads
) -> Law | None:
    """Measured shape of one class of an answer as a law, without name.

    The fit of `squares`, those of the answer that it is part of, to all records gives the
    amplitudes. None where a class has no pattern at the rim, the records do not tell what it
    follows, or its amplitudes are rounding only.
    """
    pattern = shape_of(name)
    known = {shape.id: shape for shape in shapes()}
    if pattern not in known or way_of(name) == UNDETERMINED:
        return None
    waves: list[Wave] = []
    for group, fitted in _fitted(scores, name, squares).items():
        dependence = group.rpartition(":")[2]
        if dependence == TIME:
            waves += _waves_in_time(fitted, visited)
            continue
        columns = known[pattern].columns[dependence](visited.quantities, visited.n_planets)
        functions = load_functions(visited.n_torques)[dependence].functions
        c = fitted.reshape(len(functions), -1) @ visited.weights[group]
        waves += _tabulated_waves(dependence, functions, c, columns, visited)
    largest = max((_size(wave) for wave in waves), default=0.0)
    shown = tuple(wave for wave in waves if _size(wave) > ROUNDING * largest)
    if not shown:
        return None
    rig = {"n_planets": visited.n_planets, "sensor_radius": visited.sensor_radius}
    return Law("", CARRIER, pattern, ("N", "m"), shown, visited.ranges, rig)


def _fitted(scores: ClassScores, name: str, squares: HeldOutSquares) -> dict[str, FloatArray]:
    """Coefficients of every group of a class in the fit of an answer to all records [m]."""
    table, by_column = scores.table, scores.amplitudes(squares)
    return {
        group: np.array([by_column[k] for k in table.groups[group].columns.tolist()])
        for group in table.classes[name]
    }


def _tabulated_waves(
    dependence: str,
    functions: Sequence[LoadFunction],
    c: FloatArray,
    columns: Columns,
    visited: VisitedLoads,
) -> list[Wave]:
    """Waves of a law from the amplitudes of a pattern that follows the loads in one way."""
    if dependence == NONE:
        return _waves(columns, c.T, NONE)
    torque, size = visited.scale[:2]
    if dependence == BY_TORQUE:
        x = np.linspace(*visited.ranges["torque"], _TORQUE_POINTS)
        zero = np.zeros_like(x)
        heights = np.array([function(x / torque, zero, zero) for function in functions])
        return _waves(columns, c.T @ heights, BY_TORQUE, x)
    largest = float(np.hypot(visited.loads[:, 1], visited.loads[:, 2]).max())
    x = np.linspace(0.0, largest, _LOAD_POINTS)
    # The torque is a factor beside the table where both loads make an amplitude.
    per_torque = 1.0 / torque if dependence == BY_BOTH else 1.0
    return [
        wave
        for along, heights in _along(functions, x / size).items()
        for wave in _waves(columns, per_torque * (c.T @ heights), dependence, x, along)
    ]


def _along(functions: Sequence[LoadFunction], r: FloatArray) -> dict[str, FloatArray]:
    """Functions of a radial load by the direction that they follow, over its size.

    ``f(r e) = f_y e_y + f_z e_z + f_yy e_y² + f_yz e_y e_z + f_zz e_z²``, at a torque of one: the
    first two are odd in the load, the others even.
    """
    one, zero = np.ones_like(r), np.zeros_like(r)
    diagonal = r / np.sqrt(2.0)

    def halves(y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Odd and even half of every function."""
        there = np.array([function(one, y, z) for function in functions])
        back = np.array([function(one, -y, -z) for function in functions])
        return 0.5 * (there - back), 0.5 * (there + back)

    odd_y, even_y = halves(r, zero)
    odd_z, even_z = halves(zero, r)
    _, even_both = halves(diagonal, diagonal)
    return {
        "y": odd_y,
        "z": odd_z,
        "yy": even_y,
        "yz": 2.0 * even_both - even_y - even_z,
        "zz": even_z,
    }


def _waves_in_time(c: FloatArray, visited: VisitedLoads) -> list[Wave]:
    """Offset of all sensors that changes as a parabola from the start of a run to its end."""
    x = np.linspace(0.0, 1.0, _TIME_POINTS)
    u = 2.0 * x - 1.0
    columns = offset_columns(visited.quantities)
    drift = np.array([c[0] * u + c[1] * u**2] * len(columns))
    return _waves(columns, drift, TIME, x)


def _waves(
    columns: Columns,
    amplitudes: FloatArray,
    follows: str,
    x: FloatArray | None = None,
    along: str = "",
) -> list[Wave]:
    """Waves that some columns of a pattern are made of; amplitudes of each column over x."""
    sizes: dict[tuple[str, int, int], FloatArray] = {}
    for column, amplitude in zip(columns, amplitudes, strict=True):
        for wave in column.waves:
            key = (column.quantity, column.order, wave.lobes)
            added = np.array([wave.cosine * amplitude, wave.sine * amplitude])
            sizes[key] = sizes.get(key, 0.0) + added
    x = np.empty(0) if x is None else x
    return [Wave(*key, follows, cosine, sine, x, along) for key, (cosine, sine) in sizes.items()]


def _size(wave: Wave) -> float:
    """Largest amplitude of a wave."""
    return float(max(np.abs(wave.cosine).max(), np.abs(wave.sine).max()))

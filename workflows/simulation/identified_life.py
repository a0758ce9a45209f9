"""What a tilt that a diagnosis identified costs: load and life of teeth and planet bearings.

The sensors read the tilt of the rim against the housing, not the kink of main shaft and carrier.
Which kink shows so at the rim depends on the supports, which no record states: the answer is given
for each of them, with teeth that resist tilt and teeth that do not. Statics over a turn at the
kinks of value and interval ends give load and life; intervals are propagated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.json_files import read_document
from carrierflex.geometry.involute_pair import InvolutePair
from carrierflex.simulation.carrier.effects.inside_stage import JOINT_TILT, effect_of_stage
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.stage_data import RollerBearingData, StageData
from carrierflex.simulation.stage.tooth_contact import ToothFlank, life_ratio
from carrierflex.workflows.simulation.stage_misalignment import contact_in_stage

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from carrierflex.simulation.stage.stage_body import StageBody
    from carrierflex.simulation.stage.statics import SteadyLoad

Array = NDArray[np.float64]

#: Tilt of the carrier as the sensors read it, and as it is in the joint.
_AT_THE_RIM, _IN_THE_JOINT = "carrier_tilt", effect_of_stage(JOINT_TILT)
#: Largest kink [rad] that is tried: small angles, and ten times what a record has shown.
_LARGEST_KINK = 0.02
#: Exponent of the life of roller bearings over their load, ISO 281:2007, clause 7.
_BEARING_EXPONENT = 10.0 / 3.0
#: Whether teeth resist tilt: slices of a mesh over its face width, in words.
_SLICES = {"do not resist tilt": 1, "resist tilt": 2}
_BEARING = "planet bearing row"
_COLUMNS = ("kink [urad]", "added slope [urad]", "K_Hbeta", "pressure or load ratio", "life ratio")
LIFE_HEADER = ["support", "teeth", "component",
               *(f"{name}{end}" for name in _COLUMNS for end in ("", " low", " high"))]  # fmt: skip


@dataclass(frozen=True)
class Bounded:
    """A value with its 95 % interval."""

    value: Annotated[float, "Value"]
    low: Annotated[float, "Lower end"]
    high: Annotated[float, "Upper end"]

    @property
    def ends(self) -> tuple[float, float, float]:
        """Value, lower end, upper end."""
        return self.value, self.low, self.high


@dataclass(frozen=True)
class IdentifiedTilt:
    """Tilt of the carrier as a diagnosis has it."""

    effect: Annotated[str, "Effect of the diagnosis"]
    phi: Annotated[Bounded, "Size [rad]"]
    theta: Annotated[float, "Carrier-frame angle of its axis [rad]"]
    alike: Annotated[Sequence[str], "Effects that the records cannot distinguish from it"]

    @property
    def is_of_joint(self) -> bool:
        """Whether it is the kink itself, not what the rim shows of it."""
        return self.effect == _IN_THE_JOINT


@dataclass(frozen=True)
class IdentifiedSharing:
    """Load sharing factor as `loads` has it."""

    run: Annotated[str, "Run of the largest torque"]
    factor: Annotated[Bounded, "Largest share of a planet times the number of planets"]


@dataclass(frozen=True, eq=False)
class ComponentLife:
    """One mesh or bearing under the identified tilt, worst planet, over the aligned stage."""

    support: Annotated[str, "Support of carrier and housing, assumed"]
    teeth: Annotated[str, "Whether teeth resist tilt, assumed"]
    component: Annotated[str, "sun mesh, ring mesh or planet bearing row"]
    kink: Annotated[Bounded, "Kink of main shaft and carrier that shows the identified tilt [rad]"]
    slope: Annotated[Bounded | None, "Misalignment that it adds to the mesh [rad]; null: no mesh"]
    face_load_factor: Annotated[Bounded | None, "K_Hbeta of the mesh (ISO 6336-1); null: no mesh"]
    load_ratio: Annotated[
        Bounded,
        "Of a mesh its contact pressure, of a bearing row its equivalent load, over aligned",
    ]
    life_ratio: Annotated[Bounded, "Life over that of the aligned stage"]


@dataclass(frozen=True, eq=False)
class IdentifiedLife:
    """Life under what a campaign identified."""

    tilt: Annotated[IdentifiedTilt, "Tilt of the carrier"]
    sharing: Annotated[IdentifiedSharing | None, "Load sharing; null: that of the stage's statics"]
    components: Annotated[Sequence[ComponentLife], "By support, teeth and component"]
    excluded: Annotated[
        Mapping[str, float],
        "Supports with which no kink up to 20 mrad shows the tilt, and the largest it shows [rad]",
    ]
    identified: Annotated[Sequence[str], "What the records determine, in words"]
    assumed: Annotated[Sequence[str], "What is assumed, in words"]


def identified_tilt(path: Path) -> IdentifiedTilt:
    """Tilt of the carrier in a diagnosis.

    Parameters
    ----------
    path : Path
        diagnosis.json or its folder.

    Raises
    ------
    ValueError
        Where the file is no diagnosis of a carrier, or has no such tilt with an interval.
    """
    from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis

    file = path / DIAGNOSIS_FILE if path.is_dir() else path
    document = read_diagnosis(file)
    try:
        return _tilt(document)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        why = f": {error}" if isinstance(error, ValueError) else ""
        raise ValueError(
            f"{file}: the diagnosis has no tilt of the carrier with an interval{why}; expected "
            f"{_AT_THE_RIM} or {_IN_THE_JOINT} among its parameters: diagnose a campaign of kind "
            "carrier in which it is named, or give --phi-plc"
        ) from error


def _tilt(document: Mapping[str, Any]) -> IdentifiedTilt:
    parameters = document["parameters"]
    effects = [
        name for name in (_IN_THE_JOINT, _AT_THE_RIM) if "phi_PLC" in parameters.get(name, {})
    ]
    if not effects:
        raise ValueError(f"it has {', '.join(parameters) or 'no parameter'}")
    effect = effects[0]
    size, axis = parameters[effect]["phi_PLC"], parameters[effect]["theta_PLC"]
    low, high = size["ci95"]
    ends = (float(size["value"]), max(float(low), 0.0), float(high))
    if not (all(math.isfinite(end) for end in ends) and ends[1] <= ends[0] <= ends[2]):
        raise ValueError(f"phi_PLC of {effect} is {ends[0]} in {low} to {high}")
    alike = {name for group in document["aliases"] if effect in group for name in group} - {effect}
    return IdentifiedTilt(effect, Bounded(*ends), float(axis["value"]), tuple(sorted(alike)))


def identified_sharing(path: Path) -> IdentifiedSharing:
    """Load sharing factor of the run of the largest torque.

    Parameters
    ----------
    path : Path
        loads.json or its folder.

    Raises
    ------
    ValueError
        Where the file is no loads.json, or has no such factor.
    """
    file = path / "loads.json" if path.is_dir() else path
    document = read_document(file, "a loads.json", "carrierflex-loads", 1)
    try:
        run = max(document["runs"], key=lambda one: abs(one["torque"]["value"]))
        stated = run["load_sharing_factor"]
        factor = Bounded(*(float(stated[name]) for name in ("value", "low", "high")))
        # Of equal shares it is one, and less cannot be.
        factor = replace(factor, low=max(factor.low, 1.0))
        if not factor.low <= factor.value <= factor.high:
            raise ValueError("its interval does not hold its value")
        return IdentifiedSharing(str(run["run"]), factor)
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"{file}: has no load sharing factor with an interval; expected a file of carrierflex "
            "loads"
        ) from error


def identified_life(
    tilt: IdentifiedTilt,
    sharing: IdentifiedSharing | None,
    body: StageBody,
    supports: Mapping[str, StageData],
    *,
    pairs: Mapping[str, InvolutePair],
    flank: ToothFlank,
    load: SteadyLoad,
) -> IdentifiedLife:
    """Load and life of teeth and planet bearings by support.

    Parameters
    ----------
    tilt, sharing : IdentifiedTilt, IdentifiedSharing or None
        What was identified.
    body : StageBody
        Elastic body of the stage.
    supports : mapping of str to StageData
        Stages by support, aligned.
    pairs : mapping of str to InvolutePair
        Gear pairs ``sun`` and ``ring``.
    flank : ToothFlank
        Modifications and stiffness.
    load : SteadyLoad
        Load.

    Raises
    ------
    NotConvergedError
        Where a contact at rest does not settle.
    """
    components: list[ComponentLife] = []
    excluded = {}
    for support, data in supports.items():
        for teeth, n_slices in _SLICES.items():
            stage = replace(data, mesh=replace(data.mesh, n_slices=n_slices))
            at = cache(partial(_statics, body, stage, load, tilt.theta))
            kinks = _kinks(at, tilt)
            if kinks is None:
                excluded[f"{support}, teeth {teeth}"] = at(_LARGEST_KINK).rim
                continue
            answers = _answers(at, kinks, sharing, pairs=pairs, flank=flank)
            for component, rows in answers.items():
                # Rows of planets whose teeth do not resist tilt are loaded alike by construction.
                if component != _BEARING or n_slices > 1:
                    components.append(_component(support, teeth, component, kinks, rows))
    return IdentifiedLife(
        tilt,
        sharing,
        tuple(components),
        excluded,
        tuple(_identified_words(tilt, sharing)),
        tuple(_assumed_words(tilt, sharing, load)),
    )


@dataclass(frozen=True, eq=False)
class _KinkedStage:
    """Means over a turn with one kink: tilt of the rim [rad], slopes, forces, row loads."""

    rim: float
    slope: Array
    force: Array
    row_load: Array


#: Statics over a turn by the kink [rad].
_Statics = Callable[[float], _KinkedStage]


def _statics(
    body: StageBody, data: StageData, load: SteadyLoad, theta: float, kink: float
) -> _KinkedStage:
    """Statics over a turn with a kink [rad] about the carrier-frame angle theta [rad]."""
    from carrierflex.simulation.stage.part_loads import mesh_misalignment, part_loads
    from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
    from carrierflex.simulation.stage.stage_model import stage_model
    from carrierflex.workflows.simulation.study_order_one import SENSORS

    effects = StageEffects(phi_PLC=kink, theta_PLC=theta)
    model = stage_model(body, data, effects=effects, speed=0.0)
    record = quasi_static_turn(model, load)
    # R phi sin(theta_PLC + theta - v), eq. 1 of the 2012 paper: order 1 in the pattern m = +1.
    Y = sensor_orders(model, record, SENSORS).amplitudes[:, 1]
    pattern = [np.exp(1j * sensor.angle) / sensor.radius for sensor in SENSORS]
    loads = part_loads(model, record.c)
    rows = loads.row_load((data.planet_rollers or RollerBearingData()).row_spacing)
    # ISO 281: load of equal damage over a turn.
    equivalent = (rows**_BEARING_EXPONENT).mean(axis=0) ** (1.0 / _BEARING_EXPONENT)
    return _KinkedStage(
        float(abs(np.mean(Y * pattern))),
        mesh_misalignment(model, record.c).mean(axis=0),
        loads.mesh_force[:, : 2 * body.n_planets].mean(axis=0),
        equivalent,
    )


def _kinks(at: _Statics, tilt: IdentifiedTilt) -> Bounded | None:
    """Kinks of value and interval ends; None where none is as large as the tilt asks for."""
    if tilt.is_of_joint:
        return tilt.phi
    if at(_LARGEST_KINK).rim < tilt.phi.high:
        return None
    return Bounded(*(_kink_of(at, end) for end in tilt.phi.ends))


def _kink_of(at: _Statics, rim: float) -> float:
    """Kink [rad] that shows a tilt at the rim [rad]."""
    from scipy.optimize import brentq

    high = rim
    while high < _LARGEST_KINK and at(high).rim < rim:
        high = min(2.0 * high, _LARGEST_KINK)
    return float(brentq(lambda kink: at(kink).rim - rim, 0.0, high, xtol=1e-8, rtol=1e-4))


def _answers(
    at: _Statics,
    kinks: Bounded,
    sharing: IdentifiedSharing | None,
    *,
    pairs: Mapping[str, InvolutePair],
    flank: ToothFlank,
) -> dict[str, Array]:
    """Slope, K_Hbeta, load ratio and life ratio (columns) of each component by input (rows)."""
    factor, *factor_ends = (None,) if sharing is None else sharing.factor.ends
    inputs = [(kink, factor) for kink in kinks.ends] + [(kinks.value, end) for end in factor_ends]
    rows: dict[str, list[tuple[float, ...]]] = {}
    for kink, of_sharing in inputs:
        for i, (mesh, pair) in enumerate(pairs.items()):
            row = _mesh_row(at(0.0), at(kink), i, of_sharing, pair=pair, flank=flank)
            rows.setdefault(f"{mesh} mesh", []).append(row)
        ratio = float(at(kink).row_load.max() / at(0.0).row_load.max()) * (of_sharing or 1.0)
        rows.setdefault(_BEARING, []).append((0.0, 1.0, ratio, ratio**-_BEARING_EXPONENT))
    return {component: np.array(of_component) for component, of_component in rows.items()}


def _mesh_row(
    aligned: _KinkedStage,
    kinked: _KinkedStage,
    number: int,
    sharing: float | None,
    *,
    pair: InvolutePair,
    flank: ToothFlank,
) -> tuple[float, float, float, float]:
    """Slope, K_Hbeta, pressure ratio and life ratio of the worst mesh of sun (0) or ring (1)."""
    # A lead correction takes up the misalignment that the torque makes in all of them alike.
    before, force, slope, forces = (
        np.split(values, 2)[number]
        for values in (aligned.slope, aligned.force, kinked.slope, kinked.force)
    )
    common, mean = float(before.mean()), float(force.mean())
    if sharing is not None:
        # Which planet carries most is not known: it meets the worst misalignment.
        forces = np.full_like(forces, sharing * mean)
    contacts = [
        contact_in_stage(pair, flank, one, misaligned)
        for one, misaligned in zip(forces, slope - common, strict=True)
    ]
    pressure = max(contact.largest_pressure for contact in contacts)
    ratio = pressure / contact_in_stage(pair, flank, mean, 0.0).largest_pressure
    K_Hbeta = max(contact.face_load_factor for contact in contacts)
    return float(np.abs(slope - before).max()), K_Hbeta, ratio, life_ratio(ratio)


def _component(
    support: str, teeth: str, component: str, kinks: Bounded, rows: Array
) -> ComponentLife:
    slope, K_Hbeta, load, life = rows.T
    is_mesh = component != _BEARING
    return ComponentLife(
        support=support,
        teeth=teeth,
        component=component,
        kink=kinks,
        slope=Bounded(float(slope[0]), float(slope.min()), float(slope.max())) if is_mesh else None,
        face_load_factor=propagated(K_Hbeta) if is_mesh else None,
        load_ratio=propagated(load),
        life_ratio=propagated(life),
    )


def propagated(values: Array) -> Bounded:
    """Interval of a positive quantity from what each input does to it alone.

    Changes of the logarithm by independent inputs add in square, upward and downward apart: exact
    for one input, of first order for several (JCGM 100:2008, 5.1.2).

    Parameters
    ----------
    values : ndarray, shape (1 + 2 n,)
        At the values of all inputs, then at the lower and upper end of each of n.
    """
    changes = np.log(values[1:] / values[0]).reshape(-1, 2)
    up = float(np.linalg.norm(np.maximum(changes.max(axis=1), 0.0)))
    down = float(np.linalg.norm(np.minimum(changes.min(axis=1), 0.0)))
    value = float(values[0])
    return Bounded(value, value * math.exp(-down), value * math.exp(up))


def _identified_words(tilt: IdentifiedTilt, sharing: IdentifiedSharing | None) -> Iterator[str]:
    phi = tilt.phi
    where = "in the joint of main shaft and carrier" if tilt.is_of_joint else "at the rim"
    yield (
        f"tilt of the carrier {where} ({tilt.effect}): {phi.value * 1e3:.3g} mrad "
        f"({phi.low * 1e3:.3g} to {phi.high * 1e3:.3g})"
    )
    if tilt.alike:
        yield f"the records cannot distinguish it from {', '.join(tilt.alike)}"
    if sharing is not None:
        factor = sharing.factor
        yield (
            f"load sharing factor of run {sharing.run}: {factor.value:.3g} ({factor.low:.3g} to "
            f"{factor.high:.3g})"
        )


def _assumed_words(
    tilt: IdentifiedTilt, sharing: IdentifiedSharing | None, load: SteadyLoad
) -> Iterator[str]:
    yield f"torque {load.torque / 1e3:.4g} kN m, steady, no radial load: life is under it alone"
    if tilt.is_of_joint:
        yield "supports of carrier and housing: each row has one"
    else:
        yield (
            "supports of carrier and housing: each row has one, and the kink of main shaft and "
            "carrier that shows the identified tilt at the rim with it"
        )
    yield "teeth between those that do not resist tilt and those that resist it without crowning"
    if sharing is None:
        yield "load sharing of the stage's statics: planets alike"
    else:
        yield "the planet that carries most is the one of the worst misalignment"
    yield "a lead correction takes up the misalignment that the torque makes"
    yield "slices of a tooth do not support one another (ISO 6336-1); crowning, tip relief as given"
    yield "life of teeth as pressure^(-1/0.056) (2012 paper, eq. 10), of bearings as load^(-10/3)"


def life_figure(life: IdentifiedLife) -> Figure:
    """Life ratios with their intervals by support, teeth and component."""
    from matplotlib.figure import Figure

    cases = list(dict.fromkeys((one.support, one.teeth) for one in life.components))
    figure = Figure(figsize=(10.0, 1.8 + 0.5 * max(len(cases), 1)), layout="constrained")
    axes = figure.subplots()
    names = list(dict.fromkeys(one.component for one in life.components))
    for number, name in enumerate(names):
        rows = [one for one in life.components if one.component == name]
        y = [cases.index((one.support, one.teeth)) + 0.2 * (number - 1) for one in rows]
        value = np.array([one.life_ratio.value for one in rows])
        ends = np.array([(one.life_ratio.low, one.life_ratio.high) for one in rows]).T
        axes.errorbar(value, y, xerr=np.abs(ends - value), fmt="o", capsize=3, label=name)
    axes.set_yticks(range(len(cases)), [f"{support},\nteeth {teeth}" for support, teeth in cases])
    axes.invert_yaxis()
    axes.axvline(1.0, color="0.5", linestyle="--")
    phi = life.tilt.phi
    axes.set(
        xscale="log",
        xlabel="life over that of the aligned stage; bars: 95 % interval",
        title=f"tilt of the carrier {phi.value * 1e3:.3g} mrad ({phi.low * 1e3:.3g} to "
        f"{phi.high * 1e3:.3g}), by assumed support",
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return figure


def life_rows(life: IdentifiedLife) -> Iterator[list[object]]:
    """Rows of identified_life.csv, by :data:`LIFE_HEADER`."""
    for one in life.components:
        row: list[object] = [one.support, one.teeth, one.component]
        columns = ((one.kink, 1e6), (one.slope, 1e6), (one.face_load_factor, 1.0),
                   (one.load_ratio, 1.0), (one.life_ratio, 1.0))  # fmt: skip
        for bounded, factor in columns:
            row += [math.nan] * 3 if bounded is None else [factor * end for end in bounded.ends]
        yield row

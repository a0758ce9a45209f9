"""Truth of the kind "mounting".

Five load records of a housing on two bushings, one withheld effect or two, wrong sensors.

Torque is 1 % wrong, sensors have gains up to 3 % off, speed has a ripple of 1 %, noise has a
memory. It is set so that the gap over the floor is the wanted one.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import (
    ALIASED,
    FORM,
    FORM_FAMILIES,
    NOTHING,
    ONE_CONDITION,
    OUTSIDE,
    CasePlan,
    Label,
)
from carrierflex.blind_check.truth.alias_table import OUTSIDE_CLASSES, same_class
from carrierflex.blind_check.truth.mounting.loads import (
    ALONE,
    CONDITIONS,
    LOADED,
    RATE,
    MountingRecord,
    drawn_record,
    gusty_record,
)
from carrierflex.blind_check.truth.mounting.other_forms import (
    MOUNTING_FORMS,
    form_aliases,
    with_form,
)
from carrierflex.blind_check.truth.mounting.refit import MountingRefit, zeroed
from carrierflex.blind_check.truth.mounting.rig import RIG, SENSORS, Bodies, bodies
from carrierflex.blind_check.truth.mounting.state import MountingState, with_effect
from carrierflex.blind_check.truth.mounting.time_integration import COARSE, FINE, Bushings
from carrierflex.blind_check.truth.noise import (
    case_rng,
    coloured_noise,
    largest_leak,
    noise_rng,
    root_mean_square,
    uniform_std,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

_MEMORY = 0.5
_GAIN, _TORQUE = 0.03, 0.01
#: Signals beyond so many times those without a cause are a motion that runs away.
_RUNAWAY = 10.0
#: Error of the declared masses where causes have other forms.
_MASS = 0.03


#: Names of diagnosis.json where the truth has its own.
_PUBLISHED: Mapping[str, Mapping[str, str]] = {
    "deflection_dependent_damping": {"C3": "C1"},
    "main_bearing_compliance": {"main_bearing_compliance": "compliance"},
    "ntl_direction": {"ntl_angle": "angle"},
    "unequal_bushings": {"starboard_excess": "e"},
    "sensor_delay": {"delay": "tau"},
}


#: A cause has its size where the gap that it leaves alone is the wanted one within this: sizes are
#: drawn over a factor of fourteen, and the label holds the gap that it does leave.
_TOLERANCE = 0.07
_STEPS = 12
#: Second cause of a pair over the first, both alone: as of an element.
_BALANCE = (0.6, 1.6)
#: Gap [m] of a state, by integration steps in a sample.
_Gap = Callable[[MountingState, int], float]
_Caused = Callable[[MountingState, float], tuple[MountingState, float]]


@dataclass(frozen=True, eq=False)
class _Withheld:
    """State with the withheld causes."""

    state: MountingState
    changes: tuple[float, ...] = ()
    own_gaps: tuple[float, ...] = ()
    floor: float = 0.0


def mounting_case(
    plan: CasePlan, repeat: int = 0, *, added: Sequence[MountingRecord] = ()
) -> tuple[Campaign, Label]:
    """Campaign and label of one case.

    Parameters
    ----------
    plan : CasePlan
        What to withhold and how large its gap shall be.
    repeat : int
        Number of the noise: the truth and the loads of a case are the same in all.
    added : sequence of MountingRecord
        Loads measured after those of the case, on the same rig: truth, earlier records and label
        stay what they are without them.

    Returns
    -------
    tuple of (Campaign, Label)
        Records with noise, and the truth.
    """
    rng, rig = case_rng(plan), bodies()
    is_form = plan.family in FORM_FAMILIES
    has_gusts = is_form and bool(rng.uniform() < 0.5)
    make_record = gusty_record if has_gusts else drawn_record
    records = [make_record(rng, number) for number in _conditions(plan)]
    truth = _other_masses(rig, rng) if is_form else rig
    stiffness, damping = RIG["bushing_radial_stiffness"], RIG["bushing_radial_damping"]
    known = MountingState(
        Bushings(stiffness * rng.uniform(0.8, 1.25), damping * rng.uniform(0.7, 1.5))
    )
    plain = known.read(truth, records)
    size = _deflection(rig, plain)
    refit = MountingRefit(rig, [record.loads for record in records], 1.0 / RATE)

    def gap_of(one: MountingState, fine: int) -> float:
        """RMS of what a state leaves after the baseline's refit."""
        return _size(refit.residuals(one.read(truth, records, fine=fine)))

    causes, clean, rng = _bounded(
        plan,
        rng,
        plain,
        lambda numbers, share: withheld(plan, numbers, known, size, gap=gap_of, share=share),
        lambda one: one.read(truth, records),
    )
    state = causes.state
    residuals = refit.residuals(clean)
    gap = _size(residuals) if plan.effects else 0.0
    floor = causes.floor or (
        gap / plan.ratio if plan.effects else _size(plain) * 10.0 ** float(rng.uniform(-3.0, -2.0))
    )
    factors, errors, wrong = _errors(plan, rng, records, clean, (refit, residuals, floor))
    every = [*records, *added]
    declared = [record.loads * factors for record in every]
    noise_generator = noise_rng(plan, repeat)
    measured = []
    for signal in [*clean, *state.read(truth, added)]:
        noise = floor * coloured_noise(noise_generator, signal.T.shape, memory=_MEMORY).T
        measured.append(signal * (1.0 + errors) + zeroed(noise))
    effect = [signal - other for signal, other in zip(clean, plain, strict=True)]
    again = MountingRefit(rig, declared[: len(records)], 1.0 / RATE)
    fitted = measured[: len(records)]
    after = _size(
        again.held_out([signal - more for signal, more in zip(fitted, effect, strict=True)])
    )
    rho = after / _size(again.held_out(fitted)) if plan.effects else 1.0
    run = f"run{1 + int(np.argmax([root_mean_square(residual) for residual in residuals]))}"
    label = _label(plan, state, (gap, floor, rho), run)
    if is_form:
        drive = "gusts" if has_gusts else "levels"
        label = _form_label(plan, label, causes.changes, drive=drive)
    label = replace(label, own_gaps=tuple(fitted / floor for fitted in causes.own_gaps))
    return _campaign(plan, every, declared, measured, (floor, wrong)), label


def _bounded(
    plan: CasePlan,
    rng: np.random.Generator,
    plain: list[FloatArray],
    drawn: Callable[[np.random.Generator, float], _Withheld],
    read: Callable[[MountingState], list[FloatArray]],
) -> tuple[_Withheld, list[FloatArray], np.random.Generator]:
    """Causes whose motion is bounded, its signals, and the random numbers behind them.

    A form that takes the stiffness away (warming, softening rubber) may have no bounded motion at
    the size that is drawn, alone or beside others: all are halved until it has one. Where it runs
    away for long, its values are no numbers any more.
    """
    share = 1.0
    while True:
        numbers = deepcopy(rng)
        try:
            causes = drawn(numbers, share)
            clean = read(causes.state) if plan.effects else plain
            if plan.family not in FORM_FAMILIES or _is_bounded(clean, plain):
                return causes, clean, numbers
        except ArithmeticError:
            if plan.family not in FORM_FAMILIES:
                raise
        share *= 0.5


def _is_bounded(signals: Sequence[FloatArray], plain: Sequence[FloatArray]) -> bool:
    """Whether a motion stays within ten times that without a cause."""
    most = _RUNAWAY * max(float(np.abs(signal).max()) for signal in plain)
    return all(float(np.abs(signal).max()) < most for signal in signals)


def _conditions(plan: CasePlan) -> Sequence[int]:
    """Numbers of the conditions of a case."""
    if plan.family == ONE_CONDITION:
        return (ALONE,)
    if plan.family == ALIASED:
        return (LOADED[plan.number // 2 % len(LOADED)],)
    return range(len(CONDITIONS))


def _other_masses(rig: Bodies, rng: np.random.Generator) -> Bodies:
    """Rig whose masses are not quite as declared."""
    factors = 1.0 + _MASS * rng.standard_normal(len(rig.M))
    return replace(rig, M=rig.M * np.sqrt(np.outer(factors, factors)))


def _form_label(plan: CasePlan, label: Label, changes: Sequence[float], *, drive: str) -> Label:
    """Label of a case that is judged by class: the classes of its causes."""
    classes = tuple(sorted({MOUNTING_FORMS[name].class_id for name in plan.effects}))
    is_sensor = "sensor_map" in classes
    return replace(
        label,
        family=plan.family if plan.effects else NOTHING,
        present=() if is_sensor else label.present,
        classes=classes,
        class_aliases=form_aliases(classes),
        drive=drive,
        changes=tuple(changes),
    )


def _deflection(rig: Bodies, signals: Sequence[FloatArray]) -> FloatArray:
    """Largest radial deflection of a bushing and the largest speed of one."""
    to_motion = np.linalg.pinv(rig.sensors[:, :3])
    deflections = [signal @ to_motion.T @ rig.radial[:, :3].T for signal in signals]
    largest = max(np.abs(deflection).max() for deflection in deflections)
    return np.array(
        [
            largest,
            max(np.abs(np.diff(deflection, axis=0)).max() for deflection in deflections) * RATE,
        ]
    )


def _size(signals: Sequence[FloatArray]) -> float:
    return root_mean_square(np.concatenate(signals))


def _errors(
    plan: CasePlan,
    rng: np.random.Generator,
    records: Sequence[MountingRecord],
    clean: Sequence[FloatArray],
    gap: tuple[MountingRefit, list[FloatArray], float],
) -> tuple[FloatArray, FloatArray, float]:
    """Factors of the loads as they are recorded, gain errors of the sensors, and their share.

    The errors are smaller where they alone would leave too large a gap: they have this share of
    those that are drawn.
    """
    refit, residuals, floor = gap
    torque = 1.0 + _TORQUE * float(rng.choice((-1.0, 1.0))) * np.array([1.0, 0.0, 0.0])
    gains = rng.uniform(-_GAIN, _GAIN, len(SENSORS))
    wrong = MountingRefit(refit.bodies, [record.loads * torque for record in records], refit.step)
    biased = wrong.residuals([signal * (1.0 + gains) for signal in clean])
    leak = (
        _size([residual - other for residual, other in zip(biased, residuals, strict=True)]) / floor
    )
    share = min(1.0, largest_leak(plan) / leak)
    return 1.0 + share * (torque - 1.0), share * gains, share


def _label(
    plan: CasePlan, state: MountingState, sizes: tuple[float, float, float], run: str
) -> Label:
    gap, floor, rho = sizes
    inside = () if plan.family == OUTSIDE else plan.effects
    one_load = plan.family == ONE_CONDITION
    return Label(
        case=plan.name,
        kind="mounting",
        family=plan.family,
        effects=inside,
        acceptable=tuple(same_class("mounting", effect, one_load=one_load) for effect in inside),
        # With nothing missing, what the sensors' errors leave is too small to be found.
        present=("sensor_gain",) if plan.effects else (),
        gap_over_floor=gap / floor,
        floor=floor,
        rho=rho,
        parameters={} if plan.family in (OUTSIDE, *FORM_FAMILIES) else named_parameters(state),
        where={"run": run} if inside else {},
        classes=tuple(OUTSIDE_CLASSES[name] for name in plan.effects if name in OUTSIDE_CLASSES),
    )


def _campaign(
    plan: CasePlan,
    records: Sequence[MountingRecord],
    declared: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    errors: tuple[float, float],
) -> Campaign:
    """Records in the form of a measurement campaign; its words tell nothing about the truth.

    `errors` are the noise [m] and the share of the drawn errors that sensors and torque have.
    """
    floor, share = errors
    runs = []
    for k, (record, loads, signals) in enumerate(zip(records, declared, measured, strict=True)):
        inputs = {
            "torque": loads[:, 0],
            "speed": record.speed,
            "carrier_angle": record.angle,
            "ntl_y": loads[:, 1],
            "ntl_z": loads[:, 2],
        }
        channels = dict(zip(SENSORS, np.ascontiguousarray(signals.T), strict=True))
        runs.append(
            Run(
                f"run{k + 1}",
                f"run{k + 1}.parquet",
                record.condition,
                record.time,
                inputs,
                channels,
            )
        )
    return Campaign(
        kind="mounting",
        name=plan.name,
        baseline=Baseline("model"),
        rig=dict(RIG),
        channels=tuple(
            Channel(
                name,
                "housing_displacement",
                "m",
                sensor=name,
                noise_std=floor,
                gain_std=uniform_std(share * _GAIN),
            )
            for name in SENSORS
        ),
        runs=tuple(runs),
        inputs=(InputSignal("torque", "N m", gain_std=share * _TORQUE),),
    )


def named_parameters(state: MountingState) -> dict[str, dict[str, float]]:
    """True values by effect and by the names of diagnosis.json, those of the baseline too.

    Parameters
    ----------
    state : MountingState
        What acts and what reads.
    """
    named = {"baseline": {"K1": state.bushings.K1, "C1": state.bushings.C1}}
    for effect, values in state.parameters.items():
        names = _PUBLISHED.get(effect, {})
        named[effect] = {names.get(name, name): value for name, value in values.items()}
    if "axial_bushing_stiffness" in named:
        stiffness = state.parameters["axial_bushing_stiffness"]["k_x"]
        named["axial_bushing_stiffness"] = {"dk_x": stiffness - RIG["bushing_axial_stiffness"]}
    if "fluid_branch" in named:
        k, tau = (state.parameters["fluid_branch"][name] for name in ("k", "tau"))
        named["fluid_branch"] = {"k": k, "c": k * tau}
    return named


def withheld(
    plan: CasePlan,
    rng: np.random.Generator,
    known: MountingState,
    size: FloatArray,
    *,
    gap: _Gap,
    share: float = 1.0,
) -> _Withheld:
    """State with the causes of a plan.

    One cause is as large as it is drawn. Causes of several have gaps of their own: those of the
    plan, or a pair's, whose noise follows from the gap of both.

    Parameters
    ----------
    plan : CasePlan
        Causes, and of several at once the gap over the noise that each leaves alone.
    rng : Generator
        Random numbers.
    known : MountingState
        What the baseline holds.
    size : ndarray, shape (2,)
        Largest radial deflection [m] and its speed [m/s] without the causes.
    gap : callable
        RMS [m] of what a state leaves after the baseline's refit, and how finely it is integrated.
    share : float
        Share of the drawn size that causes in other forms have at most.

    Raises
    ------
    ArithmeticError
        Where the motion grows beyond all numbers.
    """
    if plan.own_ratios:
        return _several(plan, plan.own_ratios, rng, known, size, gap=gap, share=share)
    if plan.family == FORM and len(plan.effects) > 1:
        ratios = (1.0, float(rng.uniform(*_BALANCE)))
        return replace(_several(plan, ratios, rng, known, size, gap=gap, share=share), floor=0.0)
    state = known
    changes = []
    for name in plan.effects:
        if plan.family == FORM:
            state, change = with_form(state, name, rng, size, share)
            changes.append(change)
        else:
            state = with_effect(state, name, rng, size)
    return _Withheld(state, tuple(changes))


def _several(
    plan: CasePlan,
    ratios: Sequence[float],
    rng: np.random.Generator,
    known: MountingState,
    size: FloatArray,
    *,
    gap: _Gap,
    share: float,
) -> _Withheld:
    """State with several causes of wanted gaps, one as large as drawn, none larger."""
    causes: list[_Caused] = []
    for name in plan.effects:
        causes.append(_with_share(name, deepcopy(rng), size))
        with_form(known, name, rng, size)
    largest = [_largest(cause, known, gap, float(size[0]), share) for cause in causes]
    floor = min(
        largest_gap / ratio for (_, largest_gap), ratio in zip(largest, ratios, strict=True)
    )
    state = known
    changes = []
    gaps_alone = []
    for cause, start, ratio in zip(causes, largest, ratios, strict=True):
        share_alone, gap_alone = _share(cause, known, ratio * floor, start, gap)
        state, change = cause(state, share_alone)
        changes.append(change)
        gaps_alone.append(gap_alone)
    return _Withheld(state, tuple(changes), tuple(gaps_alone), floor)


def _with_share(name: str, numbers: np.random.Generator, size: FloatArray) -> _Caused:
    """A cause that has the same form at every share of its size."""

    def caused(state: MountingState, share: float) -> tuple[MountingState, float]:
        """State with the cause, and its change of form."""
        return with_form(state, name, deepcopy(numbers), size, share)

    return caused


def _coarse_gap(gap: _Gap, state: MountingState) -> float:
    """Gap in coarse steps; a damping by a power of the speed may ask for those of a record."""
    try:
        return gap(state, COARSE)
    except ArithmeticError:
        return gap(state, FINE)


def _largest(
    cause: _Caused, known: MountingState, gap: _Gap, deflection: float, share: float
) -> tuple[float, float]:
    """Largest share of a cause's size that the motion bears, of halves, and its gap [m]."""
    while True:
        try:
            gap_alone = _coarse_gap(gap, cause(known, share)[0])
        except ArithmeticError:
            gap_alone = np.inf
        if gap_alone < deflection:
            return share, gap_alone
        share *= 0.5


def _share(
    cause: _Caused, known: MountingState, wanted: float, start: tuple[float, float], gap: _Gap
) -> tuple[float, float]:
    """Share of the drawn size at which a cause alone leaves the wanted gap, and what it leaves."""
    shares, gaps = [start[0]], [start[1]]
    share = start[0] * wanted / start[1]
    for _ in range(_STEPS):
        if abs(gaps[-1] / wanted - 1.0) < _TOLERANCE:
            break
        shares.append(share)
        gaps.append(_coarse_gap(gap, cause(known, share)[0]))
        rise = np.log(gaps[-1] / gaps[-2]) / np.log(shares[-1] / shares[-2])
        share *= float((wanted / gaps[-1]) ** (1.0 / np.clip(rise, 0.3, 4.0)))
    return shares[-1], gaps[-1]

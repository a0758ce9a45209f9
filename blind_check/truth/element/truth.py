"""Truth of the kind "element".

A mass on one element under a force, the force of a driven element, or free decays; causes of
:mod:`carrierflex.blind_check.truth.element.families`, each changed in form, with a finer and other
integration than any fit. Gains of drive and channel are wrong by what the campaign declares of
them, noise has a memory, and spring and damper of the baseline are themselves a little curved. The
noise is set so that the gap over the floor is the wanted one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from carrierflex.blind_check.labels import OUTSIDE, CasePlan, Label
from carrierflex.blind_check.truth.element.case import (
    ElementCase,
    bounded,
    samples,
    settling_time,
)
from carrierflex.blind_check.truth.element.drawing import (
    CHANGE,
    drawn_element,
    drawn_size,
    scaled,
    sized_drives,
    slightly_curved,
    with_causes,
)
from carrierflex.blind_check.truth.element.drives import DECAY, drawn_drives
from carrierflex.blind_check.truth.element.element import Element, Law
from carrierflex.blind_check.truth.element.families import CAUSES, acceptable_laws, class_sets
from carrierflex.blind_check.truth.element.reference import force_of, reference_motion
from carrierflex.blind_check.truth.noise import (
    case_rng,
    coloured_noise,
    largest_leak,
    noise_rng,
    root_mean_square,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

#: Gap of a pair's second cause over that of the first.
_BALANCE = (0.6, 1.6)
#: Coefficients of the noise's memory.
_MEMORY = (0.0, 0.7)
#: With nothing missing: curvature of the baseline's own spring and damper, as a power of ten of a
#: cause's size.
_SLIGHT = (-3.3, -2.3)
#: Curvature that is tried first, of a cause's size, and how often it is corrected: what it leaves
#: is all but proportional to it.
_TRIED_LEAK, _LEAK_PASSES = 0.01, 2


#: How near the wanted ratio of two gaps must be met, of the ratio, and how often sizes are changed.
_NEAR, _PASSES = 0.07, 8
#: Least and largest change of what a cause shows by a change of its size, both as logarithms.
_SLOPES = (0.3, 3.0)
#: Farthest that a size is changed at once, as a logarithm.
_FARTHEST = 2.0


#: Relaxation times of the linear memory, over the time in which the phase turns by one radian.
_TIMES = np.geomspace(0.03, 30.0, 14)
#: By how much the spring is curved further, and how often at most: to 10^4 times what it was.
_MORE, _TIMES_MORE = 3.0, 9


#: Relative standard deviation of the gains of drive and channel.
_GAIN_STD = 0.01
_QUANTITY = {"force": "displacement", "displacement": "force", "free_decay": "displacement"}
_UNIT = {"displacement": "m", "force": "N"}


#: Parameters of a law of textbook form from its own scale of force, deflection, speed and its p.
_VALUES: dict[str, Callable[[float, float, float, Law], dict[str, float]]] = {
    "quadratic_spring": lambda f, q, v, law: {"K2": f / q**2},
    "cubic_spring": lambda f, q, v, law: {"K3": f / q**3},
    "quintic_spring": lambda f, q, v, law: {"K5": f / q**5},
    "gap_in_spring": lambda f, q, v, law: {"gap": law.p[0] * q},
    "coulomb": lambda f, q, v, law: {"Fc": f},
    "unequal_friction": lambda f, q, v, law: {"F_plus": f, "F_minus": f * law.p[2]},
    "stribeck": lambda f, q, v, law: {"Fc": f, "Fs": f * law.p[0], "v_s": law.p[1] * v},
    "quadratic_damper": lambda f, q, v, law: {"C2": f / v**2},
    "cubic_damper": lambda f, q, v, law: {"C3": f / v**3},
    "slider": lambda f, q, v, law: {"Kp": f / (law.p[0] * q), "Fy": f},
    "maxwell": lambda f, q, v, law: {"k": f / q, "tau": law.p[1]},
    "square_coupling": lambda f, q, v, law: {"C1": f / (q**2 * v)},
}


def element_case(plan: CasePlan, repeat: int = 0) -> tuple[Campaign, Label]:
    """Campaign and label of one case.

    Parameters
    ----------
    plan : CasePlan
        What to withhold, under which drive, and how large its gap shall be.
    repeat : int
        Number of the noise: the truth and the loads of a case are the same in all.

    Returns
    -------
    tuple of (Campaign, Label)
        Records with noise, and the truth.
    """
    return element_truth(plan, repeat)[:2]


def element_truth(plan: CasePlan, repeat: int = 0) -> tuple[Campaign, Label, ElementCase]:
    """Campaign and label of one case, and the element that they are of.

    The arguments are those of :func:`element_case`.
    """
    rng = case_rng(plan)
    case = _drawn_case(plan, rng)
    residuals = case.baseline(case.channels)
    gap = root_mean_square(np.array(residuals))
    gaps = own_gaps(case, plan.effects) if len(plan.effects) > 1 else ()
    if plan.effects:
        floor = gap / plan.ratio
    else:
        # The slight curvature is all that is missing: it must stay below what noise can show.
        gap, floor = 0.0, gap / (largest_leak(plan) * rng.uniform(0.2, 1.0))
    memory = float(rng.uniform(*_MEMORY))
    gains = 1.0 + _GAIN_STD * rng.standard_normal(2)
    noise_generator = noise_rng(plan, repeat)
    noise = [floor * coloured_noise(noise_generator, (case.n,), memory=memory) for _ in case.drives]
    time = case.plain.step * np.arange(float(case.n))
    records = _Records(
        drive="free_decay"
        if case.drive == DECAY
        else ("displacement", "force")[case.plain.by_force],
        time=time,
        inputs=[gains[0] * drive.at(time) for drive in case.drives],
        signals=[
            gains[1] * channel + more for channel, more in zip(case.channels, noise, strict=True)
        ],
        noise_std=floor,
        settle=case.settle,
    )
    label = _label(plan, case, residuals, gap, floor)
    label = replace(label, own_gaps=tuple(gap_alone / floor for gap_alone in gaps))
    return _campaign_of(plan, records), label, case


def _label(
    plan: CasePlan,
    case: ElementCase,
    residuals: Sequence[FloatArray],
    gap: float,
    floor: float,
) -> Label:
    inside = () if plan.family == OUTSIDE else plan.effects
    classes, aliases = class_sets(inside)
    sizes = [root_mean_square(residual) for residual in residuals]
    return Label(
        case=plan.name,
        kind="element",
        family=plan.family,
        effects=plan.effects,
        acceptable=tuple(acceptable_laws(name) for name in plan.effects),
        present=(),
        gap_over_floor=gap / floor,
        floor=floor,
        # With the true cause in the model noise is left; gap and noise add as squares.
        rho=floor / float(np.hypot(floor, gap)),
        parameters=true_parameters(
            inside, case.changes, case.element, is_decay=case.drive == DECAY
        ),
        where={"run": f"run{1 + int(np.argmax(sizes))}"} if inside else {},
        classes=classes,
        class_aliases=aliases,
        drive=case.drive,
        changes=case.changes,
    )


def _drawn_case(plan: CasePlan, rng: np.random.Generator) -> ElementCase:
    """Element under its drives."""
    plain = drawn_element(rng, plan.drive)
    n = samples(plan.drive, plain)
    drives = sized_drives(
        rng,
        plain,
        drawn_drives(
            rng,
            plan.drive,
            omega=plain.omega,
            duration=n * plain.step,
            growth=0.5 * settling_time(plain),
            by_force=plain.by_force,
        ),
        n,
    )
    reference = reference_motion(plain, drives[-1], n)
    size = drawn_size(rng, plain, reference)
    element, changes = with_causes(rng, plan.effects, plain, reference, size, len(drives))
    case = ElementCase(plan.drive, drives, plain, element, reference, changes)
    if plan.effects == ("spring_and_dashpot",):
        case = _beyond_linear_memory(case, rng.uniform(CHANGE[1], 2.0 * CHANGE[1]))
    if len(plan.effects) > 1:
        case = _balanced(case, plan.effects, rng.uniform(*_BALANCE))
    if plan.effects:
        return _leaking(rng, plan, case, size)
    # With nothing missing the curvature is the gap that the floor is set by.
    slight = size * 10.0 ** rng.uniform(*_SLIGHT)
    return bounded(replace(case, element=slightly_curved(rng, element, reference, slight)))


def _beyond_linear_memory(case: ElementCase, least_share: float) -> ElementCase:
    """Spring and dashpot with the least curvature of which a linear memory leaves enough.

    It counts on the motion with the cause: of a mass under a force it holds back what the spring
    alone would show, and on that motion a curved spring may be a straight one. A law whose form is
    changed by less than `least_share` is one of its class.
    """
    for _ in range(_TIMES_MORE):
        case = bounded(case)
        motion = reference_motion(case.element, case.drives[-1], case.n)
        law = case.element.laws[-1]
        force = force_of(law, motion)
        v = motion.columns[:, 1]
        branches = [_relaxing(v, motion.step, time / case.plain.omega) for time in _TIMES]
        memory = replace(motion, columns=np.column_stack([motion.columns, *branches]))
        if memory.missing(force) >= least_share * motion.missing(force):
            break
        curved = replace(law, p=law.p * np.array([_MORE, *np.ones(law.p.size - 1)]))
        laws = (*case.element.laws[:-1], curved)
        case = replace(case, element=replace(case.element, laws=laws))
    return bounded(case)


def _relaxing(v: FloatArray, step: float, tau: float) -> FloatArray:
    """Deflection of a linear spring in series with a dashpot, shape (n,)."""
    keep = np.exp(-step / tau)
    return np.asarray(lfilter([tau * (1.0 - keep)], [1.0, -keep], v))


def _leaking(
    rng: np.random.Generator, plan: CasePlan, case: ElementCase, size: float
) -> ElementCase:
    """The case with a baseline a little wrong, which changes what is left by what it may."""
    # Measured on the case's own motion and in its channel: a resonance makes of a curvature that is
    # a small force a large motion, and a delay of a sample leaves less than any force of that size.
    case = bounded(case)
    before = np.array(case.baseline(case.channels))
    allowed = largest_leak(plan) * rng.uniform(0.2, 1.0) / plan.ratio * root_mean_square(before)
    tried = slightly_curved(rng, case.element, case.reference, _TRIED_LEAK * size)
    bare = len(case.element.laws)
    for _ in range(_LEAK_PASSES):
        after = np.array(case.baseline(case.signals(tried)))
        factor = allowed / root_mean_square(after - before)
        tried = replace(tried, laws=(*tried.laws[:bare], *scaled(tried.laws[bare:], factor)))
    return bounded(replace(case, element=tried))


def own_gaps(case: ElementCase, names: Sequence[str]) -> tuple[float, ...]:
    """RMS that each of several causes leaves with the others in the model, in the channel's unit.

    Parameters
    ----------
    case : ElementCase
        Element with its causes, whose motion is bounded.
    names : sequence of str
        Its causes.

    Returns
    -------
    tuple of float
        By cause, after the baseline's own refit.
    """
    return tuple(
        root_mean_square(np.array(case.baseline(signals))) for signals in shown_by_each(case, names)
    )


def _balanced(case: ElementCase, names: Sequence[str], ratio: float) -> ElementCase:
    """Case whose second cause leaves a multiple of what the first one leaves."""
    case = bounded(case)
    moved = last = 0.0
    slope = 1.0
    for _ in range(_PASSES):
        first, second = own_gaps(case, names)
        missed = float(np.log(ratio * first / second))
        if abs(missed) <= _NEAR:
            break
        if moved:
            # Causes change the motion that shows them: a cause twice as large may show four times.
            slope = float(np.clip((last - missed) / moved, *_SLOPES))
        moved = float(np.clip(missed / slope, -_FARTHEST, _FARTHEST))
        last = missed
        case = bounded(replace(case, element=_moved(case.element, names, moved)))
    return case


def _moved(element: Element, names: Sequence[str], moved: float) -> Element:
    """Element with one cause smaller by the exponential: the first, the second if negative."""
    return _resized(element, names, int(moved < 0.0), float(np.exp(-abs(moved))))


def shown_by_each(case: ElementCase, names: Sequence[str]) -> list[list[FloatArray]]:
    """Channel of every run of the plain element that one cause acts on as in the records.

    Parameters
    ----------
    case : ElementCase
        Element with its causes.
    names : sequence of str
        Its causes.

    Returns
    -------
    list of list of ndarray, shape (n,)
        By cause and run. What they differ by from the plain element adds up to what the records
        do: the plain element is linear.
    """
    alone = [_with_one_cause(case.element, names, number) for number in range(len(names))]
    if not case.plain.by_force:
        # The motion is given, and forces add.
        return [case.signals(laws) for laws in alone]
    return [[_shown(case, laws, run) for run in range(len(case.drives))] for laws in alone]


def _shown(case: ElementCase, element: Element, run: int) -> FloatArray:
    """Channel of one run with the force of one cause along the recorded motion, shape (n,)."""
    q = case.recorded[run]
    linear = replace(element, laws=(), delay=0.0, lag=0.0)
    answer = linear.motion(case.drives[run], run, case.n, added=-element.law_force(q))
    late = element.sensed(q, case.n) - linear.sensed(q, case.n)
    return linear.sensed(answer, case.n) + late


def _resized(element: Element, names: Sequence[str], number: int, factor: float) -> Element:
    """Element with one cause resized; a gap in its spring gets wider or narrower."""
    name = names[number]
    if name == "late_sensor":
        return replace(element, delay=factor * element.delay, lag=factor * element.lag)
    if not CAUSES[name].law:
        assert element.drive_side is not None
        amplitude = factor * element.drive_side.amplitude
        return replace(element, drive_side=replace(element.drive_side, amplitude=amplitude))
    index = _law_place(names, number)
    law = element.laws[index]
    if name == "gap_in_spring":
        form = law.form * np.array([[factor], [1.0], [1.0]])
        law = replace(law, p=law.p * np.array([factor, *np.ones(law.p.size - 1)]), form=form)
    else:
        (law,) = scaled([law], factor)
    return replace(element, laws=(*element.laws[:index], law, *element.laws[index + 1 :]))


def _law_place(names: Sequence[str], number: int) -> int:
    """Place among an element's laws of the law of one of its causes."""
    return sum(bool(CAUSES[name].law) for name in names[:number])


def _with_one_cause(element: Element, names: Sequence[str], number: int) -> Element:
    """Element with one of its causes alone, its base as it is."""
    cause = CAUSES[names[number]]
    is_late = names[number] == "late_sensor"
    return replace(
        element,
        laws=(element.laws[_law_place(names, number)],) if cause.law else (),
        drive_side=None if cause.law or is_late else element.drive_side,
        delay=element.delay if is_late else 0.0,
        lag=element.lag if is_late else 0.0,
        disturbance=(),
    )


@dataclass(frozen=True, eq=False)
class _Records:
    """What was measured."""

    drive: str
    time: FloatArray
    inputs: Sequence[FloatArray]
    signals: Sequence[FloatArray]
    noise_std: float
    settle: int


def _campaign_of(plan: CasePlan, records: _Records) -> Campaign:
    """Campaign of a case."""
    quantity = _QUANTITY[records.drive]
    channel = f"measured_{quantity}"
    runs = tuple(
        Run(
            f"run{k + 1}",
            f"run{k + 1}.parquet",
            f"drive {k + 1}",
            records.time,
            {} if records.drive == "free_decay" else {records.drive: values},
            {channel: signal},
        )
        for k, (values, signal) in enumerate(zip(records.inputs, records.signals, strict=True))
    )
    rig = {"drive": records.drive}
    settle = {"settle_samples": records.settle} if records.settle else {}
    declared = () if records.drive == "free_decay" else (records.drive,)
    inputs = tuple(InputSignal(name, _UNIT[name], gain_std=_GAIN_STD) for name in declared)
    return Campaign(
        kind="element",
        name=plan.name,
        baseline=Baseline("model"),
        rig={**rig, **settle},
        channels=(
            Channel(
                channel,
                quantity,
                _UNIT[quantity],
                noise_std=records.noise_std,
                gain_std=_GAIN_STD,
            ),
        ),
        runs=runs,
        inputs=inputs,
    )


def true_parameters(
    names: Sequence[str], changes: Sequence[float], element: Element, *, is_decay: bool
) -> dict[str, dict[str, float]]:
    """Parameters of baseline and causes where every cause has its textbook form.

    Parameters
    ----------
    names : sequence of str
        Withheld causes.
    changes : sequence of float
        Change of form of each.
    element : Element
        Element with the causes.
    is_decay : bool
        Forces of a decay are per mass.

    Returns
    -------
    dict
        By effect of the library, ``baseline`` among them, and symbol; empty where a cause has
        another form than the library's: its law then has no true parameter, and spring and damper
        share its linear part.
    """
    if any(changes) or any(not CAUSES[name].library for name in names):
        return {}
    mass, stiffness = element.base[:2]
    per = mass if is_decay else 1.0
    values = {"baseline": {"K1": float(stiffness / per)}}
    if not is_decay:
        values["baseline"]["m"] = float(mass)
    laws = iter(element.laws)
    for name in names:
        library = CAUSES[name].library
        if name == "late_sensor":
            values[library] = {"delay": float(element.delay)}
            continue
        law = next(laws)
        force, deflection, speed = (float(value) for value in law.scale)
        true = _VALUES[name](force, deflection, speed, law)
        of_mass = {symbol for symbol in true if symbol not in ("gap", "tau", "v_s")}
        values[library] = {
            symbol: float(value / (per if symbol in of_mass else 1.0))
            for symbol, value in true.items()
        }
    return values

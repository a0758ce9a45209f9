"""Truth of the kind "element".

A mass on one element under a force, the force of a driven element, or free decays; causes of
:mod:`carrierflex.blind_check.truth.element.families`, each changed in form, with a finer and other
integration than any fit. Gains of drive and channel are wrong by what the campaign declares of
them, noise has a memory, and spring and damper of the baseline are themselves a little curved. The
noise is set so that the gap over the floor is the wanted one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import OUTSIDE, CasePlan, Label
from carrierflex.blind_check.truth.element.balance import balanced, own_gaps
from carrierflex.blind_check.truth.element.campaign import GAIN_STD, Records, campaign_of
from carrierflex.blind_check.truth.element.case import (
    ElementCase,
    bounded,
    samples,
    settling_time,
)
from carrierflex.blind_check.truth.element.drawing import (
    drawn_element,
    drawn_size,
    scaled,
    sized_drives,
    slightly_curved,
    with_causes,
)
from carrierflex.blind_check.truth.element.drives import DECAY, drawn_drives
from carrierflex.blind_check.truth.element.families import acceptable_laws, class_sets
from carrierflex.blind_check.truth.element.parameters import true_parameters
from carrierflex.blind_check.truth.element.reference import reference_motion
from carrierflex.blind_check.truth.noise import (
    case_rng,
    coloured_noise,
    largest_leak,
    noise_rng,
    root_mean_square,
)
from carrierflex.identification.campaign.campaign import Campaign

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
    gains = 1.0 + GAIN_STD * rng.standard_normal(2)
    own_noise = noise_rng(plan, repeat)
    noise = [floor * coloured_noise(own_noise, (case.n,), memory=memory) for _ in case.drives]
    time = case.plain.step * np.arange(float(case.n))
    records = Records(
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
    return campaign_of(plan, records), replace(label, own_gaps=tuple(own / floor for own in gaps))


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
    if len(plan.effects) > 1:
        case = balanced(case, plan.effects, rng.uniform(*_BALANCE))
    if plan.effects:
        return _leaking(rng, plan, case, size)
    # With nothing missing the curvature is the gap that the floor is set by.
    slight = size * 10.0 ** rng.uniform(*_SLIGHT)
    return bounded(replace(case, element=slightly_curved(rng, element, reference, slight)))


def _leaking(
    rng: np.random.Generator, plan: CasePlan, case: ElementCase, size: float
) -> ElementCase:
    """The case with a baseline a little wrong, which changes what is left by what it may.

    Measured on the case's own motion and in its channel: a resonance makes of a curvature that is a
    small force a large motion, and a delay of a sample leaves less than any force of that size.
    """
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

"""Findings about a campaign that need the baseline: fitted, and refitted with the wiring put right.

Where an error of wiring or sign explains as much of the gap as a named effect, the verdict is
"aliased" and says so: the wiring is checked first.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from carrierflex.diagnosis.classes.results import MEASURED
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.comparison.problem import BASELINE, Effects
from carrierflex.diagnosis.inference.effect_fit import (
    ON_BOUND,
    EffectFit,
    fit_effects,
    mean_square_left,
)
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    FLOOR_UNKNOWN,
    NAMED,
    NAMED_WITH_REMAINDER,
    NAMING,
    NONE_OF_THESE,
    OTHERWISE,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.wiring.column_faults import (
    drifting_gain,
    drifting_zeros,
    filtered_signals,
    late_load,
    saturating_channel,
    zeros_behind_the_torque,
)
from carrierflex.diagnosis.wiring.linear_records import (
    FloatArray,
    LinearRecord,
    drifting_runs,
    late_signals,
    off_gains,
)
from carrierflex.diagnosis.wiring.load_faults import held_inputs, load_faults, sized_faults
from carrierflex.diagnosis.wiring.lone_channels import lone_rivals, run_of_largest_motion
from carrierflex.diagnosis.wiring.refits import (
    AS_GOOD,
    LONE_CHANNEL,
    NEARLY_ALL,
    OF_NO_KIND,
    REPORTED,
    SMALLEST_DRIFT,
    SMALLEST_GAIN,
    ClockDrift,
    Fault,
    GapSquare,
    PredictedRecord,
    WiringChecks,
    WiringRival,
    clock_rival,
    drifting_clocks,
    exchanged_runs,
    fault_words,
    put_back,
    refitted_clock,
)
from carrierflex.diagnosis.wiring.spoilt_readings import (
    jittered_samples,
    noisier_readings,
    noisy_load,
    unfollowed_loads,
)
from carrierflex.files.quantities import sized
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import (
    CampaignWarning,
    key_of,
    sample_of,
)
from carrierflex.identification.campaign_check.tones import (
    IN_RUNS,
    answers_few_lines,
    lines_that_stand_out,
    turns_with_the_shaft,
)
from carrierflex.simulation.carrier.effects.drawing import ALLOWED_BY_DRAWING
from carrierflex.simulation.laws import Law

#: Mean square of the gap over the floor from which wiring is looked at.
_GAP = 1.2
#: The same of what laws leave: beside them a fault is looked for that moves the signals by a floor.
_GAP_BESIDE = 2.0
#: Share of what shapes leave that a fault beside them explains: they were measured with it.
_BESIDE_SHAPES = 0.7
#: RMS of the gap over the declared noise below which that is too large.
_QUIETER = 0.5
#: Steps of time that a delay of all signals has at least; a smaller one is an effect.
_FEWEST_STEPS = 3.0
#: Standard deviations of a declared value or calibration from which records contradict it.
_CONTRADICTS = 3.0
#: Samples of all channels up to which records with all their columns are held: 160 MB.
_MOST_HELD = 1_000_000
#: Runs beside their linear model.
_Linear = Callable[[], Iterable[LinearRecord]]
#: Check of a wiring that explains the gap.
_WIRING = "wiring"
#: What a channel that is left out may have, which laws of the library are too.
_CHANNELS = (Fault.CHANNEL, Fault.CHANNEL_GAIN, Fault.CHANNEL_ZERO)
#: What may be the same as any cause that acts in some runs, or grows with them.
_BY_RUN = (Fault.RUN, Fault.RUN_VARIATION)
#: Checks of the records that explain any gap, and their faults; then those that are certain, where
#: what a refit explains is not.
_OF_RECORDS = (("unit", Fault.UNIT), ("detrended", Fault.AC_COUPLED))
_COPIED = "copied_channel"
_CERTAIN = (
    (_COPIED, Fault.COPIED_CHANNEL), ("wrapped", Fault.WRAPPED), ("rectified", Fault.RECTIFIED),
)  # fmt: skip
#: Beginnings of the names of laws and classes that are errors of channels.
_OF_CHANNELS = ("channel/", "sensor_")


@dataclass(frozen=True, eq=False)
class BaselineCheck:
    """Findings with the baseline, and rivals of what is named with the share that they explain."""

    findings: tuple[CampaignWarning, ...]  # Without those of the rivals
    rivals: tuple[tuple[WiringRival, float], ...]
    largest_run: str = ""  # Run that moves most: what grows with the motion is largest there
    #: Faults that explain half of the gap by themselves and not nearly all: beside a class they may
    half: tuple[WiringRival, ...] = ()

    @property
    def warnings(self) -> tuple[CampaignWarning, ...]:
        """Findings, then those of the rivals."""
        return (*self.findings, *(_wiring_warning(*pair) for pair in self.rivals))

    def with_rival(self, rival: WiringRival, share: float) -> "BaselineCheck":
        """The same with a rival in the place of that of the same fault."""
        fault = (rival.id, rival.about)
        others = [pair for pair in self.rivals if (pair[0].id, pair[0].about) != fault]
        return self if share < REPORTED else replace(self, rivals=(*others, (rival, share)))


def checked_baseline(
    problem: ComparisonProblem,
    campaign: Campaign,
    wiring: WiringChecks,
    fit: EffectFit | None = None,
    laws: Effects = (),
    shapes: Sequence[Law] = (),
) -> BaselineCheck:
    """Fit the baseline, and again with the wiring put right where there is a gap.

    `fit` is that of the baseline, where a diagnosis made it already; `laws` are those that it fits
    best, `shapes` what it measured of its classes in their place: a fault beside one of the laws,
    or beside all shapes, explains the gap too. Checks ``wiring``, ``clock``,
    ``delay``, ``gain``, ``bound``, ``prior``, ``drawing``, ``declared_noise``, ``unchecked``, and
    ``outliers`` and ``tone`` beside the prediction.
    """
    fit = fit or fit_effects(problem, ())
    before = mean_square_left(problem, fit)
    floor = problem.noise_floor_square
    warnings = [*_at_bounds(fit), *_off_priors(fit, campaign), *_quiet(campaign, before, floor)]
    warnings += problem.baseline_findings(fit.known)
    if before <= _GAP * floor:
        # A visible gap would be taken for a delay; and there a delay is an effect of the library.
        warnings += _late(wiring, campaign, fit.theta, _GAP * floor)
        warnings += _off_gain(wiring, campaign, fit.theta)
        return BaselineCheck(tuple(warnings), ())
    linear = _linear_records(wiring, campaign, fit.theta)
    tried = list(wiring.rivals())
    untold: list[WiringRival] = []
    records = wiring.predictions(fit.theta) if np.isfinite(before) else ()
    clocks = [*_drifting(linear(), campaign, before)] if np.isfinite(before) else []
    if wiring.unchecked:
        warnings.append(_unchecked(wiring.unchecked))
    # None of another simulator's prediction: it stands as it is.
    if records:
        gap = GapSquare(before, floor)
        enough = gap.remaining(1.0 - AS_GOOD)
        late = [refitted_clock(campaign, guess, wiring.refitted, enough) for guess in wiring.late()]
        clocks += drifting_clocks(records, campaign, wiring.refitted)
        clocks += _drifting_by_steps(late, campaign)
        tried += exchanged_runs(records, campaign, wiring.refitted)
        # A size that is fitted takes something of every gap: it must explain nearly all.
        for rival in _sized_rivals(linear, wiring, campaign, gap):
            (tried if rival.mean_square <= gap.enough else untold).append(rival)
        tried += _unsized_rivals(linear, wiring, campaign, gap)
        if min((rival.mean_square for rival in tried), default=np.inf) > enough:
            is_taken = bool(shapes) and wiring.takes_shapes
            with_shapes = problem.with_laws(shapes) if is_taken else None
            if with_shapes is not None:
                names = tuple(shape.name for shape in shapes)
                tried += _rivals_with_laws(with_shapes, campaign, wiring, names, floor, shapes)
            else:
                for law in laws:
                    tried += _rivals_with_laws(problem, campaign, wiring, (law,), floor)
        if Fault.LOAD_NOISE not in [rival.id for rival in tried]:
            warnings += unfollowed_loads(linear(), campaign)
        warnings += _residual_findings(records, campaign, floor)
        warnings += _late_by_steps(late, campaign, before, floor)
    # The better of two looks at one run.
    by_run = sorted(clocks, key=lambda rival: -rival.mean_square)
    tried += {rival.about: rival for rival in by_run}.values()
    # A refit knows no priors: what it leaves of the campaign as it stands no wiring explains.
    stated = before
    if wiring.has_cheap_refits and tried:
        refitted = wiring.refitted(campaign)
        stated = min(before, refitted) if np.isfinite(refitted) else before

    def share_of(rival: WiringRival) -> float:
        """Share of the gap; in full where the baseline runs away without the correction."""
        return (stated - rival.mean_square) / (before - floor) if np.isfinite(before) else 1.0

    shares = [(rival, share_of(rival)) for rival in tried]
    half = [one for one in (*tried, *untold) if one.corrected and not one.laws]
    half = [one for one in half if one.id not in OF_NO_KIND and share_of(one) >= REPORTED]
    if max((share for _, share in shares), default=0.0) >= 1.0 - AS_GOOD:
        half = []
    # Of one fault the first model that explains it: a further law must explain more.
    best: dict[tuple[str, str], tuple[WiringRival, float]] = {}
    for rival, share in shares:
        key = (rival.id, rival.about)
        if key not in best or share > best[key][1] + AS_GOOD:
            best[key] = (rival, share)
    rivals = tuple(pair for pair in best.values() if pair[1] >= REPORTED)
    return BaselineCheck(tuple(warnings), rivals, run_of_largest_motion(campaign), tuple(half))


def _rivals_with_laws(
    problem: ComparisonProblem,
    campaign: Campaign,
    wiring: WiringChecks,
    laws: Effects,
    floor: float,
    shapes: Sequence[Law] = (),
) -> Iterator[WiringRival]:
    """Lone channels, runs and faults of loads beside laws; none where they leave no gap."""
    fit = fit_effects(problem, laws)
    before = mean_square_left(problem, fit)
    if not _GAP_BESIDE * floor < before < np.inf:
        return
    gap = GapSquare(before, floor, _BESIDE_SHAPES if shapes else NEARLY_ALL)
    checks = wiring.with_laws(fit.effects, fit.known, shapes)
    linear = _linear_records(checks, campaign, fit.theta)
    of_fit = _sized_rivals(linear, checks, campaign, gap)
    for rival in (*of_fit, *_unsized_rivals(linear, checks, campaign, gap)):
        # The size of a load's noise is read above its band and not fitted.
        if rival.id == Fault.LOAD_NOISE or rival.mean_square <= gap.enough:
            yield replace(rival, laws=laws)


def _sized_rivals(
    linear: _Linear, wiring: WiringChecks, campaign: Campaign, gap: GapSquare
) -> Iterator[WiringRival]:
    """The model refitted without a channel or a run, and with faults whose size is fitted."""
    yield from lone_rivals(linear, campaign, wiring.refitted, gap)
    for faults_of in (
        filtered_signals, drifting_zeros, drifting_gain, late_load, saturating_channel,
    ):  # fmt: skip
        yield from faults_of(linear(), campaign, wiring.refitted, gap)
    yield from zeros_behind_the_torque(linear(), campaign, gap)
    if wiring.has_cheap_refits:
        yield from sized_faults(campaign, wiring.refitted)


def _unsized_rivals(
    linear: _Linear, wiring: WiringChecks, campaign: Campaign, gap: GapSquare
) -> Iterator[WiringRival]:
    """Readings that are spoilt, and the model refitted with signs and axes of the loads mended."""
    spoilt = (*jittered_samples(linear(), campaign, gap), *noisy_load(linear(), campaign, gap))
    # Either is white noise too.
    yield from spoilt or noisier_readings(linear(), campaign, gap)
    for fault in held_inputs(campaign):
        yield fault.by(wiring.refitted)
    if wiring.has_cheap_refits:
        for fault in load_faults(campaign):
            yield fault.by(wiring.refitted)


def _linear_records(wiring: WiringChecks, campaign: Campaign, theta: FloatArray) -> _Linear:
    """Runs beside their linear model: made once where they are few, else anew at every call."""
    n_samples = len(campaign.channels) * sum(run.time.size for run in campaign.runs)
    if n_samples > _MOST_HELD:
        return lambda: wiring.linear(theta)
    return cache(lambda: tuple(wiring.linear(theta)))


def _drifting(
    linear: Iterable[LinearRecord], campaign: Campaign, before: float
) -> Iterator[WiringRival]:
    """Drifting clocks as rivals, fitted together with a baseline that can be made linear."""
    runs = {run.name: run for run in campaign.runs}
    for drift in drifting_runs(linear):
        run = runs[drift.run]
        if abs(drift.seconds) > SMALLEST_DRIFT * mean_step(run.time):
            yield clock_rival(run, drift.seconds, before * (1.0 - drift.explained))


def with_findings(
    diagnosis: Diagnosis, records: tuple[CampaignWarning, ...], baseline: BaselineCheck
) -> Diagnosis:
    """Diagnosis with the findings, those of the wiring that explain most first.

    "aliased" where a wiring is as good as what is named; where nothing is named, a wiring that
    explains most of the gap is the reason.
    """
    least = _least_shown(baseline, diagnosis)
    shown = [
        (rival, share)
        for rival, share in baseline.rivals
        if share >= least or _is_beside(rival, diagnosis)
        # Values by run take something of any cause.
        if rival.id not in _BY_RUN
        or share >= _least_share(rival, diagnosis, baseline.largest_run)
        or (rival.id == Fault.RUN and diagnosis.verdict == NAMED_WITH_REMAINDER)
    ]
    # The baseline says which of two channels is the copy. Of faults that explain as much the kind
    # comes first; all others stay in their order.
    copies = {rival.about for rival, _ in shown if rival.id == Fault.COPIED_CHANNEL}
    of_records = [
        one
        for one in records
        if one.check != _COPIED or not copies.intersection(one.about.split(", "))
    ]

    def rank(finding: CampaignWarning) -> float:
        behind = AS_GOOD * (finding.id in OF_NO_KIND)
        return behind - finding.figure if finding.check == _WIRING else 0.0

    warnings = (*of_records, *replace(baseline, rivals=tuple(shown)).warnings)
    diagnosis = replace(diagnosis, warnings=tuple(sorted(warnings, key=rank)))
    reduction = diagnosis.reduction
    is_named = diagnosis.verdict in (*NAMING, CLASS_NAMED)
    is_open = diagnosis.verdict in (NONE_OF_THESE, AT_NOISE_FLOOR)
    is_open = is_open or diagnosis.reason_id == FLOOR_UNKNOWN
    if reduction is None or not (is_named or is_open):
        return diagnosis
    # Kinds of faults first, the largest share first.
    likely = sorted(baseline.rivals, key=lambda pair: (pair[0].id in OF_NO_KIND, -pair[1]))
    # What explains less than all that is named with a fault beside it is no alternative to that.
    most_beside = _most_beside(baseline, diagnosis)
    rivals = [
        (rival, share)
        for rival, share in likely
        if share >= max(_least_share(rival, diagnosis, baseline.largest_run), most_beside - AS_GOOD)
        and not _is_beside(rival, diagnosis)
    ]
    as_good = {rival.id: _explains(rival, share) for rival, share in rivals}
    with_fault = [pair for pair in likely if _is_beside(pair[0], diagnosis)]
    explained = min(reduction.phi, 1.0)
    # More of the gap, or most of the little that is left of it without the fault.
    if with_fault and with_fault[0][1] > explained + min(AS_GOOD, REPORTED * (1.0 - explained)):
        reason = f"{diagnosis.reason}; {_explains(*with_fault[0])}"
        diagnosis = replace(diagnosis, reason=reason)
    texts = {warning.check: warning.text for warning in records}
    if diagnosis.verdict != AT_NOISE_FLOOR:
        explaining = {fault: texts[check] for check, fault in _OF_RECORDS if check in texts}
        certain = {fault: texts[check] for check, fault in _CERTAIN if check in texts}
        as_good = certain | as_good | explaining
    if not is_named:
        reason = _wiring_first(as_good, diagnosis.reason)
        # What a corrected record explains is no noise.
        verdict = NONE_OF_THESE if as_good else diagnosis.verdict
        reason_id = next(iter(as_good), diagnosis.reason_id)
        return replace(diagnosis, verdict=verdict, reason_id=reason_id, reason=reason)
    which = diagnosis.attribution
    # Of a fault beside a law the other laws that are named are the alternative.
    shared = set(rivals[0][0].laws) if rivals else set()
    others = [name for name, law in _named(diagnosis).items() if law not in shared]
    aliases = [(*others, *as_good)] if as_good else []
    delays = _named_delays(diagnosis)
    if delays and "clock_shift" in texts:
        as_good[Fault.CLOCK_SHIFT] = texts["clock_shift"]
        aliases.append((*delays, Fault.CLOCK_SHIFT))
    if not as_good:
        return diagnosis
    return replace(
        diagnosis,
        verdict=ALIASED,
        reason_id=next((name for name in as_good if name != Fault.CLOCK_SHIFT), ""),
        reason=_wiring_first(as_good, diagnosis.reason),
        attribution=replace(which, aliases=(*which.aliases, *aliases)),
    )


def _explains(rival: WiringRival, share: float) -> str:
    """What a fault explains, in words."""
    return f"with {rival.text} {rival.model} explains {min(share, 1.0):.0%} of the gap"


def _is_beside(rival: WiringRival, diagnosis: Diagnosis) -> bool:
    """Whether a fault adds to all that is named: a finding, and no alternative."""
    named = _named(diagnosis)
    return bool(named) and set(named.values()) <= set(rival.laws)


def _named(diagnosis: Diagnosis) -> dict[str, str]:
    """Laws that are named, or else classes, with the law of the simulator that each is."""
    laws = diagnosis.attribution.effects
    return {law: law for law in laws} or {name: MEASURED + name for name in diagnosis.class_ids}


def _least_shown(baseline: BaselineCheck, diagnosis: Diagnosis) -> float:
    """Share that a fault must explain to be a finding: of what is named, if that leaves but noise.

    By itself, or with a fault beside it.
    """
    reduction = diagnosis.reduction
    # Which sensor an error of the sensors is of, its finding says.
    if reduction is None or any(name.startswith(_OF_CHANNELS) for name in _named(diagnosis)):
        return 0.0
    most = _most_beside(baseline, diagnosis)
    is_named = diagnosis.verdict in (NAMED, CLASS_NAMED)
    if is_named and reduction.floor_multiple <= Thresholds().near_floor:
        most = max(most, min(reduction.phi, 1.0))
    return most - AS_GOOD


def _most_beside(baseline: BaselineCheck, diagnosis: Diagnosis) -> float:
    """Largest share that all that is named explains with a fault beside it; zero where none is."""
    shares = [share for rival, share in baseline.rivals if _is_beside(rival, diagnosis)]
    return max(shares, default=0.0)


def _least_share(finding: WiringRival, diagnosis: Diagnosis, largest_run: str) -> float:
    """Share of the gap that a fault must explain to be an alias of what is named, or the reason.

    A cause that acts in the run of the largest motion alone goes with that run too, one that grows
    with the amplitude gives every run other values, and an error of a channel that is named is that
    channel's: these must explain more. Any other run must leave half of what is named leaves, any
    other fault may explain a little less.
    """
    fault = finding.id
    is_named = diagnosis.verdict in (*NAMING, CLASS_NAMED)
    if diagnosis.reduction is None or not is_named:
        return REPORTED
    far = diagnosis.reduction
    if fault == Fault.FILTERED_CHANNEL:
        # One size is as good where it leaves as little, however much both explain.
        floor, gap = far.noise_floor**2, far.rms_before**2 - far.noise_floor**2
        most = max(far.rms_after**2, floor) * Thresholds().remainder ** 2
        return min(1.0 - (most - floor) / gap, 1.0) if gap > 0.0 else 1.0
    named = (*diagnosis.attribution.effects, *diagnosis.class_ids)
    is_of_channel = any(name.startswith(_OF_CHANNELS) for name in named)
    explained = min(far.phi, 1.0)
    if fault in LONE_CHANNEL and all(name.endswith("_map") for name in named):
        # One channel is less to believe than a map of every signal on every other: stiffness,
        # loads, sensors.
        return min(NEARLY_ALL, explained - AS_GOOD)
    if fault == Fault.RUN and finding.about != largest_run:
        return 1.0 - REPORTED * (1.0 - explained)
    is_same = fault in _BY_RUN or (fault in _CHANNELS and is_of_channel)
    return explained + (AS_GOOD if is_same else -AS_GOOD)


def _wiring_first(as_good: Mapping[str, str], reason: str) -> str:
    """Reason after the wirings that explain as much; the reason alone where none does."""
    if not as_good:
        return reason
    return f"check the measurement first: {'; '.join(as_good.values())}{OTHERWISE}{reason}"


def _named_delays(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Laws, or classes where no law is named, that are a delay of the signals."""
    if "sensor_delay" in diagnosis.attribution.effects:
        return ("sensor_delay",)
    return tuple(name for name in diagnosis.class_ids if "delay" in name.split("/"))


def _unchecked(why: str) -> CampaignWarning:
    return CampaignWarning(
        "unchecked",
        "all runs",
        "clocks that drift by more than a fit finds, exchanged runs, lone samples and tones "
        f"outside the prediction were not looked for: {why}",
        "run carrierflex check on a copy of the folder with fewer [[runs]]",
        1.0,
        key_of("[[runs]]", "file"),
    )


def _wiring_warning(rival: WiringRival, share: float) -> CampaignWarning:
    return CampaignWarning(
        _WIRING,
        rival.about,
        f"{_explains(rival, share)} above the floor",
        f"check first: {fault_words(rival.id)}",
        share,
        rival.line,
        rival.id,
    )


def _late(
    wiring: WiringChecks, campaign: Campaign, theta: FloatArray, gap: float
) -> Iterator[CampaignWarning]:
    """Delays that move the baseline's parameters without a gap."""
    # What happens between two samples is the interpolation's: a small part of a step is no delay.
    # Nor is one that leaves more than `gap` once it is put back: there the slopes by which it was
    # found no longer hold.
    smallest = SMALLEST_DRIFT * min(mean_step(run.time) for run in campaign.runs)
    for late in late_signals(wiring.linear(theta)):
        if abs(late.seconds) <= smallest:
            continue
        corrected = put_back(campaign, [ClockDrift("", late.seconds, 0.0)])
        if not late.run and wiring.refitted(corrected) > gap:
            continue
        sure = f"{abs(late.seconds) / late.std:.0f} standard deviations"
        yield _delay_warning(late.run, late.seconds, sure)


def _off_gain(
    wiring: WiringChecks, campaign: Campaign, theta: FloatArray
) -> Iterator[CampaignWarning]:
    """A channel that reads too much or too little without a gap: the parameters make up for it."""
    channels = campaign.channels
    if len(channels) < 2:
        # The gain of a channel alone is the size of all that is predicted.
        return
    smallest = [
        max(SMALLEST_GAIN, _CONTRADICTS * (channel.gain_std or 0.0)) for channel in channels
    ]
    suspects = off_gains(wiring.linear(theta), smallest)
    if not suspects:
        return
    surest = suspects[0]
    names = [channels[suspect.channel].name for suspect in suspects]
    readings = ", or ".join(
        f"{name} reads {abs(suspect.gain):.1%} too {'much' if suspect.gain > 0.0 else 'little'}"
        for name, suspect in zip(names, suspects, strict=True)
    )
    yield CampaignWarning(
        "gain",
        ", ".join(names),
        f"{readings} relative to the other channels, {surest.sureness:.0f} standard deviations",
        "calibrate this sensor again, and check its amplifier and position: the baseline's "
        "parameters compensate the error",
        surest.gain,
        key_of("[[channels]]", names[0]),
    )


def _late_by_steps(
    late: Sequence[tuple[ClockDrift, float]], campaign: Campaign, before: float, floor: float
) -> Iterator[CampaignWarning]:
    """A delay of all signals that a fit of the baseline cannot find, put back."""
    step = mean_step(campaign.runs[0].time)
    for clock, remaining in late:
        if clock.run or abs(clock.delay) < _FEWEST_STEPS * step:
            continue
        share = (before - remaining) / (before - floor)
        if share >= REPORTED:
            sure = f"put back, the baseline alone explains {share:.0%} of the gap"
            yield _delay_warning("", clock.delay, sure)


def _drifting_by_steps(
    late: Sequence[tuple[ClockDrift, float]], campaign: Campaign
) -> Iterator[WiringRival]:
    """Clocks that drift by more than a fit of the baseline finds its way back from."""
    runs = {run.name: run for run in campaign.runs}
    for clock, remaining in late:
        run, size = runs.get(clock.run), max(abs(clock.delay), abs(clock.growth))
        if run is not None and size > SMALLEST_DRIFT * mean_step(run.time):
            yield clock_rival(run, clock.growth, remaining, delay=clock.delay)


def _delay_warning(run: str, seconds: float, sure: str) -> CampaignWarning:
    """Finding about signals that are late, or ever later in one run."""
    size = f"{abs(seconds) * 1e3:.2g} ms"
    text = f"the signals are {size} {'behind' if seconds > 0.0 else 'before'} the inputs"
    if run:
        text = f"the clocks of signals and inputs drift apart by {size} over run {run}"
    return CampaignWarning(
        "clock" if run else "delay",
        run or "all channels",
        f"{text}, {sure}",
        "look for filters and clocks between inputs and signals, or for all sensors turned by "
        "one angle: the baseline's parameters make up for it",
        seconds,
        "run files",
    )


def _at_bounds(fit: EffectFit) -> Iterator[CampaignWarning]:
    """Parameters of the baseline on a bound."""
    of_rig = [k for k, p in enumerate(fit.parameters) if p.effect == BASELINE and p.lower == 0.0]
    nothing = bool(of_rig) and all(_is_at_bound(fit, k) for k in of_rig)
    for k, parameter in enumerate(fit.parameters):
        of_baseline = parameter.effect == BASELINE
        if parameter.effect in ALLOWED_BY_DRAWING:
            continue
        if parameter.shape or (of_baseline and not (nothing and k in of_rig)):
            continue
        if _is_at_bound(fit, k):
            owner = "baseline" if of_baseline else plain_name(parameter.effect)
            yield CampaignWarning(
                "bound",
                parameter.name,
                f"{parameter.name} of the {owner} is at its bound, "
                f"{sized(float(fit.theta[k]), parameter.unit)}",
                "no physical value fits: check the signs of loads and sensors, units, and what the "
                "baseline contains",
                float(fit.theta[k]),
                key_of("[baseline]", "effects"),
            )


def _off_priors(fit: EffectFit, campaign: Campaign) -> Iterator[CampaignWarning]:
    """Values of the baseline that contradict what the campaign declares of them."""
    for effect, name in (key.split(".", 1) for key in campaign.baseline.fixed):
        known, value = campaign.baseline.fixed[f"{effect}.{name}"], fit.known.get((effect, name))
        if value is None or not known.std > 0.0:
            continue
        off = abs(value - known.value) / known.std
        if off > _CONTRADICTS:
            yield CampaignWarning(
                "prior",
                f"{effect}.{name}",
                f"{name} of {plain_name(effect)} is fitted as {value:.4g}, {off:.1f} standard "
                f"deviations from the declared {known.value:.4g} ± {known.std:.2g}",
                "check the declared value, the deflection curves and the calibration of the "
                "loads: records and declaration contradict each other",
                off,
                key_of("[baseline.fixed]", f"{effect}.{name}"),
            )


def _is_at_bound(fit: EffectFit, k: int) -> bool:
    parameter, value = fit.parameters[k], float(fit.theta[k])
    if not parameter.is_free:
        return False
    near = ON_BOUND * parameter.scale
    return value <= parameter.lower + near or value >= parameter.upper - near


def _quiet(campaign: Campaign, before: float, floor: float) -> Iterator[CampaignWarning]:
    """Declared noise that is larger than all that the baseline leaves."""
    declared = all(channel.noise_std is not None for channel in campaign.channels)
    if declared and before < _QUIETER**2 * floor:
        ratio = float(np.sqrt(before / floor))
        yield CampaignWarning(
            "declared_noise",
            ", ".join(channel.name for channel in campaign.channels),
            f"the whole gap of the baseline is {ratio:.2f} of the declared noise",
            "leave noise_std out, or take it from repeats or from a record at rest: a floor that "
            "is too high hides every effect",
            ratio,
            key_of("[[channels]]", "noise_std"),
        )


#: Share of the samples that lone samples may be, which must make what is reported of the gap.
_FEW = 0.02
#: Size of a lone sample over the median size in its channel, and over its two neighbours.
_FAR, _ALONE = 10.0, 3.0
#: Largest amplitude of a tone over its smallest, and the same of the signals: they tell a tone that
#: is there by itself from one that grows with the load.
_STEADY = 1.3
_GROWS = 1.5
#: Share of the gap above the floor that a tone must make.
_OF_THE_GAP = 0.3


def _residual_findings(
    records: Sequence[PredictedRecord], campaign: Campaign, floor: float
) -> Iterator[CampaignWarning]:
    """Checks ``outliers`` and ``tone`` of what the fitted baseline leaves of the records."""
    # Beside a signal three thousand times the noise a tone of ten floors, or a sample that repeats
    # the one before, is no more to be seen than the gap itself.
    runs = {run.name: run for run in campaign.runs}
    for c, channel in enumerate(campaign.channels):
        of_channel = [
            replace(one, measured=one.measured[:, c], predicted=one.predicted[:, c])
            for one in records
        ]
        known = np.concatenate([one.residual[np.isfinite(one.residual)] for one in of_channel])
        above = float(np.sum(known**2)) - floor * known.size
        if above > 0.0:
            yield from _lone_samples(channel, of_channel, runs, above)
            yield from _steady_tone(channel, of_channel, runs, above)


def _lone_samples(
    channel: Channel, records: Sequence[PredictedRecord], runs: Mapping[str, Run], above: float
) -> Iterator[CampaignWarning]:
    """Few samples, each far beyond its neighbours, that make most of the gap of a channel."""
    count, size, square = 0, 0, 0.0
    worst = ("", 0, 0.0)
    for record in records:
        values = np.abs(np.where(np.isfinite(record.residual), record.residual, 0.0))
        neighbours = np.maximum(values[:-2], values[2:])
        middle = values[1:-1]
        typical = float(np.median(values[values > 0.0])) if values.any() else 0.0
        alone = (middle > _FAR * typical) & (middle > _ALONE * neighbours)
        size += values.size
        count += int(alone.sum())
        square += float(np.sum(middle[alone] ** 2))
        if alone.any():
            k = int(np.argmax(np.where(alone, middle, 0.0)))
            worst = max(worst, (record.run, k + 1, float(middle[k])), key=lambda entry: entry[2])
    if 0 < count <= _FEW * size and square > REPORTED * above:
        run, sample, distance = worst
        yield CampaignWarning(
            "outliers",
            channel.name,
            f"{count} samples make {min(square / above, 1.0):.0%} of the gap, each alone, the "
            f"worst {sized(distance, channel.unit)} from the prediction in run {run}",
            "leave these cells empty if they are dropouts or spikes of the measuring chain; keep "
            "them if the machine strikes there: several channels at once, or where motion turns",
            float(count),
            sample_of(runs[run].file, sample),
        )


def _steady_tone(
    channel: Channel, records: Sequence[PredictedRecord], runs: Mapping[str, Run], above: float
) -> Iterator[CampaignWarning]:
    """A line at one frequency, as large in runs whose signals are not."""
    shown = []
    for record in records:
        lines = lines_that_stand_out(record.time, record.residual)
        line = max(lines, key=lambda line: line.amplitude, default=None)
        if line and not _is_of_the_machine(runs[record.run], record, line.frequency_hz):
            level = float(np.nanstd(record.measured))
            shown.append((line.frequency_hz, line.amplitude, level, record))
    if len(shown) < 2:
        return
    typical = float(np.median([entry[0] for entry in shown]))
    alike = [
        entry
        for entry in shown
        if abs(entry[0] - typical) < 2.0 / float(entry[3].time[-1] - entry[3].time[0])
    ]
    if len(alike) <= IN_RUNS * len(records) or len(alike) < 2:
        return
    amplitudes, levels = np.array([entry[1:3] for entry in alike]).T
    square = sum(0.5 * entry[1] ** 2 * entry[3].time.size for entry in alike)
    is_steady = amplitudes.max() < _STEADY * amplitudes.min()
    if is_steady and levels.max() > _GROWS * levels.min() and square > _OF_THE_GAP * above:
        size = sized(float(np.median(amplitudes)), channel.unit)
        yield CampaignWarning(
            "tone",
            channel.name,
            f"a tone of {typical:.3f} Hz, amplitude {size}, in {len(alike)} of {len(records)} "
            "runs beside the prediction, as large in all of them while the signals are not",
            "look for electrical hum (shield, ground, filter before sampling) or for something "
            "else that vibrates at this frequency",
            typical,
            sample_of(runs[alike[0][3].run].file, 0),
        )


def _is_of_the_machine(run: Run, record: PredictedRecord, frequency: float) -> bool:
    """Whether a line is an order of the shaft, or of a drive or its harmonics."""
    known = np.isfinite(record.residual)
    time = run.time - run.time[0]
    level = np.interp(time, record.time[known] - record.time[0], record.residual[known])
    drives = [drive for name, drive in run.inputs.items() if name != "carrier_angle"]
    return turns_with_the_shaft(run, level, frequency) or any(
        answers_few_lines(drive, run.time, frequency) for drive in drives
    )

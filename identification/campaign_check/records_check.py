"""All findings that the records of a campaign give by themselves."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.quantities import sized
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import (
    CampaignWarning,
    key_of,
    merged,
    sample_of,
)
from carrierflex.identification.campaign_check.copies import copied_runs, copy_findings
from carrierflex.identification.campaign_check.probe_angles import (
    ProbeAngle,
    probe_angles,
    probe_findings,
)
from carrierflex.identification.campaign_check.releases import release_findings
from carrierflex.identification.campaign_check.sample_faults import sample_faults
from carrierflex.identification.campaign_check.sample_statistics import neighbour_noise
from carrierflex.identification.campaign_check.tones import tone_findings
from carrierflex.identification.campaign_check.units import unit_findings

#: A step over the median step that is a gap, and the jitter of the steps that is told.
_GAP, _JITTER = 3.0, 0.2
#: Samples a revolution beyond those of the planets' second order: the sixth of three planets takes
#: more than twelve.
_BEYOND_SECOND_ORDER = 4
#: Share of the power of a drive above 0.8 of half the sampling rate.
_HIGHEST_SHARE = 0.05
#: Values of an input that is read coarsely (fewer are set points), and share of the samples at
#: which it changes (less is a staircase).
_FEWEST_LEVELS, _MOST_LEVELS, _MOVES = 10, 300, 0.02
#: Distance from a multiple of a step that is rounding, and share of the steps that are multiples.
_ON_GRID, _MOST_ON_GRID = 0.05, 0.9
#: A shift below this share of a step of time changes nothing that is measured.
_NOTICED = 0.1
_Curves = Mapping[str, DeflectionCurve]
#: Radius of a sensor beside that of the rig.
_RADIUS = 0.05
#: Change of a periodic drive from one period to the next over the drive.
_NOT_PERIODIC = 0.1
#: Effects whose sizes are sizes of deflection, and what an unrecorded rotor moment of +-300 kN m
#: does to order 3 at 360 kN m in the stage (a sun that floats, published clearances).
_DEFLECTIONS, _BY_MOMENT = ("stiff_pins", "flexible_pins"), 0.14
#: Loads of a mounting.
_LOADS = ("torque", "ntl_y", "ntl_z")
#: Load while the zero is taken, over the largest; range of some hundred samples of noise over its
#: standard deviation.
_AT_REST, _RANGE_OF_NOISE = 0.02, 8.0
#: Mean of a signal over its standard deviation up to which it was taken out: digits of a file.
_NO_MEAN = 1e-4
#: Mean of the zeroing samples, in errors of a mean of noise with some memory.
_NOT_ZERO = 10.0
#: Noise between neighbouring samples over the declared noise. Noise with a memory of one sample
#: (0.5) has 0.6 of it.
_NOISIER = 3.0
#: Share of the runs in which torque acts against the rotation.
_LOADED = 0.02


def records_findings(
    campaign: Campaign,
    curves: _Curves | None = None,
    copies: Mapping[str, str] | None = None,
    probes: Sequence[ProbeAngle] | None = None,
) -> tuple[CampaignWarning, ...]:
    """Findings about a campaign that need no simulation.

    Parameters
    ----------
    campaign : Campaign
        Records and declarations.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.
    copies : mapping of str to str, optional
        Runs that are copies, where :func:`copied_runs` told them already.
    probes : sequence of ProbeAngle, optional
        Probes of a carrier, where :func:`probe_angles` read them already.

    Returns
    -------
    tuple of CampaignWarning
        What the rig declares first, then units, sampling and single samples; empty where nothing
        stands out.
    """
    return merged(
        [
            *unit_findings(campaign),
            *_rig_findings(campaign, curves, probes),
            *clock_shift_findings(campaign),
            *copy_findings(campaign, copied_runs(campaign) if copies is None else copies),
            *_sampling_findings(campaign),
            *sample_faults(campaign),
            *(tone_findings(campaign) if campaign.contract.inputs else release_findings(campaign)),
        ]
    )


def _sampling_findings(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Findings about the time column of every run."""
    n_planets = int(campaign.rig.get("n_planets", CarrierParameters.n_planets))
    fewest = 4 * n_planets + _BEYOND_SECOND_ORDER
    for run in campaign.runs:
        if run.time.size > 3:
            yield from _gaps(run)
            yield from _samples_a_revolution(run, fewest)
            for name in run.inputs:
                yield from _coarse_input(run, name)
            if campaign.kind == "element":
                for name in campaign.contract.inputs:
                    yield from _drive_spectrum(run, name)


def _coarse_input(run: Run, name: str) -> Iterator[CampaignWarning]:
    """An input that moves all the time and takes few values."""
    values = run.inputs[name]
    levels = np.unique(values)
    changes = float(np.mean(np.diff(values) != 0.0))
    if not (_FEWEST_LEVELS <= levels.size <= _MOST_LEVELS and changes > _MOVES):
        return
    apart = np.diff(levels)
    step = float(np.median(apart))
    # A periodic load sampled at the same phases takes few values too, and no grid holds them.
    if np.mean(np.abs(apart / step - np.round(apart / step)) < _ON_GRID) < _MOST_ON_GRID:
        return
    yield CampaignWarning(
        "quantised",
        name,
        f"run {run.name}: {name} takes {levels.size} values, {step:.3g} apart, "
        f"{step / float(np.ptp(levels)):.1%} of its range",
        "use a finer range of its amplifier: steps between two values look like an effect missing "
        "in the simulation",
        step,
        sample_of(run.file, 0),
    )


def _gaps(run: Run) -> Iterator[CampaignWarning]:
    step = np.diff(run.time)
    typical = float(np.median(step))
    longest = int(np.argmax(step))
    line = sample_of(run.file, longest + 1)
    if step[longest] > _GAP * typical:
        missing = float(np.sum(step[step > _GAP * typical]))
        yield CampaignWarning(
            "sampling_gap",
            run.name,
            f"time jumps by {step[longest]:.4g} s where a step is {typical:.4g} s; "
            f"{missing:.4g} s are missing in all",
            "cut the run in two at the gap, or write empty cells for the samples that are missing",
            float(step[longest]),
            line,
        )
        return
    scatter = float(np.std(step)) / typical
    if scatter > _JITTER:
        yield CampaignWarning(
            "uneven_steps",
            run.name,
            f"steps of time scatter by {scatter:.0%}",
            "use the clock of the logger, not the time of arrival of the samples",
            scatter,
            line,
        )


def _samples_a_revolution(run: Run, fewest: int) -> Iterator[CampaignWarning]:
    angle = run.inputs.get("carrier_angle")
    if angle is None:
        return
    revolutions = abs(float(angle[-1] - angle[0])) / (2.0 * np.pi)
    if revolutions < 1.0 or not np.diff(angle).any():
        return
    a_revolution = float(np.count_nonzero(np.diff(angle)) / revolutions)
    if a_revolution < fewest:
        yield CampaignWarning(
            "sampling_rate",
            run.name,
            f"{a_revolution:.1f} samples a revolution; orders above {a_revolution / 2.56:.0f} "
            "fold back onto lower ones",
            f"sample at least {fewest} times a revolution, behind a filter; "
            "check that carrier_angle is in rad and time in s",
            a_revolution,
            sample_of(run.file, 0),
        )


def _drive_spectrum(run: Run, name: str) -> Iterator[CampaignWarning]:
    """Power of an element's drive near half the sampling rate."""
    drive = run.inputs[name] - np.mean(run.inputs[name])
    power = np.abs(np.fft.rfft(drive * np.hanning(drive.size))) ** 2
    total = float(power.sum())
    if total <= 0.0:
        return
    share = float(power[int(0.8 * power.size) :].sum()) / total
    if share > _HIGHEST_SHARE:
        yield CampaignWarning(
            "sampling_rate",
            run.name,
            f"{share:.0%} of the power of '{name}' lies above 0.8 of half the sampling rate; more "
            "of it may have folded back",
            "sample faster, or drive with a lower band; filter before sampling",
            share,
            sample_of(run.file, 0),
        )


def clock_shift_findings(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Finding about clocks that were moved, the largest shift first.

    Yields
    ------
    CampaignWarning
        Check ``clock_shift``.
    """
    steps = {run.name: mean_step(run.time) for run in campaign.runs}
    moved = {
        name: known
        for name, known in campaign.baseline.clock_shift.items()
        if abs(known.value) > _NOTICED * steps.get(name, 0.0)
    }
    if not moved:
        return
    name, known = max(moved.items(), key=lambda item: abs(item[1].value))
    more = f" (and {len(moved) - 1} more runs)" if len(moved) > 1 else ""
    yield CampaignWarning(
        "clock_shift",
        "sensor_delay",
        f"the import moved the simulator's clock by {1e3 * known.value:.4g} ± "
        f"{1e3 * known.std:.1g} ms in run {name}{more}: a sensor_delay looks the same, and these "
        "records tell the sum of both",
        "record both with one clock and import with shift = 0, or measure the delay of the sensors",
        float(known.value),
        key_of("[baseline.clock_shift]", name),
    )


def _rig_findings(
    campaign: Campaign, curves: _Curves | None, probes: Sequence[ProbeAngle] | None
) -> Iterator[CampaignWarning]:
    """Findings about what the campaign declares."""
    if curves is not None:
        yield from _lobes(campaign, curves)
    if campaign.kind == "carrier":
        yield from _radii(campaign)
        yield from probe_findings(probe_angles(campaign) if probes is None else probes)
        yield from _no_radial_load(campaign)
    if campaign.kind in ("carrier", "mounting"):
        yield from _torque_against_rotation(campaign)
    if campaign.kind == "mounting":
        yield from _detrended(campaign) if _is_detrended(campaign) else _zeroing(campaign)
    if campaign.kind == "element" and campaign.rig.get("period_samples"):
        for name in campaign.contract.inputs:
            yield from _period(campaign, name, int(campaign.rig["period_samples"]))
    yield from _declared_noise(campaign)


def _lobes(campaign: Campaign, curves: _Curves) -> Iterator[CampaignWarning]:
    """Largest order of the curve under torque, which the planets make."""
    n_planets = int(campaign.rig["n_planets"])
    curve = curves.get("delta_f")
    if curve is None:
        return
    orders = np.abs(np.fft.rfft(curve.axial))[1:]
    lobes = int(np.argmax(orders)) + 1
    if orders.max() > 0.0 and lobes != n_planets:
        yield CampaignWarning(
            "n_planets",
            "n_planets",
            f"n_planets is {n_planets}, the deflection curve delta_f has {lobes} lobes",
            f"n_planets = {lobes}, or the curves of a carrier of {n_planets} planets",
            float(lobes),
            key_of("[rig]", "n_planets"),
        )


def _no_radial_load(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Sizes of deflection are fitted although no radial load is recorded."""
    fixed = {key.split(".")[0] for key in campaign.baseline.fixed}
    sizes = [
        name for name in _DEFLECTIONS if name in campaign.baseline.effects and name not in fixed
    ]
    if "ntl_y" not in campaign.contract.inputs:
        # The rig has none: it is stated.
        return
    loads = [run.inputs[name] for run in campaign.runs for name in ("ntl_y", "ntl_z")]
    if sizes and not any(load.any() for load in loads):
        yield CampaignWarning(
            "no_radial_load",
            "ntl_y, ntl_z",
            "no radial load is recorded, and the sizes of "
            f"{' and '.join(sizes)} are fitted: a rotor moment of 300 kN m that is not recorded "
            f"changes order 3 of the deflection by up to {_BY_MOMENT:.0%}",
            "record the rotor moment as ntl_y and ntl_z, or state that the rig has none "
            '(radial_load = "none" in [rig])',
            _BY_MOMENT,
            key_of("[[runs]]", "ntl_y"),
        )


def _radii(campaign: Campaign) -> Iterator[CampaignWarning]:
    rig_radius = float(campaign.rig["sensor_radius"])
    for channel in campaign.channels:
        if channel.radius and abs(channel.radius / rig_radius - 1.0) > _RADIUS:
            yield CampaignWarning(
                "sensor_radius",
                channel.name,
                f"radius_m is {channel.radius:.4g}, [rig] sensor_radius {rig_radius:.4g} m",
                "measure the radius of the sensor's target, and declare the same value in both "
                "tables",
                channel.radius / rig_radius,
                key_of(f"[[channels]] {channel.name}", "radius_m"),
            )


def _torque_against_rotation(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Torque that drives the carrier has the sign of its rotation."""
    largest = max(float(np.abs(run.inputs["torque"]).max()) for run in campaign.runs)
    against = [
        run
        for run in campaign.runs
        if run.inputs["torque"].mean() * _turned(run) < 0.0
        and abs(run.inputs["torque"].mean()) > _LOADED * largest
    ]
    if against:
        mean = float(against[0].inputs["torque"].mean())
        yield CampaignWarning(
            "torque_sign",
            "torque",
            f"in {len(against)} of {len(campaign.runs)} runs torque acts against the rotation "
            f"(mean {mean:.4g} N m)",
            "positive torque drives the carrier towards increasing carrier_angle: turn the sign of "
            "the torque, or of the angle",
            mean,
            sample_of(against[0].file, 0),
        )


def _turned(run: Run) -> float:
    """Angle by which the carrier turns in a run [rad]."""
    angle = run.inputs["carrier_angle"]
    return float(angle[-1] - angle[0])


def _period(campaign: Campaign, name: str, period: int) -> Iterator[CampaignWarning]:
    for run in campaign.runs:
        drive = run.inputs[name]
        settle = int(campaign.rig.get("settle_samples") or 0)
        settled = drive[settle:]
        if settled.size <= period:
            if campaign.rig.get("periodic"):
                yield CampaignWarning(
                    "period_samples",
                    run.name,
                    f"period_samples is {period}, the run holds {settled.size} settled samples",
                    "count the samples of one period of the drive",
                    float(period),
                    key_of("[rig]", "period_samples"),
                )
            continue
        change = settled[period:] - settled[:-period]
        ratio = float(np.std(change) / (np.std(settled) or 1.0))
        if ratio > _NOT_PERIODIC:
            yield CampaignWarning(
                "period_samples",
                run.name,
                f"'{name}' changes by {ratio:.0%} of itself from one period of {period} samples to "
                "the next",
                "count the samples of one period of the drive, or set periodic = false and leave "
                "period_samples out",
                ratio,
                key_of("[rig]", "period_samples"),
            )


def _is_detrended(campaign: Campaign) -> bool:
    """Whether no signal of any run has a mean, though loads have one: it was taken out."""
    signals = [values for run in campaign.runs for values in run.signals.values()]
    loads = [run.inputs[name] for run in campaign.runs for name in _LOADS]
    return any(abs(load.mean()) > load.std() for load in loads) and all(
        abs(float(np.nanmean(values))) <= _NO_MEAN * float(np.nanstd(values))
        for values in signals
        if np.isfinite(values).any()
    )


def _detrended(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Means taken out of whole records."""
    names = ", ".join(channel.name for channel in campaign.channels)
    yield CampaignWarning(
        "detrended",
        names,
        "no channel has a mean over its run, while the loads have one: means or straight lines "
        "were taken out of the signals, or the amplifier is AC-coupled",
        "use the signals as they were recorded; subtract the mean over the zeroing samples alone",
        0.0,
        key_of("[[channels]]", campaign.channels[0].name),
    )


def _zeroing(campaign: Campaign) -> Iterator[CampaignWarning]:
    """The zero is taken at rest, and the signals are relative to it."""
    n = int(campaign.rig["zeroing_samples"])
    key = key_of("[rig]", "zeroing_samples")
    remedy = (
        "count the samples at rest before the load comes, and subtract each signal's mean over them"
    )
    for run in campaign.runs:
        if n >= run.time.size:
            text = f"zeroing_samples is {n}, the run holds {run.time.size} samples"
            yield CampaignWarning("zeroing", run.name, text, remedy, float(n), key)
            continue
        for name in _LOADS:
            values = run.inputs[name]
            largest = max(float(np.abs(other.inputs[name]).max()) for other in campaign.runs)
            change = float(np.ptp(values[:n]))
            allowed = max(_AT_REST * largest, _RANGE_OF_NOISE * neighbour_noise(values))
            if largest > 0.0 and change > allowed:
                text = f"'{name}' changes by {change:.4g} within the {n} samples of the zero"
                yield CampaignWarning("zeroing", run.name, text, remedy, change, key)
                break
        off = [mean for mean in _means_off_zero(campaign, run, n) if mean > 0.0]
        # One channel off its zero is an effect of its own.
        if len(off) > 0.5 * len(campaign.channels):
            text = (
                f"{len(off)} channels are not zero over the {n} samples of the zero, the worst by "
                f"{sized(max(off), 'm')}"
            )
            yield CampaignWarning("zeroing", run.name, text, remedy, max(off), key)


def _means_off_zero(campaign: Campaign, run: Run, n: int) -> Iterator[float]:
    """Mean of the first samples of every channel [m]; zero where noise may have made it."""
    for channel in campaign.channels:
        values = run.signals[channel.name]
        noise = channel.noise_std or neighbour_noise(values)
        mean = abs(float(np.nanmean(values[:n]))) if np.isfinite(values[:n]).any() else 0.0
        beyond = np.isfinite(noise) and mean > max(_NOT_ZERO * noise / np.sqrt(n), 1e-9)
        yield mean if beyond else 0.0


def _declared_noise(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Declared noise beside that between neighbouring samples."""
    for channel in campaign.channels:
        if channel.noise_std is None:
            continue
        scatter = [neighbour_noise(run.signals[channel.name]) for run in campaign.runs]
        known = [value for value in scatter if np.isfinite(value)]
        noise = float(np.median(known)) if known else 0.0
        if noise > _NOISIER * channel.noise_std:
            yield CampaignWarning(
                "declared_noise",
                channel.name,
                f"noise_std is {sized(channel.noise_std, channel.unit)}, neighbouring samples "
                f"scatter by {sized(noise, channel.unit)}",
                "take noise_std from a record at rest: what scatters under load alone may be a "
                "load that was not recorded",
                noise / channel.noise_std,
                key_of(f"[[channels]] {channel.name}", "noise_std"),
            )

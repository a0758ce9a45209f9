"""What campaign.toml states beside what the records show."""

from collections.abc import Iterator, Mapping

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import (
    CampaignWarning,
    key_of,
    sample_of,
)
from carrierflex.identification.campaign_check.sample_statistics import neighbour_noise

Curves = Mapping[str, DeflectionCurve]

#: Radius of a sensor beside that of the rig.
_RADIUS = 0.05
#: Change of a periodic drive from one period to the next over the drive.
_NOT_PERIODIC = 0.1
#: Load while the zero is taken, over the largest.
_AT_REST = 0.02
#: Mean of the zeroing samples, in errors of a mean of noise with some memory.
_NOT_ZERO = 10.0
#: Noise between neighbouring samples over the declared noise. Noise with a memory of one sample
#: (0.5) has 0.6 of it.
_NOISIER = 3.0
#: Share of the runs in which torque acts against the rotation.
_LOADED = 0.02


def rig_findings(campaign: Campaign, curves: Curves | None) -> Iterator[CampaignWarning]:
    """Findings about what the campaign declares.

    Parameters
    ----------
    campaign : Campaign
        Records and declarations.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves of a carrier.

    Yields
    ------
    CampaignWarning
        Checks ``n_planets``, ``sensor_radius``, ``period_samples``, ``zeroing``,
        ``declared_noise``, ``torque_sign``.
    """
    if curves is not None:
        yield from _lobes(campaign, curves)
    if campaign.kind == "carrier":
        yield from _radii(campaign)
    if campaign.kind in ("carrier", "mounting"):
        yield from _torque_against_rotation(campaign)
    if campaign.kind == "mounting":
        yield from _zeroing(campaign)
    if campaign.kind == "element" and campaign.rig.get("period_samples"):
        for name in campaign.contract.inputs:
            yield from _period(campaign, name, int(campaign.rig["period_samples"]))
    yield from _declared_noise(campaign)


def _lobes(campaign: Campaign, curves: Curves) -> Iterator[CampaignWarning]:
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


def _radii(campaign: Campaign) -> Iterator[CampaignWarning]:
    rig_radius = float(campaign.rig["sensor_radius"])
    for channel in campaign.channels:
        if channel.radius and abs(channel.radius / rig_radius - 1.0) > _RADIUS:
            yield CampaignWarning(
                "sensor_radius",
                channel.name,
                f"radius_m is {channel.radius:.4g}, [rig] sensor_radius {rig_radius:.4g} m",
                "measure the radius that the sensor looks at, and state the same in both places",
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


def _zeroing(campaign: Campaign) -> Iterator[CampaignWarning]:
    """The zero is taken at rest, and the signals are relative to it."""
    n = int(campaign.rig["zeroing_samples"])
    place = key_of("[rig]", "zeroing_samples")
    remedy = (
        "count the samples at rest before the load comes, and subtract each signal's mean over them"
    )
    for run in campaign.runs:
        if n >= run.time.size:
            text = f"zeroing_samples is {n}, the run holds {run.time.size} samples"
            yield CampaignWarning("zeroing", run.name, text, remedy, float(n), place)
            continue
        for name in ("torque", "ntl_y", "ntl_z"):
            values = run.inputs[name]
            largest = max(float(np.abs(other.inputs[name]).max()) for other in campaign.runs)
            change = float(np.ptp(values[:n]))
            if largest > 0.0 and change > _AT_REST * largest:
                text = f"'{name}' changes by {change:.4g} within the {n} samples of the zero"
                yield CampaignWarning("zeroing", run.name, text, remedy, change, place)
                break
        off = [mean for mean in _means_off_zero(campaign, run, n) if mean > 0.0]
        # One channel off its zero is an effect of its own.
        if len(off) > 0.5 * len(campaign.channels):
            text = (
                f"{len(off)} channels are not zero over the {n} samples of the zero, the worst by "
                f"{max(off):.3g} m"
            )
            yield CampaignWarning("zeroing", run.name, text, remedy, max(off), place)


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
                f"noise_std is {channel.noise_std:.3g} {channel.unit}, neighbouring samples "
                f"scatter by {noise:.3g}",
                "leave noise_std out, or take it from repeats or from a record at rest",
                noise / channel.noise_std,
                key_of(f"[[channels]] {channel.name}", "noise_std"),
            )

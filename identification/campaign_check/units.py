"""Values that no rig of this kind has: micrometres for metres, kN m, degrees, milliseconds.

Every limit lies at least a factor of ten beyond what such a rig does and at least ten short of what
a wrong prefix makes of it.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import (
    CampaignWarning,
    key_of,
    sample_of,
)

FloatArray = NDArray[np.float64]

#: Speed of a main shaft [rad/s]: 0.1 to 200 rpm.
_SLOWEST, _FASTEST = 0.1 * np.pi / 30.0, 200.0 * np.pi / 30.0
#: Motion over the radius or arm that it is measured at.
_LARGEST_MOTION = 0.05
#: Largest torque over the nominal one.
_SMALLEST_TORQUE, _LARGEST_TORQUE = 0.01, 10.0
#: Radial load times radius over nominal torque; the load's mean over its scatter that makes it one.
_SMALLEST_LOAD = 1e-3
_LARGEST_LOAD = 30.0
_IS_LOAD = 5.0
#: Radii and arms of a drivetrain [m], and torques [N m] and radial loads [N] of a mounting.
_LENGTHS = (0.01, 20.0)
_TORQUES = (2e3, 5e7)
#: Radii of gyration of a housing over its arm to the bushings: a solid ring has about one.
_GYRATION = (0.1, 5.0)
_FORCES = (1e3, 5e7)
#: Longest step of a mount that vibrates [s], its largest deflection [m] and speed [m/s].
_LONGEST_STEP = 1.0
_DEFLECTION = 0.3
_SPEED = 10.0
#: Channels of one quantity whose motion differs by this factor.
_UNLIKE = 100.0


def unit_findings(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Findings about the size of inputs and channels.

    Yields
    ------
    CampaignWarning
        Check ``unit``.
    """
    yield from _unlike_channels(campaign)
    yield from _unlike_predictions(campaign)
    if campaign.kind == "carrier":
        yield from _carrier(campaign)
    elif campaign.kind == "mounting":
        yield from _mounting(campaign)
    elif _is_in_si(campaign):
        yield from _element(campaign)


def _warning(
    campaign: Campaign, about: str, figure: float, text: str, remedy: str, line: str = ""
) -> CampaignWarning:
    location = line or sample_of(campaign.runs[0].file, 0)
    return CampaignWarning("unit", about, text, remedy, figure, location)


def _carrier(campaign: Campaign) -> Iterator[CampaignWarning]:
    rig = campaign.rig
    nominal, radius = float(rig["nominal_torque"]), float(rig["sensor_radius"])
    yield from _lengths(campaign, {"sensor_radius": radius})
    yield from _shaft_speed(campaign)
    yield from _motion(campaign, radius, "sensor_radius")
    largest = _largest(campaign, "torque")
    if 0.0 < largest < _SMALLEST_TORQUE * nominal or largest > _LARGEST_TORQUE * nominal:
        yield _warning(
            campaign,
            "torque",
            largest / nominal,
            f"the largest torque, {largest:.4g} N m, is {largest / nominal:.2g} of nominal_torque "
            f"{nominal:.4g} N m",
            "give torque in N m (kN m times 1000), or correct [rig] nominal_torque",
        )
    yield from _radial_load(
        campaign, _SMALLEST_LOAD * nominal / radius, _LARGEST_LOAD * nominal / radius
    )
    angles = [channel.angle for channel in campaign.channels if channel.angle is not None]
    span = float(np.ptp(angles)) if angles else 0.0
    if len(set(angles)) > 2 and span < np.deg2rad(2.0 * np.pi):
        yield _warning(
            campaign,
            "angle_deg",
            float(np.rad2deg(span)),
            f"all sensors lie within {np.rad2deg(span):.2f} deg",
            "give angle_deg in degrees, not in radians",
            key_of("[[channels]]", "angle_deg"),
        )


def _mounting(campaign: Campaign) -> Iterator[CampaignWarning]:
    lengths = ("R_x", "R_z", "R_b", "coupling_arm", "main_bearing_x")
    yield from _lengths(campaign, {name: abs(float(campaign.rig[name])) for name in lengths})
    yield from _shaft_speed(campaign)
    yield from _motion(campaign, float(campaign.rig["R_x"]), "R_x")
    largest = _largest(campaign, "torque")
    if 0.0 < largest < _TORQUES[0] or largest > _TORQUES[1]:
        yield _warning(
            campaign,
            "torque",
            largest,
            f"the largest torque is {largest:.4g} N m",
            "give torque in N m (kN m times 1000)",
        )
    yield from _radial_load(campaign, *_FORCES)
    yield from _speed_beside_angle(campaign)
    yield from _radii_of_gyration(campaign)


def _radii_of_gyration(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Radii of gyration of the housing, sqrt(I/m), beside its arm."""
    mass, arm = float(campaign.rig["housing_mass"]), abs(float(campaign.rig["R_x"]))
    inertia = np.abs(np.asarray(campaign.rig["housing_inertia"], dtype=np.float64))
    if not (mass > 0.0 and arm > 0.0 and inertia.size and (inertia > 0.0).any()):
        return
    radius = np.sqrt(inertia[inertia > 0.0] / mass)
    worst = float(radius[np.argmax(np.abs(np.log(radius / arm)))])
    if not _GYRATION[0] * arm <= worst <= _GYRATION[1] * arm:
        yield _warning(
            campaign,
            "housing_inertia",
            worst,
            f"housing_inertia and housing_mass make a radius of gyration of {worst:.3g} m, the "
            f"arm R_x is {arm:.3g} m",
            "give housing_inertia in kg m^2 and housing_mass in kg",
        )


def _element(campaign: Campaign) -> Iterator[CampaignWarning]:
    """A mount in m and N; analogues in other units may have any size."""
    for run in campaign.runs:
        step = float(np.median(np.diff(run.time))) if run.time.size > 1 else 0.0
        if step > _LONGEST_STEP:
            yield _warning(
                campaign,
                "time",
                step,
                f"run {run.name}: a step of time is {step:.4g} s",
                "give time in s (ms over 1000)",
                sample_of(run.file, 1),
            )
        deflection = {**run.inputs, **run.signals}.get("displacement")
        if deflection is None:
            names = [c.name for c in campaign.channels if c.quantity == "displacement"]
            deflection = run.signals[names[0]] if names else None
        if deflection is None or step <= 0.0:
            continue
        size = float(np.nanstd(deflection))
        speed = float(np.nanmedian(np.abs(np.diff(deflection)))) / step
        if size > _DEFLECTION or speed > _SPEED:
            yield _warning(
                campaign,
                "displacement",
                size,
                f"run {run.name}: the element moves by {size:.4g} m (RMS) and mostly at more than "
                f"{speed:.3g} m/s",
                "give displacements in m (mm over 1000, um over 1e6) and time in s",
                sample_of(run.file, 0),
            )


def _lengths(campaign: Campaign, lengths: Mapping[str, Any]) -> Iterator[CampaignWarning]:
    for name, length in lengths.items():
        if not (_LENGTHS[0] <= length <= _LENGTHS[1]) and length != 0.0:
            yield _warning(
                campaign,
                name,
                length,
                f"{name} is {length:.4g} m",
                "give lengths in m (mm over 1000)",
                key_of("[rig]", name),
            )


def _shaft_speed(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Speed of the carrier from its angle: degrees and milliseconds are far off."""
    for run in campaign.runs:
        angle = run.inputs["carrier_angle"]
        turned = abs(float(angle[-1] - angle[0]))
        if turned < 2.0 * np.pi:
            continue
        step = np.abs(np.diff(angle)) / np.diff(run.time)
        speed = float(np.quantile(step, 0.9))
        if not _SLOWEST <= speed <= _FASTEST:
            yield _warning(
                campaign,
                "carrier_angle",
                speed,
                f"run {run.name}: the carrier turns at {speed * 30.0 / np.pi:.4g} rpm",
                "give carrier_angle in rad (deg times pi/180) and time in s (ms over 1000)",
                sample_of(run.file, 1),
            )


def _motion(campaign: Campaign, radius: float, name: str) -> Iterator[CampaignWarning]:
    for channel in campaign.channels:
        for run in campaign.runs:
            values = run.signals[channel.name]
            present = values[np.isfinite(values)]
            # A spike is no unit.
            size = float(np.ptp(np.quantile(present, (0.02, 0.98)))) if present.size else 0.0
            if size > _LARGEST_MOTION * radius:
                yield _warning(
                    campaign,
                    channel.name,
                    size / radius,
                    f"run {run.name}: moves by {size:.4g} m, {size / radius:.2g} of {name} "
                    f"{radius:.4g} m",
                    "give displacements in m (mm over 1000, um over 1e6)",
                    sample_of(run.file, 0),
                )


def _radial_load(campaign: Campaign, smallest: float, largest: float) -> Iterator[CampaignWarning]:
    """A load that acts, too small or too large; without one there is noise about zero."""
    for name in ("ntl_y", "ntl_z"):
        columns = [run.inputs[name] for run in campaign.runs if name in run.inputs]
        acts = [column for column in columns if _is_load(column)]
        size = max((float(np.abs(column).max()) for column in acts), default=0.0)
        if 0.0 < size < smallest or size > largest:
            yield _warning(
                campaign,
                name,
                size,
                f"the radial load never exceeds {size:.4g} N"
                if size < smallest
                else f"the radial load reaches {size:.4g} N",
                "give radial loads in N (kN times 1000)",
            )


def _is_load(column: FloatArray) -> bool:
    """Whether a column is more than noise about zero."""
    size = max(abs(float(np.mean(column))), float(np.std(column)))
    return size > _IS_LOAD * float(np.std(np.diff(column)))


def _speed_beside_angle(campaign: Campaign) -> Iterator[CampaignWarning]:
    """The column `speed` against the slope of the carrier angle."""
    for run in campaign.runs:
        speed, angle = run.inputs["speed"], run.inputs["carrier_angle"]
        turned, integral = float(angle[-1] - angle[0]), float(np.trapezoid(speed, run.time))
        if max(abs(turned), abs(integral)) < 2.0 * np.pi:
            continue
        if abs(turned - integral) > 0.2 * max(abs(turned), abs(integral)):
            yield _warning(
                campaign,
                "speed",
                integral / turned if turned else np.inf,
                f"run {run.name}: the carrier turns by {turned:.4g} rad, its speed adds up to "
                f"{integral:.4g} rad",
                "give speed in rad/s (rpm times pi/30), carrier_angle in rad, time in s, both "
                "positive the same way about +x",
                sample_of(run.file, 0),
            )


def _unlike_channels(campaign: Campaign) -> Iterator[CampaignWarning]:
    """One channel whose motion is far larger or smaller than that of the others of its quantity."""
    if len(campaign.channels) < 3 or campaign.kind == "mounting":
        return
    for quantity in sorted({channel.quantity for channel in campaign.channels}):
        channels = campaign.channels_of(quantity)
        sizes = {
            channel.name: float(
                np.median([np.nanstd(run.signals[channel.name]) for run in campaign.runs])
            )
            for channel in channels
        }
        typical = float(np.median(list(sizes.values())))
        for name, size in sizes.items():
            if len(channels) > 2 and typical > 0.0 and size > _UNLIKE * typical:
                yield _warning(
                    campaign,
                    name,
                    size / typical,
                    f"moves {size / typical:.3g} times as much as the other channels",
                    "check unit and scale of this channel",
                )


def _unlike_predictions(campaign: Campaign) -> Iterator[CampaignWarning]:
    """A prediction of another simulator that is far larger or smaller than the signal."""
    for channel in campaign.channels:
        runs = [run for run in campaign.runs if channel.name in run.predictions]
        signals = [float(np.nanstd(run.signals[channel.name])) for run in runs]
        predictions = [float(np.nanstd(run.predictions[channel.name])) for run in runs]
        smaller, larger = sorted((np.median(signals or [0.0]), np.median(predictions or [0.0])))
        if larger > _UNLIKE * smaller > 0.0:
            ratio = float(np.median(predictions) / np.median(signals))
            yield _warning(
                campaign,
                channel.name,
                ratio,
                f"the prediction moves {ratio:.3g} times as much as the signal",
                f"give column '{channel.name}_sim' and the signal in the same unit",
            )


def _largest(campaign: Campaign, name: str) -> float:
    return max(float(np.abs(run.inputs[name]).max()) for run in campaign.runs)


def _is_in_si(campaign: Campaign) -> bool:
    """Whether an element is measured in m and N."""
    return campaign.input_units == campaign.contract.inputs and all(
        channel.unit == campaign.contract.quantities[channel.quantity]
        for channel in campaign.channels
    )

"""What drove an element, as the force or deflection that its model takes."""

from numpy import float64
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import (
    band_end,
    band_limited,
    filled,
    trusted_frequency,
)
from carrierflex.simulation.element.drive_forces import base_force, no_force
from carrierflex.simulation.element.drives import BASE, FREE_DECAY

FloatArray = NDArray[float64]


def drive_and_response(
    run: Run, campaign: Campaign, even: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Force or deflection that drives the element, its response, and the base's displacement.

    Parameters
    ----------
    run : Run
        Record.
    campaign : Campaign
        Its drive, mass and channel.
    even : ndarray, shape (n,)
        Evenly spaced times [s].

    Returns
    -------
    tuple of ndarray, shape (n,)
        See :mod:`carrierflex.simulation.element.drives`; the base's displacement only where the
        channel reads the deflection in space, None otherwise.

    Raises
    ------
    ValueError
        Where the deflection in space would need the integral of an acceleration.
    """
    drive, channel = campaign.rig["drive"], campaign.channels[0]
    response = filled(run.signals[channel.name], run.time, even)
    if drive == FREE_DECAY:
        return no_force(even.size), response, None
    name = next(iter(campaign.contract.inputs))
    values = filled(run.inputs[name], run.time, even)
    if drive != BASE:
        return values, response, None
    mass = float(campaign.rig.get("mass", 1.0))
    if name == "base_acceleration":
        if channel.motion == "absolute":
            raise ValueError(
                f"[[channels]] {channel.name}: motion is 'absolute' together with the input "
                "'base_acceleration', whose displacement drifts; expected motion = 'relative', or "
                "the input 'base_displacement'"
            )
        return base_force(values, mass), response, None
    step = float(even[-1] - even[0]) / (even.size - 1)
    cutoff = band_end(trusted_frequency(values, step), step)
    acceleration = band_limited(values, step, cutoff, derivative=2)
    base = values if channel.motion == "absolute" else None
    relative = response if base is None else response - base
    return base_force(acceleration, mass), relative, base

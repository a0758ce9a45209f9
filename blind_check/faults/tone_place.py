"""Where a tone stands that nothing turns or drives."""

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.tones import is_driven

#: Frequencies between the orders of every rig of the blind check [Hz].
_BETWEEN_ORDERS_HZ = (7.37, 9.13, 11.71)


def undriven_frequency(campaign: Campaign) -> float:
    """First frequency [Hz] between the orders at which no input of the first run has a line.

    At the drive's own a tone is part of what answers it. A drive of all frequencies leaves the
    first.

    Parameters
    ----------
    campaign : Campaign
        Runs and inputs.
    """
    run = campaign.runs[0]
    undriven = (own for own in _BETWEEN_ORDERS_HZ if not is_driven(run, own))
    return next(undriven, _BETWEEN_ORDERS_HZ[0])

"""A prediction whose clock an import moved: a delay of the sensors would look the same."""

from collections.abc import Iterator

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, key_of

#: A shift below this share of a step of time changes nothing that is measured.
_NOTICED = 0.1


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
        "let both run on one clock and import with shift = 0, or measure the delay of the sensors",
        float(known.value),
        key_of("[baseline.clock_shift]", name),
    )

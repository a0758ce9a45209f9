"""Truth of a fleet of carriers: a cause that grows or comes, a sensor that dies, a cable, nothing.

A turbine keeps its state, its sensors' errors and its noise level; from day to day only the size of
its cause and the noise change.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np

from carrierflex.blind_check.labels import NOTHING, SINGLE, CasePlan, Label
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.records import Run

#: Effect behind each cause that a turbine may have, and the share of its last size on the day
#: number k of n.
CAUSES = _MISALIGNMENT, _WEAR, BUSHING = ("misalignment", "wear", "bushing")
_EFFECTS = {_MISALIGNMENT: "carrier_tilt", _WEAR: "bearing_clearance", BUSHING: "ntl_tilt"}
#: Faults of the measurement, from the middle of the days on.
DEAD_SENSOR, EXCHANGED_CABLE = "dead_sensor", "exchanged_cable"
FAULTS = (DEAD_SENSOR, EXCHANGED_CABLE)
#: What becomes of the turbines in turn: seven of ten have a cause, two in ten nothing.
_ROTA = (
    _MISALIGNMENT, _WEAR, BUSHING, NOTHING, _MISALIGNMENT, _WEAR, BUSHING, DEAD_SENSOR,
    _MISALIGNMENT, NOTHING, _WEAR, BUSHING, _MISALIGNMENT, EXCHANGED_CABLE, _WEAR, BUSHING,
    NOTHING, _MISALIGNMENT, _WEAR, NOTHING,
)  # fmt: skip
#: Gap of a cause on the last day over the noise, uniform in its logarithm.
_SIZES = (0.5, 10.0)
_FIRST_DAY, _DAYS_APART = date(2026, 1, 15), 30


@dataclass(frozen=True)
class FleetPlan(CasePlan):
    """What a turbine is to hold on one day.

    Parameters
    ----------
    fate : str
        What becomes of the turbine: a cause, a fault of the measurement, or nothing.
    day, n_days : int
        Number of the day, from 1, and of all days.
    last_ratio : float
        Gap over the noise on the last day.
    """

    fate: str = NOTHING
    day: int = 1
    n_days: int = 1
    last_ratio: float = 0.0

    @property
    def turbine(self) -> str:
        """Name of the turbine; it says nothing of its fate."""
        return f"T{self.number:03d}"

    @property
    def name(self) -> str:
        """Folder of the campaign."""
        return f"{self.turbine}/day{self.day:02d}"


def fleet_plans(n_turbines: int, n_days: int, seed: int) -> Iterator[FleetPlan]:
    """Plans of all days of all turbines.

    Parameters
    ----------
    n_turbines, n_days : int
        Turbines; days of each, 30 apart.
    seed : int
        Seed of the fleet.

    Yields
    ------
    FleetPlan
        Every turbine's days in turn.
    """
    rng = np.random.default_rng([seed, n_turbines])
    fates = [_ROTA[k % len(_ROTA)] for k in range(n_turbines)]
    rng.shuffle(fates)
    for number, fate in enumerate(fates, 1):
        last = float(np.exp(rng.uniform(*np.log(_SIZES))))
        for day in range(1, n_days + 1):
            ratio = last * _grown(fate, day / n_days) if fate in _EFFECTS else 0.0
            effects = (_EFFECTS[fate],) if ratio else ()
            yield FleetPlan(
                kind="carrier",
                number=number,
                seed=seed,
                family=SINGLE if effects else NOTHING,
                effects=effects,
                ratio=ratio,
                fate=fate,
                day=day,
                n_days=n_days,
                last_ratio=last if fate in _EFFECTS else 0.0,
            )


def day_of(number: int) -> date:
    """Day of a number, from 1."""
    return _FIRST_DAY + timedelta(days=_DAYS_APART * (number - 1))


def _grown(fate: str, share_of_time: float) -> float:
    """Size of a cause over its last one: a drift, wear that speeds up, a bushing that comes loose.

    The bushing loosens in the second half of the days.
    """
    if fate == BUSHING:
        return float(share_of_time > 0.5)
    return share_of_time ** (2.0 if fate == _WEAR else 1.0)


def write_fleet_case(plan: FleetPlan, folder: Path) -> Label:
    """Write the campaign of a turbine's day; its label goes to the caller alone.

    Parameters
    ----------
    plan : FleetPlan
        What to withhold.
    folder : Path
        Folder of the campaign; new, empty, or an earlier simulated campaign, which is replaced.

    Returns
    -------
    Label
        The truth; where the measurement has a fault on that day, `family` is the fault and `where`
        has its channel.
    """
    campaign, label = case_campaign(plan, repeat=plan.day)
    if plan.fate in FAULTS and 2 * plan.day > plan.n_days:
        campaign, channel = _with_fault(campaign, plan)
        label = replace(label, family=plan.fate, where={"channel_pattern": channel})
    write_campaign(
        replace(campaign, name=plan.turbine, turbine=plan.turbine, recorded=day_of(plan.day)),
        folder,
        simulated=True,
    )
    return label


def _with_fault(campaign: Campaign, plan: FleetPlan) -> tuple[Campaign, str]:
    """Campaign with a sensor that reads one value, or with two exchanged; name of the sensor."""
    rng = np.random.default_rng([plan.seed, plan.number])
    first, second = rng.permutation([channel.name for channel in campaign.channels])[:2]

    def faulty(run: Run) -> Run:
        signals = dict(run.signals)
        if plan.fate == DEAD_SENSOR:
            signals[first] = np.full_like(signals[first], signals[first][0])
        else:
            signals[first], signals[second] = signals[second], signals[first]
        return replace(run, signals=signals)

    return replace(campaign, runs=tuple(faulty(run) for run in campaign.runs)), first

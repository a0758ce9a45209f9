"""Diagnoses of a fleet: common prior of each cause's size, turbines that differ, trends."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Annotated

import numpy as np

from carrierflex.diagnosis.inference.results import Interval
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.identification.estimation.shrinkage import (
    FEWEST_DATES,
    FEWEST_MACHINES,
    shrunk_values,
    trend,
)
from carrierflex.workflows.diagnosis.fleet_sizes import CampaignRow, CauseSize

#: Probability with which any turbine of equal ones is called different.
LEVEL = 0.05
_DAYS_A_YEAR = 365.25

#: Kind of campaign, cause, parameter, unit.
_SizeKey = tuple[str, str, str, str]


@dataclass(frozen=True, eq=False)
class TurbineSize:
    """Size of a cause at one turbine, in its last campaign."""

    turbine: Annotated[str, "Turbine"]
    campaign: Annotated[str, "Folder of the campaign"]
    value: Annotated[float, "Size as diagnosed [unit]"]
    std: Annotated[float, "Its standard deviation [unit]"]
    shrunk: Annotated[float, "Size with the fleet as prior [unit]"]
    shrunk_ci95: Annotated[Interval, "Its 95 % interval [unit]"]
    p_value: Annotated[float, "Probability of a turbine as far from the others"]
    differs: Annotated[bool, "Whether p_value times the number of turbines is below 0.05"]


@dataclass(frozen=True, eq=False)
class FleetPrior:
    """Normal distribution of a cause's size over the turbines of a fleet."""

    kind: Annotated[str, "Kind of campaign"]
    cause: Annotated[str, "Cause"]
    parameter: Annotated[str, "Parameter that is its size"]
    unit: Annotated[str, "Unit"]
    mean: Annotated[float, "Mean [unit]"]
    mean_std: Annotated[float, "Standard deviation of the mean [unit]"]
    spread: Annotated[float, "Standard deviation of the turbines' true sizes [unit]"]
    n_without: Annotated[int, "Turbines whose last diagnosis has no such size: not in the prior"]
    turbines: Annotated[tuple[TurbineSize, ...], "Turbines, the most different first"]


@dataclass(frozen=True, eq=False)
class SizeTrend:
    """Size of a cause at one turbine over time."""

    turbine: Annotated[str, "Turbine"]
    kind: Annotated[str, "Kind of campaign"]
    cause: Annotated[str, "Cause"]
    parameter: Annotated[str, "Parameter that is its size"]
    unit: Annotated[str, "Unit of the size"]
    dates: Annotated[tuple[str, ...], "Days of the records"]
    values: Annotated[tuple[float, ...], "Sizes [unit]"]
    stds: Annotated[tuple[float, ...], "Their standard deviations [unit]"]
    slope: Annotated[float, "Change [unit a year]"]
    slope_ci95: Annotated[Interval, "Its 95 % interval [unit a year]"]
    p_value: Annotated[float, "Probability of such a change of a size that stays"]
    changes: Annotated[bool, "Whether p_value times the number of turbines is below 0.05"]
    first_named: Annotated[str, "First day on which the cause is named; empty where never"]
    stepped: Annotated[
        str,
        "First day after a step, where one size before and another after it leave less than the "
        "straight line; empty where the line leaves less",
    ]


@dataclass(frozen=True, eq=False)
class FleetDiagnosis:
    """All campaigns of a fleet, diagnosed with one baseline and model."""

    rows: Annotated[tuple[CampaignRow, ...], "Campaigns, by turbine and day"]
    priors: Annotated[tuple[FleetPrior, ...], "Sizes over the turbines, where four know one"]
    trends: Annotated[tuple[SizeTrend, ...], "Sizes over time, where three days know one"]

    @property
    def latest(self) -> tuple[CampaignRow, ...]:
        """Last diagnosed campaign of every turbine and kind, largest gap over its noise first."""
        last = {(row.turbine, row.kind): row for row in self.rows if row.is_diagnosed}
        return tuple(sorted(last.values(), key=lambda row: -np.nan_to_num(row.gap_floors)))

    @property
    def failed(self) -> tuple[CampaignRow, ...]:
        """Campaigns without a diagnosis."""
        return tuple(row for row in self.rows if not row.is_diagnosed)


def fleet_diagnosis(rows: Sequence[CampaignRow]) -> FleetDiagnosis:
    """Priors, turbines that differ, and trends of diagnosed campaigns.

    Sizes of different kinds, parameters or units are never put together. A prior takes the last
    campaign of each turbine. Where a fault of the measurement explains as much as the causes, the
    sizes are those of the fault: such a campaign is in no prior and in no trend.
    """
    ordered = tuple(sorted(rows, key=lambda row: (row.turbine, row.recorded, row.campaign)))
    fleet = FleetDiagnosis(ordered, (), ())
    sound = [row for row in fleet.latest if not row.first_fault]
    priors = sorted(_priors(sound), key=lambda prior: prior.turbines[0].p_value)
    trends = _trends([row for row in ordered if not row.first_fault])
    return FleetDiagnosis(ordered, tuple(priors), tuple(trends))


def _priors(latest: Sequence[CampaignRow]) -> Iterator[FleetPrior]:
    """Prior of every size that enough turbines know."""
    known: dict[_SizeKey, list[tuple[CampaignRow, CauseSize]]] = {}
    for row in latest:
        for size in row.sizes:
            if np.isfinite(size.std):
                known.setdefault(_key(row, size), []).append((row, size))
    for key, members in known.items():
        if len(members) < FEWEST_MACHINES:
            continue
        values = np.array([size.value for _, size in members])
        stds = np.array([size.std for _, size in members])
        shrunk = shrunk_values(values, stds)
        turbines = [
            TurbineSize(
                turbine=row.turbine,
                campaign=row.campaign,
                value=size.value,
                std=size.std,
                shrunk=float(mean),
                shrunk_ci95=(float(mean - NORMAL_95 * std), float(mean + NORMAL_95 * std)),
                p_value=float(p_value),
                differs=bool(p_value * len(members) < LEVEL),
            )
            for (row, size), mean, std, p_value in zip(
                members, shrunk.values, shrunk.stds, shrunk.p_values, strict=True
            )
        ]
        n_of_kind = sum(row.kind == key[0] for row in latest)
        yield FleetPrior(
            *key,
            mean=shrunk.mean,
            mean_std=shrunk.mean_std,
            spread=shrunk.spread,
            n_without=n_of_kind - len(members),
            turbines=tuple(sorted(turbines, key=lambda one: one.p_value)),
        )


def _trends(rows: Sequence[CampaignRow]) -> Iterator[SizeTrend]:
    """Trend of every size of every turbine that enough days know."""
    known: dict[tuple[str, _SizeKey], list[tuple[CampaignRow, CauseSize]]] = {}
    for row in rows:
        for size in row.sizes:
            if row.recorded and np.isfinite(size.std):
                known.setdefault((row.turbine, _key(row, size)), []).append((row, size))
    n_turbines = Counter(key for _, key in known)
    for (turbine, key), members in known.items():
        dates = tuple(row.recorded for row, _ in members)
        if len(set(dates)) < FEWEST_DATES:
            continue
        years = np.array([date.fromisoformat(day).toordinal() for day in dates]) / _DAYS_A_YEAR
        values = tuple(size.value for _, size in members)
        stds = tuple(size.std for _, size in members)
        repeats = tuple(size.repeat_std for _, size in members)
        alike = len({row.conditions for row, _ in members}) == 1
        line = change = trend(years, np.array(values), np.array(stds))
        if alike and all(np.isfinite(repeats)) and min(repeats) > 0.0:
            # What loads, gains and curves do alike on all days scales a change and makes none.
            change = trend(years, np.array(values), np.array(repeats))
        named = [row.recorded for row, size in members if size.is_named]
        yield SizeTrend(
            turbine,
            *key,
            dates=dates,
            values=values,
            stds=stds,
            slope=line.slope,
            slope_ci95=line.slope_ci95,
            p_value=change.p_value,
            changes=change.p_value * n_turbines[key] < LEVEL,
            first_named=named[0] if named else "",
            stepped=""
            if np.isnan(change.step_time)
            else dates[int(np.argmax(years >= change.step_time))],
        )


def _key(row: CampaignRow, size: CauseSize) -> _SizeKey:
    return row.kind, size.cause, size.parameter, size.unit

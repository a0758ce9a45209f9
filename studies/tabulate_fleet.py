"""How well a batch knows a simulated fleet: order of the turbines, causes, faults, trends.

Campaigns are written and sealed before the first diagnosis, `batch` diagnoses them, then the labels
are verified and scored. Writes fleet.md and the folders `campaigns` and `fleet`; a later call goes
on. A good answer: Spearman's correlation of true and diagnosed size above 0.9, causes named rightly
in 90 %, nothing named where nothing is missing.
"""

from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path

import numpy as np
from scipy import stats

from carrierflex.blind_check.labels import NOTHING, Label
from carrierflex.blind_check.sealing.check import SEALS_FILE, read_seals, sealed_check, verify
from carrierflex.blind_check.truth.fleet import (
    BUSHING,
    CAUSES,
    FAULTS,
    FleetPlan,
    day_of,
    fleet_plans,
    write_fleet_case,
)
from carrierflex.diagnosis.report.words import counted
from carrierflex.files.json_files import save_text
from carrierflex.identification.estimation.shrinkage import trend
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis.fleet_sizes import GAP, CampaignRow
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fleet import diagnose_fleet
from carrierflex.workflows.fleet.fleet import FleetDiagnosis, SizeTrend
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

#: Gap over the noise from which a cause is to be named rightly.
_NAMED_FROM = 3.0


def main(
    *,
    out: Path,
    turbines: int = 100,
    days: int = 3,
    seed: int = 1,
    workers: int = 1,
    quiet: bool = False,
) -> str:
    """Simulate a fleet, seal its truth, diagnose it by batch, and score.

    Parameters
    ----------
    out : Path
        Folder; a later call with the same options goes on.
    turbines : int
        Turbines.
    days : int
        Days of each, 30 apart.
    seed : int
        Seed of the fleet.
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    str
        Table of the figures, as in fleet.md.
    """
    folder = prepared_folder(out).resolve()
    plans = list(fleet_plans(turbines, days, seed))
    request = {"turbines": turbines, "days": days, "seed": seed}
    stages = Stages(1, quiet)
    with stages.stage("writing and sealing the campaigns"), work_executor(workers) as executor:
        sealed = sealed_check(plans, folder, _write, executor, check=request, note=stages.note)
    fleet = diagnose_fleet.main(
        folder / "campaigns", out=folder / "fleet", report=False, workers=workers, quiet=quiet
    )
    verify(sealed.labels, sealed.salts, read_seals(folder / SEALS_FILE))
    lines = [
        f"{turbines} turbines, {counted(days, 'day')} each, seed {seed}; digest of the seals "
        f"`{sealed.published.digest}`.",
        "",
        *_table(fleet, plans, sealed.labels),
    ]
    text = "\n".join(lines) + "\n"
    save_text(folder / "fleet.md", text)
    return text


def _write(plan: FleetPlan, folder: Path) -> Label:
    with single_threaded():
        return write_fleet_case(plan, folder)


def _table(
    fleet: FleetDiagnosis, plans: Sequence[FleetPlan], labels: Mapping[str, Label]
) -> Iterator[str]:
    """Figures of the last day, of all days, and of changes."""
    rows = {row.campaign: row for row in fleet.rows}
    last = {plan: rows[plan.name] for plan in plans if plan.day == plan.n_days}
    sized = {plan: row for plan, row in last.items() if plan.effects}
    true = [labels[plan.name].gap_over_floor for plan in sized]
    correlation = stats.spearmanr(true, [row.gap_floors for row in sized.values()]).statistic
    large = {
        plan: row for plan, row in sized.items() if labels[plan.name].gap_over_floor >= _NAMED_FROM
    }
    right = sum(_is_right(row, labels[plan.name]) for plan, row in large.items())
    wrong = sum(_is_wrong(row, labels[plan.name]) for plan, row in sized.items())
    sound = [rows[plan.name] for plan in plans if labels[plan.name].family == NOTHING]
    faulty = {plan: rows[plan.name] for plan in plans if labels[plan.name].family in FAULTS}
    reported = sum(
        _reports(row, str(labels[plan.name].where["channel_pattern"]))
        for plan, row in faulty.items()
    )
    yield "| figure | wanted | reached | of |"
    yield "|---|---|---|---|"
    yield f"| Spearman, true and diagnosed size | > 0.9 | {correlation:.3f} | {len(sized)} |"
    yield (
        f"| cause named rightly from {_NAMED_FROM:g} floors | 90 % | {_share(right, large)} | "
        f"{len(large)} |"
    )
    yield f"| another cause named, any size | - | {_share(wrong, sized)} | {len(sized)} |"
    named = sum(bool(row.causes) for row in sound)
    of_sound = _share(named, sound)
    yield f"| a cause named where nothing is missing | 0 % | {of_sound} | {len(sound)} |"
    yield f"| fault of the measurement reported | - | {_share(reported, faulty)} | {len(faulty)} |"
    if fleet.trends:
        yield from _trend_rows(fleet.trends, plans, labels)


def _trend_rows(
    trends: Sequence[SizeTrend], plans: Sequence[FleetPlan], labels: Mapping[str, Label]
) -> Iterator[str]:
    """Figures of the gap's trends and of the causes' own by fate, and of what stays as it is."""
    fates = {plan.turbine: plan.fate for plan in plans}
    for fate in CAUSES:
        of_fate = [one for one in trends if fates[one.turbine] == fate]
        members = [one for one in of_fate if one.cause == GAP]
        reported = [one for one in members if one.changes]
        upward = sum(one.slope > 0.0 for one in reported)
        yield _row(f"{fate}: change of the gap reported", "-", len(reported), members)
        yield _row(f"{fate}: of these, upward", "100 %", upward, reported)
        true = {one: _true_slope(one, labels) for one in of_fate}
        of_cause = [one for one, slope in true.items() if slope is not None]
        inside = sum(
            one.slope_ci95[0] <= (true[one] or 0.0) <= one.slope_ci95[1] for one in of_cause
        )
        name = f"{fate}: interval of the cause's slope holds the true one"
        yield _row(name, "95 %", inside, of_cause)
        if fate == BUSHING:
            first = {plan.turbine: plan.day for plan in reversed(plans) if plan.effects}
            dated = sum(
                bool(one.stepped)
                and abs(one.dates.index(one.stepped) + 1 - first[one.turbine]) <= 1
                for one in reported
            )
            yield _row(f"{fate}: step dated within one campaign", "100 %", dated, reported)
    steady = [one for one in trends if fates[one.turbine] == NOTHING]
    false = sum(one.changes for one in steady)
    yield _row("change reported of a size that stays", "<= 5 %", false, steady)


def _true_slope(one: SizeTrend, labels: Mapping[str, Label]) -> float | None:
    """Slope of the same line through the true values of a withheld size [unit a year]."""
    days = {day_of(number).isoformat(): number for number in range(1, len(labels) + 1)}
    of_day = [labels[f"{one.turbine}/day{days[recorded]:02d}"] for recorded in one.dates]
    if not all(one.cause in label.effects for label in of_day):
        return None
    true = np.array([label.parameters[one.cause][one.parameter] for label in of_day])
    years = np.array([date.fromisoformat(day).toordinal() for day in one.dates]) / 365.25
    return trend(years, true, np.array(one.stds)).slope


def _row(name: str, wanted: str, count: int, members: Sequence[object]) -> str:
    return f"| {name} | {wanted} | {_share(count, members)} | {len(members)} |"


def _reports(row: CampaignRow, channel: str) -> bool:
    """Whether a finding names the channel, or a refusal where there is no diagnosis."""
    findings = row.faults if row.is_diagnosed else (row.text,)
    return any(channel in finding for finding in findings)


def _is_right(row: CampaignRow, label: Label) -> bool:
    """Whether every withheld effect, or one that the records cannot tell from it, is named."""
    return all(set(row.causes) & set(members) for members in label.acceptable)


def _is_wrong(row: CampaignRow, label: Label) -> bool:
    """Whether a law is named that is neither withheld nor a disturbance of the sensors."""
    known = {name for members in label.acceptable for name in members} | set(label.present)
    return row.verdict == "named" and not set(row.causes) <= known


def _share(count: int, members: Sequence[object] | Mapping[FleetPlan, object]) -> str:
    return f"{count / len(members):.0%}" if members else "-"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

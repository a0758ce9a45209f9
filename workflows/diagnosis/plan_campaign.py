"""Show, before measuring, which causes a campaign can separate, and what to add to it.

Takes a case file, or a campaign whose records leave causes that cannot be told apart. Writes
plan.json and plan.png. A good answer: every cause that matters is seen well below the size worth
noticing, no pair is alike, or the first proposal parts all that are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from carrierflex.diagnosis.inference.planning.results import (
    CampaignPlan,
    Costs,
    RankedAddition,
    RigLimits,
)
from carrierflex.files.json_files import save_json
from carrierflex.files.result_schemas import json_content, json_table
from carrierflex.files.toml_files import read_toml, toml_document
from carrierflex.files.versions import software_name
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign.campaign_part import campaign_part
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.case_kinds import CARRIER_CASE, MOUNTING_CASE
from carrierflex.workflows.diagnosis.diagnose_campaign import campaign_curves, with_stage_baseline
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation import simulate_load_case

if TYPE_CHECKING:
    from carrierflex.diagnosis.carrier.planned import CarrierPool
    from carrierflex.diagnosis.kinds import Curves
    from carrierflex.diagnosis.mounting.planned import MountingPool
    from carrierflex.simulation.plan_tables import PlanTable

#: Additions that plan.json lists.
_MOST_ADDITIONS = 40
#: plan.json.
PLAN = json_table(
    "PlanDocument",
    "plan.json, written by plan.",
    {
        CampaignPlan: "campaign unit gap noise_std is_measured left_wanted costs sizes hidden "
        "pairs additions"
    },
    format=(Literal["carrierflex-plan"], "Kind of the file"),
    version=(Literal[1], "Version of the format"),
    software=(str, "Name and version of this software"),
    kind=(Literal["carrier", "mounting"], "Kind of the campaign"),
    proposal=(RankedAddition | None, "First proposal; null where nothing is to be separated"),
)


@dataclass(frozen=True, eq=False)
class PlannedCampaign:
    """A plan with the runs and channels that it looked at."""

    plan: Annotated[CampaignPlan, "Sizes, pairs and additions"]
    pool: Annotated[CarrierPool | MountingPool, "What is planned and what could be added"]


@dataclass(frozen=True)
class PlanSettings:
    """What a plan is asked for."""

    gap: Annotated[float, "Gap in floors at which causes are to be distinguished"] = 6.0
    costs: Annotated[Costs, "What additions cost"] = field(default_factory=Costs)
    limits: Annotated[RigLimits, "What the rig can do"] = field(default_factory=RigLimits)


def main(
    case: Path,
    *,
    out: Path | None = None,
    gap: float | None = None,
    baseline: list[str] | None = None,
    effects: list[str] | None = None,
    quiet: bool = False,
) -> CampaignPlan:
    """Show which causes a campaign can separate, and the cheapest addition that helps.

    Parameters
    ----------
    case : Path
        Case file (TOML) of kind carrier or mounting, as for simulate, or the name of a bundled
        case; its table [plan] states costs [min] and limits of the rig [N m, N, deg]. Or a campaign
        folder: its records then determine the amplitudes of each cause. Costs without [plan]: a
        sensor 240 min, a load case 15 min beside its length, a minute of record 1 min; limits 400
        kN m and 200 kN.
    out : Path, optional
        Folder to write: plan.json and plan.png; default: the result is shown and not written.
    gap : float, optional
        Gap at which causes are to be distinguished, its RMS over that of the noise [1];
        default: that of the records or of the case, else 6.
    baseline : list of str, optional
        Effects of the baseline, instead of the campaign's (of a case: the axial offset); may be
        given several times.
    effects : list of str, optional
        Causes that are considered; default: all of the kind. May be given several times.
    quiet : bool
        Show no progress.

    Returns
    -------
    CampaignPlan
        Smallest sizes, pairs that look alike, additions with what they part.

    Raises
    ------
    ValueError
        Where the case or campaign is refused or of kind element, or the gap is not positive.
    OSError
        Where `out` cannot be written.
    """
    if not case.suffix and not case.exists():
        case = shipped_case(str(case))
    if gap is not None and not (np.isfinite(gap) and gap > 0.0):
        raise ValueError(f"--gap is {gap}; expected a positive number of noise floors")
    stages = Stages(2, quiet)
    with single_threaded(), TemporaryDirectory() as folder:
        is_measured = case.is_dir()
        settings = PlanSettings() if is_measured else case_settings(case)
        settings = settings if gap is None else replace(settings, gap=gap)
        with stages.stage(f"reading {case}"):
            records = case
            if not is_measured:
                records = Path(folder) / "campaign"
                simulate_load_case.main(case, out=records, quiet=True)
            campaign = campaign_part(
                read_campaign(records), baseline=baseline, effects=effects or ()
            )
            curves = campaign_curves(campaign, records)
            campaign = with_stage_baseline(
                campaign, records, None, stages, partial(_pool_of_carrier, campaign, settings)
            )
        with stages.stage("what can be detected, separated and added"):
            planned = plan_of(campaign, curves, settings, is_measured=is_measured, note=stages.note)
    if out is not None:
        _write(planned.plan, prepared_folder(out))
    return planned.plan


def _pool_of_carrier(campaign: Campaign, settings: PlanSettings) -> Campaign:
    from carrierflex.diagnosis.carrier.planned import carrier_pool

    return carrier_pool(campaign, settings.costs, settings.limits).campaign


def plan_of(
    campaign: Campaign,
    curves: Curves | None,
    settings: PlanSettings,
    *,
    is_measured: bool,
    note: Callable[[str], None] = lambda text: None,
) -> PlannedCampaign:
    """Plan of a campaign with signals, simulated or measured.

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves, which kind carrier asks for.
    is_measured : bool
        Whether the signals say which amplitudes a cause has.

    Raises
    ------
    ValueError
        Where the kind has no additions.
    """
    from carrierflex.diagnosis.carrier.planned import carrier_planned_table, carrier_pool
    from carrierflex.diagnosis.carrier.problem import CarrierProblem
    from carrierflex.diagnosis.inference.planning.plan import campaign_plan
    from carrierflex.diagnosis.kinds import problem_of
    from carrierflex.diagnosis.mounting.planned import mounting_planned_table, mounting_pool
    from carrierflex.diagnosis.mounting.problem import MountingProblem

    if campaign.kind == "element":
        raise ValueError(
            f"campaign '{campaign.name}' is of kind element; expected kind carrier or mounting"
        )
    problem = problem_of(campaign, curves)
    pool: CarrierPool | MountingPool
    if isinstance(problem, CarrierProblem):
        pool = carrier_pool(problem.campaign, settings.costs, settings.limits)
        table = carrier_planned_table(problem, pool.campaign, settings.limits, note)
    elif isinstance(problem, MountingProblem):
        pool = mounting_pool(
            problem.records,
            problem.model.channels,
            settings.costs,
            torque=settings.limits.torque,
            radial_load=settings.limits.radial_load,
        )
        table = mounting_planned_table(problem, pool, note)
    else:
        raise ValueError(
            f"campaign '{campaign.name}' has predictions of another simulator; expected the "
            "baseline source model"
        )
    plan = campaign_plan(
        table,
        pool.additions,
        planned=pool.planned,
        gap=settings.gap,
        names=(campaign.name, campaign.kind, problem.unit),
        costs=settings.costs,
        is_measured=is_measured,
        note=note,
    )
    return PlannedCampaign(plan, pool)


def case_settings(case: Path) -> PlanSettings:
    """Gap, costs and limits of a case file of kind carrier or mounting; another is refused."""
    from carrierflex.simulation.carrier.case_tables import CarrierCaseDocument
    from carrierflex.simulation.mounting.case_tables import MountingCaseDocument

    if toml_document(case, CARRIER_CASE).get("format") != "carrierflex-case":
        raise ValueError(
            f"{case}: not a case of kind carrier or mounting; expected one, or the campaign folder "
            "that simulate writes of it"
        )
    table: PlanTable | None
    if toml_document(case, CARRIER_CASE).get("kind") == "mounting":
        table = read_toml(case, MOUNTING_CASE, MountingCaseDocument).plan
    else:
        table = read_toml(case, CARRIER_CASE, CarrierCaseDocument).plan
    if table is None:
        return PlanSettings()
    return PlanSettings(
        table.gap,
        Costs(table.sensor_cost, table.load_case_cost, table.minute_cost),
        RigLimits(
            table.largest_torque,
            table.largest_radial_load,
            tuple(np.deg2rad(table.sensor_angles_deg).tolist()),
        ),
    )


def _write(plan: CampaignPlan, out: Path) -> None:
    from carrierflex.diagnosis.inference.planning.results import plan_figure

    additions = plan.additions[:_MOST_ADDITIONS]
    content = json_content(PLAN, plan, software=software_name(), additions=additions)
    save_json(out / "plan.json", content)
    save_figure(out / "plan.png", plan_figure(plan))

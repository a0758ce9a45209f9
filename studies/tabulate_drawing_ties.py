"""Dimensions that cannot be distinguished at the rim, without a radial sensor and with one.

    python -m studies.tabulate_drawing_ties --cases 30 --seed 1 --out drawing_ties

Each campaign is of the family ``model`` of the blind check: one dimension or constant is off the
drawing, by CalculiX (:mod:`validation.independent_carrier`), the pins have any fit, and one radial
sensor stands beside the axial ones. It is planned and diagnosed twice, without the radial sensor
and with it. ``plan`` says which dimensions are distinguished from all others at the size that the
records show; a good answer names them alone, in 80 % of those. A file a campaign, made where it is
missing, then drawing_ties.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from carrierflex.blind_check.labels import MODEL, CasePlan
from carrierflex.blind_check.truth.carrier.off_drawing import (
    CURVES_FILE,
    OFF_DRAWING,
    model_case,
    write_drawn_curves,
)
from carrierflex.diagnosis.carrier.planned import carrier_planned_table
from carrierflex.diagnosis.carrier.problem import CarrierProblem
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.planning.plan import campaign_plan
from carrierflex.diagnosis.inference.planning.results import (
    MINUTES,
    PARTED,
    Addition,
    Costs,
    RigLimits,
)
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.files.json_files import save_json
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_part import campaign_part
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.carrier.effects.drawing import body_of_effect
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL
from carrierflex.workflows.diagnosis.diagnose_campaign import curves_of_rig
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import seeded_cases, write_table

#: Gap over the floor at the drawn sizes.
_LEAST_GAP, _LARGEST_GAP = 4.0, 40.0
#: Radial sensors of both halves of a case.
SENSORS = (0, 1)


@dataclass(frozen=True)
class TiedAnswer:
    """What plan and diagnosis say of one campaign whose carrier has one value off its drawing."""

    truth: str  # Effect
    gap: float  # Gap over the floor at the drawn sizes
    n_radial: int  # Radial sensors
    rivals: tuple[str, ...] | None  # Alike by plan; None: plan does not list the truth
    verdict: str  # Of the diagnosis
    named: tuple[str, ...]  # Dimensions and constants, ties included
    ratio: float | None  # Value over the true one
    inside: bool | None  # Whether the 95 % interval holds the true one

    @property
    def is_separable(self) -> bool:
        """Whether plan says that the value is distinguished from all others."""
        return self.rivals == ()

    @property
    def is_alone(self) -> bool:
        """Whether the true value is named, and nothing is tied with it."""
        return self.named == (self.truth,)


def _rivals(problem: CarrierProblem, truth: str) -> tuple[str, ...] | None:
    """Dimensions and constants that plan cannot distinguish from the true one."""
    campaign = problem.campaign
    names = tuple(channel.name for channel in campaign.channels)
    planned = Addition(MINUTES, "as recorded", {run.name: 1.0 for run in campaign.runs}, names, 0.0)
    table = carrier_planned_table(problem, campaign, RigLimits())
    plan = campaign_plan(
        table,
        (),
        planned=planned,
        gap=6.0,
        names=("", "carrier", "m"),
        costs=Costs(),
        is_measured=True,
    )
    pairs = [pair for pair in plan.pairs if pair.cause == truth]
    listed = {pair.cause for pair in plan.pairs}
    if not plan.is_measured or (plan.pairs and truth not in listed):
        return None
    return tuple(pair.rival for pair in pairs if pair.state != PARTED)


def answered(campaign: Campaign, truth: str, change: float, gap: float) -> TiedAnswer:
    """Plan and diagnosis of one campaign."""
    with TemporaryDirectory() as folder:
        write_drawn_curves(Path(folder) / CURVES_FILE)
        curves = curves_of_rig(campaign.rig, Path(folder))
    problem, _ = problem_of(campaign, curves)
    known = set(campaign.baseline.effects)
    others = tuple(name for name in campaign.contract.effects if name not in known)
    only_drawing = replace(campaign.baseline, impossible=others)
    alone, _ = problem_of(replace(campaign, baseline=only_drawing), curves)
    if not isinstance(alone, CarrierProblem):
        raise TypeError("a campaign of this study has a prediction of its own")
    rivals = _rivals(alone, truth)
    answer = diagnose(problem, campaign="tie", kind="carrier")
    which = answer.attribution
    effects = [name for name in which.effects if body_of_effect(name)]
    ties = [set(group) for group in which.aliases if set(group) & set(effects)]
    named = sorted(set(effects).union(*ties))
    values = {**which.alternatives, **which.parameters}
    value = values.get(truth, {}).get("change")
    n_radial = sum(channel.quantity == RADIAL for channel in campaign.channels)
    return TiedAnswer(
        truth,
        gap,
        n_radial,
        rivals,
        answer.verdict,
        tuple(named),
        None if value is None else value.value / change,
        None if value is None else bool(value.ci95[0] <= change <= value.ci95[1]),
    )


def tied_campaign(seed: int, number: int) -> tuple[Campaign, str, float, float]:
    """Campaign with one radial sensor, the effect that differs, its change, and the gap."""
    rng = np.random.default_rng([seed, number])
    while True:
        ratio = float(np.exp(rng.uniform(*np.log((_LEAST_GAP, _LARGEST_GAP)))))
        plan = CasePlan("carrier", number, int(rng.integers(2**31)), MODEL, (OFF_DRAWING,), ratio)
        campaign, label = model_case(plan, n_radial=SENSORS[-1])
        if len(label.effects) == 1 and label.gap_over_floor >= _LEAST_GAP:
            break
    (truth,) = label.effects
    return campaign, truth, float(label.parameters[truth]["change"]), label.gap_over_floor


def _write(seed: int, number: int, path: Path) -> None:
    campaign, truth, change, gap = tied_campaign(seed, number)
    axial = [one.name for one in campaign.channels if one.quantity == AXIAL]
    with single_threaded():
        rows = [
            answered(campaign_part(campaign, channels=names), truth, change, gap)
            for names in (axial, ())
        ]
    save_json(path, {"answers": rows})


def _rows(content: dict[str, Any]) -> list[TiedAnswer]:
    return [
        TiedAnswer(
            **{
                **row,
                "named": tuple(row["named"]),
                "rivals": None if row["rivals"] is None else tuple(row["rivals"]),
            }
        )
        for row in content["answers"]
    ]


def ties_table(rows: Sequence[TiedAnswer]) -> list[str]:
    """Table of the figures by number of radial sensors."""
    columns = (
        "radial sensors",
        "true value named, alone or tied",
        "plan: separable",
        "named alone where plan: separable",
        "named alone",
        "values tied with it, mean",
        "value inside its interval",
        "a value that is as drawn, without the true one",
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for n_radial in SENSORS:
        of = [row for row in rows if row.n_radial == n_radial]
        true = [row for row in of if row.truth in row.named]
        separable = [row for row in of if row.is_separable]
        valued = [row for row in true if row.inside is not None]
        tied = np.mean([len(row.named) - 1 for row in true]) if true else np.nan
        cells = (
            str(n_radial),
            f"{len(true)} of {len(of)}",
            f"{len(separable)} of {len(of)}",
            f"{sum(row.is_alone for row in separable)} of {len(separable)}",
            f"{sum(row.is_alone for row in of)} of {len(of)}",
            f"{tied:.1f}",
            f"{sum(bool(row.inside) for row in valued)} of {len(valued)}",
            f"{sum(bool(row.named) and row.truth not in row.named for row in of)} of {len(of)}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def main(
    *, out: Path, cases: int = 30, seed: int = 1, workers: int = 1, quiet: bool = False
) -> None:
    """Make, plan and diagnose campaigns; write drawing_ties.md.

    Parameters
    ----------
    out
        Folder; campaigns that stand there are not made again.
    cases
        Campaigns.
    seed
        Seed.
    workers
        Processes.
    quiet
        Show no progress.
    """
    folder, stages = prepared_folder(out), Stages(1, quiet)
    answers = seeded_cases(
        folder, seed, cases, partial(_write, seed), _rows, stages=stages, workers=workers
    )
    rows = [row for of_campaign in answers for row in of_campaign]
    lines = ties_table(rows)
    write_table(folder / "drawing_ties.md", lines)
    print("\n".join(lines))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

"""Dimensions that cannot be distinguished at the rim, without a radial sensor and with one.

    python -m studies.tabulate_drawing_ties --cases 30 --seed 1 --out drawing_ties

Each campaign is of the family ``model`` of the blind check: one dimension or constant is off the
drawing, by CalculiX (:mod:`validation.independent_carrier`), the pins have any fit, and one radial
sensor stands beside the axial ones. It is planned and diagnosed twice, without the radial sensor
and with it. ``plan`` says which dimensions are distinguished from all others at the size that the
records show; a good answer names them alone, in 80 % of those. What is seen of tied dimensions is
their combination, the change of the rim's largest order: its interval is set against the bound of
Cramer and Rao, at most 3 times it in a good answer. A file a campaign, made where it is missing,
then drawing_ties.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import MODEL, CasePlan
from carrierflex.blind_check.truth.carrier.off_drawing import (
    CURVES_FILE,
    MEMORY,
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
from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.fe.curve_files import PIN_FIT, axial_of_fit
from carrierflex.fe.deflection_curves import DeflectionCurve, amplitudes_along
from carrierflex.files.json_files import save_json
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_part import campaign_part
from carrierflex.identification.campaign.declarations import CURVES, TOLERANCES
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.carrier.effects.drawing import MULTIPLES, body_of_effect
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL
from carrierflex.workflows.diagnosis.diagnose_campaign import curves_of_rig
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import seeded_cases, write_table

#: Gap over the floor at the drawn sizes.
_LEAST_GAP, _LARGEST_GAP = 4.0, 40.0
#: Angles of a curve [rad].
_GRID = 2.0 * np.pi * np.arange(720) / 720
#: Interval of a combination over the bound, in a good answer.
_MOST_WIDTH = 3.0
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
    width: float | None  # Interval of the largest order's change, over that of the bound
    is_change_inside: bool | None  # Whether that interval holds the change by the true value

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
    problem = problem_of(campaign, curves)
    known = set(campaign.baseline.effects)
    others = tuple(name for name in campaign.contract.effects if name not in known)
    only_drawing = replace(campaign.baseline, impossible=others)
    alone = problem_of(replace(campaign, baseline=only_drawing), curves)
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
        *_against_bound(which.parameters, alone, truth, change),
    )


def _against_bound(
    parameters: Mapping[str, Mapping[str, NamedValue]],
    problem: CarrierProblem,
    truth: str,
    change: float,
) -> tuple[float | None, bool | None]:
    """Interval of the largest order's change over the bound, and whether it holds the true one."""
    changes = parameters.get(f"model/{body_of_effect(truth)}")
    if changes is None:
        return None, None
    order, larger = max(changes.items(), key=lambda item: abs(item[1].value))
    curves, w = problem.model.source.rig.curves, parameters[PIN_FIT]["w"].value
    by_value = _by_value(curves, truth, w, int(order.removeprefix("order_")))
    least = abs(by_value) * least_std(problem.campaign, curves, truth, w=w, change=change)
    low, high = larger.ci95
    return 0.5 * (high - low) / (NORMAL_95 * least), low <= by_value * change <= high


def _by_value(curves: Mapping[str, DeflectionCurve], truth: str, w: float, order: int) -> float:
    """Change of an order of the rim, over the drawn curve's RMS, by the unit of a value."""
    drawn = axial_of_fit(curves, w, _GRID.size)
    change = axial_of_fit(curves, w, _GRID.size, cause=truth.partition("/")[2])
    return float(amplitudes_along(change, drawn)[order] / np.sqrt(np.mean(drawn**2)))


def least_std(
    campaign: Campaign,
    curves: Mapping[str, DeflectionCurve],
    truth: str,
    *,
    w: float,
    change: float,
) -> float:
    """Least standard deviation of a value off the drawing, ``P = (J^T R^-1 J + C^-1)^-1``.

    Unknown are the value, the pin fit, errors of the curve's orders, tilts of housing and carrier,
    offsets, gain and place of every axial sensor and the gain of the torque, with the variances
    that the campaign declares as C; R is the noise of the family's cases. Radial sensors are not
    counted, nor orders of the curves whose errors are in no declaration.

    Parameters
    ----------
    campaign : Campaign
        Records; their angles, torques and declarations are used, no signal.
    curves : mapping of str to DeflectionCurve
        Drawn curves, by pin fit, and their derivatives.
    truth : str
        Effect of the value.
    w : float
        Share of a rigid pin fit.
    change : float
        The value less that of the drawing.
    """
    tolerances, cause = campaign.rig[TOLERANCES], truth.partition("/")[2]
    channels = [channel for channel in campaign.channels if channel.quantity == AXIAL]
    size = np.sqrt(np.mean(curves["delta_f"].axial ** 2))
    orders = int(campaign.rig["n_planets"]) * np.array(MULTIPLES)
    waves = [size * np.sin(n * _GRID) for n in orders]

    def curve_at(w: float, change: float) -> NDArray[np.float64]:
        by_value = axial_of_fit(curves, w, _GRID.size, cause=cause)
        c = np.fft.rfft(axial_of_fit(curves, w, _GRID.size) + change * by_value)
        c[np.setdiff1d(np.arange(c.size), orders)] = 0.0
        return np.fft.irfft(c, _GRID.size)

    # The curve is linear in the value and in the fit, each by itself.
    made = curve_at(w, change)
    of_value, by_fit = curve_at(w, 1.0) - curve_at(w, 0.0), curve_at(w + 1.0, change) - made
    # The torque's gain reads as the curve itself.
    of_curve = np.array([of_value, by_fit, *waves, made])
    slope = np.gradient(np.append(made, made[0]), _GRID[1])[:-1]
    stds = [tolerances[cause], 0.5, *[tolerances[CURVES]] * len(waves)]
    stds += [campaign.inputs[0].gain_std]
    # Tilts and offsets have no prior.
    stds += [np.inf] * (4 + len(campaign.runs))
    for channel in channels:
        stds += [channel.gain_std, channel.angle_std]
    information = np.diag(1.0 / np.array(stds) ** 2)
    for run, offset in zip(campaign.runs, np.eye(len(campaign.runs)), strict=True):
        for channel, of_sensor in zip(channels, np.eye(len(channels)), strict=True):
            angle, radius, noise = (channel.angle, channel.radius, channel.noise_std)
            if angle is None or radius is None or noise is None:
                raise ValueError(f"{channel.name}: expected angle, radius and noise_std")
            u, still = angle - run.inputs["carrier_angle"], np.ones(run.time.size)
            read = partial(_read, u=u, load=run.inputs["torque"] / 1e3)
            tilts = [radius * f(v) * still for v in (angle, u) for f in (np.cos, np.sin)]
            sensors = [mine * read(curve) for mine in of_sensor for curve in (made, slope)]
            rows = [*map(read, of_curve), *tilts, *(value * still for value in offset), *sensors]
            J = np.array(rows).T / noise
            # Noise of an AR(1) process is white after its filter.
            white = (J[1:] - MEMORY * J[:-1]) / np.sqrt(1.0 - MEMORY**2)
            information += white.T @ white
    return float(np.sqrt(np.linalg.inv(information)[0, 0]))


def _read(
    curve: NDArray[np.float64], *, u: NDArray[np.float64], load: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Signal of a curve under a torque [kN m] at carrier-frame angles u."""
    return load * np.interp(u, _GRID, curve, period=2.0 * np.pi)


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
        "interval of the largest order's change over the bound, median",
        "at most 3 times the bound",
        "that change inside its interval",
        "a value that is as drawn, without the true one",
    )
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    for n_radial in SENSORS:
        of = [row for row in rows if row.n_radial == n_radial]
        true = [row for row in of if row.truth in row.named]
        separable = [row for row in of if row.is_separable]
        valued = [row for row in true if row.inside is not None]
        widths = [row.width for row in of if row.width is not None]
        changes = [row.is_change_inside for row in of if row.is_change_inside is not None]
        tied = np.mean([len(row.named) - 1 for row in true]) if true else np.nan
        cells = (
            str(n_radial),
            f"{len(true)} of {len(of)}",
            f"{len(separable)} of {len(of)}",
            f"{sum(row.is_alone for row in separable)} of {len(separable)}",
            f"{sum(row.is_alone for row in of)} of {len(of)}",
            f"{tied:.1f}",
            f"{sum(bool(row.inside) for row in valued)} of {len(valued)}",
            f"{np.median(widths):.2f}" if widths else "",
            f"{sum(width <= _MOST_WIDTH for width in widths)} of {len(widths)}",
            f"{sum(changes)} of {len(changes)}",
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

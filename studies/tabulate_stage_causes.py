"""What the diagnosis says of campaigns that the stage predicts and something inside it differs.

    python -m studies.tabulate_stage_causes --cases 30 --seed 1 --out stage_causes
    python -m studies.tabulate_stage_causes --cases 30 --truth held_sun --out held_sun_stage

The case of each campaign is a stage with clearances, pins and supports of the housing drawn within
their sourced ranges. The truth has one thing else (a held sun, a clearance, positions of the pins,
a tilt of the joint, a support), or nothing, and runs through time by another integrator than the
simulator's at half its step (:mod:`studies.stage_in_time`), under six loads, with sensors of 5 um
of noise and 0.3 % of gain and a torque that is 1 % off. The diagnosis has the case, ``[baseline]
source = "stage"``. Truths that leave less than two floors are drawn again. With ``--truth
held_sun`` the records are those of :mod:`studies.tabulate_held_sun` of two floors and more: static
equilibria with a sun that friction holds. A file a campaign, made where it is missing, then
stage_causes.md. A good answer: the class alone, or tied, in 90 %.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.carrier.stage import LOADS, series_campaign
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.files.json_files import save_json
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.carrier.effects.inside_stage import STAGE, group_of_effect
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.hidden_stages import HIDDEN, PIN_OFFSET
from carrierflex.simulation.stage.predicted_readings import (
    LoadPoints,
    PredictedStage,
    stage_readings,
)
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.statics import NotConvergedError
from carrierflex.workflows.diagnosis.stage_baseline import predicted_by
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.case_files import seeded_cases, write_table
from studies.stage_in_time import series_in_time
from studies.tabulate_held_sun import (
    FLOOR,
    VISIBLE,
    cosines_and_sines,
    drawn_data,
    held_sun_campaign,
    named_and_tied,
)

#: Classes in turn; nothing differs in the last.
NOTHING = "nothing"
CLASSES = ("sun_restraint", "carrier_clearance", "pin_places", "joint_tilt", "mounting", NOTHING)
#: Truth of another study, whose class is the first.
HELD_SUN = "held_sun"
#: Step of the truth [s], half of the simulator's in the shipped cases.
_STEP = 5e-4
_SPEED, _HIGHEST_ORDER = 2.3, 9
#: Ratio by which a clearance or a support differs at least.
_LEAST_RATIO = 2.0
#: Tilt of the joint [rad]: 2012 paper, table 5, half to twice.
_TILT = (0.3e-3, 1.2e-3)
RIGHT, TIED, WITH_OTHERS, FALSE, NONE = (
    "class right",
    "tied with others",
    "with a false one",
    "false alone",
    "none named",
)


#: Data and effects of a stage.
_Data = tuple[StageData, StageEffects]


@dataclass(frozen=True)
class StageAnswer:
    """What the diagnosis says of one campaign.

    Parameters
    ----------
    truth : str
        Class that differs, or `NOTHING`.
    gap : float
        RMS of the gap over the noise.
    verdict : str
        Its verdict.
    named, ties : tuple of str
        Named laws and classes, and those that cannot be distinguished from them.
    rho : float
        RMS after over before on held-out records; not a number where nothing is named.
    """

    truth: str
    gap: float
    verdict: str
    named: tuple[str, ...]
    ties: tuple[str, ...]
    rho: float

    @property
    def outcome(self) -> str:
        """One of the outcomes."""
        if not self.named:
            return RIGHT if self.truth == NOTHING else NONE
        right = [name for name in self.named if self._is_true(name)]
        if len(right) == len(self.named):
            return TIED if any(not self._is_true(name) for name in self.ties) else RIGHT
        if right:
            return WITH_OTHERS
        return TIED if any(map(self._is_true, self.ties)) else FALSE

    def _is_true(self, name: str) -> bool:
        return class_of(name) == self.truth


def class_of(name: str) -> str:
    """Class inside the stage of a law or class; the name itself of another."""
    frame, _, rest = name.partition("/")
    if frame != STAGE:
        return name
    return group_of_effect(name) or rest.partition("/")[0]


def drawn_pair(truth: str, rng: np.random.Generator) -> tuple[_Data, _Data]:
    """Data and effects of the case, and of the stage behind the records."""
    restrained, floating, pins = drawn_data(rng)
    # A spline that rubs moves on in time where the carrier floats in its clearances.
    quill = replace(restrained.bearings, sun_friction=0.0, sun_clearance=0.0)
    restrained = replace(restrained, bearings=quill)
    case = floating, pins
    if truth == NOTHING:
        return case, case
    if truth == "sun_restraint":
        return case, (restrained, pins)
    if truth == "joint_tilt":
        angle = float(rng.uniform(0.0, 2.0 * np.pi))
        tilted = replace(pins, phi_PLC=float(rng.uniform(*_TILT)), theta_PLC=angle)
        return case, (floating, tilted)
    if truth == "pin_places":
        # A floating sun shares the load wherever the pins stand.
        moved = tuple(PIN_OFFSET.at(rng.random()) for _ in pins.pin_offset)
        return (restrained, pins), (restrained, replace(pins, pin_offset=moved))
    if truth == "carrier_clearance":
        side = str(rng.choice(("upwind_clearance", "downwind_clearance")))
        factor = float(rng.choice((1.0 / _LEAST_RATIO, _LEAST_RATIO)) * rng.uniform(0.75, 1.0))
        size = factor * getattr(floating.bearings, side)
        return case, (replace(floating, bearings=replace(floating.bearings, **{side: size})), pins)
    key = str(rng.choice(("axial_stiffness", "tilt_stiffness")))
    drawn = size = getattr(floating.mounting, key)
    while not (size * _LEAST_RATIO < drawn or size > _LEAST_RATIO * drawn):
        size = HIDDEN[f"mounting_{key.partition('_')[0]}"].at(rng.random())
    return case, (replace(floating, mounting=replace(floating.mounting, **{key: size})), pins)


def drawn_campaign(
    body: StageBody, truth: str, rng: np.random.Generator
) -> tuple[Campaign, PredictedStage, float]:
    """Records of a drawn truth, the stage of their case, and the gap over the noise."""
    while True:
        case, other = (
            PredictedStage(body, *data, ReadingEffects(), _SPEED, rest_angle=0.0)
            for data in drawn_pair(truth, rng)
        )
        try:
            predicted, at_rest = readings_at_rest(case), readings_at_rest(other)
            gap = size_of(at_rest - predicted) / FLOOR
            if truth != NOTHING and gap < VISIBLE:
                continue
            true = series_in_time(other, SENSORS, LOADS, step=_STEP, highest_order=_HIGHEST_ORDER)
        except NotConvergedError:
            continue
        return recorded_campaign(f"stage, {truth}", predicted, true, rng), case, gap


def recorded_campaign(
    name: str,
    predicted: NDArray[np.complex128],
    true: NDArray[np.complex128],
    rng: np.random.Generator,
) -> Campaign:
    """Records that read `true` where a case predicts `predicted`."""
    orders = slice(_HIGHEST_ORDER + 1)
    pairs = cosines_and_sines(true[:, :, orders]), cosines_and_sines(predicted[:, :, orders])
    return series_campaign(name, *pairs, lambda _: FLOOR, rng, rng.spawn(1)[0]).campaign


def readings_at_rest(stage: PredictedStage) -> NDArray[np.complex128]:
    """Series of the readings in equilibrium under the loads of the records."""
    points = LoadPoints(np.array(LOADS), np.array([LOADS[0][0], 2e5, 2e5]))
    return stage_readings(stage, SENSORS, points)[0].series


def size_of(series: NDArray[np.complex128]) -> float:
    """RMS of signals that stand as series, without what an offset of all sensors takes."""
    tilted = series[:, :, 0].real - series[:, :, 0].real.mean(axis=1, keepdims=True)
    return float(np.sqrt(np.mean(tilted**2 + 0.5 * (np.abs(series[:, :, 1:]) ** 2).sum(axis=2))))


def answered(campaign: Campaign, case: PredictedStage, truth: str, gap: float) -> StageAnswer:
    """Answer of the diagnosis to records that a stage predicts."""
    problem = problem_of(predicted_by(campaign, case), default_curves())
    answer = diagnose(
        problem, campaign=campaign.name, kind="carrier", floor_is_measured=problem.noise_is_measured
    )
    rho = np.nan if answer.reduction is None else answer.reduction.rho
    return StageAnswer(truth, gap, answer.verdict, *named_and_tied(answer), float(rho))


def answers_table(rows: Sequence[StageAnswer]) -> list[str]:
    """Outcomes by class, then the answers."""
    outcomes = (RIGHT, TIED, WITH_OTHERS, FALSE, NONE)
    lines = [
        f"| truth | cases | gap / floor | {' | '.join(outcomes)} |",
        "|---|---|---|" + "---|" * len(outcomes),
    ]
    for truth in (*CLASSES, ""):
        of = [row for row in rows if truth in ("", row.truth)]
        if not of:
            continue
        gaps = [row.gap for row in of]
        counts = Counter(row.outcome for row in of)
        cells = " | ".join(str(counts[outcome]) for outcome in outcomes)
        size = f"{min(gaps):.1f} to {max(gaps):.1f}"
        lines.append(f"| {truth or 'all'} | {len(of)} | {size} | {cells} |")
    lines += ["", "| truth | named | not distinguished | verdict | rho |", "|---|---|---|---|---|"]
    for row in rows:
        named, ties = (", ".join(names) or "-" for names in (row.named, row.ties))
        lines.append(f"| {row.truth} | {named} | {ties} | {row.verdict} | {row.rho:.3f} |")
    return lines


def _of_held_sun(body: StageBody, seed: int, number: int) -> tuple[Campaign, PredictedStage, float]:
    """As :func:`drawn_campaign`, of the other study."""
    made, data, pins = held_sun_campaign(body, seed, number)
    case = PredictedStage(body, data, pins, ReadingEffects(), rest_angle=0.0)
    return made.campaign, case, made.gap / made.floor


def _write(body: StageBody, seed: int, truth: str | None, number: int, path: Path) -> None:
    drawn = truth or CLASSES[number % len(CLASSES)]
    with single_threaded():
        if drawn == HELD_SUN:
            campaign, case, gap = _of_held_sun(body, seed, number)
            drawn = CLASSES[0]
        else:
            campaign, case, gap = drawn_campaign(body, drawn, np.random.default_rng([seed, number]))
        row = answered(campaign, case, drawn, gap)
    save_json(path, row)


def _row(content: dict[str, Any]) -> StageAnswer:
    named, ties = (tuple(content[name]) for name in ("named", "ties"))
    rho = np.nan if content["rho"] is None else content["rho"]
    return StageAnswer(content["truth"], content["gap"], content["verdict"], named, ties, rho)


def main(
    *,
    out: Path,
    cases: int = 30,
    seed: int = 1,
    truth: str | None = None,
    size: float = 0.06,
    workers: int = 1,
    quiet: bool = False,
) -> None:
    """Make and diagnose campaigns; write stage_causes.md.

    Parameters
    ----------
    out
        Folder; campaigns that stand there are not made again.
    cases
        Campaigns.
    seed
        Seed.
    truth
        One class, nothing or held_sun; by default all but the last take turns.
    size
        Element edge length of carrier and pins [m].
    workers
        Processes.
    quiet
        Show no progress.
    """
    folder, stages = prepared_folder(out), Stages(2, quiet)
    with stages.stage(f"carrier and pins of {size} m"):
        body = default_stage_body(PAPER_STIFFNESS, size)
    rows = seeded_cases(
        folder,
        seed,
        cases,
        partial(_write, body, seed, truth),
        _row,
        stages=stages,
        workers=workers,
    )
    rows = [row for row in rows if row.truth == NOTHING or row.gap >= VISIBLE]
    lines = answers_table(rows)
    write_table(folder / "stage_causes.md", lines)
    print("\n".join(lines))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

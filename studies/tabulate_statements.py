"""How often the statements of a diagnosis are true: causes, forces, agreement, a law put back.

- ``friction``: elements with Coulomb friction of any form; the level that is reported is within
  15 % of half the true step at rest, which lies in its interval.
- ``unknown``: causes that no class holds, of ten floors and more, noise declared or not; the
  verdict is not "agree within the noise".
- ``nothing``: campaigns without a missing effect and without declared noise, of which periods
  (elements), revolutions (carriers) or equal runs (mountings) bound the floor; the verdict is
  "agree within the noise". The elements' noise is coloured, with a memory of up to 0.9 from sample
  to sample.
- ``law``: springs that no law of the library has (a hyperbolic sine; stiffness that falls with
  time or with the damper's heat) under sweeps; no law is named alone.
- ``saved``: causes of elements; what ``--save-law`` writes, put back with ``--law``, leaves what
  the answer leaves. With ``--campaigns`` of the folders in it (``validation.measured_campaigns``).

Writes CASE.json for every case, which a later call takes up, and SORT.md.
"""

import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from carrierflex.blind_check.labels import NOTHING, OUTSIDE, SINGLE, CasePlan
from carrierflex.blind_check.truth.alias_table import OUTSIDE_NAMES
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.element.drives import MULTISINE, NOISE, SINES, SWEEPS
from carrierflex.blind_check.truth.element.families import (
    CAUSES,
    INSIDE_CAUSES,
    OUTSIDE_CAUSES,
)
from carrierflex.blind_check.truth.element.truth import element_truth
from carrierflex.blind_check.truth.noise import coloured_noise
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.law_fits import law_fits
from carrierflex.diagnosis.inference.results import (
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMED_WITH_REMAINDER,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kinds import problem_of, saved_law
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.json_files import save_json
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import make_missing, read_case, write_table

_DRIVES = (MULTISINE, NOISE, SWEEPS, SINES)
_FRICTION = "coulomb"
#: Step [s], samples of a period and periods of an element with nothing missing.
_STEP, _PERIOD, _PERIODS = 5e-3, 512, 5
#: Springs that no law of the library has, and the drive under which they passed for one.
_NO_LAWS = ("hyperbolic_hardening", "warming_spring", "heated_spring")
_NUMBER = r"(\S+) (k?N\S*)"
_LEVEL = re.compile(rf"dry friction, about {_NUMBER} \({_NUMBER} to {_NUMBER}\)")
#: Share of the true friction that the reported level may be off, and of what an answer leaves that
#: its saved law may.
_NEAR, _SAME = 0.15, 0.02


@dataclass(frozen=True)
class Statement:
    """What is reported of one case.

    Parameters
    ----------
    cause, drive : str
        What is missing, and how an element is driven.
    ratio : float
        Gap over floor.
    verdict : str
        Verdict of the diagnosis.
    level, low, high, true_level : float
        Dry friction as reported, its interval and the true one [N]; zero where there is none.
    laws : str
        Named laws.
    put_back : float
        RMS that the saved law leaves, over that of the answer; zero where no law is saved.
    """

    cause: str
    drive: str
    ratio: float
    verdict: str
    level: float = 0.0
    true_level: float = 0.0
    low: float = 0.0
    high: float = 0.0
    laws: str = ""
    put_back: float = 0.0

    @property
    def is_near(self) -> bool:
        """Whether the reported level is within 15 % of the true one."""
        return abs(self.level - self.true_level) <= _NEAR * self.true_level

    @property
    def is_in_interval(self) -> bool:
        """Whether the interval of the reported level holds the true one."""
        return self.low <= self.true_level <= self.high

    @property
    def is_law_alone(self) -> bool:
        """Whether a law is the answer, with or without a remainder."""
        return self.verdict in (NAMED, NAMED_WITH_REMAINDER)

    @property
    def is_put_back(self) -> bool:
        """Whether the saved law leaves what the answer leaves, within 2 %."""
        return abs(self.put_back - 1.0) <= _SAME


def main(
    *,
    out: Path,
    sort: Literal["friction", "unknown", "nothing", "law", "saved"],
    kind: Literal["element", "carrier", "mounting"] = "element",
    seed: int = 1,
    cases: int = 40,
    campaigns: Path | None = None,
    workers: int = 1,
    quiet: bool = False,
) -> tuple[Statement, ...]:
    """Diagnose cases of one sort and count the true statements.

    Parameters
    ----------
    out : Path
        Folder for the cases and the table; cases that stand there are not done again.
    sort : str
        What is missing.
    kind : str
        Kind of campaign.
    seed, cases : int
        Seed and number of the cases.
    campaigns : Path, optional
        Folder of campaign folders that are diagnosed instead (sort ``saved``).
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    tuple of Statement
        Cases that were diagnosed.

    Raises
    ------
    ValueError
        Where the kind has no cases of the sort.
    """
    if sort not in ("unknown", "nothing") and kind != "element":
        raise ValueError(f"--kind is {kind}; expected element: only it has cases of --sort {sort}")
    folder = prepared_folder(out)
    plans: Sequence[CasePlan | Path] = _plans(sort, kind, seed, cases)
    if campaigns is not None:
        plans = sorted(path.parent for path in campaigns.glob("*/campaign.toml"))
    files = [folder / f"{sort}-{seed}-{plan.name}.json" for plan in plans]
    write: Callable[[Any, Path], None] = _write_saved if sort == "saved" else _write_case
    stages = Stages(1, quiet)
    with stages.stage("diagnosing cases"), work_executor(workers) as executor:
        make_missing(plans, files, write, executor, stages)
    results = tuple(map(_read_case, files))
    write_table(folder / f"{sort}.md", _table(results))
    return results


def _plans(sort: str, kind: str, seed: int, cases: int) -> list[CasePlan]:
    least, largest = (10.0, 50.0) if sort == "unknown" else (3.0, 50.0)
    ratios = np.random.default_rng(seed).permutation(np.geomspace(least, largest, cases))
    if sort == "nothing":
        drive = MULTISINE if kind == "element" else ""
        plan = CasePlan(kind, 1, seed, NOTHING, (), 0.0, drive, declares_noise=False)
        return [replace(plan, number=k + 1) for k in range(cases)]
    outside = OUTSIDE_CAUSES if kind == "element" else OUTSIDE_NAMES[kind]
    causes = {"friction": (_FRICTION,), "law": _NO_LAWS, "unknown": outside}.get(
        sort, tuple(name for name in INSIDE_CAUSES if CAUSES[name].drives)
    )
    plans = []
    for number, ratio in enumerate(ratios):
        cause = causes[number % len(causes)]
        drives = {"law": (SWEEPS,), "saved": CAUSES[cause].drives}.get(sort, _DRIVES)
        plans.append(
            CasePlan(
                kind,
                number + 1,
                seed,
                OUTSIDE if sort == "unknown" else SINGLE,
                (cause,),
                float(ratio),
                drives[number % len(drives)] if kind == "element" else "",
                declares_noise=number // len(_DRIVES) % 2 == 0,
            )
        )
    return plans


def _periodic_element(plan: CasePlan) -> Campaign:
    """Spring and damper moved by a periodic multisine at three levels, with coloured noise."""
    rng = np.random.default_rng([plan.seed, plan.number])
    K, C = 10.0 ** rng.uniform(3.0, 7.0), rng.uniform(0.002, 0.02)
    time = _STEP * np.arange(float(_PERIODS * _PERIOD))
    omega = 2.0 * np.pi / (_PERIOD * _STEP) * np.arange(1, rng.integers(15, 60), 2)
    noise_std, memory = K * 1e-3 * 10.0 ** rng.uniform(-3.0, -1.5), rng.uniform(0.0, 0.9)
    noise = noise_std * coloured_noise(rng, (3, time.size), memory=memory)
    runs = []
    for number, amplitude in enumerate((0.5e-3, 1e-3, 2e-3)):
        phase = rng.uniform(0.0, 2.0 * np.pi, omega.size)
        a = amplitude * np.sqrt(2.0 / omega.size) * np.exp(1j * (np.outer(time, omega) + phase))
        q, v = a.real.sum(axis=1), (1j * omega * a).real.sum(axis=1)
        force = K * (q + C * v) + noise[number]
        name = f"run{number + 1}"
        runs.append(
            Run(name, f"{name}.csv", f"{amplitude} m", time, {"displacement": q}, {"F": force})
        )
    rig = {"drive": "displacement", "periodic": True, "period_samples": _PERIOD}
    channel = Channel("F", "force", "N")
    return Campaign("element", plan.name, Baseline("model"), rig, (channel,), tuple(runs))


def _repeated_mounting(plan: CasePlan) -> Campaign:
    """Mounting of which every run is measured twice."""
    campaign, again = case_campaign(plan)[0], case_campaign(plan, repeat=1)[0]
    runs = [replace(run, name=f"{run.name}_again", file=f"again_{run.file}") for run in again.runs]
    return replace(campaign, runs=(*campaign.runs, *runs))


def _campaign_of(plan: CasePlan) -> tuple[Campaign, float]:
    """Campaign of a case, and its dry friction [N]."""
    true_level = 0.0
    if (plan.kind, plan.family) == ("element", NOTHING):
        campaign = _periodic_element(plan)
    elif (plan.kind, plan.family) == ("mounting", NOTHING):
        campaign = _repeated_mounting(plan)
    elif plan.effects == (_FRICTION,):
        campaign, _, case = element_truth(plan)
        # A change of form is smooth: the step at rest is that of the law.
        true_level = float(case.element.laws[0].scale[0])
    else:
        campaign, _ = case_campaign(plan)
    if plan.declares_noise:
        return campaign, true_level
    channels = tuple(replace(channel, noise_std=None) for channel in campaign.channels)
    return replace(campaign, channels=channels), true_level


def _diagnosed(campaign: Campaign) -> Diagnosis:
    curves = default_curves() if campaign.kind == "carrier" else None
    problem = problem_of(campaign, curves)
    return diagnose(
        problem,
        campaign=campaign.name,
        kind=campaign.kind,
        floor_is_measured=problem.noise_is_measured,
    )


def _write_case(plan: CasePlan, path: Path) -> None:
    campaign, true_level = _campaign_of(plan)
    with single_threaded():
        diagnosis = _diagnosed(campaign)
    level, low, high = _level(diagnosis)
    statement = Statement(
        "+".join(plan.effects),
        plan.drive,
        plan.ratio,
        diagnosis.verdict,
        level,
        true_level,
        low,
        high,
        _laws(diagnosis),
    )
    save_json(path, statement)


def _laws(diagnosis: Diagnosis) -> str:
    """Named laws, and the classes of an answer."""
    named = (diagnosis.attribution.effects, diagnosis.class_ids)
    return " | ".join("+".join(names) for names in named)


def _level(diagnosis: Diagnosis) -> tuple[float, float, float]:
    """Dry friction as reported, with its interval [N]: that of a named law, else in words."""
    value = diagnosis.attribution.parameters.get("coulomb_friction", {}).get("Fc")
    if value is not None and value.ci95 is not None:
        return value.value, *value.ci95
    for finding in diagnosis.classes.classes if diagnosis.classes else ():
        one = _LEVEL.search(finding.shape.words) if finding.shape is not None else None
        if one:
            numbers, units = one.groups()[::2], one.groups()[1::2]
            level, low, high = (
                float(number) * (1e3 if unit.startswith("kN") else 1.0)
                for number, unit in zip(numbers, units, strict=True)
            )
            return level, low, high
    return 0.0, 0.0, 0.0


def _write_saved(plan: CasePlan | Path, path: Path) -> None:
    """Diagnose a case, save the laws of its answer and offer them again."""
    if isinstance(plan, Path):
        campaign, cause, drive, ratio = read_campaign(plan), plan.name, "", 0.0
    else:
        campaign, _ = _campaign_of(plan)
        cause, drive, ratio = "+".join(plan.effects), plan.drive, plan.ratio
    with single_threaded():
        diagnosis = _diagnosed(campaign)
        put_back = _put_back(campaign, diagnosis)
    level, low, high = _level(diagnosis)
    statement = Statement(
        cause, drive, ratio, diagnosis.verdict, level, 0.0, low, high, _laws(diagnosis), put_back
    )
    save_json(path, statement)


def _put_back(campaign: Campaign, diagnosis: Diagnosis) -> float:
    """RMS that the saved laws of all classes leave over that of the answer; zero without one."""
    is_named = diagnosis.verdict in (NAMED, NAMED_WITH_REMAINDER)
    if not is_named and diagnosis.verdict != CLASS_NAMED:
        return 0.0
    if diagnosis.classes is None or diagnosis.reduction is None:
        return 0.0
    values = {
        effect: {name: value.value for name, value in named.items()}
        for effect, named in diagnosis.attribution.parameters.items()
        if is_named
    }
    laws = []
    with tempfile.TemporaryDirectory() as folder:
        for number, finding in enumerate(diagnosis.classes.classes):
            try:
                law = saved_law(campaign, diagnosis.classes, finding.id, values)
            except ValueError:
                return 0.0
            path = Path(folder) / f"{number}.toml"
            write_law(path, law)
            laws.append(read_law(path))
    problem = problem_of(campaign, None, laws)
    names = tuple(sorted(law.name for law in laws))
    mean_square = law_fits(problem, Thresholds()).mean_square(names)
    return float(np.sqrt(mean_square)) / diagnosis.reduction.rms_after


def _read_case(path: Path) -> Statement:
    def statement(row: Mapping[str, Any]) -> Statement:
        """Statement of a row; a file holds no interval that is not determined."""
        known: dict[str, Any] = {k: np.nan if v is None else v for k, v in row.items()}
        return Statement(**known)

    return read_case(path, "a statement of a case", statement)


def _table(results: Sequence[Statement]) -> Iterator[str]:
    columns = "cases | agree within the noise | a law alone | friction given | within 15 % | in its"
    yield f"| cause | drive | {columns} interval | saved | left again | verdicts |"
    yield "|---" * 11 + "|"
    groups = dict.fromkeys((one.cause, one.drive) for one in results)
    for cause, drive in (*groups, ("all", "all")):
        members = [
            one for one in results if (cause, drive) in ((one.cause, one.drive), ("all",) * 2)
        ]
        verdicts = Counter(one.verdict for one in members)
        levels = [one for one in members if one.true_level > 0.0 and one.level > 0.0]
        counts = (
            len(members),
            verdicts[AT_NOISE_FLOOR],
            sum(one.is_law_alone for one in members),
            sum(one.level > 0.0 for one in members),
            sum(one.is_near for one in levels),
            sum(one.is_in_interval for one in levels),
            sum(one.put_back > 0.0 for one in members),
            sum(one.is_put_back for one in members),
        )
        text = ", ".join(f"{name} {count}" for name, count in verdicts.most_common())
        yield f"| {cause or 'nothing'} | {drive or '-'} | {' | '.join(map(str, counts))} | {text} |"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

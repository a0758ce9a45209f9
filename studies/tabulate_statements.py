"""How often three statements of a diagnosis are true: dry friction, an unknown cause, nothing.

- ``friction``: elements with Coulomb friction; the level in words is within 15 % of the true one.
  One case in four has friction of the textbook form, which has a true level; the others are left
  out.
- ``unknown``: causes that no class holds, of ten floors and more, noise declared or not; the
  verdict is not "agree within the noise".
- ``nothing``: campaigns without a missing effect and without declared noise, of which periods
  (elements) or revolutions (carriers) bound the floor; the verdict is "agree within the noise".
  The elements' noise is coloured, with a memory of up to 0.9 from sample to sample.

Writes CASE.json for every case, which a later call takes up, and SORT.md.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from carrierflex.blind_check.labels import NOTHING, OUTSIDE, SINGLE, CasePlan
from carrierflex.blind_check.truth.alias_table import OUTSIDE_NAMES
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.element.drives import MULTISINE, NOISE, SINES, SWEEPS
from carrierflex.blind_check.truth.element.families import OUTSIDE_CAUSES
from carrierflex.blind_check.truth.noise import coloured_noise
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.results import AT_NOISE_FLOOR
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.files.json_files import save_json
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import make_missing, read_case, write_table

_DRIVES = (MULTISINE, NOISE, SWEEPS, SINES)
_FRICTION = "coulomb"
#: Step [s], samples of a period and periods of an element with nothing missing.
_STEP, _PERIOD, _PERIODS = 5e-3, 512, 5
_LEVEL = re.compile(r"dry friction, about (\S+) N")
#: Share of the true friction that the level in words may be off.
_NEAR = 0.15


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
    level, true_level : float
        Dry friction in words and the true one [N]; zero where there is none.
    """

    cause: str
    drive: str
    ratio: float
    verdict: str
    level: float = 0.0
    true_level: float = 0.0

    @property
    def is_near(self) -> bool:
        """Whether the level in words is within 15 % of the true one."""
        return abs(self.level - self.true_level) <= _NEAR * self.true_level


def main(
    *,
    out: Path,
    sort: Literal["friction", "unknown", "nothing"],
    kind: Literal["element", "carrier", "mounting"] = "element",
    seed: int = 1,
    cases: int = 40,
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
    if sort == "friction" and kind != "element":
        raise ValueError(f"--kind is {kind}; expected element: only its cases have dry friction")
    if sort == "nothing" and kind == "mounting":
        raise ValueError("--kind is mounting; expected element or carrier: no run of it repeats")
    folder = prepared_folder(out)
    plans = _plans(sort, kind, seed, cases)
    files = [folder / f"{sort}-{seed}-{plan.name}.json" for plan in plans]
    stages = Stages(1, quiet)
    with stages.stage("diagnosing cases"), work_executor(workers) as executor:
        make_missing(plans, files, _write_case, executor, stages)
    results = tuple(result for result in map(_read_case, files) if result.verdict)
    write_table(folder / f"{sort}.md", _table(results))
    return results


def _plans(sort: str, kind: str, seed: int, cases: int) -> list[CasePlan]:
    least, largest = (3.0, 50.0) if sort == "friction" else (10.0, 50.0)
    ratios = np.random.default_rng(seed).permutation(np.geomspace(least, largest, cases))
    if sort == "nothing":
        drive = MULTISINE if kind == "element" else ""
        plan = CasePlan(kind, 1, seed, NOTHING, (), 0.0, drive, declares_noise=False)
        return [replace(plan, number=k + 1) for k in range(cases)]
    outside = OUTSIDE_CAUSES if kind == "element" else OUTSIDE_NAMES[kind]
    family, causes = (OUTSIDE, outside) if sort == "unknown" else (SINGLE, (_FRICTION,))
    return [
        CasePlan(
            kind,
            number + 1,
            seed,
            family,
            (causes[number % len(causes)],),
            float(ratio),
            _DRIVES[number % len(_DRIVES)] if kind == "element" else "",
            declares_noise=number // len(_DRIVES) % 2 == 0,
        )
        for number, ratio in enumerate(ratios)
    ]


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


def _write_case(plan: CasePlan, path: Path) -> None:
    if (plan.kind, plan.family) == ("element", NOTHING):
        campaign, true_level = _periodic_element(plan), 0.0
    else:
        campaign, label = case_campaign(plan)
        true_level = label.parameters.get("coulomb_friction", {}).get("Fc", 0.0)
    if plan.effects == (_FRICTION,) and not true_level:
        save_json(path, Statement(_FRICTION, plan.drive, plan.ratio, ""))
        return
    if not plan.declares_noise:
        channels = tuple(replace(channel, noise_std=None) for channel in campaign.channels)
        campaign = replace(campaign, channels=channels)
    with single_threaded():
        curves = default_curves() if plan.kind == "carrier" else None
        problem, measured = problem_of(campaign, curves)
        diagnosis = diagnose(
            problem, campaign=campaign.name, kind=plan.kind, floor_is_measured=measured
        )
    words = [
        member.shape.words
        for member in (diagnosis.classes.classes if diagnosis.classes else ())
        if member.shape is not None
    ]
    level = next((float(one[1]) for one in map(_LEVEL.search, words) if one), 0.0)
    statement = Statement(
        "+".join(plan.effects), plan.drive, plan.ratio, diagnosis.verdict, level, true_level
    )
    save_json(path, statement)


def _read_case(path: Path) -> Statement:
    return read_case(path, "a statement of a case", lambda row: Statement(**row))


def _table(results: Sequence[Statement]) -> Iterator[str]:
    columns = "cases | agree within the noise | friction given | within 15 % | verdicts"
    yield f"| cause | drive | {columns} |"
    yield "|---" * 7 + "|"
    groups = dict.fromkeys((one.cause, one.drive) for one in results)
    for cause, drive in (*groups, ("all", "all")):
        members = [
            one for one in results if (cause, drive) in ((one.cause, one.drive), ("all",) * 2)
        ]
        verdicts = Counter(one.verdict for one in members)
        counts = (
            len(members),
            verdicts[AT_NOISE_FLOOR],
            sum(one.level > 0.0 for one in members),
            sum(one.is_near for one in members if one.true_level > 0.0),
        )
        text = ", ".join(f"{name} {count}" for name, count in verdicts.most_common())
        yield f"| {cause or 'nothing'} | {drive or '-'} | {' | '.join(map(str, counts))} | {text} |"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

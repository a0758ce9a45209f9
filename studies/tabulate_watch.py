"""How well `watch` knows a turbine: delay, names, false alarms, speed, memory, kills.

Causes come from the truth of simulated fleets, which imports nothing that fits: a campaign of the
turbine without the cause is diagnosed, then its records run on, and from one revolution on the
cause is there. Writes watch.md; every topic has a folder, and a later call goes on with what is
missing. A good answer: three noise floors found within 50 revolutions, named rightly in 90 %, no
alarm where there is nothing.
"""

import multiprocessing
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray
from scipy import stats

from carrierflex.blind_check.labels import SINGLE
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.fleet import (
    DEAD_SENSOR,
    EXCHANGED_CABLE,
    FleetPlan,
)
from carrierflex.blind_check.truth.noise import coloured_noise
from carrierflex.diagnosis.carrier.classes.answer import CLASS_OF_LAW
from carrierflex.diagnosis.carrier.watch.change_test import (
    ChangeTest,
    learned_noise,
    threshold_of,
)
from carrierflex.files.json_files import read_json, save_json, save_text
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis import diagnose_campaign
from carrierflex.workflows.fleet import watch_turbine
from carrierflex.workflows.fleet.watch_result import WatchResult
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

FloatArray = NDArray[np.float64]
Columns = dict[str, FloatArray]
Topic = Literal["causes", "statistics", "days", "size", "kills"]
TOPICS: tuple[Topic, ...] = ("causes", "statistics", "days", "size", "kills")

#: Causes that come, and faults of the measurement.
_CAUSES = (
    "carrier_tilt", "bearing_clearance", "ntl_tilt", "housing_tilt", "flange_warp", "face_runout",
    "ring_pass", "unequal_load_sharing",
)  # fmt: skip
_FAULTS = (DEAD_SENSOR, EXCHANGED_CABLE)
#: Wanted size of a cause in noise floors, and revolutions within which it is to be found.
_FLOORS, _WITHIN = 3.0, 50
#: Size of the cause in the records before it comes [noise floors].
_ABSENT = 1e-3
#: Run of the campaign that runs on: full torque with a radial load along both axes.
_RUN = 3
#: Records of 48 s before the cause, and with it.
_BEFORE, _AFTER = 14, 5
_RPM, _REVOLUTIONS_A_DAY = 22.0, 22.0 * 60.0 * 24.0
#: Memory of the noise from revolution to revolution: of each turbine uniform up to this.
_LARGEST_MEMORY = 0.8
#: Daily temperature: amplitude of the common offset [noise floors].
_TEMPERATURE = 10.0
#: Streams that are simulated at once, revolutions of one chunk of them.
_STREAMS, _CHUNK = 500, 5_000_000
#: Options of watch, as they are by default: false alarms a day, drift in noise floors an hour.
_RATE_OF_ALARMS, _DRIFT = 1e-3, 5.0
#: Samples a second of the turbine-days.
_RATE = 40.0
#: Files that come before each kill, their length [s], and files between two changes.
_FILES_A_KILL, _SECONDS_OF_A_FILE, _FILES_A_CHANGE = 4, 61.7, 20


def main(
    *,
    out: Path,
    only: list[Topic] | None = None,
    turbines: int = 5,
    revolutions: int = 10_000_000,
    days: int = 20,
    samples: int = 100_000_000,
    kills: int = 100,
    seed: int = 1,
    quiet: bool = False,
) -> str:
    """Simulate turbines with and without a cause that comes, watch them, and score.

    Parameters
    ----------
    out : Path
        Folder; a later call with the same options goes on.
    only : list of str, optional
        What is done: causes, statistics, days, size, kills; default: all.
    turbines : int
        Turbines a cause.
    revolutions : int
        Revolutions whose statistics are simulated under the null.
    days : int
        Turbine-days that are simulated sample by sample.
    samples : int
        Samples (rows) of the record on which memory and speed are measured.
    kills : int
        Times that the command is killed.
    seed : int
        Seed of the turbines.
    quiet : bool
        Show no progress.

    Returns
    -------
    str
        Table of the figures, as in watch.md.
    """
    folder = prepared_folder(out).resolve()
    stages = Stages(len(only or TOPICS), quiet)
    works: dict[Topic, Callable[[Path], dict[str, Any]]] = {
        "causes": lambda to: _causes(to, turbines, seed, stages),
        "statistics": lambda to: _statistics(to, revolutions, seed, stages),
        "days": lambda to: _days(to, days, seed, stages),
        "size": lambda to: _long_record(to, samples, seed),
        "kills": lambda to: _kills(to, kills, seed, stages),
    }
    for name in only or TOPICS:
        with stages.stage(name), single_threaded():
            result = works[name](prepared_folder(folder / name))
            save_json(folder / f"{name}.json", result)
    lines = ["| figure | wanted | reached | of |", "|---|---|---|---|"]
    for name in TOPICS:
        if (folder / f"{name}.json").exists():
            lines += read_json(folder / f"{name}.json", "figures of this study")["rows"]
    text = "\n".join(lines) + "\n"
    save_text(folder / "watch.md", text)
    return text


def _row(figure: str, wanted: str, reached: str, of: str) -> str:
    return f"| {figure} | {wanted} | {reached} | {of} |"


# Causes and faults of the measurement.


def _causes(folder: Path, turbines: int, seed: int, stages: Stages) -> dict[str, Any]:
    """Delay, name and size of causes of three floors, by turbine."""
    outcomes = []
    cases = [(cause, k) for k in range(turbines) for cause in (*_CAUSES, *_FAULTS)]
    for number, (cause, k) in enumerate(cases):
        stages.note(f"{cause}, turbine {k + 1}", number / len(cases))
        to = folder / f"{cause}-{k}"
        if not (to / "outcome.json").exists():
            plan = _plan(cause, number, seed)
            save_json(prepared_folder(to) / "outcome.json", _outcome(to, plan, cause))
        outcomes.append(read_json(to / "outcome.json", "an outcome"))
    new = [one for one in outcomes if one["cause"] in _CAUSES]
    faults = [one for one in outcomes if one["cause"] in _FAULTS]
    delays = [one["delay"] if one["delay"] is not None else np.inf for one in new]
    within = sum(delay <= _WITHIN for delay in delays)
    late = [abs(one["since"]) for one in new if one["since"] is not None]
    rows = [
        _row(
            "cause of three floors: median delay, revolutions",
            f"<= {_WITHIN}",
            f"{np.median(delays):g} ({within} within {_WITHIN})",
            str(len(new)),
        ),
        _row("named rightly", "90 %", _share(new, "is_right"), str(len(new))),
        _row("named with another class as a tie", "-", _share(new, "is_tied"), str(len(new))),
        _row("another class named", "-", _share(new, "is_wrong"), str(len(new))),
        _row(
            "begin of the change, median and largest error, revolutions",
            "-",
            f"{np.median(late):g}, {max(late):g}",
            str(len(late)),
        ),
        _row("true size in the 95 % interval", "95 %", _share(new, "holds_size"), str(len(new))),
        _row(
            "alarm before the cause", "0", str(sum(one["n_before"] for one in outcomes)),
            f"{sum(one['revolutions_before'] for one in outcomes)} revolutions",
        ),
        _row(
            "fault of the measurement reported as one, with its channel",
            "-",
            _share(faults, "is_right"),
            str(len(faults)),
        ),
    ]  # fmt: skip
    return {"rows": rows, "outcomes": outcomes}


def _share(outcomes: list[dict[str, Any]], key: str) -> str:
    n = sum(bool(one[key]) for one in outcomes)
    return f"{n / len(outcomes):.0%}" if outcomes else "-"


def _plan(cause: str, number: int, seed: int) -> FleetPlan:
    """Turbine that holds next to nothing of its cause; one with a fault holds a tilt instead."""
    effect = cause if cause in _CAUSES else "housing_tilt"
    return FleetPlan(
        kind="carrier",
        number=number + 1,
        seed=seed,
        family=SINGLE,
        effects=(effect,),
        ratio=_ABSENT,
        fate=cause,
    )


def _outcome(folder: Path, plan: FleetPlan, cause: str) -> dict[str, Any]:
    """Watch a turbine whose cause comes, or whose measurement fails."""
    for name in ("records", "watch"):
        # Of a call that was interrupted.
        shutil.rmtree(folder / name, ignore_errors=True)
    campaign, label = case_campaign(plan)
    write_campaign(campaign, folder / "campaign", simulated=True)
    diagnose_campaign.main(folder / "campaign", out=folder / "diagnosis", report=False, quiet=True)
    # The same noise with and without: their difference is the cause, made three floors of the run.
    large, _ = case_campaign(replace(plan, ratio=_FLOORS))
    names = [channel.name for channel in campaign.channels]
    without, with_it = (_signals(one, names) for one in (campaign, large))
    difference = with_it - without
    size = float(np.sqrt(np.mean(difference**2)))
    factor = _FLOORS * label.floor / size if cause in _CAUSES else 0.0
    records = prepared_folder(folder / "records")
    start = 0.0
    rng = np.random.default_rng([plan.seed, plan.number])
    first, second = rng.permutation(len(names))[:2]
    before = None
    for k in range(_BEFORE + _AFTER):
        if k == _BEFORE:
            before = _watched(folder, records, "watch")
        run = case_campaign(plan, repeat=k + 1)[0].runs[_RUN]
        signals = np.array([run.signals[name] for name in names])
        if k >= _BEFORE:
            signals = signals + factor * difference
            if cause == DEAD_SENSOR:
                signals[first] = signals[first, 0]
            elif cause == EXCHANGED_CABLE:
                signals[[first, second]] = signals[[second, first]]
        columns = {"time": run.time + start, **run.inputs}
        start = float(columns["time"][-1]) + 1.0
        _write(records / f"{k:04d}.parquet", columns | dict(zip(names, signals, strict=True)))
    assert before is not None
    change = before.revolutions + 1
    result = _watched(folder, records, "watch")
    after = result.alarms[len(before.alarms) :]
    outcome: dict[str, Any] = {
        "cause": cause,
        "revolutions_before": change,
        "n_before": len(before.alarms),
        "delay": None,
        "since": None,
        **dict.fromkeys(("is_right", "is_tied", "is_wrong", "holds_size"), False),
        "lines": result.lines,
    }
    if not after:
        return outcome
    alarm = after[0]
    outcome |= {"delay": alarm.revolution - change, "since": alarm.since - change}
    faulty = {names[first], *([names[second]] if cause == EXCHANGED_CABLE else [])}
    if cause in _FAULTS:
        is_fault = alarm.change is None or alarm.change.is_fault
        return outcome | {"is_right": is_fault and set(alarm.channels) == faulty}
    wanted = CLASS_OF_LAW[cause]
    assert alarm.change is not None
    assert alarm.size_ci95 is not None
    named = alarm.change.id
    return outcome | {
        "is_right": named == wanted and not alarm.change.ties,
        "is_tied": bool(alarm.change.ties) and wanted in (named, *alarm.change.ties),
        "is_wrong": wanted not in (named, *alarm.change.ties) and named != "none_of_these",
        "holds_size": alarm.size_ci95[0] <= _FLOORS * label.floor <= alarm.size_ci95[1],
    }


def _signals(campaign: Campaign, names: list[str]) -> FloatArray:
    return np.array([campaign.runs[_RUN].signals[name] for name in names])


def _write(path: Path, columns: Columns) -> None:
    pa_parquet.write_table(pa.table(columns), path)


# Statistics of revolutions under the null.


def _statistics(folder: Path, revolutions: int, seed: int, stages: Stages) -> dict[str, Any]:
    """False alarms of vectors of revolutions without a change, chunk by chunk."""
    outcomes = []
    n_chunks = -(-revolutions // _CHUNK)
    for chunk in range(n_chunks):
        path = folder / f"{chunk:03d}.json"
        if not path.exists():
            stages.note(f"{chunk * _CHUNK:.3g} revolutions", chunk / n_chunks)
            save_json(path, _null_chunk(min(_CHUNK, revolutions - chunk * _CHUNK), [seed, chunk]))
        outcomes.append(read_json(path, "an outcome"))
    n_alarms = sum(one["alarms"] for one in outcomes)
    n = sum(one["revolutions"] for one in outcomes)
    largest = max(one["largest"] for one in outcomes)
    turbine_days = n / _REVOLUTIONS_A_DAY
    limit = float(stats.chi2.ppf(0.95, 2 * (n_alarms + 1))) / 2.0 / turbine_days
    row = _row(
        "false alarms a turbine-day, statistics of revolutions: upper 95 % limit",
        "1 in 1000",
        f"1 in {1.0 / limit:.0f} ({n_alarms} alarms; largest evidence {largest:.1f} of "
        f"{threshold_of(_REVOLUTIONS_A_DAY, _RATE_OF_ALARMS):.1f})",
        f"{n:.2g} revolutions, {turbine_days:.0f} turbine-days",
    )
    return {"rows": [row], "outcomes": outcomes}


def _null_chunk(revolutions: int, seed: list[int]) -> dict[str, Any]:
    """Alarms of streams with coloured noise and a daily temperature."""
    # Every stream learns its noise and its floor from its first 200 revolutions. The noise has a
    # memory from revolution to revolution and is correlated between channels; the offset follows
    # the day.
    p, C, learn = 25, 4, 200
    rng = np.random.default_rng(seed)
    # Half of the noise's mean square repeats within a turn, as at a sampling rate of 40 Hz.
    std = np.sqrt(0.5 / (p * C))
    phi = rng.uniform(0.0, _LARGEST_MEMORY, (_STREAMS, p, 1))
    mix = std * np.linalg.cholesky(0.7 * np.eye(C) + 0.3).T
    nuisance = np.zeros((p, C))
    nuisance[0] = 0.5
    phase = rng.uniform(0.0, 2.0 * np.pi, _STREAMS)

    def vectors() -> Iterator[FloatArray]:
        """Vectors of one revolution of every stream after another, in noise floors."""
        x = rng.standard_normal((_STREAMS, p, C)) @ mix
        for k in count():
            day = _TEMPERATURE * np.sin(2.0 * np.pi * k / _REVOLUTIONS_A_DAY + phase)
            yield x + day[:, None, None] * nuisance
            white = rng.standard_normal((_STREAMS, p, C)) @ mix
            x = phi * x + np.sqrt(1.0 - phi**2) * white

    stream = vectors()
    first = np.array([next(stream) for _ in range(learn)])
    noises = [learned_noise(first[:, b]) for b in range(_STREAMS)]
    mean = np.array([one.mean for one in noises])
    floors = np.sqrt(0.5 + np.mean(np.sum((first - mean) ** 2, axis=(2, 3)), axis=0))
    test = ChangeTest(
        memory=np.array([one.memory for one in noises]),
        covariance=np.array([one.covariance for one in noises]),
        dead_band=floors,
        threshold=threshold_of(_REVOLUTIONS_A_DAY, _RATE_OF_ALARMS),
        nuisance=nuisance,
        drift=_DRIFT * floors / (_REVOLUTIONS_A_DAY / 24.0),
    )
    state = test.begin()
    n_alarms, largest = 0, -np.inf
    steps = max(revolutions // _STREAMS, 1)
    for _ in range(steps):
        state = test.advanced(state, next(stream) - mean)
        evidence = state.evidence
        largest = max(largest, float(evidence.max()))
        alarmed = evidence >= test.threshold
        n_alarms += int(alarmed.sum())
        state = replace(state, sums=np.where(alarmed[:, None], 0.0, state.sums))
    return {"alarms": n_alarms, "largest": largest, "revolutions": steps * _STREAMS}


# Whole days, sample by sample, through the command.


def _days(folder: Path, days: int, seed: int, stages: Stages) -> dict[str, Any]:
    """Alarms and speed on turbine-days without a change; each is another turbine."""
    outcomes = []
    for day in range(days):
        stages.note(f"day {day + 1}", day / days)
        to = folder / f"{day:03d}"
        if not (to / "outcome.json").exists():
            save_json(prepared_folder(to) / "outcome.json", _day(to, day, seed))
        outcomes.append(read_json(to / "outcome.json", "an outcome"))
    n_alarms = sum(len(one["lines"]) for one in outcomes)
    faster = min(one["times_real_time"] for one in outcomes)
    n_days = sum(one["seconds"] for one in outcomes) / 86400.0
    return {
        "rows": [
            _row(
                "alarms in whole turbine-days, from samples", "0", str(n_alarms), f"{n_days:g} days"
            ),
            _row("speed over real time, the slowest day", "100", f"{faster:.0f}", f"{_RATE:g} Hz"),
        ],
        "outcomes": outcomes,
    }


def _diagnosed_turbine(folder: Path, number: int, seed: int) -> tuple[Campaign, float]:
    """Campaign and noise of a turbine, its diagnosis written beside."""
    plan = _plan("housing_tilt", number, seed)
    campaign, label = case_campaign(plan)
    write_campaign(campaign, folder / "campaign", simulated=True)
    diagnose_campaign.main(folder / "campaign", out=folder / "diagnosis", report=False, quiet=True)
    return campaign, label.floor


class _RunningTurbine:
    """Samples of a turbine that runs on as in one run of its campaign, mean turn by mean turn."""

    def __init__(self, campaign: Campaign, floor: float, rate: float, seed: list[int]) -> None:
        run = campaign.runs[_RUN]
        self.names = [channel.name for channel in campaign.channels]
        self.floor, self.rate = floor, rate
        self.rng = np.random.default_rng(seed)
        self.memory = float(self.rng.uniform(0.3, 0.7))
        self.phase = self.rng.uniform(0.0, 2.0 * np.pi, 4)
        self.load = {name: float(run.inputs[name].mean()) for name in ("ntl_y", "ntl_z", "torque")}
        self.angle = 0.0
        # The signals of the run as waves of the angle: noise and ripple averaged out.
        theta = run.inputs["carrier_angle"]
        self.orders = np.arange(1, 13)
        phase = np.outer(theta, self.orders)
        A = np.hstack([np.ones((theta.size, 1)), np.cos(phase), np.sin(phase)])
        signals = np.array([run.signals[name] for name in self.names])
        self.waves = np.linalg.lstsq(A, signals.T, rcond=None)[0]

    def samples(self, begin: float, seconds: float) -> Columns:
        """Columns from a time on: speed and torque with ripple, temperature, coloured noise."""
        time = begin + np.arange(round(seconds * self.rate)) / self.rate
        a, b, c, d = self.phase
        slow = np.sin(2.0 * np.pi * time / 17.3 + a)
        speed = _RPM * np.pi / 30.0 * (1.0 + 0.01 * slow)
        angle = self.angle + np.cumsum(speed) / self.rate
        self.angle = float(angle[-1]) % (2.0 * np.pi)
        phase = np.exp(1j * angle)
        total = np.repeat(self.waves[:1], time.size, axis=0)
        power = np.ones_like(phase)
        for n in self.orders.tolist():
            power = power * phase
            total = total + np.outer(power.real, self.waves[n])
            total += np.outer(power.imag, self.waves[12 + n])
        day = np.sin(2.0 * np.pi * time / 86400.0 + d)
        total += (_TEMPERATURE * self.floor * day)[:, None]
        noise = coloured_noise(self.rng, (len(self.names), time.size), memory=self.memory)
        signals = total.T + self.floor * noise
        torque = self.load["torque"] * (1.0 + 0.01 * np.sin(2.0 * np.pi * time / 10.9 + b))
        still = np.ones_like(time)
        ripple = 1.0 + 0.005 * np.sin(2.0 * np.pi * time / 61.0 + c)
        return {
            "time": time,
            "carrier_angle": angle,
            "torque": torque,
            "ntl_y": self.load["ntl_y"] * still * ripple,
            "ntl_z": self.load["ntl_z"] * still * ripple,
            **dict(zip(self.names, signals, strict=True)),
        }


def _day(folder: Path, day: int, seed: int) -> dict[str, Any]:
    """One day of one turbine in files of two hours, watched as they come."""
    campaign, floor = _diagnosed_turbine(folder, 1000 + day, seed)
    turbine = _RunningTurbine(campaign, floor, _RATE, [seed, day])
    records = prepared_folder(folder / "records")
    seconds = 0.0
    result = None
    for piece in range(12):
        path = records / f"{piece:02d}.parquet"
        _write(path, turbine.samples(7200.0 * piece, 7200.0))
        begin = time.perf_counter()
        result = watch_turbine.main(
            records, baseline=folder / "diagnosis", out=folder / "watch", once=True, quiet=True
        )
        seconds += time.perf_counter() - begin
        path.unlink()
    assert result is not None
    return {
        "lines": list(result.lines),
        "revolutions": result.revolutions,
        "seconds": 12 * 7200.0,
        "times_real_time": 12 * 7200.0 / seconds,
    }


# A long record: memory and speed.


def _command(folder: Path, source: Path | str, out: Path, *more: str) -> list[str]:
    """Line of the shipped command."""
    line = [sys.executable, "-m", "carrierflex.workflows.command_line", "watch", str(source)]
    return [*line, "--baseline", str(folder / "diagnosis"), "--out", str(out), "--quiet", *more]


def _long_record(folder: Path, samples: int, seed: int) -> dict[str, Any]:
    """Peak memory and speed of the command on a record of many samples."""
    # One file under as many names: every file has a clock of its own.
    rate, rows_of_a_file = 1000.0, 2_000_000
    campaign, floor = _diagnosed_turbine(folder, 2000, seed)
    turbine = _RunningTurbine(campaign, floor, rate, [seed, 2000])
    records = prepared_folder(folder / "records")
    n_files = -(-samples // rows_of_a_file)
    for k in range(n_files):
        path = records / f"{k:05d}.parquet"
        if k == 0:
            _write(path, turbine.samples(0.0, rows_of_a_file / rate))
        elif not path.exists():
            os.link(records / "00000.parquet", path)
    process = subprocess.Popen(_command(folder, records, folder / "watch", "--once"))
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise RuntimeError(f"the command ended with status {status}; expected 0")
    # Kilobytes, but on macOS.
    peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    seconds = usage.ru_utime + usage.ru_stime
    n = n_files * rows_of_a_file
    speed = f"{n / seconds:.2g} ({n / rate / seconds:.0f} times real time)"
    return {
        "rows": [
            _row("peak memory", "< 1 GB", f"{peak / 1e9:.2f} GB", f"{n:.1g} samples"),
            _row("samples a second of processor time, 1 kHz", "-", speed, f"{n:.1g} samples"),
        ]
    }


# Kills.


def _kills(folder: Path, kills: int, seed: int, stages: Stages) -> dict[str, Any]:
    """Whether a watch that is killed again and again ends as one that never was."""
    records = prepared_folder(folder / "records")
    if not (folder / "never.json").exists():
        _write_changing_records(folder, records, _FILES_A_KILL * kills, seed)
        save_json(folder / "never.json", {"lines": _watched(folder, records, "never").lines})
    lines = read_json(folder / "never.json", "lines of a watch")["lines"]
    tally = {"kills": 0, "while_reading": 0}
    if (folder / "tally.json").exists():
        tally = read_json(folder / "tally.json", "a tally")
    while tally["kills"] < kills:
        k = tally["kills"]
        stages.note(f"{k} of {kills}", k / kills)
        tally["while_reading"] += _killed(folder, records, k, seed)
        tally["kills"] += 1
        save_json(folder / "tally.json", tally)
    last = _watched(folder, records, "killed").lines
    with (
        np.load(folder / "never" / watch_turbine.STATE_FILE) as one,
        np.load(folder / "killed" / watch_turbine.STATE_FILE) as other,
    ):
        differing = [name for name in one.files if one[name].tobytes() != other[name].tobytes()]
    lost, doubled = len(set(lines) - set(last)), len(last) - len(set(last))
    row = _row(
        "kill -9: alarms lost, doubled; arrays of the last state that differ",
        "0, 0; 0",
        f"{lost}, {doubled}; {len(differing)}",
        f"{tally['kills']} kills ({tally['while_reading']} after it wrote), {len(lines)} alarms",
    )
    return {"rows": [row], "differing": differing}


def _write_changing_records(folder: Path, records: Path, n_files: int, seed: int) -> None:
    """Files of a turbine whose housing tilts and comes back every so many files."""
    campaign, floor = _diagnosed_turbine(folder, 3000, seed)
    turbine = _RunningTurbine(campaign, floor, _RATE, [seed, 3000])
    begin = 0.0
    for k in range(n_files):
        columns = turbine.samples(begin, _SECONDS_OF_A_FILE)
        begin = float(columns["time"][-1]) + 1.0 / _RATE
        tilt = _FLOORS * floor * np.sqrt(2.0) * ((k // _FILES_A_CHANGE) % 2)
        for channel in campaign.channels:
            columns[channel.name] += tilt * np.sin(channel.angle or 0.0)
        _write(records / f"{k:05d}.parquet", columns)


def _killed(folder: Path, records: Path, k: int, seed: int) -> bool:
    """Kill the command at a random moment while files wait for it; whether it wrote before."""
    source, out = prepared_folder(folder / "growing"), folder / "killed"
    for number in range(_FILES_A_KILL * k, _FILES_A_KILL * (k + 1)):
        name = f"{number:05d}.parquet"
        if not (source / name).exists():
            os.link(records / name, source / name)
    before = _written(out)
    # A copy of this process: what a new one takes to start leaves no time to hit its work.
    options = {"baseline": folder / "diagnosis", "out": out, "every": 0.05, "quiet": True}
    process = multiprocessing.get_context("fork").Process(
        target=watch_turbine.main, args=(source,), kwargs=options
    )
    process.start()
    begin = time.monotonic()
    while k % 2 and _written(out) == before and time.monotonic() < begin + 60.0:
        time.sleep(0.01)
    rng = np.random.default_rng([seed, 3000, k])
    time.sleep(rng.uniform(0.0, 1.0 if k % 2 else 3.0))
    process.kill()
    process.join()
    return _written(out) != before


def _watched(folder: Path, records: Path, name: str) -> WatchResult:
    diagnosis = folder / "diagnosis"
    return watch_turbine.main(records, baseline=diagnosis, out=folder / name, once=True, quiet=True)


def _written(out: Path) -> int:
    """When the state was written; zero where there is none."""
    path = out / watch_turbine.STATE_FILE
    return path.stat().st_mtime_ns if path.exists() else 0


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

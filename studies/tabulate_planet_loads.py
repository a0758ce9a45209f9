"""How often the intervals of `carrierflex loads` hold the truth, and how narrow they are.

Campaigns of a known and a hidden load on stages whose pin fit, supports, clearances, pin places,
kink and rotor moment are drawn, by a carrier of another, finer mesh than that of the inference:

    python -m studies.tabulate_planet_loads --cases 200 --seed 1 --out planet_loads

writes planet_loads.csv (a row a campaign) and planet_loads.md. Campaigns are files of the folder: a
command that was stopped continues with the next one. Statics makes the records: 36 angles of a
turn, the samples of ten turns with noise; sensors have gains, places, zeros, brackets, a saddle and
a wavy face. A good answer: 95 % intervals hold 90 to 98 %, half widths at most 1.3 times what the
sensors allow (the bound of Cramer and Rao at the hidden stage), and below 15 % of a pin's load.
A second table has that bound at drawn stages, with errors of the readings taken away one at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from carrierflex.files.json_files import save_json
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.parameters import GearData
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.planet_loads import (
    ReadingErrors,
    inferred_loads,
    measured_turn,
)
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.reduction.mode_count import rule_of_options
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.sensing import SensorError
from carrierflex.simulation.stage.hidden_stages import (
    LARGEST_MOMENT,
    TORQUE_SHARES,
    TURN_ANGLES,
    Bodies,
    StagePair,
    drawn_load,
    load_of,
    loaded_turn,
    stage_at,
)
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.statics import NotConvergedError
from carrierflex.workflows.executors import SerialExecutor, work_executor
from carrierflex.workflows.outputs import prepared_folder, save_table
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.reduction.half_sector_bodies import half_sector_body
from carrierflex.workflows.simulation.stage_bodies import reduced_pin
from studies.case_files import make_missing, read_case, seeded_cases, write_table

#: Sensors of the 2012 paper.
SENSORS = tuple(
    Sensor(f"{name}{angle:03d}", quantity, float(np.deg2rad(angle)), 0.412)
    for name, quantity, angles in (("s", AXIAL, (47, 137, 227, 317)), ("r", RADIAL, (40, 310)))
    for angle in angles
)
NOMINAL = 360e3
#: The known run: nominal torque, no rotor moment.
KNOWN = np.array([NOMINAL, 0.0, 0.0])
#: Carrier angles of a simulated record, how often each is read, and noise of every sensor [m]:
#: together the 2700 samples of ten turns (27 s) at 100 Hz.
_ANGLES, _TURNS, _NOISE = 36, 75, 5e-6


@dataclass(frozen=True)
class LoadsRow:
    """One simulated campaign."""

    torque: Annotated[float, "hidden torque [N m]"]
    moment: Annotated[float, "size of the hidden rotor moment [N m]"]
    torque_error: Annotated[float, "inferred less true torque [N m]"]
    torque_half: Annotated[float, "half width of its 95 % interval [N m]"]
    torque_bound: Annotated[float, "the same of the bound [N m]"]
    moment_y_error: Annotated[float, "inferred less true moment about y [N m]"]
    moment_y_half: Annotated[float, "half width of its 95 % interval [N m]"]
    moment_z_error: Annotated[float, "inferred less true moment about z [N m]"]
    moment_z_half: Annotated[float, "half width of its 95 % interval [N m]"]
    moment_bound: Annotated[float, "the same of the bound, mean of y and z [N m]"]
    pins_held: Annotated[float, "share of pins and angles whose interval holds the force"]
    pins_half: Annotated[float, "mean half width of the tangential forces [N]"]
    pins_bound: Annotated[float, "the same of the bound [N]"]
    pin_load: Annotated[float, "mean tangential force [N]"]
    moments_held: Annotated[float, "share of the pins' tilting moments that are held"]
    misfit: Annotated[float, "deviation from the nearest stage, about 1"]


def reduced_bodies(size: float) -> Bodies:
    """Default carrier and pin by elements of `size` [m]; the carrier from its half sector."""
    rule, stage = rule_of_options({}), read_parameters(None)
    half, sensors = half_sector_body("flexible_carrier", stage, size)
    reduction = symmetric_craig_bampton(half, rule, sensors=sensors)
    return Bodies(reduction.model, reduced_pin(size), StageData(gear=GearData()))


def loads_row(truth: Bodies, bodies: Bodies, draws: int, rng: np.random.Generator) -> LoadsRow:
    """Simulate a campaign by the bodies `truth`, and infer its hidden load by `bodies`.

    A stage that reaches no equilibrium is drawn again.
    """
    errors, arm = ReadingErrors(), truth.data.mounting.ntl_arm
    effects = ReadingEffects(
        sensors={
            sensor.name: SensorError(
                gain=errors.gain * rng.standard_normal(), angle=errors.angle * rng.standard_normal()
            )
            for sensor in SENSORS
        }
    )
    while True:
        shares, hidden = rng.random(truth.n_hidden), drawn_load(rng, NOMINAL)
        model = stage_at(shares).model(truth)
        try:
            turns = [
                loaded_turn(model, load_of(load, arm), SENSORS, effects=effects, n_angles=_ANGLES)
                for load in (KNOWN, hidden)
            ]
            bound = _bound_of(bodies, shares, hidden, BOUNDS[:1])
            break
        except NotConvergedError:
            continue
    theta = 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES
    E = errors.additive(SENSORS, 2, theta)
    read = np.array([turn.readings for turn in turns])
    read = read + (E @ rng.standard_normal(E.shape[1])).reshape(read.shape)
    measured = [measured_turn(_record(values, rng), [s.name for s in SENSORS]) for values in read]
    readings = np.array([turn.readings for turn in measured])
    R = errors.covariance(SENSORS, readings, np.array([turn.noise for turn in measured]))
    forward = StagePair(bodies, KNOWN, SENSORS, NOMINAL)
    estimate = inferred_loads(
        forward, readings, R, n_draws=draws, rng=rng, executor=SerialExecutor()
    )
    true = turns[1].pins[:, :, :: _ANGLES // estimate.pins.shape[-1]]
    covered = np.abs(estimate.pins - true) <= estimate.half_width
    gap = estimate.load - hidden
    return LoadsRow(
        torque=float(hidden[0]),
        moment=float(np.hypot(*hidden[1:])),
        torque_error=float(gap[0]),
        torque_half=float(estimate.load_half_width[0]),
        torque_bound=NORMAL_95 * bound.torque_stds[0],
        moment_y_error=float(gap[1]),
        moment_y_half=float(estimate.load_half_width[1]),
        moment_z_error=float(gap[2]),
        moment_z_half=float(estimate.load_half_width[2]),
        moment_bound=NORMAL_95 * bound.moment_stds[0],
        pins_held=float(covered[:, 0].mean()),
        pins_half=float(estimate.half_width[:, 0].mean()),
        pins_bound=NORMAL_95 * bound.pin_stds[0] * float(true[:, 0].mean()),
        pin_load=float(true[:, 0].mean()),
        moments_held=float(covered[:, 2:].mean()),
        misfit=estimate.misfit,
    )


def _record(readings: NDArray[np.float64], rng: np.random.Generator) -> Run:
    """Record with noise."""
    angle = 2.0 * np.pi * np.arange(_ANGLES * _TURNS) / _ANGLES
    signals = {
        sensor.name: np.tile(values, _TURNS) + _NOISE * rng.standard_normal(angle.size)
        for sensor, values in zip(SENSORS, readings, strict=True)
    }
    return Run("run", "run.csv", "", angle, {"carrier_angle": angle}, signals)


def loads_table(rows: list[LoadsRow], size: float, truth_size: float) -> list[str]:
    """Figures over all campaigns as Markdown."""
    of = {
        entry.name: np.array([getattr(row, entry.name) for row in rows])
        for entry in fields(LoadsRow)
    }
    error, torque, pin = np.abs(of["torque_error"]), of["torque"], of["pin_load"]

    def share(values: NDArray[np.float64] | NDArray[np.bool_]) -> str:
        return f"{100.0 * float(np.mean(values)):.1f} %"

    def median(values: NDArray[np.float64]) -> str:
        return f"{float(np.median(values)):.3g}"

    def percentage(values: NDArray[np.float64]) -> str:
        return f"{100.0 * float(np.median(values)):.1f} %"

    coverage = {
        name: share(np.abs(of[f"{name}_error"]) <= of[f"{name}_half"])
        for name in ("torque", "moment_y", "moment_z")
    }
    above = torque >= 0.5 * NOMINAL
    figures = {
        "95 % intervals of the pins' tangential forces hold": share(of["pins_held"]),
        "those of their tilting moments": share(of["moments_held"]),
        "those of torque, M_y, M_z": ", ".join(coverage.values()),
        "median half width over a pin's load": percentage(of["pins_half"] / pin),
        "the same of the bound": percentage(of["pins_bound"] / pin),
        "median half width over the bound": median(of["pins_half"] / of["pins_bound"]),
        "the same, torque": median(of["torque_half"] / of["torque_bound"]),
        "the same, mean of M_y and M_z": median(
            0.5 * (of["moment_y_half"] + of["moment_z_half"]) / of["moment_bound"]
        ),
        "median error of the torque": percentage(error / torque),
        "torque within 3 % of the nominal one": share(error <= 0.03 * NOMINAL),
        "torque within 3 % of itself": share(error <= 0.03 * torque),
        "the same, above half of the nominal one": share((error <= 0.03 * torque)[above]),
        "median half widths of M_y, M_z [kN m]": ", ".join(
            median(of[f"moment_{axis}_half"] / 1e3) for axis in "yz"
        ),
        "median misfit": median(of["misfit"]),
        "misfit above 2": share(of["misfit"] > 2.0),
    }
    title = f"{len(rows)} campaigns, carrier of {truth_size} m, inferred with {size} m"
    return [f"| {title} | |", "|---|---|", *(f"| {a} | {b} |" for a, b in figures.items())]


_ALL = ReadingErrors()
#: Far below what any reading has [m].
_NO_ERROR = 1e-9
#: A second known load: torque without rotor moment.
_SECOND = np.array([0.3 * NOMINAL, 0.0, 0.0])
#: Errors of the readings, and whether the second known load is measured too.
BOUNDS = (
    ("all errors", _ALL, False),
    ("waves of the face known", replace(_ALL, waves=_NO_ERROR), False),
    ("gains and places exact", replace(_ALL, gain=1e-6, angle=1e-6), False),
    (
        "brackets and flange do not move",
        replace(_ALL, bracket=_NO_ERROR, saddle=_NO_ERROR),
        False,
    ),
    ("statics and mesh leave 0.2 um in place of 1 um", replace(_ALL, model=0.2e-6), False),
    ("all errors, a second known load at 30 %", _ALL, True),
    ("both, 0.2 um and a second known load", replace(_ALL, model=0.2e-6), True),
)
#: Steps of the derivatives: shares of a range, and loads [N m].
_SHARE_STEP, _LOAD_STEP = 0.02, 5e3
#: Readings of some runs, and tangential pin forces of the first.
_Turns = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True)
class Bound:
    """Least standard deviations at one stage and load, by the cases of errors."""

    torque: float
    torque_stds: list[float]
    """Of the torque [N m]."""
    moment_stds: list[float]
    """Of the rotor moment, mean of y and z [N m]."""
    pin_stds: list[float]
    """Of the tangential pin forces over their mean."""


def bound_at(bodies: Bodies, seed: int, number: int) -> Bound:
    """Bound of Cramer and Rao by the rows of `BOUNDS`, at a drawn stage."""
    rng = np.random.default_rng([seed, 2, number])
    while True:
        shares, load = rng.random(bodies.n_hidden), drawn_load(rng, NOMINAL)
        try:
            return _bound_of(bodies, shares, load, BOUNDS)
        except NotConvergedError:
            continue


def _bound_of(
    bodies: Bodies,
    shares: NDArray[np.float64],
    load: NDArray[np.float64],
    cases: Sequence[tuple[str, ReadingErrors, bool]],
) -> Bound:
    """Bound of Cramer and Rao with priors, ``P = (J^T R^-1 J + C^-1)^-1``."""
    arm, n = bodies.data.mounting.ntl_arm, len(shares)
    # The run of the hidden load first.
    loads = (load, KNOWN, _SECOND)[: 2 + any(second for *_, second in cases)]

    def read(shares: NDArray[np.float64], loads: Sequence[NDArray[np.float64]]) -> _Turns:
        model = stage_at(shares).model(bodies)
        turns = [loaded_turn(model, load_of(load, arm), SENSORS) for load in loads]
        return np.array([turn.readings for turn in turns]), turns[0].pins[:, 0]

    J, Q = [], []
    base, pins = read(shares, loads)
    for i in range(n):
        step = (_SHARE_STEP if shares[i] < 0.5 else -_SHARE_STEP) * np.eye(n)[i]
        readings, moved = read(shares + step, loads)
        J.append((readings - base) / step.sum())
        Q.append((moved - pins) / step.sum())
    for i in range(3):
        readings, moved = read(shares, [load + _LOAD_STEP * np.eye(3)[i]])
        J.append(np.zeros_like(base))
        J[-1][0] = (readings[0] - base[0]) / _LOAD_STEP
        Q.append((moved - pins) / _LOAD_STEP)
    of_load = [np.diff(TORQUE_SHARES)[0] * NOMINAL / np.sqrt(12.0), *2 * [LARGEST_MOMENT / 2.0]]
    scale = np.concatenate([np.full(n, 1.0 / np.sqrt(12.0)), of_load])
    J_scaled, Q_scaled = (
        np.moveaxis(np.array(J), 0, -1) * scale,
        np.moveaxis(np.array(Q), 0, -1) * scale,
    )
    bound = Bound(float(load[0]), [], [], [])
    for _, errors, second in cases:
        turns = slice(0, 2 + second)
        noise = _NOISE**2 * TURN_ANGLES / (_ANGLES * _TURNS) * np.eye(TURN_ANGLES)
        noise = np.broadcast_to(noise, (2 + second, len(SENSORS), TURN_ANGLES, TURN_ANGLES))
        R = errors.covariance(SENSORS, base[turns], noise)
        of = J_scaled[turns].reshape(len(R), -1)
        P = np.linalg.inv(of.T @ np.linalg.solve(R, of) + np.eye(len(scale)))
        stds = np.sqrt(np.diag(P))[n:] * scale[n:]
        variance = np.einsum("paj,jk,pak->pa", Q_scaled, P, Q_scaled)
        bound.torque_stds.append(float(stds[0]))
        bound.moment_stds.append(float(stds[1:].mean()))
        bound.pin_stds.append(float(np.sqrt(variance).mean() / pins.mean()))
    return bound


def bounds_table(bounds: Sequence[Bound]) -> list[str]:
    """What the sensors allow, by the errors that remain, as Markdown."""
    T = np.array([bound.torque for bound in bounds])
    low = T < 0.5 * NOMINAL
    lines = [
        f"| bound at {len(bounds)} stages | torque, RMS [kN m] | within 3 % of itself | above half "
        "of the nominal torque | below half | pins' half width, median | M_y, M_z, half width "
        "[kN m] |",
        "|---" * 7 + "|",
    ]
    for i, (name, *_) in enumerate(BOUNDS):
        std = np.array([bound.torque_stds[i] for bound in bounds])
        within = 2.0 * ndtr(0.03 * T / std) - 1.0
        shares = (100.0 * within[group].mean() for group in (T > 0.0, ~low, low))
        pins = 196.0 * np.median([bound.pin_stds[i] for bound in bounds])
        moments = 1.96e-3 * np.median([bound.moment_stds[i] for bound in bounds])
        cells = [f"{np.sqrt(np.mean(std**2)) / 1e3:.1f}", *(f"{share:.0f} %" for share in shares)]
        lines.append(f"| {name} | {' | '.join(cells)} | {pins:.1f} % | {moments:.0f} |")
    return lines


def main(
    *,
    out: Path,
    cases: int = 200,
    seed: int = 1,
    draws: int = 1500,
    bounds: int = 24,
    size: float = 0.045,
    truth_size: float = 0.02,
    workers: int = 1,
) -> None:
    """Simulate campaigns, infer their loads; write planet_loads.csv and planet_loads.md.

    Parameters
    ----------
    out
        Folder.
    cases
        Campaigns.
    seed
        Seed of the campaigns.
    draws
        Stages of each inference.
    bounds
        Stages at which the bound is taken.
    size, truth_size
        Element edge length [m] of the inference's and of the campaigns' carrier.
    workers
        Processes; a campaign takes about a minute of one.
    """
    folder, stages = prepared_folder(out), Stages(3)
    with stages.stage(f"carriers of {size} and {truth_size} m"):
        bodies, truth = reduced_bodies(size), reduced_bodies(truth_size)
    rows = seeded_cases(
        folder,
        seed,
        cases,
        partial(_save_campaign, truth, bodies, draws, seed),
        lambda content: LoadsRow(**content),
        stages=stages,
        workers=workers,
    )
    names = [entry.name for entry in fields(LoadsRow)]
    save_table(
        folder / "planet_loads.csv", names, [[getattr(row, name) for name in names] for row in rows]
    )
    of_bounds = [folder / f"bound_{seed}_{number}.json" for number in range(bounds)]
    with stages.stage(f"bound at {bounds} stages"), work_executor(workers) as executor:
        make = partial(_save_bound, bodies, seed)
        make_missing(range(bounds), of_bounds, make, executor, stages)
    limited = [read_case(file, "a bound of this study", lambda c: Bound(**c)) for file in of_bounds]
    lines = [*loads_table(rows, size, truth_size), "", *bounds_table(limited)]
    write_table(folder / "planet_loads.md", lines)
    print("\n".join(lines))


def _save_campaign(
    truth: Bodies, bodies: Bodies, draws: int, seed: int, number: int, file: Path
) -> None:
    save_json(file, loads_row(truth, bodies, draws, np.random.default_rng([seed, 1, number])))


def _save_bound(bodies: Bodies, seed: int, number: int, file: Path) -> None:
    save_json(file, bound_at(bodies, seed, number))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

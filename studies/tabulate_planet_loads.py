"""How often the intervals of `carrierflex loads` hold the truth, and how narrow they are.

Campaigns of a known and a hidden load on stages whose pin fit, supports, clearances, pin places,
kink and rotor moment are drawn, by a carrier of another, finer mesh than that of the inference:

    python -m studies.tabulate_planet_loads --cases 200 --seed 1 --out planet_loads

writes planet_loads.csv (a row a campaign) and planet_loads.md. Stages and campaigns stand in files
of the folder: a command that was stopped goes on where it was. Statics makes the records: 36 angles
of a turn, the samples of ten turns with noise; sensors have gains, places, zeros, brackets, a
saddle and a wavy face. A good answer: 95 % intervals hold 90 to 98 %, half widths at most 1.3 times
those of a carrier and pin fit that are known (the linear bound), and below 15 % of a pin's load.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import ndtr

from carrierflex.files.json_files import save_json
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.parameters import GearData
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.planet_loads import (
    LoadInference,
    ReadingErrors,
    candidate_bodies,
    inferred_loads,
    load_inference,
    measured_turn,
)
from carrierflex.reduction.mode_count import rule_of_options
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.sensing import SensorError
from carrierflex.simulation.stage.hidden_stages import (
    HIDDEN,
    TURN_ANGLES,
    Bodies,
    StageEnsemble,
    drawn_ensemble,
    drawn_load,
    drawn_stage,
    load_of,
    loaded_turn,
    reading_per_force,
)
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.statics import NotConvergedError
from carrierflex.workflows.outputs import prepared_folder, save_table
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.reduction.half_sector_bodies import half_sector_body
from carrierflex.workflows.simulation.stage_bodies import reduced_pin
from studies.case_files import make_missing, read_case, write_table

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
#: Stages of one file, and arrays of an ensemble.
_PART = 250
_ARRAYS = ("loads", "rest", "forces", "pins")


@dataclass(frozen=True)
class LoadsRow:
    """One simulated campaign."""

    torque: Annotated[float, "hidden torque [N m]"]
    moment: Annotated[float, "size of the hidden rotor moment [N m]"]
    torque_error: Annotated[float, "inferred less true torque [N m]"]
    torque_half: Annotated[float, "half width of its 95 % interval [N m]"]
    torque_bound: Annotated[float, "the same of the linear bound [N m]"]
    moment_y_error: Annotated[float, "inferred less true moment about y [N m]"]
    moment_y_half: Annotated[float, "half width of its 95 % interval [N m]"]
    moment_z_error: Annotated[float, "inferred less true moment about z [N m]"]
    moment_z_half: Annotated[float, "half width of its 95 % interval [N m]"]
    pins_held: Annotated[float, "share of pins and angles whose interval holds the force"]
    pins_half: Annotated[float, "mean half width of the tangential forces [N]"]
    pins_bound: Annotated[float, "the same of the linear bound [N]"]
    pins_prior: Annotated[float, "half width that the drawn stages alone leave, torque known [N]"]
    pin_load: Annotated[float, "mean tangential force [N]"]
    moments_held: Annotated[float, "share of the pins' tilting moments that are held"]
    misfit: Annotated[float, "deviation from the ensemble, about 1"]


def reduced_bodies(size: float) -> Bodies:
    """Default carrier and pin by elements of `size` [m]; the carrier from its half sector."""
    rule, stage = rule_of_options({}), read_parameters(None)
    half, sensors = half_sector_body("flexible_carrier", stage, size)
    reduction = symmetric_craig_bampton(half, rule, sensors=sensors)
    return Bodies(reduction.model, reduced_pin(size), StageData(gear=GearData()))


def loads_row(
    truth: Bodies, ensemble: StageEnsemble, inference: LoadInference, rng: np.random.Generator
) -> LoadsRow:
    """Simulate a campaign by the bodies `truth`, and infer its hidden load.

    A stage that reaches no equilibrium is drawn again, as in the ensemble.
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
        stage, hidden = drawn_stage(rng, truth.n_planets), drawn_load(rng, NOMINAL)
        model = stage.model(truth)
        try:
            turns = [
                loaded_turn(model, load_of(load, arm), SENSORS, effects=effects, n_angles=_ANGLES)
                for load in (KNOWN, hidden)
            ]
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
    estimate = inferred_loads(inference, readings, R)
    own = stage.values["pin_fit"], model.layout.body
    bound = inferred_loads(load_inference(ensemble, [own], SENSORS), readings, R)
    true = turns[1].pins[:, :, :: _ANGLES // estimate.pins.shape[-1]]
    held = np.abs(estimate.pins - true) <= estimate.half_width
    gap = estimate.load - hidden
    tangential = ensemble.pins[:, 1, :, 0] / ensemble.loads[:, 1, :1, None]
    return LoadsRow(
        torque=float(hidden[0]),
        moment=float(np.hypot(*hidden[1:])),
        torque_error=float(gap[0]),
        torque_half=float(estimate.load_half_width[0]),
        torque_bound=float(bound.load_half_width[0]),
        moment_y_error=float(gap[1]),
        moment_y_half=float(estimate.load_half_width[1]),
        moment_z_error=float(gap[2]),
        moment_z_half=float(estimate.load_half_width[2]),
        pins_held=float(held[:, 0].mean()),
        pins_half=float(estimate.half_width[:, 0].mean()),
        pins_bound=float(bound.half_width[:, 0].mean()),
        pins_prior=float(1.96 * tangential.std(axis=0).mean() * hidden[0]),
        pin_load=float(true[:, 0].mean()),
        moments_held=float(held[:, 2:].mean()),
        misfit=estimate.misfit,
    )


def _draw_part(bodies: Bodies, seed: int, number: int, file: Path) -> None:
    """Draw stages and write them."""
    part = drawn_ensemble(
        bodies, KNOWN, SENSORS, _PART,
        nominal_torque=NOMINAL, rng=np.random.default_rng([seed, 0, number]),
    )  # fmt: skip
    arrays = {name: getattr(part, name) for name in _ARRAYS}
    with whole_file(file) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **arrays, n_failed=part.n_failed)


def _joined(files: Sequence[Path]) -> StageEnsemble:
    parts = [np.load(file) for file in files]
    loads, rest, forces, pins = (np.concatenate([part[name] for part in parts]) for name in _ARRAYS)
    return StageEnsemble(loads, rest, forces, pins, sum(int(part["n_failed"]) for part in parts))


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

    def part(values: NDArray[np.float64]) -> str:
        return f"{100.0 * float(np.median(values)):.1f} %"

    held = {
        name: share(np.abs(of[f"{name}_error"]) <= of[f"{name}_half"])
        for name in ("torque", "moment_y", "moment_z")
    }
    above = torque >= 0.5 * NOMINAL
    figures = {
        "95 % intervals of the pins' tangential forces hold": share(of["pins_held"]),
        "those of their tilting moments": share(of["moments_held"]),
        "those of torque, M_y, M_z": ", ".join(held.values()),
        "median half width over a pin's load": part(of["pins_half"] / pin),
        "the same of drawn stages alone, torque known": part(of["pins_prior"] / pin),
        "the same of the linear bound": part(of["pins_bound"] / pin),
        "median half width over the linear bound": median(of["pins_half"] / of["pins_bound"]),
        "the same, torque": median(of["torque_half"] / of["torque_bound"]),
        "median error of the torque": part(error / torque),
        "torque within 3 % of the nominal one": share(error <= 0.03 * NOMINAL),
        "torque within 3 % of itself": share(error <= 0.03 * torque),
        "the same, above half of the nominal one": share((error <= 0.03 * torque)[above]),
        "median half widths of M_y, M_z [kN m]": ", ".join(
            median(of[f"moment_{axis}_half"] / 1e3) for axis in "yz"
        ),
        "median misfit": median(of["misfit"]),
    }
    title = f"{len(rows)} campaigns, carrier of {truth_size} m, inferred with {size} m"
    return [f"| {title} | |", "|---|---|", *(f"| {a} | {b} |" for a, b in figures.items())]


@dataclass(frozen=True)
class TorqueLimit:
    """What the torque's error would be with some errors of the sensors taken away."""

    name: str
    errors: ReadingErrors
    moment: float = np.inf
    """Standard error of a recorded rotor moment [N m]."""


_ALL = ReadingErrors()
#: Far below what any reading has [m].
_NO_ERROR = 1e-9
LIMITS = (
    TorqueLimit("all errors", _ALL),
    TorqueLimit("waves of the face known, from other loads", replace(_ALL, waves=_NO_ERROR)),
    TorqueLimit("rotor moment recorded to 10 kN m", _ALL, 10e3),
    TorqueLimit("gains and places exact", replace(_ALL, gain=1e-6, angle=1e-6)),
    TorqueLimit(
        "brackets and flange do not move", replace(_ALL, bracket=_NO_ERROR, saddle=_NO_ERROR)
    ),
    TorqueLimit("statics and mesh leave 0.2 um in place of 1 um", replace(_ALL, model=0.2e-6)),
    TorqueLimit("no error but 0.2 um", ReadingErrors(
        zero=_ALL.zero, bracket=_NO_ERROR, saddle=_NO_ERROR, face_tilt=_NO_ERROR,
        radial_runout=_NO_ERROR, waves=_NO_ERROR, gain=1e-6, angle=1e-6, model=0.2e-6,
    )),
)  # fmt: skip


def torque_errors(
    ensemble: StageEnsemble, body: StageBody, limit: TorqueLimit
) -> tuple[NDArray[np.float64], float]:
    """Error of the torque of every stage, left out of its own prediction, and that of its readings.

    The conditioning of the inference, all stages alike, with a body that is known.

    Parameters
    ----------
    ensemble : StageEnsemble
        Stages without turned copies.
    body : StageBody
        Carrier and pins.
    limit : TorqueLimit
        Errors of the readings.

    Returns
    -------
    errors : ndarray, shape (N,)
        Of the stages [N m].
    std : float
        Standard deviation that the readings' errors add [N m].
    """
    turns = ensemble.readings(reading_per_force(body, SENSORS, TURN_ANGLES))
    noise = _NOISE**2 * TURN_ANGLES / (_ANGLES * _TURNS) * np.eye(TURN_ANGLES)
    noise = np.broadcast_to(noise, (*turns.shape[1:3], TURN_ANGLES, TURN_ANGLES))
    R = limit.errors.covariance(SENSORS, turns.mean(axis=0), noise)
    Y, T = turns.reshape(len(turns), -1), ensemble.loads[:, 1, 0]
    if np.isfinite(limit.moment):
        # In units of its standard error, as one more reading.
        Y = np.hstack([1e6 * Y, ensemble.loads[:, 1, 1:] / limit.moment])
        R = block_diag(1e12 * R, np.eye(2))
    dY, dT = Y - Y.mean(axis=0), T - T.mean()
    inverse = np.linalg.inv(dY.T @ dY / len(T) + R)
    K = inverse @ dY.T @ dT / len(T)
    leverage = (1.0 + np.einsum("ij,jk,ik->i", dY, inverse, dY)) / len(T)
    return (dT - dY @ K) / (1.0 - leverage), float(np.sqrt(K @ R @ K))


def limits_table(ensemble: StageEnsemble, body: StageBody) -> list[str]:
    """Which errors keep the torque from 3 % of itself, as Markdown."""
    T = ensemble.loads[:, 1, 0]
    low, least = T < 0.5 * NOMINAL, T < 0.3 * NOMINAL
    lines = [
        "| errors of the readings | RMS [kN m] | RMS below 30 % of the nominal torque | within 3 % "
        "of itself | above half of the nominal torque | below half |",
        "|---" * 6 + "|",
    ]
    for limit in LIMITS:
        error, std = torque_errors(ensemble, body, limit)
        rms = (np.sqrt((of**2).mean() + std**2) / 1e3 for of in (error, error[least]))
        within = ndtr((0.03 * T - error) / std) - ndtr((-0.03 * T - error) / std)
        shares = (100.0 * within[group].mean() for group in (T > 0.0, ~low, low))
        cells = [*(f"{value:.1f}" for value in rms), *(f"{share:.0f} %" for share in shares)]
        lines.append(f"| {limit.name} | {' | '.join(cells)} |")
    return lines


def main(
    *,
    out: Path,
    cases: int = 200,
    seed: int = 1,
    draws: int = 1500,
    size: float = 0.045,
    truth_size: float = 0.02,
) -> None:
    """Simulate campaigns, infer their loads; write planet_loads.csv and planet_loads.md.

    Parameters
    ----------
    out
        Folder.
    cases
        Campaigns.
    seed
        Seed of campaigns and ensemble.
    draws
        Stages of the ensemble.
    size, truth_size
        Element edge length [m] of the inference's and of the campaigns' carrier.
    """
    folder, stages = prepared_folder(out), Stages(3)
    with stages.stage(f"carriers of {size} and {truth_size} m"):
        bodies, truth = reduced_bodies(size), reduced_bodies(truth_size)
    numbers = range(math.ceil(draws / _PART))
    parts = [folder / f"stages_{seed}_{number}.npz" for number in numbers]
    with stages.stage(f"{_PART * len(parts)} stages"), ThreadPoolExecutor(1) as executor:
        make_missing(numbers, parts, partial(_draw_part, bodies, seed), executor, stages)
    drawn = _joined(parts)
    ensemble = drawn.with_turned_copies()
    inference = load_inference(ensemble, candidate_bodies(bodies), SENSORS)
    files = [folder / f"campaign_{seed}_{number}.json" for number in range(cases)]

    def simulate(number: int, file: Path) -> None:
        save_json(
            file, loads_row(truth, ensemble, inference, np.random.default_rng([seed, 1, number]))
        )

    with stages.stage(f"{cases} campaigns"), ThreadPoolExecutor(1) as executor:
        make_missing(range(cases), files, simulate, executor, stages)
    rows = [read_case(file, "a campaign of this study", lambda c: LoadsRow(**c)) for file in files]
    names = [entry.name for entry in fields(LoadsRow)]
    save_table(
        folder / "planet_loads.csv", names, [[getattr(row, name) for name in names] for row in rows]
    )
    fit = math.sqrt(HIDDEN["pin_fit"].lower * HIDDEN["pin_fit"].upper)
    limits = limits_table(drawn, bodies.body(fit, 1.0))
    lines = [*loads_table(rows, size, truth_size), "", *limits]
    write_table(folder / "planet_loads.md", lines)
    print("\n".join(lines))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

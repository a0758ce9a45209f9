"""Simulate the whole planetary stage in a set of load cases.

What a ``carrierflex-stage-case`` asks for.

Bodies come from the parameters by finite elements and Craig-Bampton reduction or from files, the
stage runs in time, and the sensors' signals become a campaign of kind ``carrier``, written as they
come: memory does not grow with the length. A good answer: order 3 of the rim's deflection in
proportion to the torque, energy that balances to rounding, and planets that share the load but for
weight and pin errors.
"""

import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
from numpy.typing import NDArray

from carrierflex.fe.curve_files import read_curves, write_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.parameters import DEFAULT_SIZE, GearData
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import (
    CASE_COPY,
    prepare_campaign_folder,
    write_campaign,
)
from carrierflex.identification.campaign.growing_runs import GrowingRuns, growing_runs
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.simulated_campaign import CURVES_FILE, rim_campaign
from carrierflex.reduction.body_files import read_stresses
from carrierflex.simulation.record_size import MOST_IN_A_FILE, refuse_size, refuse_steps
from carrierflex.simulation.rexs.planetary_stage import (
    PlanetaryStage,
    planetary_stage,
    planetary_stages,
)
from carrierflex.simulation.rexs.rexs_files import (
    read_rexs,
    refuse_foreign_model,
    write_with_load_cases,
)
from carrierflex.simulation.rexs.rexs_model import RexsModel
from carrierflex.simulation.rexs.stage_results import RunMeans
from carrierflex.simulation.stage.load_channels import load_columns
from carrierflex.simulation.stage.response import (
    StageDivergedError,
    joined_records,
    steps_per_sample,
)
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_cases import StageCase, StageRun, read_stage_case
from carrierflex.simulation.stage.stage_model import StageModel, stage_model
from carrierflex.simulation.stage.stage_run import StageResponse, simulate_stage
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation import linearise_stage
from carrierflex.workflows.simulation.stage_bodies import stage_body_of_files
from carrierflex.workflows.simulation.stage_stress import StageStresses, with_stress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Revolutions that a picture shows.
_SHOWN_TURNS = 2.0
_BEARINGS = ("main_bearing", "bearing_A", "bearing_B")
_SHAFTS = ("carrier", "sun", "intermediate", "generator")
_ENERGIES = ("torque", "generator", "loads", "mount", "dissipated", "stored")


class _RexsResults:
    """A REXS file and the means of the runs that go into a copy of it."""

    def __init__(self, source: Path, folder: Path, gear: GearData) -> None:
        self._source, self._path, self._gear = source, folder / source.name, gear
        if self._path.resolve() == source.resolve():
            raise ValueError(f"--rexs is {source}, in the folder of --loads; expected another one")
        refuse_foreign_model(self._path)
        model = read_rexs(source)
        stages = list(_simple_stages(model))
        wanted = (gear.ring_teeth, gear.planet_teeth, gear.sun_teeth)
        alike = [stage for stage in stages if stage.teeth == wanted]
        if len(alike) != 1:
            numbers = "; ".join("/".join(map(str, stage.teeth)) for stage in stages) or "none"
            raise ValueError(
                f"--rexs is {source}, whose planetary stages have ring/planet/sun teeth {numbers}; "
                f"expected one with {'/'.join(map(str, wanted))}, as the case has"
            )
        self._stage = alike[0]
        self._runs: dict[str, RunMeans] = {}

    def means_of(self, run: str) -> RunMeans:
        """What takes the load columns of a run."""
        return self._runs.setdefault(run, RunMeans(self._stage))

    def write(self) -> None:
        """Write the copy, one load case a run."""
        cases = [(name, means.results(self._gear)) for name, means in self._runs.items()]
        write_with_load_cases(self._path, self._source, cases)


@dataclass(frozen=True, eq=False)
class SimulatedStage:
    """What the workflow made."""

    case: Annotated[StageCase, "The case"]
    campaign: Annotated[
        Campaign,
        "The campaign; of every run it holds the last piece alone, the records are in the folder",
    ]
    folder: Annotated[Path, "Where they were written"]
    imbalance: Annotated[
        dict[str, float], "Energy that each run's balance left over, over the work done"
    ]
    n_samples: Annotated[dict[str, int], "Length of each run"]


def main(
    case: Path,
    *,
    out: Path,
    curves: Path | None = None,
    linearised: Path | None = None,
    loads: Path | None = None,
    stress: Path | None = None,
    rexs: Path | None = None,
    size: float = DEFAULT_SIZE,
    quiet: bool = False,
) -> SimulatedStage:
    """Simulate the planetary stage in a set of load cases, written as a campaign folder of records.

    Parameters
    ----------
    case : Path
        Stage case (TOML).
    out : Path
        Campaign folder to write: new, empty, or an earlier simulated campaign.
    curves : Path, optional
        Deflection curves kept with the campaign; without it those of the default carrier.
    linearised : Path, optional
        Folder for modes, frequency response and Campbell diagram.
    loads : Path, optional
        Folder for loads, speeds and energies: ``<run>_loads.csv`` and ``<run>_loads.png`` a run.
    stress : Path, optional
        Folder for the stress of carrier and pins, as
        :mod:`carrierflex.workflows.simulation.stage_stress` writes it.
    rexs : Path, optional
        REXS file of the stage; `loads` takes a copy with the runs' results as load cases.
    size : float
        Element edge length [m] of carrier and pins.
    quiet : bool
        Show no progress.

    Raises
    ------
    ValueError
        Before the run, where the case or a body is refused, or the folder holds something that is
        not a campaign.
    StageDivergedError
        Where a run leaves the range of small motions; what there is of it is written first.
    KeyboardInterrupt
        Likewise.
    """
    what = read_stage_case(case)
    _refuse_size(case, what)
    steps_per_sample(
        what.speed, what.data.gear.ring_teeth, sample_rate=what.sample_rate, step=what.step
    )
    prepare_campaign_folder(out)
    stresses = None
    if stress is not None:
        stresses = _stage_stresses(case, what.bodies)
        prepared_folder(stress)
    if loads is not None:
        prepared_folder(loads)
    back = None if rexs is None or loads is None else _RexsResults(rexs, loads, what.data.gear)
    curve_set = _curves(curves)
    first = 1 + (linearised is not None)
    # Runs are equally long; what comes before them tells nothing of their time.
    weights = (1.0,) * (first + len(what.runs)) + (0.0,)
    stages = Stages(len(weights), quiet, weights, timed_from=first)
    made = "of the files of [bodies]" if what.bodies else f"elements of {size} m"
    with stages.stage(f"reduced carrier and pins, {made}"):
        body = stage_body_of_case(what, size, stresses)
    model = stage_model(body, what.data, effects=what.effects, speed=what.speed)
    if linearised is not None:
        with stages.stage(f"writing {linearised}"):
            linearise_stage.main(what, model, out=linearised)
    rng, imbalance = np.random.default_rng(what.seed), dict[str, float]()
    stopped: BaseException | None = None
    with growing_runs(out) as growing:
        for run in what.runs:
            with stages.stage(f"{run.name}, {what.duration:g} s"):
                try:
                    pieces = stage_pieces(model, what, run, rng)
                    if loads is not None:
                        means = None if back is None else back.means_of(run.name)
                        pieces = _with_loads(pieces, loads, run.name, model, means=means)
                    if stress is not None and stresses is not None:
                        pieces = with_stress(pieces, stress, run.name, model, stresses)
                    imbalance[run.name] = _grown(pieces, what, run, growing, stages.note)
                except (StageDivergedError, KeyboardInterrupt) as error:
                    stopped = error
                    why = "interrupted"
                    if isinstance(error, StageDivergedError):
                        why = f"{error.coordinate} diverged"
                    if run.name in growing.n_samples:
                        growing.cut(run.name, why)
            if stopped is not None:
                break
        if not growing.runs:
            raise stopped or ValueError(f"{case.name}: no run; expected one or more")
        campaign = stage_campaign(what, list(growing.runs))
        with stages.stage(f"writing {out}"):
            write_campaign(
                campaign,
                out,
                simulated=True,
                more_files=_files(case, curve_set),
                written_files=growing.files,
            )
            if back is not None:
                back.write()
    if stopped is not None:
        raise stopped
    return SimulatedStage(what, campaign, out, imbalance, growing.n_samples)


def _stage_stresses(case: Path, bodies: Mapping[str, Path]) -> StageStresses:
    """Stress rows of a case's carrier file, and of its pin file where it names one."""
    if "carrier" not in bodies:
        raise ValueError(
            f"{case}: --stress is given, [bodies] names no carrier; expected carrier = a body file "
            "of carrierflex reduce --body carrier --stresses"
        )
    read = {name: read_stresses(bodies[name]) for name in ("carrier", "pin") if name in bodies}
    for name, stresses in read.items():
        if stresses is None:
            raise ValueError(
                f"{bodies[name]}: the body has no stress rows; reduce it again with --stresses"
            )
    carrier = read["carrier"]
    assert carrier is not None
    return StageStresses(carrier, read.get("pin"))


def stage_body_of_case(
    what: StageCase, size: float, stresses: StageStresses | None = None
) -> StageBody:
    """Elastic body of a case: its files, or the default's by finite elements of `size` [m].

    `stresses` are rows of its files that the body is to read too.
    """
    body = stage_body_of_files(
        what.bodies,
        what.pin_fit_stiffness,
        size,
        gear=what.data.gear,
        main_shaft=what.main_shaft,
        stresses=None if stresses is None else stresses.carrier,
        pin_stresses=None if stresses is None else stresses.pin,
    )
    stated = what.rig["n_planets"]
    if body.n_planets != stated:
        raise ValueError(
            f"key 'n_planets' of [rig] is {stated}, the carrier has pins for {body.n_planets} "
            "planets; expected as many ([bodies] carrier takes another carrier)"
        )
    return body


def _curves(curves: Path | None) -> Mapping[str, DeflectionCurve]:
    from carrierflex.workflows.fe.default_curves import default_curves

    return default_curves() if curves is None else read_curves(curves)


def stage_pieces(
    model: StageModel, what: StageCase, run: StageRun, rng: np.random.Generator | None
) -> Iterator[StageResponse]:
    """Pieces of a run of a case."""
    return simulate_stage(
        model,
        run.load,
        what.sensors,
        duration=what.duration,
        sample_rate=what.sample_rate,
        step=what.step,
        effects=what.reading,
        rng=rng,
        rest_angle=what.rest_angle,
    )


def _grown(
    pieces: Iterable[StageResponse],
    what: StageCase,
    run: StageRun,
    growing: GrowingRuns,
    note: Callable[[str, float], None],
) -> float:
    """Write a run as it comes; the energy that its balance leaves over, over the work done."""
    imbalance, work = 0.0, 1.0  # J: a run without torque does no work
    for piece in pieces:
        growing.append(stage_run_record(run, [piece]))
        reached = float(piece.record.time[-1])
        note(f"{reached:.1f} s", reached / what.duration)
        imbalance = max(imbalance, float(np.abs(piece.record.imbalance).max()))
        work = max(work, float(np.abs(piece.record.energy[:, 0]).max()))
    return imbalance / work


def stage_run_record(run: StageRun, pieces: list[StageResponse]) -> Run:
    """Pieces of a run as one run of a campaign."""
    record = joined_records([piece.record for piece in pieces])
    columns = ("torque", "generator_speed", "ntl_y", "ntl_z")
    inputs = {
        name: record.drive[:, i] for i, name in enumerate(columns) if name != "generator_speed"
    }
    return Run(
        name=run.name,
        file=f"{run.name}.csv",
        condition=run.condition,
        time=record.time,
        inputs={"carrier_angle": record.c[:, 0], **inputs},
        signals={
            name: np.concatenate([piece.signals[name] for piece in pieces])
            for name in pieces[0].signals
        },
    )


def stage_campaign(what: StageCase, records: list[Run]) -> Campaign:
    """Records of a case as a campaign of kind ``carrier``."""
    noise_std = what.reading.noise_std
    return rim_campaign(what.name, what.sensors, records, rig=what.rig, noise_std=noise_std)


def _files(
    case: Path, curve_set: Mapping[str, DeflectionCurve]
) -> dict[str, Callable[[Path], None]]:
    return {
        CURVES_FILE: lambda path: write_curves(path, curve_set),
        CASE_COPY: partial(shutil.copyfile, case),
    }


def _refuse_size(case: Path, what: StageCase) -> None:
    keys = {"duration [s]": what.duration, "sample_rate_hz [1/s]": what.sample_rate}
    columns = len(what.sensors) + 5  # time and four inputs
    refuse_size(str(case), keys, what.duration * what.sample_rate * columns, MOST_IN_A_FILE)
    refuse_steps(str(case), what.duration, what.step)


def _simple_stages(model: RexsModel) -> Iterator[PlanetaryStage]:
    """Planetary stages of the kind that is simulated; the error of the only one, if it is none."""
    components = planetary_stages(model)
    for component in components:
        try:
            yield planetary_stage(model, component)
        except ValueError:
            if len(components) == 1:
                raise


def _with_loads(
    pieces: Iterable[StageResponse],
    folder: Path,
    run: str,
    model: StageModel,
    *,
    means: RunMeans | None = None,
) -> Iterator[StageResponse]:
    """Pieces of a run, each written to ``<run>_loads.csv`` as it passes.

    The picture ``<run>_loads.png`` follows at the end. A run that diverges or is interrupted leaves
    what was written until then, as its record does.
    """
    stopped: BaseException | None = None
    first: list[dict[str, NDArray[np.float64]]] = []
    with whole_file(folder / f"{run}_loads.csv") as temporary, temporary.open("wb") as file:
        try:
            for piece in pieces:
                columns = {
                    "time": piece.record.time,
                    **load_columns(model, piece.record, piece.loads),
                }
                if file.tell() == 0:
                    # Arrow would quote the column names.
                    file.write((",".join(columns) + "\n").encode())
                table = pa.table({name: pa.array(values) for name, values in columns.items()})
                pa_csv.write_csv(table, file, pa_csv.WriteOptions(include_header=False))
                if means is not None:
                    means.append(columns)
                shown = columns["carrier_angle"] <= 2.0 * np.pi * _SHOWN_TURNS
                if shown.any():
                    first.append({name: values[shown] for name, values in columns.items()})
                yield piece
        except (StageDivergedError, KeyboardInterrupt) as error:
            stopped = error
    if first:
        columns = {name: np.concatenate([piece[name] for piece in first]) for name in first[0]}
        save_figure(folder / f"{run}_loads.png", loads_figure(run, columns))
    if stopped is not None:
        raise stopped


def loads_figure(run: str, columns: dict[str, NDArray[np.float64]]) -> "Figure":
    """Six panels over the first revolutions: meshes, pins, sharing, bearings, speeds, energies."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 7.5), layout="constrained")
    meshes, pins, sharing, bearings, speeds, energies = figure.subplots(2, 3, sharex=True).flat
    turns = columns["carrier_angle"] / (2.0 * np.pi)
    for planet in (1, 2, 3):
        for mate, style in (("sun", "-"), ("ring", "--")):
            values = columns[f"{mate}_mesh_{planet}"] / 1e3
            label = f"{mate}, planet {planet}"
            meshes.plot(turns, values, f"C{planet - 1}{style}", label=label, linewidth=0.9)
        tangential = -columns[f"pin_{planet}_force_tangential"] / 1e3
        pins.plot(turns, tangential, label=f"pin {planet}", linewidth=0.9)
        sharing.plot(turns, columns[f"share_{planet}"], label=f"planet {planet}", linewidth=0.9)
    factor = columns["load_sharing_factor"].max()
    for name in _BEARINGS:
        radial = np.hypot(columns[f"{name}_y"], columns[f"{name}_z"]) / 1e3
        bearings.plot(turns, radial, label=name.replace("_", " "), linewidth=0.9)
    for name in _SHAFTS:
        speed = columns[f"{name}_speed"]
        ripple = (speed / speed.mean() - 1.0) * 100.0
        label = f"{name}, {abs(speed.mean()) * 30.0 / np.pi:.4g} rpm"
        speeds.plot(turns, ripple, label=label, linewidth=0.9)
    for name in _ENERGIES:
        energies.plot(turns, columns[f"energy_{name}"] / 1e3, label=name, linewidth=0.9)
    imbalance = np.abs(columns["energy_imbalance"]).max()
    torque = columns["generator_torque"].mean()
    meshes.set(title="forces along the tooth normals", ylabel="kN")
    pins.set(title="tangential pin forces, against the rotation", ylabel="kN")
    sharing.set(title=f"load shares; sharing factor at most {factor:.4f}", ylabel="1")
    bearings.set(title="radial bearing loads", ylabel="kN")
    speeds.set(title=f"speeds less their means; generator torque {torque:.5g} N m", ylabel="%")
    energies.set(title=f"energies since the start; {imbalance:.1e} J left over", ylabel="kJ")
    for panel in (meshes, pins, sharing, bearings, speeds, energies):
        panel.title.set_fontsize("medium")
        panel.margins(y=0.25)
        panel.legend(fontsize="x-small", ncols=2)
        panel.grid(alpha=0.3)
    for panel in (bearings, speeds, energies):
        panel.set_xlabel("revolutions")
    figure.suptitle(run)
    return figure

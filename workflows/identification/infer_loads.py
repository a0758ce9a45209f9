"""Infer what the planet pins carry from the proximity sensors at the carrier's rim.

Stages in equilibrium are led to the readings of a known run and another one; what the sensors
cannot see stands in the intervals. A good answer: a misfit about 1, torques within their intervals
of the recorded ones, and pin loads known to some percent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.geometry.parameters import DEFAULT_SIZE, GearData
from carrierflex.geometry.pins import planets_of
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from carrierflex.identification.campaign.campaign import Campaign
    from carrierflex.identification.campaign.records import Run
    from carrierflex.identification.carrier.planet_loads import LoadEstimate
    from carrierflex.simulation.carrier.run_cases import Sensor
    from carrierflex.simulation.stage.hidden_stages import Bodies

#: Misfit above which a drawn stage hardly made the readings.
_LARGEST_MISFIT = 2.0
_UNITS = {"tangential": "kN", "radial": "kN", "moment_tangential": "kN m", "moment_radial": "kN m"}


@dataclass(frozen=True)
class LoadValue:
    """A load with its 95 % interval."""

    value: Annotated[float, "Mean"]
    low: Annotated[float, "Lower end of the 95 % interval"]
    high: Annotated[float, "Upper end of the 95 % interval"]
    recorded: Annotated[float | None, "What the record holds; null where it has none"] = None

    @classmethod
    def around(cls, value: float, half: float, recorded: float | None = None) -> LoadValue:
        """Value with the half width of its interval."""
        return cls(float(value), float(value - half), float(value + half), recorded)


@dataclass(frozen=True, eq=False)
class PinLoads:
    """Loads of one pin in one run, means over a turn and their largest values."""

    pin: Annotated[int, "Number of the pin"]
    tangential: Annotated[LoadValue, "Mean force of the planet against the rotation [N]"]
    largest: Annotated[LoadValue, "Largest of these forces over the turn [N]"]


@dataclass(frozen=True, eq=False)
class RunLoads:
    """Loads of one run."""

    run: Annotated[str, "Name of the run"]
    known: Annotated[bool, "Whether its torque and rotor moment are taken as recorded"]
    torque: Annotated[LoadValue, "Torque [N m]"]
    moment_y: Annotated[LoadValue, "Rotor moment about y [N m]: vertical load at the hub"]
    moment_z: Annotated[LoadValue, "Rotor moment about z [N m]: load to the side"]
    load_sharing_factor: Annotated[
        LoadValue, "Largest share of the tangential pin forces times the number of planets"
    ]
    pins: Annotated[Sequence[PinLoads], "By pin"]
    pin_fit: Annotated[float, "Bending stiffness of a pin interface [N m/rad]"]
    misfit: Annotated[float, "Deviation from the nearest stage in standard deviations, about 1"]


@dataclass(frozen=True, eq=False)
class InferredLoads:
    """What the workflow found."""

    campaign: str
    known_run: str
    runs: tuple[RunLoads, ...]
    warnings: tuple[str, ...]
    estimates: Mapping[str, LoadEstimate]
    files: tuple[Path, ...]


def main(
    campaign: Path,
    *,
    body: Path,
    out: Path,
    known_run: str = "",
    known_torque: float | None = None,
    pin: Path | None = None,
    draws: int = 1500,
    seed: int = 0,
    workers: int = 1,
    quiet: bool = False,
) -> InferredLoads:
    """Infer torque, rotor moment and loads of the planet pins from proximity sensors.

    Parameters
    ----------
    campaign : Path
        Campaign folder of kind carrier.
    body : Path
        Carrier without pins, of carrierflex reduce --body carrier --variant flexible (.h5).
    out : Path
        Folder to write: loads.json, loads.csv and a picture a run.
    known_run : str
        Run with known torque and radial load, which calibrates the others; default: the run of the
        largest recorded torque.
    known_torque : float, optional
        Its torque [N m], instead of the recorded one.
    pin : Path, optional
        Pin of carrierflex reduce --body pin (.h5); default: the default pin.
    draws : int
        Number of stages drawn for each run, 600 or more; 1500 take half a minute to two minutes of
        processor time.
    seed : int
        Seed of the draws.
    workers : int
        Processes that solve stages; the answer does not depend on their number.
    quiet : bool
        Show no progress.

    Returns
    -------
    InferredLoads
        Torque and moments [N m], pin forces [N] with 95 % intervals.

    Raises
    ------
    ValueError
        Where the campaign or a body is refused, or there is no such run.
    OSError
        Where `out` cannot be written.
    """
    import numpy as np

    from carrierflex.identification.campaign.campaign_files import read_campaign
    from carrierflex.identification.carrier.planet_loads import (
        ReadingErrors,
        inferred_loads,
        measured_turn,
    )
    from carrierflex.simulation.stage.hidden_stages import HIDDEN, PIN_OFFSET, StagePair

    if draws < 600:
        raise ValueError(f"--draws is {draws}; expected 600 or more for an error estimate")
    stages = Stages(3, quiet, (0.02, 1.0, 0.05))
    with stages.stage(f"reading {campaign}"):
        measured = read_campaign(campaign).within_use()
        sensors = _sensors(measured)
        known = _known_run(measured, known_run)
        bodies = _bodies(body, pin, measured)
        names = [sensor.name for sensor in sensors]
        turns = {run.name: measured_turn(run, names) for run in measured.runs}
    arm = bodies.data.mounting.ntl_arm
    recorded = {run.name: _recorded(run, arm) for run in measured.runs}
    known_load = np.array(recorded[known])
    if known_torque is not None:
        known_load[0] = known_torque
    if not known_load[0] > 0.0:
        raise ValueError(
            f"run {known}: known torque is {known_load[0]:g} N m; expected a positive one: choose "
            "another --known-run, or give --known-torque"
        )
    nominal, errors, estimates = measured.rig["nominal_torque"], ReadingErrors(), {}
    with (
        work_executor(workers) as executor,
        stages.stage(f"loads of {len(turns)} runs, {draws} stages each"),
    ):
        prepared_folder(out)
        for number, (name, turn) in enumerate(turns.items()):
            pair = [turns[known]] if name == known else [turns[known], turn]
            readings = np.array([entry.readings for entry in pair])
            R = errors.covariance(sensors, readings, np.array([entry.noise for entry in pair]))
            forward = StagePair(bodies, known_load, sensors, nominal, of_known=name == known)

            def note(text: str, share: float, name: str = name, number: int = number) -> None:
                stages.note(f"run {name}: {text}", (number + share) / len(turns))

            estimates[name] = inferred_loads(
                forward, readings, R,
                n_draws=draws, rng=np.random.default_rng([seed, number]), executor=executor,
                note=note,
            )  # fmt: skip
    runs = tuple(
        _run_loads(name, estimate, recorded[name], name == known)
        for name, estimate in estimates.items()
    )
    warnings = tuple(_warnings(runs))
    with stages.stage(f"writing {out}"):
        inputs = Inputs(
            campaign=str(campaign), body=str(body), pin=None if pin is None else str(pin),
            known_run=known, known_torque=float(known_load[0]),
            known_moments=(float(known_load[1]), float(known_load[2])), draws=draws, seed=seed,
            errors=asdict(errors),
            ranges={
                name: (hidden.lower, hidden.upper)
                for name, hidden in {**HIDDEN, "pin_offset": PIN_OFFSET}.items()
            },
        )  # fmt: skip
        files = _write(out, measured.name, inputs, runs, estimates, warnings)
    return InferredLoads(measured.name, known, runs, warnings, estimates, files)


def _sensors(measured: Campaign) -> tuple[Sensor, ...]:
    from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor

    if measured.kind != "carrier":
        raise ValueError(
            f"campaign '{measured.name}' is of kind {measured.kind}; expected kind carrier"
        )
    sensors = tuple(
        Sensor(channel.name, channel.quantity, float(channel.angle), float(channel.radius))
        for channel in measured.channels
        if channel.angle is not None and channel.radius is not None
    )
    n_axial = sum(sensor.quantity == AXIAL for sensor in sensors)
    if n_axial < 3:
        raise ValueError(
            f"campaign '{measured.name}' has {n_axial} axial sensors; expected three or more: "
            "fewer cannot tell a tilt from a deflection"
        )
    return sensors


def _known_run(measured: Campaign, name: str) -> str:
    names = [run.name for run in measured.runs]
    if name and name not in names:
        raise ValueError(f"--known-run {name}: no such run; expected one of {', '.join(names)}")
    largest = max(measured.runs, key=lambda run: float(run.inputs["torque"].mean()))
    return name or largest.name


def _bodies(body: Path, pin: Path | None, measured: Campaign) -> Bodies:
    from carrierflex.reduction.body_files import read_body
    from carrierflex.simulation.stage.hidden_stages import Bodies
    from carrierflex.simulation.stage.stage_body import holds_pins, refuse_unfit_carrier
    from carrierflex.simulation.stage.stage_data import StageData
    from carrierflex.workflows.simulation.stage_bodies import reduced_pin

    carrier = read_body(body)
    if holds_pins(carrier):
        raise ValueError(
            f"{body}: {carrier.name} comes with its pins, whose fit is one of the unknowns; "
            "expected the body of carrierflex reduce --body carrier --variant flexible"
        )
    try:
        refuse_unfit_carrier(carrier, GearData())
    except ValueError as error:
        raise ValueError(f"{body}: {error}") from error
    n_planets = planets_of(carrier.pilots)
    if n_planets != measured.rig["n_planets"]:
        raise ValueError(
            f"{body}: a carrier of {n_planets} planets; expected {measured.rig['n_planets']}, "
            "'n_planets' of the campaign"
        )
    of_pin = read_body(pin) if pin is not None else reduced_pin(DEFAULT_SIZE)
    return Bodies(carrier, of_pin, StageData(), n_planets)


def _recorded(run: Run, arm: float) -> tuple[float, float, float]:
    """Mean torque and rotor moment about y and z of a record [N m]."""
    inside = run.in_use
    mean = {name: float(values[inside].mean()) for name, values in run.inputs.items()}
    moment_y, moment_z = arm * mean.get("ntl_z", 0.0), -arm * mean.get("ntl_y", 0.0)
    return mean["torque"], moment_y, moment_z


def _run_loads(
    run: str, estimate: LoadEstimate, recorded: tuple[float, float, float], known: bool
) -> RunLoads:
    torque, moment_y, moment_z = (
        LoadValue.around(value, half, measured)
        for value, half, measured in zip(
            estimate.load, estimate.load_half_width, recorded, strict=True
        )
    )
    sharing = LoadValue.around(estimate.sharing, estimate.sharing_half_width)
    pins = []
    for number, (values, halves) in enumerate(
        zip(estimate.pins[:, 0], estimate.half_width[:, 0], strict=True), start=1
    ):
        # Errors of one pin over the turn are alike, so that of the mean is hardly smaller.
        mean = LoadValue.around(values.mean(), halves.mean())
        top = values.argmax()
        pins.append(PinLoads(number, mean, LoadValue.around(values[top], halves[top])))
    return RunLoads(
        run,
        known,
        torque,
        moment_y,
        moment_z,
        sharing,
        tuple(pins),
        estimate.pin_fit,
        estimate.misfit,
    )


def _warnings(runs: Sequence[RunLoads]) -> list[str]:
    return [
        f"run {loads.run}: its readings deviate from the nearest stage by {loads.misfit:.1f} "
        "standard deviations, by which the intervals are widened: draw more stages (--draws), and "
        "check the carrier's dimensions, the sensors' angles and units, and that carrier_angle is "
        "zero with pin 1 along z"
        for loads in runs
        if loads.misfit > _LARGEST_MISFIT
    ]


def _write(
    out: Path,
    campaign: str,
    inputs: Inputs,
    runs: Sequence[RunLoads],
    estimates: Mapping[str, LoadEstimate],
    warnings: Sequence[str],
) -> tuple[Path, ...]:
    import numpy as np

    from carrierflex.simulation.stage.hidden_stages import PIN_LOADS, TURN_ANGLES

    files = [out / "loads.json", out / "loads.csv"]
    document: LoadsDocument = {
        "format": "carrierflex-loads",
        "version": 1,
        "campaign": campaign,
        "inputs": inputs,
        "runs": runs,
        "warnings": warnings,
        "versions": versions(),
    }
    save_json(files[0], document)
    header = ["run", "carrier_angle_deg", "pin", "load", "unit", "value", "low", "high"]
    rows: list[Sequence[object]] = []
    for run, estimate in estimates.items():
        for pin, angle in np.ndindex(estimate.pins.shape[0], TURN_ANGLES):
            for number, load in enumerate(PIN_LOADS):
                value = estimate.pins[pin, number, angle]
                half = estimate.half_width[pin, number, angle]
                unit = "N m" if load.startswith("moment") else "N"
                degrees = 360.0 * angle / TURN_ANGLES
                rows.append([run, degrees, pin + 1, load, unit, value, value - half, value + half])
    save_table(files[1], header, rows)
    for loads in runs:
        files.append(out / f"loads_{loads.run}.png")
        save_figure(files[-1], loads_figure(loads, estimates[loads.run]))
    return tuple(files)


def loads_figure(loads: RunLoads, estimate: LoadEstimate) -> Figure:
    """Loads of the pins over a turn with their 95 % bands."""
    import numpy as np
    from matplotlib.figure import Figure

    from carrierflex.simulation.stage.hidden_stages import PIN_LOADS, TURN_ANGLES

    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    degrees = 360.0 * np.arange(TURN_ANGLES + 1) / TURN_ANGLES
    closed = np.arange(TURN_ANGLES + 1) % TURN_ANGLES
    titles = {
        "tangential": "force against the rotation",
        "radial": "force away from the axis",
        "moment_tangential": "moment about the tangential direction",
        "moment_radial": "moment about the radial direction",
    }
    for number, (panel, load) in enumerate(
        zip(figure.subplots(2, 2, sharex=True).flat, PIN_LOADS, strict=True)
    ):
        for pin in range(estimate.pins.shape[0]):
            value = estimate.pins[pin, number, closed] / 1e3
            half = estimate.half_width[pin, number, closed] / 1e3
            panel.plot(degrees, value, f"C{pin}", label=f"pin {pin + 1}")
            panel.fill_between(degrees, value - half, value + half, color=f"C{pin}", alpha=0.2)
        panel.set(title=titles[load], ylabel=_UNITS[load], xlim=(0.0, 360.0))
        panel.set_xticks(range(0, 361, 60))
        panel.grid(alpha=0.3)
        if number >= 2:
            panel.set_xlabel("carrier angle [deg]")
    figure.axes[0].legend(fontsize="small")
    torque, half = loads.torque.value / 1e3, (loads.torque.high - loads.torque.low) / 2e3
    said = "known" if loads.known else f"+- {half:.2g}"
    figure.suptitle(f"{loads.run}: torque {torque:.4g} kN m ({said}); bands: 95 %")
    return figure


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of the inference."""

    campaign: Annotated[str, "Campaign folder"]
    body: Annotated[str, "File of the carrier"]
    pin: Annotated[str | None, "File of the pin; null: the default pin"]
    known_run: Annotated[str, "Run of the known load"]
    known_torque: Annotated[float, "Its torque [N m]"]
    known_moments: Annotated[tuple[float, float], "Its rotor moment about y and z [N m]"]
    draws: Annotated[int, "Stages drawn for each run"]
    seed: Annotated[int, "Seed of the draws"]
    errors: Annotated[Mapping[str, float], "Standard deviations of the readings' errors"]
    ranges: Annotated[
        Mapping[str, tuple[float, float]], "Lower and upper end of what no sensor reads"
    ]


class LoadsDocument(TypedDict):
    """loads.json, written by loads."""

    format: Annotated[Literal["carrierflex-loads"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    campaign: Annotated[str, "Name of the campaign"]
    inputs: Annotated[Inputs, "Inputs"]
    runs: Annotated[Sequence[RunLoads], "Loads by run"]
    warnings: Annotated[Sequence[str], "What the intervals do not hold"]
    versions: Versions

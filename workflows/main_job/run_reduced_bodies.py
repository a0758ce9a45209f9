"""The reduced bodies at work: planetary stage and mounting in time.

The carrier and pin that were just reduced, joined to the main shaft, run as the planetary stage
under the first load case of the 2012 paper; the housing answers on its bushings to the load history
of the 2011 paper. A good answer: the sensors' planet order in time is that of the static curve of
the same bodies, energy balances to rounding, and the planets share the load but for weight.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from os.path import relpath
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.curve_files import write_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.toml_files import toml_document
from carrierflex.geometry.parameter_tables import GEAR_KEYS
from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import planets_of
from carrierflex.identification.campaign.campaign_files import CASE_COPY, write_campaign
from carrierflex.identification.campaign.simulated_campaign import CURVES_FILE
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.case_kinds import STAGE_CASE as STAGE_CASE_FILE
from carrierflex.simulation.mounting.rig import HOUSING_MOTION
from carrierflex.simulation.stage.load_channels import HOUSING_COLUMNS, load_columns
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.response import joined_records
from carrierflex.simulation.stage.stage_cases import StageCase, read_stage_case
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.workflows.identification.identify_bushings import measured_motion
from carrierflex.workflows.outputs import save_figure, save_table
from carrierflex.workflows.simulation import simulate_mounting
from carrierflex.workflows.simulation.simulate_stage import (
    stage_campaign,
    stage_pieces,
    stage_run_record,
)
from carrierflex.workflows.simulation.stage_bodies import stage_body_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Case whose rig, sensors, load and pin fit the stage has, and the mounting's.
STAGE_CASE, MOUNTING_CASE = "stage_lc1", "mounting_2011"
#: Length of the stage's run, in revolutions.
_TURNS = 2
#: Samples a revolution: orders are told apart without leakage.
_SAMPLES_A_TURN = 300

Columns = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class BodiesAtWork:
    """What the bodies did in time."""

    case: Annotated[StageCase, "What was run, with the bodies' gears"]
    stage: Annotated[
        Columns,
        "Time [s], sensors [m], loads, load shares and motion of the housing by column name",
    ]
    imbalance: Annotated[float, "Energy that the stage's balance leaves over, over the work done"]
    mounting: Annotated[
        Columns, "Time [s], loads and motion of the housing on its bushings [m, rad]"
    ]

    @property
    def n_planets(self) -> int:
        """Number of planets."""
        return int(self.case.rig["n_planets"])

    @property
    def planet_order(self) -> float:
        """Amplitude of the planets' order over the last revolution [m].

        Mean vector of the axial sensors: weight adds to the torque's as a vector that turns from
        sensor to sensor and has no mean.
        """
        last = slice(-_SAMPLES_A_TURN, None)
        angle = self.stage["carrier_angle"][last]
        components = [
            np.mean(
                self.stage[sensor.name][last] * np.exp(1j * self.n_planets * (sensor.angle - angle))
            )
            for sensor in self.axial_sensors
        ]
        return float(2.0 * np.abs(np.mean(components)))

    @property
    def axial_sensors(self) -> tuple[Sensor, ...]:
        """Sensors of the rim's axial motion."""
        return tuple(sensor for sensor in self.case.sensors if sensor.quantity == AXIAL)

    @property
    def figures(self) -> dict[str, float]:
        """What the summary tells, by name with unit."""
        torque = self.case.runs[0].load.torque
        shares = np.stack([self.stage[f"share_{pin + 1}"] for pin in range(self.n_planets)])
        roll = self.stage["housing_theta_x"].mean()
        return {
            "revolutions": float(_TURNS),
            "torque_nm": torque,
            f"order_{self.n_planets}_um_per_knm": self.planet_order * 1e9 / torque,
            "smallest_load_share": float(shares.min()),
            "largest_load_share": float(shares.max()),
            "housing_roll_mrad": float(roll) * 1e3,
            "energy_imbalance_over_work": self.imbalance,
            "mounting_largest_roll_mrad": float(np.abs(self.mounting["theta_x"]).max()) * 1e3,
        }


def main(
    carrier: ReducedModel,
    pin: ReducedModel,
    gear: GearData,
    *,
    curves: Mapping[str, DeflectionCurve],
    out: Path,
) -> BodiesAtWork:
    """Run stage and mounting in time.

    Parameters
    ----------
    carrier, pin : ReducedModel
        Reduced bodies: the carrier without pins, and pin 1.
    gear : GearData
        Gears that belong to them.
    curves : mapping of str to DeflectionCurve
        Kept with the stage's campaign.
    out : Path
        Folder that exists; ``stage/`` and ``mounting/`` in it get a campaign, a table of the motion
        and a picture each.

    Returns
    -------
    BodiesAtWork
        Columns over time.

    The stage's campaign has the stage itself as its simulation, with these bodies: ``plan`` and
    ``diagnose`` take the folder as it is, or with measured records in place of the simulated ones.

    Raises
    ------
    ValueError, StageDivergedError
        Where body and stage do not fit, or the run leaves the range of small motions.
    """
    case = _case(gear, planets_of(carrier.pilots))
    bodies = {name: out / "bodies" / f"{model.name}.h5" for name, model in (
        ("carrier", carrier), ("pin", pin),
    )}  # fmt: skip
    case = replace(case, bodies=bodies)
    stage, imbalance = _run_stage(case, carrier, pin, curves, out / "stage")
    mounting = _run_mounting(out / "mounting")
    return BodiesAtWork(case, stage, imbalance, mounting)


def _case(gear: GearData, n_planets: int) -> StageCase:
    shipped = read_stage_case(shipped_case(STAGE_CASE))
    turn = 2.0 * np.pi / shipped.speed
    return replace(
        shipped,
        rig={**shipped.rig, "n_planets": n_planets},
        data=replace(shipped.data, gear=gear),
        duration=_TURNS * turn,
        sample_rate=_SAMPLES_A_TURN / turn,
    )


def _run_stage(
    case: StageCase,
    carrier: ReducedModel,
    pin: ReducedModel,
    curves: Mapping[str, DeflectionCurve],
    folder: Path,
) -> tuple[dict[str, NDArray[np.float64]], float]:
    """Columns over time, and the energy left over, over the work done."""
    body = stage_body_of(carrier, pin, case.pin_fit_stiffness)
    model = stage_model(body, case.data, effects=case.effects, speed=case.speed)
    (run,) = case.runs
    pieces = list(stage_pieces(model, case, run, np.random.default_rng(case.seed)))
    record = stage_run_record(run, pieces)
    files: dict[str, Callable[[Path], None]] = {
        CURVES_FILE: lambda path: write_curves(path, curves),
        CASE_COPY: partial(_write_case, case, folder / "campaign"),
    }
    campaign = stage_campaign(case, [record])
    baseline = replace(campaign.baseline, source="stage", case=CASE_COPY)
    write_campaign(
        replace(campaign, baseline=baseline), folder / "campaign", simulated=True, more_files=files
    )
    states = joined_records([piece.record for piece in pieces])
    loads = load_columns(model, states, part_loads(model, states.c))
    columns = {"time": record.time, **record.signals, **loads}
    shown = (
        "time",
        "carrier_angle",
        *record.signals,
        *(f"share_{pin + 1}" for pin in range(body.n_planets)),
        *HOUSING_COLUMNS,
    )
    save_table(
        folder / "in_time.csv", shown, np.column_stack([columns[name] for name in shown]).tolist()
    )
    save_figure(folder / "in_time.png", _stage_figure(run.name, columns, case.sensors))
    work = np.abs(states.energy[:, 0]).max()
    return columns, float(np.abs(states.imbalance).max() / work)


def _write_case(case: StageCase, folder: Path, path: Path) -> None:
    """Write the shipped case with the gears, the planets, the times and the bodies of this one."""
    import tomli_w

    document = toml_document(shipped_case(STAGE_CASE), STAGE_CASE_FILE)
    gear = {name: getattr(case.data.gear, name) for name in GEAR_KEYS}
    changed = {
        "duration": case.duration,
        "sample_rate_hz": case.sample_rate,
        "rig": {**document["rig"], "n_planets": case.rig["n_planets"]},
        "gear": gear,
        "bodies": {name: relpath(body, folder) for name, body in case.bodies.items()},
    }
    path.write_bytes(tomli_w.dumps({**document, **changed}).encode())


def _run_mounting(folder: Path) -> dict[str, NDArray[np.float64]]:
    """Time, loads and motion of the housing under the record of the 2011 paper."""
    simulated = simulate_mounting.main(
        shipped_case(MOUNTING_CASE), out=folder / "campaign", quiet=True
    )
    (run,) = simulated.campaign.runs
    motion = measured_motion(simulated.campaign)[run.name]
    columns = {
        "time": run.time,
        **{name: run.inputs[name] for name in ("torque", "ntl_y", "ntl_z")},
    }
    columns |= {name: motion[:, i] for i, name in enumerate(HOUSING_MOTION)}
    save_table(
        folder / "housing_motion.csv",
        list(columns),
        np.column_stack(list(columns.values())).tolist(),
    )
    save_figure(folder / "housing_motion.png", _mounting_figure(columns))
    return columns


def _stage_figure(run: str, columns: Columns, sensors: Sequence[Sensor]) -> "Figure":
    """Sensors, tooth forces, load shares and motion of the housing over the revolutions."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 11.5), layout="constrained")
    figure.suptitle(f"{run}: the reduced bodies in the planetary stage")
    axial, radial, teeth, shares, moved, turned = figure.subplots(3, 2, sharex=True).flat
    turns = columns["carrier_angle"] / (2.0 * np.pi)
    n_planets = sum(name.startswith("share_") for name in columns)
    for sensor in sensors:
        panel = axial if sensor.quantity == AXIAL else radial
        panel.plot(turns, columns[sensor.name] * 1e3, label=sensor.name, linewidth=0.9)
    for mate, style in (("sun", "-"), ("ring", "--")):
        for planet in range(1, n_planets + 1):
            force = columns[f"{mate}_mesh_{planet}"] / 1e3
            teeth.plot(
                turns, force, f"C{planet - 1}{style}", label=f"{mate} {planet}", linewidth=0.7
            )
    for planet in range(1, n_planets + 1):
        share = columns[f"share_{planet}"] * 100.0
        shares.plot(turns, share, label=f"planet {planet}", linewidth=0.9)
    _draw_change(moved, turns, columns, HOUSING_COLUMNS[:3])
    _draw_change(turned, turns, columns, HOUSING_COLUMNS[3:])
    axial.set(title="axial sensors", ylabel="mm")
    radial.set(title="radial sensors", ylabel="mm")
    teeth.set(title="forces along the tooth normals", ylabel="kN")
    shares.set(title="load shares of the planets", ylabel="%")
    moved.set(title="housing: displacement less its mean", ylabel="um")
    turned.set(title="housing: rotation less its mean", ylabel="urad")
    for panel in (axial, radial, teeth, shares, moved, turned):
        panel.margins(y=0.35)
        n_columns = 1 if panel in (moved, turned) else 3
        panel.legend(fontsize="small", ncols=n_columns, loc="upper center")
        panel.grid(alpha=0.3)
    for panel in (moved, turned):
        panel.set_xlabel("revolutions of the carrier")
    return figure


def _draw_change(
    panel: "Axes", turns: NDArray[np.float64], columns: Columns, names: Sequence[str]
) -> None:
    """Columns less their means [um or urad], the means in the legend."""
    for name in names:
        mean = columns[name].mean()
        unit = "mrad" if "theta" in name else "mm"
        label = f"{name.removeprefix('housing_')}, mean {mean * 1e3:.3f} {unit}"
        panel.plot(turns, (columns[name] - mean) * 1e6, label=label, linewidth=0.9)


def _mounting_figure(columns: Columns) -> "Figure":
    """Loads of the main shaft and motion of the housing over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    figure.suptitle("housing on its bushings under the load case of the 2011 paper")
    loads, moved, turned = figure.subplots(3, 1, sharex=True)
    time = columns["time"]
    for name, unit in (("torque", "kN m"), ("ntl_y", "kN"), ("ntl_z", "kN")):
        loads.plot(time, columns[name] / 1e3, label=f"{name}, {unit}", linewidth=0.9)
    for panel, names, unit in (
        (moved, HOUSING_MOTION[:3], "mm"),
        (turned, HOUSING_MOTION[3:], "mrad"),
    ):
        for name in names:
            panel.plot(time, columns[name] * 1e3, label=name, linewidth=0.9)
        panel.set_ylabel(unit)
    loads.set(title="loads of the main shaft", ylabel="kN m, kN")
    moved.set_title("displacement midway between the bushings")
    turned.set(title="rotation", xlabel="time, s")
    for panel in (loads, moved, turned):
        panel.legend(fontsize="small", loc="upper left")
        panel.grid(alpha=0.3)
    return figure

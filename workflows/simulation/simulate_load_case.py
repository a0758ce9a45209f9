"""Simulate what the sensors would read in a set of load cases.

At the carrier's rim, or on the gearbox's housing.

Reads a case (the shipped ones hold LC1 to LC4 of the 2012 paper and the load history of the 2011
paper), simulates every run and writes a campaign folder that ``identify`` and ``diagnose`` read
like a measurement. A good answer at the rim: the order-1 swing of the tilt rules the axial signals,
with three small peaks a revolution of the deflection on top of it. On the housing: rest, a step of
millimetres with the radial load, and the roll that opens ssz from spz with the torque.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.files.toml_files import toml_document
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.case_kinds import CARRIER_CASE, STAGE_FORMAT

if TYPE_CHECKING:
    from carrierflex.workflows.simulation import (
        simulate_carrier,
        simulate_mounting,
        simulate_stage,
        vary_mounting,
    )

    #: What a case becomes, by its kind and the options.
    Simulated = (
        simulate_carrier.SimulatedLoadCases
        | simulate_mounting.SimulatedMounting
        | simulate_stage.SimulatedStage
        | vary_mounting.Variants
    )


def main(
    case: Path,
    *,
    out: Path,
    curves: Path | None = None,
    law: list[Path] | None = None,
    linearised: Path | None = None,
    loads: Path | None = None,
    stress: Path | None = None,
    rexs: Path | None = None,
    energy_balance: bool = False,
    parquet: bool = False,
    variants: Path | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    quiet: bool = False,
) -> Simulated:
    """Simulate the sensors in a set of load cases and write them as a campaign folder.

    Parameters
    ----------
    case : Path
        Case file (TOML), or the name of a bundled case.

        Rig, sensors and runs with the carrier's true motion, or of kind mounting, or a stage case,
        in which the whole planetary stage runs; SI units. Bundled cases: carrier_lc1_to_lc4,
        stage_lc1 to stage_lc4, mounting_2011.
    out : Path
        Folder to write: a campaign; new, empty, or simulated before.
    curves : Path, optional
        Deflection curves of the carrier (CSV); default: bundled.

        Columns theta_deg, delta_s, delta_f [m per kN m]. A case of kind mounting has none.
    law : list of Path, optional
        Carrier: law files (TOML) of diagnose --save-law, added.

        Their signals are added to the case's truth; may be given several times. The output folder
        gets copies.
    linearised : Path, optional
        Folder for modes, frequency response and Campbell diagram.

        Of a mounting at the largest torque of each run, of a stage at the case's speed.
    loads : Path, optional
        Stage: folder for loads of teeth, pins and bearings.

        Also the shares of the planets, the speeds of the shafts, the generator's torque and the
        energies: <run>_loads.csv and <run>_loads.png for each run.
    stress : Path, optional
        Stage: folder for stress and rainflow cycles of carrier and pins.

        The carrier of [bodies], and the pin where it names one, must be of carrierflex reduce
        --stresses. <run>_stress.csv: hotspot of every surface and pin; <run>_cycles.csv: its
        rainflow cycles; <run>_stress.png. Needs 8 bytes of memory a coordinate and sample.
    rexs : Path, optional
        Stage, beside loads: REXS file of the gearbox for results.

        The folder of loads takes a copy of it with one load case a run: forces at bearings and
        meshes, mesh load factor, speeds, lives.
    energy_balance : bool
        Mounting: energy balance; exit code 1 above 0.1 %.

        Work, dissipation and stored energy of every run; exit code 1 where more than 0.1 % of the
        work is missing, which a smaller step of the case cures.
    parquet : bool
        Mounting: Parquet files in constant memory (long records).

        Written piece by piece, for records of 1e5 s; the case has no sensor delay.
    variants : Path, optional
        Mounting: CSV of parameter sets, each simulated.

        A header of names of [truth], one set a row, SI units; every run is simulated with each, and
        the output folder gets variants.csv with the RMS of every sensor [m] instead of a campaign.
    workers : int
        Processes for the variants.

        1: in this process.
    scheduler : str, optional
        Address of a Dask scheduler (tcp://host:8786) instead.
    quiet : bool
        Show no progress.

    Returns
    -------
    SimulatedLoadCases, SimulatedMounting, SimulatedStage or Variants
        The case, the campaign and its folder; or the RMS by parameter set.

    Raises
    ------
    ValueError
        Where the case or the curves are refused, or the folder holds something that is not a
        campaign.
    """
    if not case.suffix and not case.exists():
        case = shipped_case(str(case))
    document = toml_document(case, CARRIER_CASE)
    options = {"energy-balance": energy_balance, "parquet": parquet, "variants": variants}
    given = [name for name, value in options.items() if value]
    if given and document.get("kind") != "mounting":
        raise ValueError(f"--{given[0]} is for cases of kind mounting; {case.name} is none")
    if (
        linearised is not None
        and document.get("kind") != "mounting"
        and document.get("format") != STAGE_FORMAT
    ):
        raise ValueError(f"--linearised is for mountings and stages; {case.name} is neither")
    for name, folder in (("loads", loads), ("stress", stress)):
        if folder is not None and document.get("format") != STAGE_FORMAT:
            raise ValueError(f"--{name} is for stages; {case.name} is none")
    if rexs is not None and loads is None:
        raise ValueError(
            "--rexs takes the results of --loads back to a REXS file; expected --loads FOLDER too"
        )
    is_carrier = document.get("kind") != "mounting" and document.get("format") != STAGE_FORMAT
    if law and not is_carrier:
        raise ValueError(f"--law is for cases of the carrier; {case.name} is none")
    if (workers != 1 or scheduler is not None) and variants is None:
        raise ValueError(
            "--workers and --scheduler spread the sets of --variants; expected --variants too"
        )

    from carrierflex.workflows.simulation import (
        simulate_carrier,
        simulate_mounting,
        simulate_stage,
        stream_mounting,
        vary_mounting,
    )

    if document.get("format") == STAGE_FORMAT:
        return simulate_stage.main(
            case,
            out=out,
            curves=curves,
            linearised=linearised,
            loads=loads,
            stress=stress,
            rexs=rexs,
            quiet=quiet,
        )
    if is_carrier:
        return simulate_carrier.main(case, out=out, curves=curves, law=law, quiet=quiet)
    if curves is not None:
        raise ValueError(f"--curves is {curves}; a case of kind mounting has no deflection curves")
    given += ["linearised"] if linearised is not None else []
    if len(given) > 1 and (parquet or variants):
        raise ValueError(
            f"--{' and --'.join(given)} exclude one another; expected --parquet or --variants alone"
        )
    if parquet:
        return stream_mounting.main(case, out=out, quiet=quiet)
    if variants is not None:
        return vary_mounting.main(
            case, variants=variants, out=out, workers=workers, scheduler=scheduler, quiet=quiet
        )
    return simulate_mounting.main(
        case, out=out, linearised=linearised, energy_balance=energy_balance, quiet=quiet
    )

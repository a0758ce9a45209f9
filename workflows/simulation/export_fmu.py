"""Export the mounting or the planetary stage as a unit for co-simulation with other tools.

A good answer: a file ``.fmu`` that an importing tool runs with torque and radial loads as inputs
and reads the sensors from, equal to the project's integrator.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from carrierflex.files.toml_files import toml_document
from carrierflex.files.versions import versions
from carrierflex.files.whole_files import refuse_foreign
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.case_kinds import CARRIER_CASE, STAGE_FORMAT
from carrierflex.simulation.fmi.functional_mockup import UnitModel
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

#: Largest step of the mounting [s]: a third of a radian of the stiffest bushing of table 3.
_STEP = 1e-3
#: Torque [N m] and radial loads [N] that the step resolves without a case: the rig's nominal ones.
_LOADS = np.array([[360e3, 100e3, 100e3]])


@dataclass(frozen=True, eq=False)
class ExportedUnit:
    """What was written."""

    file: Annotated[Path, "The unit"]
    fmi: Annotated[str, "Version of the standard"]
    model: Annotated[str, "What is inside"]
    step: Annotated[float, "Largest step inside [s]"]
    compiled: Annotated[bool, "Whether it holds a library for this platform and its sources"]


def main(
    *,
    out: Path,
    case: Path | None = None,
    run: str | None = None,
    fmi: Literal["2", "3"] = "2",
    time_step: float | None = None,
    size: float = DEFAULT_SIZE,
    sources_only: bool = False,
    quiet: bool = False,
) -> ExportedUnit:
    """Export mounting or stage, nonlinear as they are simulated, as an FMI co-simulation unit.

    Parameters
    ----------
    out : Path
        File to write (.fmu).
    case : Path, optional
        Case of kind mounting or stage case, or the name of a bundled one.

        Of a mounting its rig and truth are exported; default: the default rig with linear bushings.
    run : str, optional
        Stage: run of the initial load; default: the first run.
    fmi : {"2", "3"}
        Version of the standard: 2.0, which most tools import, or 3.0.
    time_step : float, optional
        Largest internal step [s]; default: 0.001, of a stage its case's.

        Communication steps may be of any size.
    size : float
        Stage: element edge length [m] of default bodies.
    sources_only : bool
        Write the C sources only, even where there is a compiler.
    quiet : bool
        Show no progress.

    Raises
    ------
    ValueError
        Where the case, the step or the file name is refused.
    """
    from carrierflex.simulation.fmi.functional_mockup import c_compiler, write_fmu

    refuse_foreign(out, "modelDescription.xml", "sources/model_data.h")
    if case is not None and not case.suffix and not case.exists():
        case = shipped_case(str(case))
    document = {} if case is None else toml_document(case, CARRIER_CASE)
    if case is not None and document.get("format") == STAGE_FORMAT:
        model, step = _stage(case, run, time_step, size, Stages(2, quiet))
    elif case is not None and document.get("kind") != "mounting":
        raise ValueError(
            f"{case}: a case of the carrier's motion, which holds no equations of motion; expected "
            "a case of kind mounting or a stage case"
        )
    elif run is not None:
        raise ValueError(
            f"--run is {run!r}; a mounting begins at rest under its inputs: leave --run out"
        )
    else:
        step = _STEP if time_step is None else time_step
        model = _mounting(case, step)
    prepared_folder(out.parent)
    compiler = None if sources_only else c_compiler()
    write_fmu(model, out, version=fmi, compiler=compiler, notes=versions())
    return ExportedUnit(out, f"{fmi}.0", model.title, step, compiler is not None)


def _mounting(case: Path | None, step: float) -> UnitModel:
    from carrierflex.simulation.mounting.mounting_unit import mounting_unit
    from carrierflex.workflows.simulation.linearise_mounting import operating_point

    if case is None:
        rig = MountingRig()
        return mounting_unit(rig, parameter_array(rig), step=step, loads=_LOADS)
    what = read_mounting_case(case)
    loads = np.array([operating_point(run)[0] for run in what.runs])
    return mounting_unit(what.rig, what.truth, step=step, loads=loads)


def _stage(
    case: Path, name: str | None, time_step: float | None, size: float, stages: Stages
) -> tuple[UnitModel, float]:
    """Unit of a stage and its largest step."""
    from carrierflex.simulation.stage.stage_cases import read_stage_case
    from carrierflex.simulation.stage.stage_model import stage_model
    from carrierflex.simulation.stage.stage_unit import refuse_effects, stage_unit
    from carrierflex.workflows.simulation.simulate_stage import stage_body_of_case

    what = read_stage_case(case)
    runs = {run.name: run for run in what.runs}
    if name is not None and name not in runs:
        raise ValueError(f"{case}: no run {name!r}; expected one of {', '.join(runs)}")
    run = what.runs[0] if name is None else runs[name]
    step = what.step if time_step is None else time_step
    refuse_effects(what.effects, what.reading)
    with stages.stage(f"reduced carrier and pins, elements of {size} m"):
        body = stage_body_of_case(what, size)
    with stages.stage("equations of the stage"):
        model = stage_model(body, what.data, effects=what.effects, speed=what.speed)
        unit = stage_unit(
            model,
            run.load,
            what.sensors,
            step=step,
            effects=what.reading,
            rest_angle=what.rest_angle,
        )
    return unit, step

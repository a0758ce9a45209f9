"""Export the mounting as a unit for co-simulation with other tools.

A good answer: a file ``.fmu`` that an importing tool runs with torque and radial loads as inputs
and reads the sensors from, equal to the project's integrator.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from carrierflex.files.versions import versions
from carrierflex.files.whole_files import refuse_foreign
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.fmi.functional_mockup import UnitModel
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.workflows.outputs import prepared_folder

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
    fmi: Literal["2", "3"] = "2",
    time_step: float | None = None,
    sources_only: bool = False,
) -> ExportedUnit:
    """Export the mounting as an FMI co-simulation unit, with its nonlinear bushings.

    Parameters
    ----------
    out : Path
        File to write (.fmu).
    case : Path, optional
        Case of kind mounting whose rig and truth are taken, or the name of a bundled one. Without
        it the default rig with linear bushings.
    fmi : {"2", "3"}
        Version of the standard: 2.0, which most tools import, or 3.0.
    time_step : float, optional
        Largest step inside [s], 0.001 by default; communication steps may be of any size.
    sources_only : bool
        Write the C sources only, even where there is a compiler.

    Raises
    ------
    ValueError
        Where the case, the step or the file name is refused.
    """
    from carrierflex.simulation.fmi.functional_mockup import c_compiler, write_fmu

    step = _STEP if time_step is None else time_step
    model = _mounting(case, step)
    prepared_folder(out.parent)
    refuse_foreign(out, "modelDescription.xml", "sources/model.h")
    compiler = None if sources_only else c_compiler()
    write_fmu(model, out, version=fmi, compiler=compiler, notes=versions())
    return ExportedUnit(out, f"{fmi}.0", model.title, step, compiler is not None)


def _mounting(case: Path | None, step: float) -> UnitModel:
    from carrierflex.simulation.mounting.mounting_unit import mounting_unit
    from carrierflex.workflows.simulation.linearise_mounting import operating_point

    if case is None:
        rig = MountingRig()
        return mounting_unit(rig, parameter_array(rig), step=step, loads=_LOADS)
    if not case.suffix and not case.exists():
        case = shipped_case(str(case))
    what = read_mounting_case(case)
    loads = np.array([operating_point(run)[0] for run in what.runs])
    return mounting_unit(what.rig, what.truth, step=step, loads=loads)

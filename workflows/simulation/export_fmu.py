"""Export the linear mounting model for co-simulation with other tools.

A good answer: a file ``.fmu`` that an importing tool runs with torque and radial loads as inputs
and reads the six motion sensors from, equal to the project's own integrator.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from carrierflex.files.versions import versions
from carrierflex.files.whole_files import refuse_foreign
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.workflows.outputs import prepared_folder


@dataclass(frozen=True, eq=False)
class ExportedUnit:
    """What was written."""

    file: Annotated[Path, "The unit"]
    step: Annotated[float, "Its own step [s]"]
    compiled: Annotated[bool, "Whether it holds a library for this platform and its sources"]


def main(
    *, out: Path, case: Path | None = None, time_step: float = 0.01, sources_only: bool = False
) -> ExportedUnit:
    """Export the linear mounting model as an FMI 2.0 co-simulation unit.

    Parameters
    ----------
    out : Path
        File to write (.fmu).
    case : Path, optional
        Case of kind mounting with linear bushings: its rig and truth are exported; default: the
        default rig with linear bushings.
    time_step : float
        Internal step [s]; communication steps are multiples of it. Exact for inputs that are linear
        in time.
    sources_only : bool
        Write the C sources only, even where there is a compiler.

    Raises
    ------
    ValueError
        Where the case, the step or the file name is refused.
    """
    if case is None:
        rig = MountingRig()
        parameters = parameter_array(rig)
    else:
        what = read_mounting_case(case)
        rig, parameters = what.rig, what.truth

    from carrierflex.simulation.mounting.functional_mockup import (
        c_compiler,
        mounting_system,
        write_fmu,
    )

    system = mounting_system(rig, parameters, step=time_step)
    prepared_folder(out.parent)
    refuse_foreign(out, "modelDescription.xml", "sources/linear_system.h")
    compiler = None if sources_only else c_compiler()
    write_fmu(system, out, compiler=compiler, notes=versions())
    return ExportedUnit(out, time_step, compiler is not None)

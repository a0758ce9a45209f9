"""Deflection curves and pin fit at the limit of fine meshes, and the interval of the pin fit.

    python -m studies.tabulate_mesh_limit --out mesh_limit

writes mesh_limit.md. Orders of both torque curves over the element size, and the interface
stiffness that meets the rim deflection of table 4 of the 2012 paper with the interval of its
printed digits; then their limits by a straight line in the size. A good answer: the scatter about
the line is small beside what the line takes off.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.mesh_limits import mesh_limit
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.identification.carrier.printed_tables import Printed, derived_facts
from carrierflex.reduction.pin_fit import PinFitFamily
from carrierflex.workflows.fe.study_pin_fit import HIGHEST, LOWEST, static_family
from carrierflex.workflows.main_job import check_mesh_convergence
from carrierflex.workflows.main_job.check_mesh_convergence import MeshStudy
from carrierflex.workflows.outputs import prepared_folder
from studies.case_files import write_table

#: Element sizes of the curves, on half a sector, and of the pin fit, on whole bodies [m].
CURVE_SIZES = (0.05, 0.035, 0.03, 0.025, 0.02, 0.016, 0.0125)
FIT_SIZES = (0.045, 0.03, 0.025, 0.02)


def fits_of_table_4(family: PinFitFamily, deflection: Printed) -> NDArray[np.float64]:
    """Interface stiffness that meets the printed rim deflection [N m/rad].

    For its value, then for the ends of its interval: lowest stiffness, highest stiffness.

    Parameters
    ----------
    family : PinFitFamily
        Curves over the stiffness.
    deflection : Printed
        RMS of the rim deflection [m per N m].
    """

    def stiffness(wanted: float) -> float:
        """Interface stiffness whose curve has an RMS [m per N m]."""
        return family.stiffness_where(lambda curve: curve.rms <= 1e3 * wanted, LOWEST, HIGHEST)

    ends = (deflection.value, deflection.high, deflection.low)
    return np.array([stiffness(wanted) for wanted in ends])


def limit_table(study: MeshStudy, fits: Mapping[float, NDArray[np.float64]]) -> list[str]:
    """Both tables as Markdown, the limit last."""
    n = check_mesh_convergence.study_orders(3)
    columns = [f"{variant} {order}" for variant in ("flexible", "stiff") for order in n]
    lines = [f"| element size [m] | unknowns | {' | '.join(columns)} |", "|---" * 6 + "|"]
    values = 1e6 * np.concatenate([study.flexible, study.stiff], axis=1)
    for size, n_dofs, row in zip(study.sizes, study.n_dofs, values, strict=True):
        lines.append(f"| {size:g} | {n_dofs} | {_cells(row, '.4f')} |")
    limit, error = mesh_limit(study.sizes, values)
    lines.append(f"| limit, linear in the size | | {_cells(limit, '.4f')} |")
    lines.append(f"| its standard error | | {_cells(error, '.4f')} |")
    lines += ["", "| element size [m] | pin fit [N m/rad] | lowest | highest |", "|---" * 4 + "|"]
    lines += [f"| {size:g} | {_cells(fit, '.3g')} |" for size, fit in fits.items()]
    limit, error = mesh_limit(tuple(fits), np.array(list(fits.values())))
    lines.append(f"| limit, linear in the size | {_cells(limit, '.3g')} |")
    lines.append(f"| its standard error | {_cells(error, '.1g')} |")
    return lines


def _cells(values: NDArray[np.float64], form: str) -> str:
    return " | ".join(format(value, form) for value in values)


def main(
    *,
    out: Path,
    curve_sizes: Sequence[float] = CURVE_SIZES,
    fit_sizes: Sequence[float] = FIT_SIZES,
) -> None:
    """Compute curves and pin fit at each size; write mesh_limit.md.

    Parameters
    ----------
    out
        Folder.
    curve_sizes, fit_sizes
        Element edge lengths [m] of the curves and of the pin fit, three or more.
    """
    folder = prepared_folder(out)
    deflection = derived_facts().common_deflection_per_torque
    if deflection is None:
        raise ValueError("table 4 has no rim deflection that all load cases share")
    stage = read_parameters(None)
    fits = {size: fits_of_table_4(static_family(stage, size)[0], deflection) for size in fit_sizes}
    study = check_mesh_convergence.main(stage, tuple(curve_sizes))
    write_table(folder / "mesh_limit.md", limit_table(study, fits))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

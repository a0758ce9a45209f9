"""The carrier as drawn by two finite element codes, at the limit of fine meshes.

    python -m studies.tabulate_independent_carrier --out independent_carrier

writes independent_carrier.md: orders of the rim under torque by the project's tetrahedra and by
CalculiX's wedges (:mod:`validation.independent_carrier`), with no pins, with bonded pins (shaft
face held node by node) and with pins of a fit (shaft face held by its mean motion). A good answer:
the limits differ by about 1 %. CalculiX (``ccx``) is needed.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.mesh_limits import mesh_limit
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.workflows.fe.study_pin_fit import static_family
from carrierflex.workflows.main_job import check_mesh_convergence
from carrierflex.workflows.outputs import prepared_folder
from studies.case_files import write_table
from validation.independent_carrier.curves import ORDERS, Carrier, TruthCarrier

#: Element sizes [m] of the project's mesh and of the stack of wedges, which is finer at its edges.
SIZES = (0.03, 0.025, 0.02)
WEDGE_SIZES = (0.06, 0.045, 0.03)
#: Fits of the pins [N m/rad].
FITS = (1e6, 1e7, 3e7, 1e8)
#: Orders of the rim.
_COMPARED = (3, 6)


def our_orders(sizes: Sequence[float]) -> NDArray[np.float64]:
    """Amplitudes [m per kN m], shape (n_sizes, 2, 2 + n_fits): no pins, bonded pins, fits."""
    stage = read_parameters(None)
    study = check_mesh_convergence.main(stage, tuple(sizes))
    rows = []
    for size, flexible, stiff in zip(sizes, study.flexible, study.stiff, strict=True):
        family = static_family(stage, size)[0]
        curves = [family.curve(fit).axial_order_content()[list(_COMPARED)] for fit in FITS]
        rows.append(np.array([flexible, stiff, *curves]).T)
    return np.array(rows)


def wedge_orders(sizes: Sequence[float]) -> NDArray[np.float64]:
    """The same by CalculiX."""
    compared = np.isin(ORDERS, _COMPARED)
    rows = []
    for size in sizes:
        truth = TruthCarrier(Carrier(), size)
        pin = truth.pin_stiffness()
        by_pilot = truth.flexible(clamped=False)
        curves = [truth.flexible().without_pins(), truth.bonded()]
        curves += [by_pilot.with_pins(pin, fit) for fit in FITS]
        rows.append(np.abs(curves)[:, 0, compared].T)
    return np.array(rows)


def comparison_table(
    sizes: tuple[Sequence[float], Sequence[float]],
    orders: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> list[str]:
    """Table of both codes' orders [um per kN m] by size, their limits and the difference."""
    pins = ("none", "bonded", *(f"{fit:.0e} N m/rad" for fit in FITS))
    names = [f"{pin}, order {order}" for order in _COMPARED for pin in pins]
    heads = [
        f"{code} {size:g} m"
        for code, code_sizes in zip(_CODES, sizes, strict=True)
        for size in code_sizes
    ]
    columns = ["pins", *heads, *(f"{code}, limit" for code in _CODES), "difference [%]"]
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    by_code = [1e6 * amplitudes.reshape(len(amplitudes), -1) for amplitudes in orders]
    limits = [
        mesh_limit(code_sizes, values) for code_sizes, values in zip(sizes, by_code, strict=True)
    ]
    for k, name in enumerate(names):
        cells = [f"{row[k]:.4f}" for values in by_code for row in values]
        cells += [f"{limit[k]:.4f} ± {error[k]:.4f}" for limit, error in limits]
        (ours, _), (theirs, _) = limits
        lines.append(f"| {' | '.join([name, *cells, f'{100.0 * (theirs / ours - 1.0)[k]:.1f}'])} |")
    return lines


_CODES = ("tetrahedra", "wedges")


def main(*, out: Path) -> None:
    """Compute both codes' orders at three sizes each; write independent_carrier.md.

    Parameters
    ----------
    out
        Folder.
    """
    folder = prepared_folder(out)
    orders = our_orders(SIZES), wedge_orders(WEDGE_SIZES)
    lines = comparison_table((SIZES, WEDGE_SIZES), orders)
    write_table(folder / "independent_carrier.md", lines)


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

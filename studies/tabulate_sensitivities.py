"""Derivatives of the torque curves by every dimension beside differences of remeshed carriers.

    python -m studies.tabulate_sensitivities --out sensitivities --variant flexible

writes sensitivities_flexible.md: orders N and 2 N of the torque curve under tangential pin loads,
their derivative on one mesh and the difference of two new meshes of the dimension 5 % smaller and
greater (less where 5 % is no carrier), both at the limit of fine meshes by a straight line in the
size. New meshes differ in every node, so that their differences scatter, by about the same
amplitude whatever the dimension: the standard error is pooled over the dimensions. A good answer:
the two agree within it. The derivative on one mesh scatters far less.
"""

import contextlib
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.carrier_curves import UNIT_TORQUE
from carrierflex.fe.half_sector_curve import half_sector_curve
from carrierflex.fe.load_cases import bonded_pin_load, gear_forces, simply_supported_pin_load
from carrierflex.fe.mesh_limits import mesh_limit
from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData
from carrierflex.geometry.shape_velocity import dimension_value, with_step
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.carrier_sensitivities import curve_sensitivities, parametric_problem
from carrierflex.workflows.main_job.check_mesh_convergence import study_orders
from carrierflex.workflows.outputs import prepared_folder
from studies.case_files import write_table

SIZES = (0.03, 0.025, 0.02)
#: Shares of a dimension to change it by, the first that leaves a carrier.
CHANGES = (0.05, 0.02, 0.01)
#: Dimensions that move nodes and no face.
NO_FACES = ("carrier.sensor_radius", "carrier.upwind_bearing_width", "pin.bearing_width")

#: Diameter of the hub [m]: the default one leaves the pin holes no room for 5 %.
HUB = 0.42

Variant = Literal["flexible", "stiff"]


@dataclass(frozen=True, eq=False)
class Comparison:
    """One dimension's derivatives of both orders at the limit [m per kN m and m], shape (2,)."""

    dimension: str
    span: float
    """From the smaller to the greater dimension [m]."""
    on_one_mesh: NDArray[np.float64]
    remeshed: NDArray[np.float64]
    scatter: NDArray[np.float64]
    """Standard error of the remeshed difference's limit by its own line [m per kN m]."""


def half_of(variant: Variant, stage: StageParameters, size: float) -> TetMesh:
    """Half sector of a variant."""
    if variant == "flexible":
        return flexible_half_sector(stage.carrier, size)
    return stiff_half_sector(stage.carrier, stage.pin, size)


def remeshed_orders(variant: Variant, stage: StageParameters, size: float) -> NDArray[np.float64]:
    """Signed amplitudes [m per kN m] of orders N and 2 N on a mesh of these dimensions."""
    n = stage.carrier.n_planets
    force = gear_forces(UNIT_TORQUE, stage.gear, n).F_PLC
    load = (
        simply_supported_pin_load(1, force, 0.0, stage.carrier)
        if variant == "flexible"
        else bonded_pin_load(1, force, 0.0, n)
    )
    curve = half_sector_curve(half_of(variant, stage, size), stage.carrier, load)
    return np.array([curve.axial_order(order).imag for order in study_orders(n)])


def comparisons(variant: Variant, sizes: Sequence[float]) -> Iterator[Comparison]:
    """Every dimension that moves a face, one after the other."""
    # Spur gears: the pins carry tangential forces alone.
    stage = StageParameters(
        carrier=CarrierParameters(hub_outer_diameter=HUB), gear=replace(GearData(), helix_angle=0.0)
    )
    orders = study_orders(stage.carrier.n_planets)
    one_mesh: dict[str, list[NDArray[np.float64]]] = {}
    for size in sizes:
        problem = parametric_problem(half_of(variant, stage, size), stage)
        curve = next(iter(curve_sensitivities(problem).values()))
        derivatives = np.array([curve.order_derivative(order).imag for order in orders])
        for change, value in zip(problem.changes, derivatives.T, strict=True):
            if change.cause.unit == "m":
                one_mesh.setdefault(change.cause.name, []).append(value)
    for dimension in one_mesh:
        print(dimension, file=sys.stderr)
        if dimension in NO_FACES:
            continue
        share, difference = _remeshed(variant, stage, dimension, sizes)
        span = 2.0 * share * dimension_value(stage, dimension)
        limit, scatter = mesh_limit(sizes, difference)
        on_one_mesh, _ = mesh_limit(sizes, np.array(one_mesh[dimension]))
        yield Comparison(dimension, span, on_one_mesh, limit / span, scatter)


def _remeshed(
    variant: Variant, stage: StageParameters, dimension: str, sizes: Sequence[float]
) -> tuple[float, NDArray[np.float64]]:
    """Share that a dimension is changed by either way, and what changes of the orders, by size."""
    value = dimension_value(stage, dimension)
    for share in CHANGES:
        with contextlib.suppress(ValueError):
            high, low = (with_step(stage, dimension, sign * share * value) for sign in (1.0, -1.0))
            return share, np.array(
                [
                    remeshed_orders(variant, high, size) - remeshed_orders(variant, low, size)
                    for size in sizes
                ]
            )
    raise ValueError(f"{dimension} cannot be changed by {CHANGES[-1]:.0%}")


def comparison_lines(rows: Sequence[Comparison]) -> list[str]:
    """Table as Markdown [nm per kN m and mm], and the differences over the standard error."""
    pooled = np.sqrt(np.mean([row.scatter**2 for row in rows], axis=0))
    lines = [
        "| dimension | order | on one mesh | remeshed | standard error | difference over it |",
        "|---" * 6 + "|",
    ]
    for row in rows:
        error = pooled / row.span
        over = np.abs(row.on_one_mesh - row.remeshed) / error
        for i, order in enumerate(("N", "2 N")):
            numbers = (row.on_one_mesh[i], row.remeshed[i], error[i])
            cells = " | ".join(f"{1e6 * number:.3f}" for number in numbers)
            lines.append(f"| {row.dimension} | {order} | {cells} | {over[i]:.1f} |")
    return lines


def main(*, out: Path, variant: Variant, sizes: Sequence[float] = SIZES) -> None:
    """Compare derivatives on one mesh with differences of new meshes; write a table.

    Parameters
    ----------
    out
        Folder.
    variant
        Carrier without pins (flexible) or with bonded pins (stiff).
    sizes
        Element edge lengths [m], three or more.
    """
    folder = prepared_folder(out)
    rows = list(comparisons(variant, sizes))
    write_table(folder / f"sensitivities_{variant}.md", comparison_lines(rows))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

"""What will long work cost? Degrees of freedom, memory and time, told before it begins.

Degrees of freedom are those of the mesh itself, which costs little of the work behind it. Where
they would be more than 400 000, or 40 000 of a CAD model, a coarser mesh is counted and scaled by
volume V, surface A and edge length h: ``n = c3 V / h³ + c2 A / h²``, fitted to the default bodies
at h = 22 and 16 mm.

Memory and processor time follow from n. Measured on one busy thread with MKL, nine pilots, 20
modes, certificate and program start included; memory above the program's own 0.25 GB. The seconds
are those of a processor on which the small factorisation of :func:`slowness` takes 0.09 s; they are
previewed times what it takes here and now, with the library that is installed. n is that of the
whole body where its half sector serves ("by symmetry").

======== ========= ============== ========= ============== ============== ===============
n        curves, s curves, GB     reduce, s reduce, GB     by symmetry, s by symmetry, GB
======== ========= ============== ========= ============== ============== ===============
34 434   1.3       0.22                                    10.5           0.22
39 291                            23.7      0.59
125 946  6.7       0.91                                    20.4           0.53
193 440                           96.1      2.53
329 634  51        3.04           197       4.01           60             1.33
======== ========= ============== ========= ============== ============== ===============

39 291 and 193 440 unknowns are those of CAD models, 125 946 by symmetry of the default carrier. The
other times are wall times of an earlier measurement times 2.22, plus 12 s of a CAD model and 5 s by
symmetry for the program's start and the mesh, by which those three differ from it. They hold
between the points by power laws, beyond them by the last one. A reduction's time grows with the
number of modes.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from rich.console import Console

from carrierflex.fe.factorisation import factorise
from carrierflex.geometry.cad_mesh import step_volume_and_area
from carrierflex.geometry.cad_surface_files import read_cad_statements
from carrierflex.geometry.given_meshes.named_solids import GivenMesh
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.quality import mesh_quality
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets
from carrierflex.workflows.fe.bodies import body_mesh
from carrierflex.workflows.geometry.carrier_files import CarrierFiles

#: c3 and c2 of the formula above; the main shaft's elements are long along its axis.
_DOFS = {"carrier": (12.6, 21.0), "pin": (8.7, 30.7), "main_shaft": (7.6, 39.0)}
#: The same of a CAD model, whose coarser mesh holds what finer edges add.
_CAD_DOFS = (12.6, 17.4)
#: Edge length of the mesh that volume and surface are measured on [m].
_COARSE = 0.06
#: Largest estimate for which the mesh is made and counted.
_MOST_COUNTED = 400_000
#: The same of a CAD model, by the formula: elements at its inner edges are finer, and it has up to
#: four times as many.
_MOST_COUNTED_CAD = 40_000
#: Largest elements of a CAD model that are counted [m].
_COARSE_CAD = 0.1
_CURVES = {
    "n": (34434, 125946, 329634),
    "seconds": (1.3, 6.7, 51.0),
    "gigabytes": (0.22, 0.91, 3.04),
}
_REDUCTION = {
    "n": (39291, 193440, 329634),
    "seconds": (23.7, 96.1, 197.0),
    "gigabytes": (0.59, 2.53, 4.01),
}
_BY_SYMMETRY = {
    "n": (34434, 125946, 329634),
    "seconds": (10.5, 20.4, 60.0),
    "gigabytes": (0.22, 0.53, 1.33),
}
#: Nodes along each edge of the block that is factorised for the speed of the machine, times that it
#: is (the first loads the library), and how long it took where the table was measured [s].
_NODES, _TRIALS, _MEASURED_FACTORISATION = 12, 3, 0.09
#: Memory of the program without any mesh [GB].
_PROGRAM = 0.25
#: Modes of the measured reductions, and the share of the time that grows with their number.
_MEASURED_MODES, _MODES_SHARE = 20, 0.5


@dataclass(frozen=True)
class CostPreview:
    """Estimated cost of one piece of work."""

    work: str
    n_dofs: int
    memory_gb: float
    seconds: float  # Of the processor, at the speed that it has as the preview is made

    def __str__(self) -> str:
        duration = (
            f"{max(self.seconds, 1.0):.0f} s"
            if self.seconds < 90.0
            else f"{self.seconds / 60.0:.0f} min"
        )
        return (
            f"{self.work}: about {self.n_dofs:,} degrees of freedom, {self.memory_gb:.1f} GB, "
            f"{duration} of processor time"
        )


def curves_cost(stage: StageParameters, size: float, files: CarrierFiles) -> CostPreview:
    """Cost of the deflection curves of both variants.

    One after the other, so memory is that of the larger one.
    """
    each = [
        estimated_dofs(f"{variant}_carrier", stage, size, files)
        for variant in ("flexible", "stiff")
    ]
    seconds = slowness() * sum(_at(_CURVES["n"], _CURVES["seconds"], n) for n in each)
    # The first variant's mesh and matrices are kept while the second is solved.
    memory = _PROGRAM + _at(_CURVES["n"], _CURVES["gigabytes"], max(each))
    return CostPreview("deflection curves", max(each), memory, seconds)


def reduction_cost(
    name: str,
    stage: StageParameters,
    size: float,
    *,
    n_modes: int | None,
    files: CarrierFiles,
    by_symmetry: bool = False,
) -> CostPreview:
    """Cost of reducing the body `name` to its pilots and `n_modes` modes, with certificate.

    None stands for the number of the measured reductions.
    """
    n = estimated_dofs(name, stage, size, files)
    modes = _MEASURED_MODES if n_modes is None else n_modes
    share = 1.0 - _MODES_SHARE + _MODES_SHARE * modes / _MEASURED_MODES
    measured = _BY_SYMMETRY if by_symmetry else _REDUCTION
    memory = _PROGRAM + _at(measured["n"], measured["gigabytes"], n)
    work = f"reduction of {name}" + (" by symmetry" if by_symmetry else "")
    seconds = share * slowness() * _at(measured["n"], measured["seconds"], n)
    return CostPreview(work, n, memory, seconds)


def estimated_dofs(name: str, stage: StageParameters, size: float, files: CarrierFiles) -> int:
    """Degrees of freedom of the body `name` meshed with elements of `size` [m].

    Those of a mesh file are counted.
    """
    variant = name.removesuffix("_carrier")
    if variant in files.meshes:
        return _n_dofs(files.mesh(variant, size))
    if files.step is not None and files.surfaces is not None:
        statements = read_cad_statements(files.surfaces)
        solid = step_volume_and_area(files.step, statements, pins=variant == "stiff")
        estimate = partial(_formula, *_CAD_DOFS, *solid)
        counted_size = _counted_size(estimate, size, _MOST_COUNTED_CAD, _COARSE_CAD)
        counted = _n_dofs(files.mesh(variant, counted_size))
        return round(counted * estimate(size) / estimate(counted_size))
    coarse = body_mesh(name, stage, max(size, _COARSE))
    if size >= _COARSE:
        return _n_dofs(coarse)
    coefficients = _DOFS["carrier" if name.endswith("_carrier") else name]
    estimate = partial(_formula, *coefficients, *_volume_and_area(coarse))
    counted_size = _counted_size(estimate, size, _MOST_COUNTED, _COARSE)
    counted = _n_dofs(body_mesh(name, stage, counted_size))
    return round(counted * estimate(size) / estimate(counted_size))


def _counted_size(
    estimate: Callable[[float], int], size: float, most: int, coarsest: float
) -> float:
    """Edge length [m] from `size` on at which an estimate is low enough for a mesh to be made."""
    while estimate(size) > most and size < coarsest:
        size = min(coarsest, 1.05 * size)
    return size


def slowness() -> float:
    """Processor time of a small sparse factorisation over that where the work was measured."""
    line = sp.diags_array([1.0, 4.0, 1.0], offsets=[-1, 0, 1], shape=(_NODES, _NODES))
    grid = sp.kron(sp.kron(line, line), line)
    # Every node is coupled to its 26 neighbours by three displacements, as in a solid.
    A = sp.csr_array(sp.kron(grid, np.eye(3) + 1.0))
    seconds = []
    for _ in range(_TRIALS):
        begin = time.process_time()
        factorise(A)
        seconds.append(time.process_time() - begin)
    return min(seconds) / _MEASURED_FACTORISATION


def tell(preview: Callable[[], CostPreview], *, quiet: bool) -> None:
    """Say the preview on a terminal, before the work it is about; elsewhere it is not made."""
    if not quiet and sys.stderr.isatty():
        Console(stderr=True, highlight=False).print(str(preview()))


def _n_dofs(mesh: GivenMesh) -> int:
    return 3 * len(mesh.points)


def _formula(c3: float, c2: float, volume: float, area: float, size: float) -> int:
    return round(c3 * volume / size**3 + c2 * area / size**2)


def _volume_and_area(mesh: TetMesh) -> tuple[float, float]:
    """Volume [m^3], and surface of the flat triangles of the boundary [m^2]."""
    corners = mesh.points[boundary_facets(mesh.tets)[:, :3]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return mesh_quality(mesh).volume, float(np.linalg.norm(normals, axis=1).sum() / 2.0)


def _at(n: tuple[float, ...], measured: tuple[float, ...], wanted: int) -> float:
    """Measured value at `wanted` degrees of freedom."""
    x, y = np.log(n), np.log(measured)
    slopes: NDArray[np.float64] = np.diff(y) / np.diff(x)
    at = np.log(max(wanted, 1))
    piece = int(np.clip(np.searchsorted(x, at) - 1, 0, len(slopes) - 1))
    return float(np.exp(y[piece] + slopes[piece] * (at - x[piece])))

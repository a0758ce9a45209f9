"""Curved elements about the small features of a CAD solid, in as many passes as they take.

A coarse second-order element that bends round a bolt hole or a fillet turns inside out. Where a
mesh of one size has such elements, the next pass makes them as small as the curvature asks for and
gmsh moves the nodes of what is still distorted (its high-order optimisation); further passes halve
the elements there.
"""

import logging
from dataclasses import dataclass, field

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from carrierflex.geometry.cad_faces import CadFace
from carrierflex.geometry.cad_recognition.inner_edges import grade_towards, reentrant_edges
from carrierflex.geometry.cad_recognition.quarter_points import draw_towards
from carrierflex.geometry.half_sector import MeshingError

log = logging.getLogger(__name__)

#: Passes at most, and gmsh's minSJ (smallest scaled Jacobian determinant) above which all is well.
MOST_PASSES, LEAST_QUALITY = 4, 0.1
#: Elements around a full turn of a curved face.
_ELEMENTS_AROUND = 8
#: Smallest element over the size asked for: what curvature and refinement may ask for.
_SMALLEST = 1.0 / 8.0
#: Elements within so many of its own sizes of a bad one are made smaller with it.
_REACH = 2.0
_TET10 = 11
#: gmsh's algorithms: the fast one, which fails on some graded surfaces, and the sturdy one.
HXT, DELAUNAY = 10, 1
#: Bad faces that a refusal names.
_SHOWN = 6


@dataclass
class _Refinement:
    """Places where elements have to be smaller than the curvature asks for."""

    size: float
    centres: list[NDArray[np.float64]] = field(default_factory=list)
    sizes: list[float] = field(default_factory=list)
    tree: cKDTree | None = None

    def add(self, centres: NDArray[np.float64], sizes: NDArray[np.float64]) -> None:
        """Halve the elements about these centres [m], which are so large [m] now."""
        self.centres += list(centres)
        self.sizes += [max(0.5 * size, _SMALLEST * self.size) for size in sizes]
        self.tree = cKDTree(np.array(self.centres))

    def __call__(self, dim: int, tag: int, x: float, y: float, z: float, lc: float) -> float:
        """Element size [m] at a point, as gmsh asks for it."""
        if self.tree is None:
            return lc
        near = self.tree.query_ball_point([x, y, z], _REACH * 2.0 * max(self.sizes))
        centre = np.array([x, y, z])
        for i in near:
            reach = _REACH * 2.0 * self.sizes[i]
            if float(np.linalg.norm(self.centres[i] - centre)) < reach:
                lc = min(lc, self.sizes[i])
        return lc


@dataclass(frozen=True)
class EdgeGrading:
    """How elements follow the singular stress at re-entrant edges.

    Parameters
    ----------
    finer : float
        How many times smaller elements are there, more than 1.
    reach : float
        Distance at which they have their full size [m].
    """

    finer: float
    reach: float


class GmshFailureError(MeshingError):
    """Gmsh makes no mesh; it meshes nothing more before it is opened anew."""


class CoarseMeshError(GmshFailureError):
    """The first mesh fails: its surfaces may cut one another beside a small feature."""


def mesh_until_sound(
    what: str,
    size: float,
    faces: tuple[CadFace, ...],
    *,
    first_pass: int = 1,
    algorithm: int = HXT,
    at_inner_edges: EdgeGrading | None = None,
) -> None:
    """Mesh gmsh's current model with quadratic tetrahedra none of which is distorted.

    Parameters
    ----------
    what : str
        The model, for messages.
    size : float
        Largest edge length [m].
    faces : tuple of CadFace
        Its faces, for messages.
    first_pass : int
        1: a mesh of one size; 2: elements as small as the curvature asks for.
    algorithm : int
        gmsh's number of the one that fills the volume.
    at_inner_edges : EdgeGrading, optional
        Elements at re-entrant edges are smaller from the first pass on, and their mid-side nodes
        are drawn towards the edge at the end; None: a mesh of one size.

    Raises
    ------
    CoarseMeshError, GmshFailureError
        Where gmsh fails in the first pass, or in a later one.
    MeshingError
        Where an element's minSJ is not above 0.1 after four passes; the message
        names the faces that bad elements lie on.
    """
    refinement = _Refinement(size)
    for option in ("Mesh.MeshSizeMin", "Mesh.MeshSizeMax"):
        gmsh.option.setNumber(option, size)
    gmsh.option.setNumber("Mesh.Algorithm3D", algorithm)
    gmsh.option.setNumber("Mesh.HighOrderThresholdMin", 2.0 * LEAST_QUALITY)
    edges = [] if at_inner_edges is None else reentrant_edges()
    if at_inner_edges is not None:
        grade_towards(edges, size, size / at_inner_edges.finer, at_inner_edges.reach)
    if algorithm == DELAUNAY:
        # Beside small holes facets may overlap where their circles' sizes go no further.
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
    if first_pass > 1:
        _follow_curvature(refinement)
    for number in range(first_pass, MOST_PASSES + 1):
        try:
            _meshed_once(optimise=number > 1)
        except Exception as error:
            kind = CoarseMeshError if number == 1 else GmshFailureError
            raise kind(f"gmsh could not mesh {what} at size {size} m: {error}") from error
        tags, quality = _qualities()
        # A mesh of one size that inverts no element stays as it is: its slivers are straight.
        bad = quality <= LEAST_QUALITY
        log.info("%s: pass %d, worst minSJ %.3f, %d bad", what, number, quality.min(), bad.sum())
        if not bad.any():
            n_drawn = draw_towards(edges, LEAST_QUALITY)
            log.info("%s: %d mid-side nodes drawn to %d edges", what, n_drawn, len(edges))
            return
        if number == 1:
            _follow_curvature(refinement)
        else:
            refinement.add(*_centres_and_edges(tags[bad]))
    raise MeshingError(
        f"{what}: after {MOST_PASSES} passes from size {size} m {int(bad.sum())} of {len(tags)} "
        f"elements have a scaled Jacobian (minSJ) of {quality.min():.3f} to {LEAST_QUALITY}, on "
        f"{_touched(tags[bad], faces)}; expected more than {LEAST_QUALITY}: choose a smaller size, "
        "or leave small holes out ([mesh] leave_out_holes_below)"
    )


def _follow_curvature(refinement: _Refinement) -> None:
    """Let the next pass make elements as small as the curvature asks for."""
    gmsh.option.setNumber("Mesh.MeshSizeMin", _SMALLEST * refinement.size)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _ELEMENTS_AROUND)
    gmsh.model.mesh.setSizeCallback(refinement)


def _meshed_once(*, optimise: bool) -> None:
    if optimise:
        gmsh.model.mesh.clear()
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    if optimise and _qualities()[1].min() <= LEAST_QUALITY:
        # Where it improves too little gmsh throws out of a parallel region, which ends the process;
        # what it could not improve is judged after it anyway.
        abort_on_error = gmsh.option.getNumber("General.AbortOnError")
        gmsh.option.setNumber("General.AbortOnError", 0)
        gmsh.model.mesh.optimize("HighOrder")
        gmsh.option.setNumber("General.AbortOnError", abort_on_error)


def _qualities() -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Tags and minSJ of all quadratic tetrahedra."""
    tags = np.asarray(gmsh.model.mesh.getElementsByType(_TET10)[0], dtype=np.int64)
    return tags, np.asarray(gmsh.model.mesh.getElementQualities(tags, "minSJ"))


def _centres_and_edges(tags: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres (n, 3) and mean edges (n,) of elements [m]."""
    corners = np.array([_corners(int(tag)) for tag in tags])
    edges = [corners[:, i] - corners[:, j] for i in range(4) for j in range(i)]
    return corners.mean(axis=1), np.mean(np.linalg.norm(edges, axis=2), axis=0)


def _corners(tag: int) -> NDArray[np.float64]:
    nodes = gmsh.model.mesh.getElement(tag)[1][:4]
    return np.array([gmsh.model.mesh.getNode(node)[0] for node in nodes])


def _touched(tags: NDArray[np.int64], faces: tuple[CadFace, ...]) -> str:
    """Faces that these elements have nodes on, in words."""
    nodes = {int(node) for tag in tags for node in gmsh.model.mesh.getElement(int(tag))[1]}
    touched = []
    for face in faces:
        on_face = gmsh.model.mesh.getNodes(2, face.tag, includeBoundary=True)[0]
        if nodes & set(on_face.tolist()):
            touched.append(f"face {face.tag} ({face})")
    shown = "; ".join(touched[:_SHOWN]) or "no face"
    return shown + (f"; and {len(touched) - _SHOWN} more" if len(touched) > _SHOWN else "")

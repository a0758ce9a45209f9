"""Contact channels: the few motions whose forces are not constant springs - meshes, mount, bearings with clearance."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry.parameters import N_PINS
from simulation.stage.effects import StageEffects
from simulation.stage.gear_meshes import FlankLine, MeshStiffness, flank_line, mesh_stiffness
from simulation.stage.places import Places
from simulation.stage.springs import Spring

#: Channel 0 is the carrier angle: the mesh stiffness depends on it, and answers with a torque.
ANGLE = 0


@dataclass(frozen=True, eq=False)
class Channels:
    """Columns ``B`` of the channels, ``delta = Bᵀ c - free``, and what each needs.

    Order: carrier angle; six drive flanks (sun 1-3, ring 1-3); six back flanks; six motions of the housing; two a bearing
    with clearance.

    Parameters
    ----------
    B : ndarray, shape (n, m)
        Columns of the channels in the coordinates c.
    free : ndarray, shape (m,)
        Offset of each channel.
    reference : ndarray, shape (m,)
        Stiffness that the linear part of the equations already has [N/m].
    lines : tuple of FlankLine
        The twelve flanks.
    stiffness : tuple of MeshStiffness
        Of the six meshes, sun 1-3, ring 1-3.
    K_mount, C_mount, K_mean, C_mean : ndarray, shape (6, 6)
        Mount in the fixed frame, and what the linear part has of it.
    clearance : ndarray, shape (k,)
        Radial play [m] of each bearing with clearance.
    bearings : tuple of str
        Their names.
    mesh_teeth : int
        Mesh periods a turn of the carrier.
    """

    B: NDArray[np.float64]
    free: NDArray[np.float64]
    reference: NDArray[np.float64]
    lines: tuple[FlankLine, ...]
    stiffness: tuple[MeshStiffness, ...]
    K_mount: NDArray[np.float64]
    C_mount: NDArray[np.float64]
    K_mean: NDArray[np.float64]
    C_mean: NDArray[np.float64]
    clearance: NDArray[np.float64]
    bearings: tuple[str, ...]
    mesh_teeth: int

    @property
    def meshes(self) -> slice:
        """Channels of the flanks."""
        return slice(1, 1 + len(self.lines))

    @property
    def housing(self) -> slice:
        """Channels of the housing's motion."""
        return slice(self.meshes.stop, self.meshes.stop + 6)

    @property
    def plays(self) -> slice:
        """Channels of the bearings with clearance."""
        return slice(self.housing.stop, self.housing.stop + 2 * len(self.bearings))


def stage_channels(
    places: Places,
    effects: StageEffects,
    springs: Mapping[str, Spring],
    mount: tuple[NDArray[np.float64], NDArray[np.float64]],
    mean_mount: tuple[NDArray[np.float64], NDArray[np.float64]],
    L: NDArray[np.float64],
) -> Channels:
    """Channels of a stage; `mount` and `mean_mount` are stiffness and damping, `L` as in :class:`StageModel`."""
    lines, stiffness = _meshes(places, effects)
    loose = tuple(name for name, spring in springs.items() if spring.clearance > 0.0)
    n_lines = len(lines)
    rows = np.zeros((1 + n_lines + 6 + 2 * len(loose), places.n))
    rows[1 : 1 + n_lines] = [_approach_row(places, line) for line in lines]
    rows[1 + n_lines + np.arange(6), places.rows["housing"]] = 1.0
    free, reference = np.zeros(len(rows)), np.zeros(len(rows))
    reference[1 : 1 + len(stiffness)] = [own.mean for own in stiffness]
    for k, name in enumerate(loose):
        own = 1 + n_lines + 6 + 2 * k + np.arange(2)
        rows[own] = springs[name].G[1:3]
        free[own], reference[own] = springs[name].free[1:3], springs[name].stiffness[1:3]
    B = L.T @ rows.T
    # Flanks and clearances do not see the drive motion; what rounding leaves of it would grow with the angle.
    B[0] = 0.0
    B[0, ANGLE] = 1.0
    clearance = np.array([springs[name].clearance for name in loose])
    return Channels(
        B, free, reference, lines, stiffness, *mount, *mean_mount, clearance, loose, places.data.gear.ring_teeth
    )


def _meshes(places: Places, effects: StageEffects) -> tuple[tuple[FlankLine, ...], tuple[MeshStiffness, ...]]:
    gear, data, x = places.data.gear, places.data.mesh, places.data.planet.x
    order = [(mate, planet) for mate in ("sun", "ring") for planet in range(1, N_PINS + 1)]
    lines = tuple(
        flank_line(mate, planet, gear, x=x, back=back, gap=data.backlash if back else 0.0)
        for back in (False, True)
        for mate, planet in order
    )
    factors = {"sun": effects.sun_mesh_factor, "ring": effects.ring_mesh_factor}
    stiffness = tuple(
        MeshStiffness(mesh_stiffness(mate, planet, gear, data).amplitudes * factors[mate][planet - 1])
        for mate, planet in order
    )
    return lines, stiffness


def _approach_row(places: Places, line: FlankLine) -> NDArray[np.float64]:
    """Approach ``n · (u_mate - u_planet)`` at the pitch point, shape (n,)."""
    mate, planet = places.part_motion(line.mate, line.point), places.part_motion(f"planet_{line.planet}", line.point)
    return line.normal @ (mate[:3] - planet[:3])

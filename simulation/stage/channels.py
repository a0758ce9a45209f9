"""Contact channels: the few motions whose forces are not constant springs.

Meshes, mount and bearings with clearance.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import GearData
from carrierflex.simulation.stage.coordinate_layout import CoordinateLayout, motion_at
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.gear_meshes import (
    FlankLine,
    MeshStiffness,
    face_slices,
    flank_line,
    mesh_stiffness,
)
from carrierflex.simulation.stage.roller_bearing import no_rollers, roller_set
from carrierflex.simulation.stage.roller_contact import RollerSet
from carrierflex.simulation.stage.springs import Spring, unequal_bearings

#: Channel 0 is the carrier angle: the mesh stiffness depends on it, and answers with a torque.
ANGLE = 0
#: Rows of a planet bearing's spring that its rollers take over: y, z and the tilts.
ROLLING_ROWS = [1, 2, 4, 5]
#: Damping of the sun's spline where it rubs, over the critical one of the sun on its quill. The
#: spline's law is that of an offset that is slow beside the sun's turning: at its natural frequency
#: it would drive the sun with up to 0.49 k across the offset. Chosen: twice what stops it.
_SPLINE, _SPLINE_DAMPING = "damping of the sun's spline", 1.0


@dataclass(frozen=True, eq=False)
class Channels:
    """Columns ``B`` of the channels, ``delta = Bᵀ c - free``, and what each needs.

    Order: carrier angle; two drive flanks a planet (all suns', then all rings'), slice by slice; as
    many coast flanks; six motions of the housing; two a carrier bearing with unequal stiffnesses;
    two a bearing with clearance; four a roller bearing: y, z, ry, rz of planet 1, 2, 3 ... against
    its pin; three where the sun's spline rubs: twist of the sun shaft, sun's y and z.

    Parameters
    ----------
    B : ndarray, shape (n, m)
        Columns of the channels in the coordinates c.
    free : ndarray, shape (m,)
        Offset of each channel.
    reference : ndarray, shape (m,)
        Stiffness that the linear part of the equations already has [N/m].
    lines : tuple of FlankLine
        Four flanks a planet, times the slices over the face width.
    stiffness : tuple of MeshStiffness
        Of the meshes, all suns', then all rings'.
    K_fixed, C_fixed, K_mean, C_mean : ndarray, shape (t, t)
        Stiffness and damping in the fixed frame of what stands still there, and what the linear
        part has of it: t = 6 motions of the housing on its mount, 2 an unequal bearing and 2 a
        spline that rubs.
    clearance : ndarray, shape (k,)
        Radial play [m] of each bearing with clearance.
    bearings : tuple of str
        Their names.
    unequal : tuple of str
        Names of the carrier bearings with unequal stiffnesses, and of the sun's spline where it
        rubs.
    rollers : RollerSet
        Rollers of the planet bearings; no bearings where those are springs.
    splines : ndarray, shape (s, 3)
        Lateral stiffness [N/m], radial clearance [m] and largest friction per twist of the shaft
        [N/rad] of the sun's spline; no row where it does not rub.
    mesh_teeth : int
        Mesh periods a turn of the carrier.
    """

    B: NDArray[np.float64]
    free: NDArray[np.float64]
    reference: NDArray[np.float64]
    lines: tuple[FlankLine, ...]
    stiffness: tuple[MeshStiffness, ...]
    K_fixed: NDArray[np.float64]
    C_fixed: NDArray[np.float64]
    K_mean: NDArray[np.float64]
    C_mean: NDArray[np.float64]
    clearance: NDArray[np.float64]
    bearings: tuple[str, ...]
    unequal: tuple[str, ...]
    rollers: RollerSet
    splines: NDArray[np.float64]
    mesh_teeth: int

    @property
    def labels(self) -> tuple[str, ...]:
        """Every channel in words."""
        flanks = [
            f"{line.mate} mesh of planet {line.planet}, "
            f"{'coast' if 2 * i >= len(self.lines) else 'drive'} flank [m]"
            for i, line in enumerate(self.lines)
        ]
        housing = [
            f"housing {coordinate}"
            for coordinate in ("Tx [m]", "Ty [m]", "Tz [m]", "Rx [rad]", "Ry [rad]", "Rz [rad]")
        ]
        unequal = [f"{name} along {axis} [m]" for name in self.unequal for axis in "yz"]
        clearances = [f"clearance of {name}, {axis}" for name in self.bearings for axis in "yz"]
        rollers = [
            f"rollers of planet {i + 1}, {motion}"
            for i in range(len(self.rollers.directions))
            for motion in ("Ty [m]", "Tz [m]", "Ry [rad]", "Rz [rad]")
        ]
        spline = ("twist of the sun shaft [rad]", "spline of the sun, y", "spline of the sun, z")
        splines = len(self.splines) * spline
        return ("carrier angle [rad]", *flanks, *housing, *unequal, *clearances, *rollers, *splines)

    @property
    def meshes(self) -> slice:
        """Channels of the flanks."""
        return slice(1, 1 + len(self.lines))

    @cached_property
    def shares(self) -> NDArray[np.float64]:
        """Share of its mesh's stiffness that each flank or slice has, shape (n_lines,)."""
        return np.array([line.share for line in self.lines])

    @cached_property
    def gaps(self) -> NDArray[np.float64]:
        """Play of each flank or slice before it touches [m], shape (n_lines,)."""
        return np.array([line.gap for line in self.lines])

    def of_flanks(self, k: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stiffness of every flank or slice [N/m], shape (..., n_lines), from those of meshes."""
        return np.asarray(np.tile(k, len(self.lines) // len(self.stiffness)) * self.shares)

    @property
    def housing(self) -> slice:
        """Channels of the housing's motion."""
        return slice(self.meshes.stop, self.meshes.stop + 6)

    @property
    def turning(self) -> slice:
        """Channels of the housing's motion and of the unequal bearings.

        Their stiffness stands still in the fixed frame.
        """
        return slice(self.housing.start, self.housing.stop + 2 * len(self.unequal))

    def turned(self, angle: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """Matrix R that takes the motions of the turning channels to the fixed frame.

        At carrier angles [rad] of any shape, shape (..., t, t).
        """
        t = len(self.K_fixed)
        R = np.broadcast_to(np.eye(t), (*np.shape(angle), t, t)).copy()
        y = np.array([1, 4, *range(6, t, 2)])
        R[..., y, y] = R[..., y + 1, y + 1] = np.cos(angle)[..., None]
        R[..., y + 1, y] = np.sin(angle)[..., None]
        R[..., y, y + 1] = -R[..., y + 1, y]
        return R

    @property
    def quarter_turn(self) -> NDArray[np.float64]:
        """Matrix J of the turning channels, ``dR/dangle = R J``, shape (t, t)."""
        J = np.zeros_like(self.K_fixed)
        for y in (1, 4, *range(6, len(J), 2)):
            J[y, y + 1], J[y + 1, y] = -1.0, 1.0
        return J

    @property
    def clearances(self) -> slice:
        """Channels of the bearings with clearance."""
        return slice(self.turning.stop, self.turning.stop + 2 * len(self.bearings))

    @property
    def rolling(self) -> slice:
        """Channels of the roller bearings."""
        return slice(self.clearances.stop, self.clearances.stop + 4 * len(self.rollers.directions))

    @property
    def rubbing(self) -> slice:
        """Channels of the sun's spline."""
        return slice(self.rolling.stop, self.rolling.stop + 3 * len(self.splines))


@dataclass(frozen=True, eq=False)
class _FixedPair:
    """Motions y and z of a spring whose stiffness or damping stands still in the fixed frame."""

    spring: Spring
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]


def stage_channels(
    layout: CoordinateLayout,
    effects: StageEffects,
    springs: Mapping[str, Spring],
    mount: tuple[NDArray[np.float64], NDArray[np.float64]],
    mean_mount: tuple[NDArray[np.float64], NDArray[np.float64]],
    L: NDArray[np.float64],
) -> Channels:
    """Channels of a stage; `mount`, `mean_mount` are (K, D); `L` as in :class:`StageModel`."""
    lines, stiffness = _meshes(layout, effects)
    loose = tuple(name for name, spring in springs.items() if spring.clearance > 0.0)
    splines = _splines(layout)
    fixed = {
        name: _FixedPair(springs[name], pair, np.zeros(2))
        for name, pair in unequal_bearings(layout.data.bearings).items()
    }
    if len(splines):
        fixed[_SPLINE] = _spline_damping(layout, springs["sun"])
    n_lines = len(lines)
    rollers = _rollers(layout, effects)
    n_turning = 6 + 2 * len(fixed)
    n_rows = 1 + n_lines + n_turning + 2 * len(loose) + 4 * len(rollers.directions)
    n_rows += 3 * len(splines)
    rows = np.zeros((n_rows, layout.n))
    rows[1 : 1 + n_lines] = [_approach_row(layout, line) for line in lines]
    rows[1 + n_lines + np.arange(6), layout.rows["housing"]] = 1.0
    for i, pair in enumerate(fixed.values()):
        rows[1 + n_lines + 6 + 2 * i + np.arange(2)] = pair.spring.G[1:3]
    free, reference = np.zeros(n_rows), np.zeros(n_rows)
    means = np.tile([mesh.mean for mesh in stiffness], layout.data.mesh.n_slices)
    reference[1 : 1 + n_lines // 2] = means * [line.share for line in lines[: n_lines // 2]]
    # Which rows of which spring each channel that takes over from one has.
    taken = [(springs[name], [1, 2]) for name in loose]
    taken += [(springs[f"planet_{i + 1}"], ROLLING_ROWS) for i in range(len(rollers.directions))]
    if len(splines):
        # The shaft's twist is only read: the linear part keeps its spring.
        twist = replace(springs["sun_shaft"], stiffness=np.zeros(1))
        taken += [(twist, [0]), (springs["sun"], [1, 2])]
    first = 1 + n_lines + n_turning
    for spring, own_rows in taken:
        channels = first + np.arange(len(own_rows))
        rows[channels] = spring.G[own_rows]
        free[channels] = spring.free[own_rows]
        reference[channels] = spring.stiffness[own_rows]
        first += len(own_rows)
    B = L.T @ rows.T
    # Flanks and clearances do not see the drive motion; what rounding leaves of it would grow with
    # the angle.
    B[0] = 0.0
    B[0, ANGLE] = 1.0
    still = np.array([pair.stiffness for pair in fixed.values()]).reshape(-1, 2)
    damping = np.array([pair.damping for pair in fixed.values()]).reshape(-1, 2)
    mean = np.tile(still.mean(axis=1, keepdims=True), 2)
    return Channels(
        B,
        free,
        reference,
        lines,
        stiffness,
        K_fixed=_mount_and(mount[0], still),
        C_fixed=_mount_and(mount[1], damping),
        K_mean=_mount_and(mean_mount[0], mean),
        C_mean=_mount_and(mean_mount[1], np.zeros_like(still)),
        clearance=np.array([springs[name].clearance for name in loose]),
        bearings=loose,
        unequal=tuple(fixed),
        rollers=rollers,
        splines=splines,
        mesh_teeth=layout.data.gear.ring_teeth,
    )


def _mount_and(mount: NDArray[np.float64], pairs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix of the mount (6, 6) and, on the diagonal, of pairs (p, 2)."""
    values = pairs.ravel()
    K = np.zeros((6 + len(values), 6 + len(values)))
    K[:6, :6] = mount
    K[6:, 6:] = np.diag(values)
    return K


def _rollers(layout: CoordinateLayout, effects: StageEffects) -> RollerSet:
    data = layout.data
    if data.planet_rollers is None:
        return no_rollers()
    return roller_set(
        data.planet_rollers,
        data.gear,
        data.bearings.planet_clearance,
        effects.of_planets("planet_bearing_factor", layout.n_planets),
    )


def _splines(layout: CoordinateLayout) -> NDArray[np.float64]:
    """Rows of :attr:`Channels.splines`."""
    bearings, chain = layout.data.bearings, layout.data.chain
    if bearings.sun_friction == 0.0:
        return np.zeros((0, 3))
    friction = bearings.sun_friction * chain.sun_shaft_torsion / bearings.spline_radius
    return np.array([[bearings.sun_radial, bearings.sun_clearance, friction]])


def _spline_damping(layout: CoordinateLayout, spring: Spring) -> _FixedPair:
    """What resists fast motion of a sun whose spline rubs."""
    critical = 2.0 * np.sqrt(layout.data.bearings.sun_radial * layout.data.sun.mass)
    return _FixedPair(spring, np.zeros(2), _SPLINE_DAMPING * critical * np.ones(2))


def _meshes(
    layout: CoordinateLayout, effects: StageEffects
) -> tuple[tuple[FlankLine, ...], tuple[MeshStiffness, ...]]:
    gear = layout.data.gear
    data = layout.data.mesh
    n_planets = layout.n_planets
    lines = _flank_lines(gear, n_planets, layout.data.planet.x, data.backlash, data.n_slices)
    factors = {
        mate: effects.of_planets(f"{mate}_mesh_factor", n_planets) for mate in ("sun", "ring")
    }
    stiffness = tuple(
        MeshStiffness(
            mesh_stiffness(mate, planet, gear, data, n_planets).amplitudes
            * factors[mate][planet - 1]
        )
        for mate, planet in _mesh_order(n_planets)
    )
    return lines, stiffness


def _mesh_order(n_planets: int) -> list[tuple[str, int]]:
    return [(mate, planet) for mate in ("sun", "ring") for planet in range(1, n_planets + 1)]


@lru_cache(maxsize=4)
def _flank_lines(
    gear: GearData, n_planets: int, x: float, backlash: float, n_slices: int
) -> tuple[FlankLine, ...]:
    """Slices of all flanks at x; stages of the same gears, drawn in thousands, share them."""
    drive, coast = (
        [
            face_slices(
                flank_line(mate, planet, gear, n_planets, x=x, coast=coasting, gap=gap),
                gear,
                n_slices,
            )
            for mate, planet in _mesh_order(n_planets)
        ]
        for coasting, gap in ((False, 0.0), (True, backlash))
    )
    return tuple(
        line for side in (drive, coast) for slices in zip(*side, strict=True) for line in slices
    )


def _approach_row(layout: CoordinateLayout, line: FlankLine) -> NDArray[np.float64]:
    """Approach ``n · (u_mate - u_planet)`` at the pitch point, shape (n,)."""
    row = np.zeros(layout.n)
    for body, sign in ((line.mate, 1.0), (f"planet_{line.planet}", -1.0)):
        displacement = motion_at(line.point - layout.centre(body))[:3]
        row[layout.rows[body]] = sign * line.normal @ displacement
    return row

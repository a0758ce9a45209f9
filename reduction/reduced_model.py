"""The reduced body that simulation works with.

Matrices, names of every coordinate, pilots, sensors, mass.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.reduction.ffrf_data import FfrfData

#: Names and units of a pilot's six coordinates.
PILOT_COORDINATES = ("Tx [m]", "Ty [m]", "Tz [m]", "Rx [rad]", "Ry [rad]", "Rz [rad]")
#: Entry of a body's provenance that says how many rigid motions nothing holds, where not all six.
FREE_MOTIONS = "free_rigid_motions"


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Rigid mass properties in the body's frame."""

    mass: float
    """Mass [kg]."""
    centre: NDArray[np.float64]
    """Centre of mass [m], shape (3,)."""
    inertia: NDArray[np.float64]
    """Inertia tensor about the centre of mass [kg m^2], shape (3, 3)."""


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """A reduced elastic body, or several assembled ones.

    Parameters
    ----------
    name : str
        Name of the body.
    K, M, D : ndarray, shape (n, n)
        Stiffness, mass and damping, symmetric, SI.
    labels : tuple of str
        Every coordinate in words, as in ``pin_1_upwind Ty [m]`` or ``mode 3 (812.4 Hz)``.
    pilots : mapping of str to ndarray
        Position [m] of each pilot in the body's frame.
    pilot_coordinates : mapping of str to ndarray of int, shape (6,)
        Rows of each pilot's coordinates; tied pilots share rows. Fewer for a pilot of fewer
        components.
    sensor_names : tuple of str
        Names of the recovery rows.
    sensor_rows : ndarray, shape (n_sensors, n)
        Sensor displacement [m] from the coordinates.
    mass_properties : MassProperties
        Of the body this was reduced from.
    provenance : mapping of str to str
        Inputs and versions that made it.
    ffrf : FfrfData or None
        Inertia invariants in the order of the coordinates; None for an assembly, whose parts tie
        coordinates of bodies that have frames of their own, and for a body that is held to the
        ground or whose mass differs between axes.
    pilot_components : mapping of str to tuple of int
        Components, numbered from 0 in the order of `PILOT_COORDINATES`, of each pilot that has
        fewer than six.

    Raises
    ------
    ValueError
        Where shapes or names contradict each other.
    """

    name: str
    K: NDArray[np.float64]
    M: NDArray[np.float64]
    D: NDArray[np.float64]
    labels: tuple[str, ...]
    pilots: Mapping[str, NDArray[np.float64]]
    pilot_coordinates: Mapping[str, NDArray[np.int64]]
    sensor_names: tuple[str, ...]
    sensor_rows: NDArray[np.float64]
    mass_properties: MassProperties
    provenance: Mapping[str, str] = field(default_factory=dict)
    ffrf: FfrfData | None = None
    pilot_components: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.labels)
        for letter, matrix in (("K", self.K), ("M", self.M), ("D", self.D)):
            if matrix.shape != (n, n):
                raise ValueError(
                    f"{self.name}: {letter} has shape {matrix.shape}; expected ({n}, {n}), one row "
                    "a label"
                )
        if self.sensor_rows.shape != (len(self.sensor_names), n):
            raise ValueError(
                f"{self.name}: sensor rows have shape {self.sensor_rows.shape}; expected "
                f"({len(self.sensor_names)}, {n})"
            )
        if set(self.pilots) != set(self.pilot_coordinates):
            raise ValueError(
                f"{self.name}: pilots and pilot coordinates do not name the same pilots"
            )
        for pilot, rows in self.pilot_coordinates.items():
            if len(rows) != len(self.components_of(pilot)):
                raise ValueError(
                    f"{self.name}: pilot {pilot!r} has {len(rows)} coordinates; expected "
                    f"{len(self.components_of(pilot))}, one a component"
                )

    @property
    def n_coordinates(self) -> int:
        """Number of reduced coordinates."""
        return len(self.labels)

    def coordinates_of(self, pilot: str) -> NDArray[np.int64]:
        """Rows of a pilot's six coordinates, shape (6,).

        Raises
        ------
        KeyError
            Where there is no such pilot; names those there are.
        ValueError
            Where the pilot has fewer components than six.
        """
        rows = self.rows_of(pilot)
        if pilot in self.pilot_components:
            listed = ", ".join(PILOT_COORDINATES[i] for i in self.pilot_components[pilot])
            raise ValueError(f"{self.name}: pilot {pilot!r} has {listed} only; expected all six")
        return rows

    def rows_of(self, pilot: str) -> NDArray[np.int64]:
        """Rows of a pilot's coordinates, however many; KeyError names the pilots there are."""
        if pilot not in self.pilot_coordinates:
            raise KeyError(
                f"{self.name} has no pilot {pilot!r}; it has {', '.join(self.pilot_coordinates)}"
            )
        return self.pilot_coordinates[pilot]

    def components_of(self, pilot: str) -> tuple[int, ...]:
        """Components that a pilot's rows are, numbered as in `PILOT_COORDINATES`."""
        return tuple(self.pilot_components.get(pilot, range(len(PILOT_COORDINATES))))

    @property
    def n_free_motions(self) -> int:
        """How many rigid motions nothing holds, as its provenance says; six by default."""
        return int(self.provenance.get(FREE_MOTIONS, "6"))

    @property
    def pilot_rows(self) -> NDArray[np.int64]:
        """Rows of all pilots' coordinates, pilot by pilot."""
        none = np.zeros(0, dtype=np.int64)
        return np.concatenate([none, *(self.pilot_coordinates[name] for name in self.pilots)])


def turned(model: ReducedModel, angle: float, rename: Mapping[str, str]) -> ReducedModel:
    """Copy of a body turned about +x by `angle` [rad], its pilots renamed.

    Modal coordinates stay as they are.

    Parameters
    ----------
    model : ReducedModel
        Body in its original position. Its sensors keep their names and turn with it.
    angle : float
        Rotation [rad] about +x.
    rename : mapping of str to str
        New name of each pilot.
    """
    missing = model.pilots.keys() - rename.keys()
    if missing:
        raise ValueError(
            f"{model.name}: no new name is given for the pilot {sorted(missing)[0]!r}; expected "
            "one for each"
        )
    R = rotation_about_x(angle)
    Q = np.eye(model.n_coordinates)
    for name in model.pilots:
        rows = model.coordinates_of(name)
        for triple in (rows[:3], rows[3:]):
            Q[np.ix_(triple, triple)] = R
    labels = list(model.labels)
    for old, new in rename.items():
        for row, coordinate in zip(model.coordinates_of(old), PILOT_COORDINATES, strict=True):
            labels[row] = f"{new} {coordinate}"
    mass = model.mass_properties
    return replace(
        model,
        K=Q @ model.K @ Q.T,
        M=Q @ model.M @ Q.T,
        D=Q @ model.D @ Q.T,
        labels=tuple(labels),
        pilots={rename[name]: R @ point for name, point in model.pilots.items()},
        pilot_coordinates={rename[name]: rows for name, rows in model.pilot_coordinates.items()},
        sensor_rows=model.sensor_rows @ Q.T,
        mass_properties=MassProperties(mass.mass, R @ mass.centre, R @ mass.inertia @ R.T),
        ffrf=model.ffrf.turned(R).transformed(Q.T) if model.ffrf else None,
    )

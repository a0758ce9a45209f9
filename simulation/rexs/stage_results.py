"""Results of a stage's run as attributes of REXS components: what a load case of it states.

Means over the run: speeds of the shafts, torque of the carrier's load, force of each bearing on its
inner side, in the bearing's axes: of planets in the carrier's frame, else in the fixed one.
Of each mesh the mean tangential force and the largest mesh load factor ``K_γ``, the largest planet
share times the number of planets. Rolling bearings of planets whose dynamic rating C the file
states get the nominal life ``L_10 = (C/P)^p``, ``P`` the mean of the load to the power p.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import GearData
from carrierflex.simulation.rexs.planetary_stage import Planet, PlanetaryStage
from carrierflex.simulation.rexs.rexs_model import Component, RexsModel

#: Exponents of the life of roller and ball bearings (ISO 281).
_ROLLERS, _BALLS = 10.0 / 3.0, 3.0
_FORCES = tuple(f"force_acting_on_inner_component_{axis}" for axis in "uvw")
_BEARING_COLUMNS = ("x", "y", "z", "my", "mz")

Columns = Mapping[str, NDArray[np.float64]]


@dataclass
class RunMeans:
    """Means of a run's load columns, added up piece by piece.

    Parameters
    ----------
    stage : PlanetaryStage
        Components of the stage.
    """

    stage: PlanetaryStage
    _n_samples: int = 0
    _sums: dict[str, float] = field(default_factory=dict)
    _largest: float = 0.0

    def append(self, columns: Columns) -> None:
        """Add columns of :func:`carrierflex.simulation.stage.load_channels.load_columns`."""
        self._n_samples += len(columns["torque"])
        for name, values in columns.items():
            self._sums[name] = self._sums.get(name, 0.0) + float(values.sum())
        for p, planet in enumerate(self.stage.planets, start=1):
            for k, bearing in enumerate(planet.bearings):
                load = np.linalg.norm(self._across(columns, p, k), axis=0)
                key = f"life {bearing.id}"
                exponent = _exponent(self.stage.model, bearing)
                self._sums[key] = self._sums.get(key, 0.0) + float((load**exponent).sum())
        self._largest = max(self._largest, float(columns["load_sharing_factor"].max()))

    def results(self, gear: GearData) -> dict[int, dict[str, float]]:
        """Attributes in SI by component.

        Parameters
        ----------
        gear : GearData
            Gears of the case.
        """
        means = {name: total / self._n_samples for name, total in self._sums.items()}
        stage = self.stage
        results: dict[int, dict[str, float]] = {}
        for load in stage.carrier_loads[:1]:
            sense = stage.along_x(stage.carrier_shafts[0])
            results[load.id] = {"torque_around_u_axis": sense * means["torque"]}
        speeds = [(shaft, means["carrier_speed"]) for shaft in stage.carrier_shafts]
        if stage.sun_shaft is not None:
            speeds.append((stage.sun_shaft, means["sun_speed"]))
        for p, planet in enumerate(stage.planets, start=1):
            if planet.shaft is not None:
                speeds.append((planet.shaft, means[f"planet_{p}_speed"]))
            self._meshes(results, planet, p, means, gear)
            for k, bearing in enumerate(planet.bearings):
                results[bearing.id] = self._planet_bearing(planet, p, k, means, gear)
        for shaft, speed in speeds:
            results[shaft.id] = {"rotational_speed": stage.along_x(shaft) * speed}
        for bearings, column in (
            (stage.upwind_bearings, "bearing_A"),
            (stage.downwind_bearings, "bearing_B"),
            (stage.sun_bearings, "sun_support"),
        ):
            forces = np.array([means[f"{column}_{name}"] for name in _BEARING_COLUMNS])
            results |= self._housing_bearings(bearings, forces)
        return results

    def _meshes(
        self,
        results: dict[int, dict[str, float]],
        planet: Planet,
        p: int,
        means: Mapping[str, float],
        gear: GearData,
    ) -> None:
        # Of the normal force F, F cos(α_n) cos(β) is tangential at the reference circle.
        share = math.cos(gear.pressure_angle) * math.cos(gear.helix_angle)
        for mate, mesh in (("sun", planet.sun_mesh), ("ring", planet.ring_mesh)):
            results[mesh.id] = {
                "nominal_tangential_force_at_reference_circle": share
                * abs(means[f"{mate}_mesh_{p}"]),
                "mesh_load_factor_iso_6336_2019": self._largest,
            }

    def _across(self, columns: Mapping[str, object], p: int, k: int) -> NDArray[np.float64]:
        """Radial and tangential force on the pin of planet p's bearing k [N].

        ``F/n + (M_t, -M_r) x_k / Σ x^2`` of pin force F and moment M, places x from their mean.
        """
        bearings = self.stage.planets[p - 1].bearings
        x = _axial_positions(self.stage, bearings)
        force = np.array([columns[f"pin_{p}_force_{name}"] for name in ("radial", "tangential")])
        moment = np.array([columns[f"pin_{p}_moment_{name}"] for name in ("tangential", "radial")])
        moment[1] *= -1.0
        return np.asarray(force / len(bearings) + moment * _lever(x, k))

    def _planet_bearing(
        self, planet: Planet, p: int, k: int, means: Mapping[str, float], gear: GearData
    ) -> dict[str, float]:
        stage, bearing = self.stage, planet.bearings[k]
        radial, tangential = self._across(means, p, k)
        axial = means[f"pin_{p}_force_axial"] * _axial_share(stage.model, planet.bearings, bearing)
        x = stage.axes[0]
        force = axial * x + radial * planet.radial + tangential * np.cross(x, planet.radial)
        # The model's force is that on the pin; it is the inner side of the usual bearing.
        on_inner = 1.0 if _inner_is(stage.model, bearing, planet.pin) else -1.0
        result = dict(zip(_FORCES, stage.axes_of(bearing) @ (on_inner * force), strict=True))
        rating = stage.model.number(bearing, "radial_dynamic_load_rating")
        if rating is not None and rating > 0.0:
            exponent = _exponent(stage.model, bearing)
            # Sum over the run of P^p, as its mean.
            life = 1e6 * rating**exponent / means[f"life {bearing.id}"]
            turns = abs(means["carrier_speed"]) * gear.ring_teeth / gear.planet_teeth
            result["nominal_rating_life_rotations_iso_281_2007"] = 2.0 * math.pi * life
            if turns > 0.0:
                result["nominal_rating_life_time_iso_281_2007"] = 2.0 * math.pi * life / turns
        return {name: float(value) for name, value in result.items()}

    def _housing_bearings(
        self, bearings: tuple[Component, ...], load: NDArray[np.float64]
    ) -> dict[int, dict[str, float]]:
        """Forces of bearings that the model joins to one, in the fixed frame.

        ``F_y/n + M_z x_k / Σ x^2`` and ``F_z/n - M_y x_k / Σ x^2``.
        """
        stage, x = self.stage, _axial_positions(self.stage, bearings)
        results = {}
        for k, bearing in enumerate(bearings):
            across = load[1:3] / len(bearings) + np.array([load[4], -load[3]]) * _lever(x, k)
            axial = load[0] * _axial_share(stage.model, bearings, bearing)
            force = np.array([axial, *across]) @ stage.axes
            casing = next(iter(stage.model.of_type("gear_casing")), None)
            on_inner = -1.0 if _inner_is(stage.model, bearing, casing) else 1.0
            values = stage.axes_of(bearing) @ (on_inner * force)
            results[bearing.id] = dict(zip(_FORCES, map(float, values), strict=True))
        return results


def _axial_positions(stage: PlanetaryStage, bearings: Iterable[Component]) -> NDArray[np.float64]:
    """Places of bearings along x from their mean [m]; zeros where one is not stated."""
    stated = [stage.x(bearing) for bearing in bearings]
    positions = np.array([0.0 if None in stated or x is None else x for x in stated])
    return positions - positions.mean() if len(positions) else positions


def _lever(x: NDArray[np.float64], k: int) -> float:
    """``x_k / Σ x^2``, the force of bearing k for a unit moment [1/m]."""
    square = float(x @ x)
    return float(x[k]) / square if square > 0.0 else 0.0


def _axial_share(model: RexsModel, bearings: Iterable[Component], bearing: Component) -> float:
    """Share of the axial force: equal among those that take one."""
    takes = [
        each.id for each in bearings if model.text(each, "axial_force_absorption") != "no_direction"
    ]
    return 1.0 / len(takes) if bearing.id in takes else 0.0


def _inner_is(model: RexsModel, bearing: Component, component: Component | None) -> bool:
    """Whether a component is on the inner side of a bearing."""
    inner = model.related("side", "assembly", bearing, "inner_part")
    return component is not None and any(each.id == component.id for each in inner)


def _exponent(model: RexsModel, bearing: Component) -> float:
    return _BALLS if "ball" in model.text(bearing, "bearing_type") else _ROLLERS

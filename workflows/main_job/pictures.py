"""Pictures of the main job.

Meshes, deformed carriers, modes, deflection curves, the pin fit's influence.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.load_cases import radial
from carrierflex.fe.view import curves_figure, deformed_picture, orders_over_fit_figure
from carrierflex.geometry.view import mesh_picture
from carrierflex.reduction.pin_fit import FIXED_PILOT
from carrierflex.reduction.view import modes_picture
from carrierflex.simulation.carrier.case_files import read_case
from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.workflows.fe.carrier_variants import CarrierVariant
from carrierflex.workflows.main_job.reduce_carrier import ReducedCarrier
from carrierflex.workflows.outputs import save_figure, save_image

#: Of the pin fit in the picture of its influence [N m/rad].
_STIFFNESSES = tuple(float(k) for k in np.logspace(4.0, 10.0, 25))
_TITLES = {
    "flexible": "carrier without pins (flexible)",
    "stiff": "carrier with bonded pins (stiff)",
}


def draw_carriers(
    folder: Path,
    variants: Mapping[str, CarrierVariant],
    curves: Mapping[str, DeflectionCurve],
    reduced: ReducedCarrier,
    case: Path,
) -> None:
    """Draw mesh, deformation and modes of both variants, and the curves.

    Both deflection curves, and their orders over the pin fit. The sensors of a simulation case are
    marked on the deformed bodies.
    """
    sensors = read_case(case, curves["delta_f"]).sensors
    for name, variant in variants.items():
        title = _TITLES[name]
        n_tets = f"{len(variant.mesh.tets):,} quadratic tetrahedra"
        save_image(folder / f"{name}_mesh.png", mesh_picture(variant.mesh, f"{title}: {n_tets}"))
        u = variant.deflection.u
        picture = deformed_picture(
            variant.mesh,
            u,
            f"{title}, torque of 1 kN m",
            labels=_labels(variant, sensors),
            torque_at=_torque_face(variant),
        )
        save_image(folder / f"{name}_deformed.png", picture)
    for name, body in (("flexible", reduced.flexible), ("stiff", reduced.stiff)):
        save_image(folder / f"{name}_modes.png", modes_picture(variants[name].mesh, body.modes))
    n_planets = variants["flexible"].n_planets
    save_figure(
        folder / "deflection_curves.png",
        curves_figure(curves["delta_s"], curves["delta_f"], n_planets),
    )
    joined = {stiffness: reduced.fit.curve(stiffness) for stiffness in _STIFFNESSES}
    save_figure(
        folder / "pin_fit.png",
        orders_over_fit_figure(joined, curves["delta_f"], curves["delta_s"], n_planets),
    )


def _labels(variant: CarrierVariant, sensors: Sequence[Sensor]) -> dict[str, NDArray[np.float64]]:
    """Where the pins' axes leave the upwind face and the points before the sensors are [m]."""
    face = np.array([0.0, 1.0, 1.0])
    pins = {
        pilot.name.rpartition("_")[0].replace("_", " "): face * pilot.point
        for pilot in variant.structure.pilots
        if pilot.name.startswith("pin_") and not pilot.name.endswith("_downwind")
    }
    # The rim face that the sensors look at is the plane x = 0.
    return pins | {sensor.name: sensor.radius * radial(sensor.angle) for sensor in sensors}


def _torque_face(variant: CarrierVariant) -> NDArray[np.float64]:
    return next(pilot.point for pilot in variant.structure.pilots if pilot.name == FIXED_PILOT)

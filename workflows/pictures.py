"""Pictures of the main job.

Meshes, deformed carriers, modes, deflection curves, the pin fit's influence.
"""

from collections.abc import Mapping
from pathlib import Path

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.view import curves_figure, deformed_picture, order_content_figure
from carrierflex.geometry.view import mesh_picture
from carrierflex.reduction.view import modes_picture
from carrierflex.workflows.reduction.reduce_carrier import ReducedCarrier
from carrierflex.workflows.support.carrier_variants import CarrierVariant
from carrierflex.workflows.support.outputs import save_figure, save_image

_TITLES = {
    "flexible": "carrier without pins (flexible)",
    "stiff": "carrier with bonded pins (stiff)",
}


def draw_carriers(
    folder: Path,
    variants: Mapping[str, CarrierVariant],
    curves: Mapping[str, DeflectionCurve],
    reduced: ReducedCarrier,
) -> None:
    """Draw mesh, deformation and modes of both variants, and the curves.

    Both deflection curves, and the curves over the pin fit.
    """
    for name, variant in variants.items():
        title = _TITLES[name]
        n_tets = f"{len(variant.mesh.tets):,} quadratic tetrahedra"
        save_image(folder / f"{name}_mesh.png", mesh_picture(variant.mesh, f"{title}: {n_tets}"))
        u = variant.deflection.u
        save_image(
            folder / f"{name}_deformed.png", deformed_picture(variant.mesh, u, f"{title}, 1 kN m")
        )
    for name, body in (("flexible", reduced.flexible), ("stiff", reduced.stiff)):
        save_image(folder / f"{name}_modes.png", modes_picture(variants[name].mesh, body.modes))
    n_planets = variants["flexible"].n_planets
    save_figure(
        folder / "deflection_curves.png",
        curves_figure(curves["delta_s"], curves["delta_f"], n_planets),
    )
    joined = {_stiffness_label(k): curve for k, curve in reduced.joined.items()}
    labelled = {"no pins (FE)": curves["delta_f"], **joined, "bonded (FE)": curves["delta_s"]}
    save_figure(
        folder / "pin_fit.png",
        order_content_figure(list(labelled), list(labelled.values()), n_planets),
    )


def _stiffness_label(stiffness: float) -> str:
    return f"{stiffness:.2g} N m/rad"

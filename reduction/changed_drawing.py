"""Curves of a carrier whose drawing is changed, by finite elements at the changed values.

New meshes differ in every node, and what they make of a small change scatters by some per cent of
it (docs/reduction.md). Here the nodes of one mesh move with the dimensions, as the boundary
does (:mod:`carrierflex.geometry.shape_velocity`), so that the error of the mesh is in the curves
before and after and drops out of their difference.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np

from carrierflex.fe.curve_files import MATERIAL_CAUSES, axial_of_fit
from carrierflex.fe.deflection_curves import DeflectionCurve, amplitudes_along, resampled
from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.geometry.parameter_files import StageParameters

if TYPE_CHECKING:
    from carrierflex.geometry.tet_mesh import TetMesh

Curves = Mapping[str, DeflectionCurve]


@dataclass(frozen=True, eq=False)
class ChangedDrawing:
    """Dimensions and materials at changed values, and the curves before and after.

    Parameters
    ----------
    stage : StageParameters
        Changed dimensions.
    materials : mapping of str to Material
        Changed materials by body.
    before, after : mapping of str to DeflectionCurve
        ``delta_s``, ``delta_f``, ``g_s``, ``g_f`` and ``pin_fit``, on one mesh.
    """

    stage: StageParameters
    materials: Mapping[str, Material]
    before: Curves
    after: Curves

    def moved(self, curves: Curves) -> dict[str, DeflectionCurve]:
        """Curves of any code, moved by what the change makes of ours; derivatives as they are.

        All come out at the angles of ``delta_f``.
        """
        n = curves["delta_f"].axial.size
        result = {name: resampled(curve, n) for name, curve in curves.items()}
        for name, curve in result.items():
            if name in self.after:
                old, new = resampled(self.before[name], n), resampled(self.after[name], n)
                axial = curve.axial + new.axial - old.axial
                radial = curve.radial + new.radial - old.radial
                result[name] = replace(curve, axial=axial, radial=radial)
        return result


def causes_in(
    stage: StageParameters, materials: Mapping[str, Material] = BODY_MATERIALS
) -> dict[str, float]:
    """Value of every cause: dimensions of the table [carrier] [m], material constants."""
    values = {
        name: float(value)
        for name, value in vars(stage.carrier).items()
        if isinstance(value, float)
    }
    constants = {
        cause: float(getattr(materials[body], constant))
        for cause, (body, constant, _) in MATERIAL_CAUSES.items()
    }
    return values | constants


def changed_drawing(
    stage: StageParameters,
    changes: Mapping[str, float],
    size: float,
    *,
    note: Callable[[str], None] = lambda text: None,
) -> ChangedDrawing:
    """Curves before and after some causes change.

    Parameters
    ----------
    stage : StageParameters
        Dimensions as drawn.
    changes : mapping of str to float
        Change of each cause: a dimension of the table [carrier] [m], ``E`` or ``nu`` of the
        carrier, ``pin_E`` of its pins.
    size : float
        Element edge length [m].
    note : callable
        Told what is computed.

    Raises
    ------
    ValueError, InvertedElementError
        Where no carrier has the changed values, or the mesh cannot follow them.
    """
    # Late: commands that describe the result do not wait for gmsh.
    from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
    from carrierflex.geometry.shape_velocity import with_step
    from carrierflex.reduction.drawing_derivatives import nominal_curves

    dimensions = {
        f"carrier.{name}": change for name, change in changes.items() if name not in MATERIAL_CAUSES
    }
    changed = stage
    for name, change in dimensions.items():
        changed = with_step(changed, name, change)
    changed_materials = dict(BODY_MATERIALS)
    for cause, (body, constant, _) in MATERIAL_CAUSES.items():
        if cause in changes:
            of_body = changed_materials[body]
            value = getattr(of_body, constant) + changes[cause]
            changed_materials[body] = replace(of_body, **{constant: value})
    halves = (
        flexible_half_sector(stage.carrier, size),
        stiff_half_sector(stage.carrier, stage.pin, size),
    )
    note("curves as drawn")
    before = nominal_curves(*halves, stage, size)
    flexible, stiff = (_moved(half, stage, dimensions) for half in halves)
    note("curves at the changed values")
    after = nominal_curves(flexible, stiff, changed, size, materials=changed_materials)
    return ChangedDrawing(changed, changed_materials, before, after)


def _moved(half: "TetMesh", stage: StageParameters, changes: Mapping[str, float]) -> "TetMesh":
    """Half sector whose nodes have moved with some dimensions [m]."""
    from carrierflex.fe.shape_extension import extended_velocity
    from carrierflex.geometry.quality import check_quality
    from carrierflex.geometry.shape_velocity import parametric_motion

    if not changes:
        return half
    velocity = extended_velocity(half, parametric_motion(half, stage, tuple(changes)))
    step = np.array(list(changes.values()))
    moved = replace(half, points=half.points + np.einsum("k,kna->na", step, velocity))
    check_quality(moved)
    return moved


@dataclass(frozen=True, eq=False)
class OrderChange:
    """Change of one order of the rim's axial curve under torque, along its phase as drawn."""

    order: Annotated[int, "Order"]
    predicted: Annotated[float, "By the derivative [m per kN m]"]
    computed: Annotated[float, "By finite elements at the new value [m per kN m]"]


@dataclass(frozen=True, eq=False)
class LinearPrediction:
    """What derivatives predict of a change of the drawing, and what the full computation gives."""

    off: Annotated[float, "RMS of their difference over the RMS of the computed change"]
    factor: Annotated[
        float, "Factor on the computed change, and so about on the values, that meets the predicted"
    ]
    orders: Annotated[Sequence[OrderChange], "Orders of the planets"]


def linear_prediction(
    curves: Curves, changes: Mapping[str, float], w: float, drawing: ChangedDrawing
) -> LinearPrediction:
    """Compare ``sum_p change_p (d delta_f/dp + w d d/dp)`` with the computed change.

    The factor f is that of least squares, ``f = predicted . computed / computed . computed``: the
    records ask for the predicted curve, which the values times f make but for terms of f - 1
    squared.

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve
        Derivatives of the drawing's curves (:mod:`carrierflex.fe.curve_files`).
    changes : mapping of str to float
        As of :func:`changed_drawing`.
    w : float
        Share of a rigid pin fit, from 0 to 1.
    drawing : ChangedDrawing
        Curves before and after.
    """
    nominal = drawing.before["delta_f"]
    n = nominal.axial.size
    before = axial_of_fit(drawing.before, w, n)
    computed = axial_of_fit(drawing.after, w, n) - before
    predicted = np.sum(
        [change * axial_of_fit(curves, w, n, cause=p) for p, change in changes.items()], axis=0
    )
    square = float(computed @ computed)
    error = predicted - computed
    along = [amplitudes_along(values, before) for values in (predicted, computed)]
    is_changed = square > 0.0
    return LinearPrediction(
        float(np.sqrt(error @ error / square)) if is_changed else float("nan"),
        float(predicted @ computed / square) if is_changed else float("nan"),
        tuple(
            OrderChange(order, *(float(values[order]) for values in along))
            for order in nominal.main_orders(drawing.stage.carrier.n_planets)
        ),
    )

"""Curves that a drawing allows beside known answers, and differences of the same mesh moved."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.fe.carrier_curves import UNIT_TORQUE
from carrierflex.fe.curve_derivatives import clamped_carrier
from carrierflex.fe.curve_files import PIN_FIT, causes_of
from carrierflex.fe.deflection_curves import order_amplitudes
from carrierflex.fe.load_cases import gear_forces
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.shape_extension import extended_velocity
from carrierflex.fe.structural_model import PIN_PILOTS, structural_model
from carrierflex.geometry.carrier_mesh import flexible_half_sector, pin_mesh
from carrierflex.geometry.dihedral import completed
from carrierflex.geometry.named_surfaces import with_carrier_surfaces
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.shape_velocity import dimension_value, parametric_motion, with_step
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.drawing_derivatives import drawn_curves, given_drawn_curves
from carrierflex.reduction.pin_fit import PinFitFamily
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

pytestmark = pytest.mark.long
STAGE = StageParameters()
SIZE = 0.1
STEP = 1e-4


def relative(actual, expected):
    return np.abs(actual - expected).max() / np.abs(expected).max()


@pytest.fixture(scope="module")
def half():
    return flexible_half_sector(STAGE.carrier, SIZE)


@pytest.fixture(scope="module")
def curves(half):
    return drawn_curves(half, STAGE, SIZE)


def test_every_cause_has_both_derivatives(curves):
    causes = causes_of(curves)
    assert {"outer_radius", "plate_gap", "E", "nu", "pin_E"} < set(causes)
    assert {f"delta_f/{cause}" for cause in causes} < set(curves)


def test_a_modulus_scales_the_curve(curves):
    """Of carrier and pins together: ``E dd/dE + E_p dd/dE_p = -d``."""
    E, E_p = BODY_MATERIALS["carrier"].E, BODY_MATERIALS["pins"].E
    scaled = E * curves[f"{PIN_FIT}/E"].axial + E_p * curves[f"{PIN_FIT}/pin_E"].axial
    assert relative(scaled, -curves[PIN_FIT].axial) < 2e-4


def test_a_rigid_fit_is_that_of_the_pin_fit_study_but_for_the_shaft_face(half, curves):
    """Held through a pilot, which is softer than node by node."""
    clamped = clamped_carrier(half, STAGE)
    carrier = symmetric_craig_bampton(clamped.half, 0, sensors=clamped.sensors).model
    mesh = pin_mesh(STAGE.carrier, STAGE.pin, SIZE)
    pin = craig_bampton(structural_model("pin", mesh, STAGE.carrier, PIN_PILOTS), 0).model
    family = PinFitFamily(carrier, pin, gear_forces(UNIT_TORQUE, STAGE.gear, 3), 0.412)
    rigid, free = family.ends
    order_6 = order_amplitudes(rigid.axial - free.axial)[6]
    assert curves[PIN_FIT].axial_order(6) == pytest.approx(order_6, rel=0.15)


@pytest.mark.parametrize("dimension", ["outer_radius", "centre_distance"])
def test_a_dimension_meets_differences_of_the_same_mesh_moved(half, curves, dimension):
    name = f"carrier.{dimension}"
    step = STEP * dimension_value(STAGE, name)
    V = extended_velocity(half, parametric_motion(half, STAGE, [name]))[0]
    plus, minus = (
        drawn_curves(
            replace(half, points=half.points + sign * step * V),
            with_step(STAGE, name, sign * step),
            SIZE,
        )[PIN_FIT].axial
        for sign in (1.0, -1.0)
    )
    assert relative(curves[f"{PIN_FIT}/{dimension}"].axial, (plus - minus) / (2.0 * step)) < 1e-3


def test_a_given_mesh_has_its_surfaces_as_causes(half, curves):
    """The same carrier as a mesh of somebody: a seat moved outwards by 1 is 2 of its diameter."""
    full = with_carrier_surfaces(completed(half, 3), STAGE.carrier, None)
    given = given_drawn_curves(full, STAGE, SIZE)
    assert {"downwind_seat", "shaft_face", "E", "pin_E"} < set(causes_of(given))
    assert relative(given[PIN_FIT].axial, curves[PIN_FIT].axial) < 1e-6
    for name in ("delta_f", PIN_FIT):
        for cause, dimension, factor in (
            ("downwind_seat", "seat_outer_diameter", 2.0),
            ("E", "E", 1.0),
        ):
            expected = factor * curves[f"{name}/{dimension}"].axial
            assert relative(given[f"{name}/{cause}"].axial, expected) < 0.03, (name, cause)

    thick = replace(STAGE, carrier=replace(STAGE.carrier, plate_gap=0.25))
    with pytest.raises(ValueError, match=r"bore pin_1.* of the mesh is at .*\[carrier\]"):
        given_drawn_curves(full, thick, SIZE)

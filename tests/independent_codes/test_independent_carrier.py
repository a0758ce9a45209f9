"""The carrier in wedges by CalculiX: mesh, assembly and elements share nothing with ours."""

import ast
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.half_sector_curve import half_sector_curve
from carrierflex.fe.load_cases import bonded_pin_load, gear_forces, simply_supported_pin_load
from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
from carrierflex.reduction.pin_fit import PinFitFamily
from tests.independent_codes.calculix import needs_calculix
from validation.independent_carrier.curves import ORDERS, Carrier, TruthCarrier
from validation.independent_carrier.section_mesh import DRAWN, section_mesh
from validation.independent_carrier.stack import facets_on, stack, stations, surface_moments

FOLDER = Path(__file__).parents[2] / "validation" / "independent_carrier"
COARSE = 0.09


@pytest.fixture(scope="module")
def solid():
    section = section_mesh(DRAWN, COARSE)
    return stack(section, DRAWN, {"CARRIER": ("hub", "plate_a", "webs", "plate_b", "seat")}, COARSE)


def test_it_imports_nothing_of_the_project():
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not any(str(name).startswith("carrierflex") for name in names), path


def test_its_drawing_is_the_projects(carrier, pin):
    ours = {**vars(carrier), "bearing_width": pin.bearing_width}
    assert {name: ours[name] for name in DRAWN} == DRAWN


def test_surfaces_have_their_area_and_moment(solid):
    x, radius = stations(DRAWN)["plate_a"], DRAWN["pin_hole_diameter"] / 2.0
    bore = facets_on(solid.wedges["CARRIER"], solid.on_bore(DRAWN, x))
    middle = np.array([sum(x) / 2.0, 0.0, DRAWN["centre_distance"]])
    B, Z = surface_moments(solid.points, bore, middle)
    # Half a bore: area and second moment about its axis, by quadratic arcs.
    area = np.pi * radius * (x[1] - x[0])
    assert_allclose([Z[0, 0], Z[3, 3]], [area, area * radius**2], rtol=1e-3)
    # A rigid motion of the nodes is the motion that is averaged.
    motion = np.tile([0.0, 0.0, 1.0], len(solid.points))
    assert_allclose(B @ motion, Z[:, 2], atol=1e-15)


@needs_calculix
@pytest.mark.long
def test_a_pin_fit_has_the_curve_of_the_reduced_carrier(flexible_reduction, pin_reduction, gear):
    forces = gear_forces(1000.0, gear, 3)
    family = PinFitFamily(
        flexible_reduction.model, pin_reduction.model, forces, DRAWN["sensor_radius"]
    )
    truth = TruthCarrier(Carrier(), COARSE)
    flexible, pin = truth.flexible(clamped=False), truth.pin_stiffness()
    free = flexible.without_pins()[0, 1].imag, family.curve(0.0).axial_order(3).imag
    for fit in (1e7, 1e8):
        share = flexible.with_pins(pin, fit)[0, 1].imag / free[0]
        # Errors of the coarse meshes cancel in part; half the fit would be 15 % more.
        assert share == pytest.approx(family.curve(fit).axial_order(3).imag / free[1], rel=0.04)


@needs_calculix
@pytest.mark.long
def test_a_loose_fit_ends_at_simply_supported_pins_and_a_tight_one_at_six_peaks():
    truth = TruthCarrier(Carrier(), COARSE)
    flexible, pin = truth.flexible(), truth.pin_stiffness()
    free = flexible.without_pins()
    # The pins hold the bores at their length: 0.1 % (docs/reduction.md).
    assert_allclose(flexible.with_pins(pin, 1.0), free, atol=2e-3 * np.abs(free).max())
    sizes = np.abs([flexible.with_pins(pin, fit)[0, 1] for fit in (1e6, 1e7, 1e8, np.inf)])
    assert (np.diff(sizes) < 0.0).all()
    assert free[0, 2].imag * flexible.with_pins(pin, np.inf)[0, 2].imag < 0.0


@needs_calculix
@pytest.mark.long
def test_both_codes_come_to_the_same_curves(carrier, pin, gear):
    """Orders 3 and 6 without pins and with bonded ones, on meshes that are as far from the limit.

    Fine tetrahedra and wedges that are half as large at re-entrant edges: order 3 without pins is
    3 % too small on both (``python -m studies.tabulate_independent_carrier``).
    """
    force = gear_forces(1000.0, gear, 3).F_PLC
    flexible, stiff = flexible_half_sector(carrier, 0.02), stiff_half_sector(carrier, pin, 0.02)
    load = simply_supported_pin_load(1, force, 0.0, carrier)
    ours = (
        half_sector_curve(flexible, carrier, load),
        half_sector_curve(stiff, carrier, bonded_pin_load(1, force, 0.0, 3)),
    )
    truth = TruthCarrier(Carrier(), 0.06)
    theirs = (truth.flexible().without_pins(), truth.bonded())
    for curve, orders in zip(ours, theirs, strict=True):
        for order in (3, 6):
            # The helix's moment, which the half sector's curve leaves out, makes real parts alone.
            expected = curve.axial_order(order).imag
            assert orders[0, order == ORDERS][0].imag == pytest.approx(expected, rel=0.015)

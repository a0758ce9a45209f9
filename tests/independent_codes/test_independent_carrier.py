"""The carrier in wedges by CalculiX: mesh, assembly and elements share nothing with ours."""

import ast
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.half_sector_curve import half_sector_curve
from carrierflex.fe.load_cases import bonded_pin_load, gear_forces, simply_supported_pin_load
from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
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
def test_a_loose_fit_ends_at_simply_supported_pins_and_a_tight_one_at_six_peaks():
    truth = TruthCarrier(Carrier(), COARSE)
    flexible, pin = truth.flexible(), truth.pin_stiffness()
    free = flexible.without_pins()
    # The pins hold the bores at their length: 0.1 % (docs/pin_fit.md).
    assert_allclose(flexible.with_pins(pin, 1.0), free, atol=2e-3 * np.abs(free).max())
    sizes = np.abs([flexible.with_pins(pin, fit)[1] for fit in (1e6, 1e7, 1e8, np.inf)])
    assert (np.diff(sizes) < 0.0).all()
    assert free[2].imag * flexible.with_pins(pin, np.inf)[2].imag < 0.0


@needs_calculix
@pytest.mark.long
def test_both_codes_come_to_the_same_curves_on_finer_meshes(carrier, pin, gear):
    """Limits of orders 3 and 6 at elements of no size, each code by a line through two meshes."""
    force = gear_forces(1000.0, gear, 3).F_PLC
    ours, theirs = [], []
    for size in (0.03, 0.02):
        flexible, stiff = (
            flexible_half_sector(carrier, size),
            stiff_half_sector(carrier, pin, size),
        )
        curves = (
            half_sector_curve(flexible, carrier, simply_supported_pin_load(1, force, 0.0, carrier)),
            half_sector_curve(stiff, carrier, bonded_pin_load(1, force, 0.0, 3)),
        )
        ours.append([curve.axial_order(n).imag for curve in curves for n in (3, 6)])
    for size in (0.06, 0.04):
        truth = TruthCarrier(Carrier(), size)
        curves = (truth.flexible().without_pins(), truth.bonded())
        theirs.append([c[ORDERS == n][0].imag for c in curves for n in (3, 6)])
    limits = [3.0 * np.array(fine) - 2.0 * np.array(coarse) for coarse, fine in (ours, theirs)]
    # 1 % is wanted; extrapolation of free meshes scatters by as much as that.
    assert_allclose(limits[0], limits[1], rtol=0.02)

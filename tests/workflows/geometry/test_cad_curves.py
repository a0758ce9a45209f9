"""Deflection curves of the ten solids at the default size, beside those at half of every size.

Two to nine minutes a solid and variant, 2.8 GB a million unknowns of up to 3.7 millions; the
measured figures stand in docs/cad.md.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.assembly import assemble_stiffness
from carrierflex.fe.carrier_curves import flexible_cases, sensor_curve, stiff_cases
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.static import held_displacement
from carrierflex.geometry.cad_mesh import step_volume_and_area
from carrierflex.geometry.cad_surface_files import read_cad_statements
from carrierflex.geometry.parameters import GearData
from carrierflex.workflows.fe.bodies import given_structure
from carrierflex.workflows.geometry.carrier_files import CarrierFiles
from tests.fe.two_level_solver import two_level_displacement
from tests.geometry.cad_solids import SOLIDS, write_solid

#: Largest change with half of every size, over half of the curve's peak-to-peak value.
WANTED = 0.02
#: Unknowns up to which a factorisation takes less than 6 GB.
MOST_FACTORISED = 400_000
#: Residual of the others over their load: a hundredth of what is asked of the curves.
RESIDUAL = 1e-6


def without_mass(mesh, materials):
    K = assemble_stiffness(mesh, materials)
    return K, 0.0 * K[:0]


def torque_curve(files, variant, size):
    """delta_s or delta_f, and the number of unknowns."""
    mesh = files.mesh(variant, size)
    structure, interface = given_structure(variant, mesh, BODY_MATERIALS, without_mass)
    gear = GearData(centre_distance=interface.centre_distance)
    stiff = variant == "stiff"
    cases = stiff_cases(gear, interface.n_planets) if stiff else flexible_cases(interface, gear)
    load = structure.load_vector(cases["both"])[:, None]
    fixed = dofs_of(np.unique(mesh.surface("shaft_face"))).ravel()
    if structure.n_dofs < MOST_FACTORISED:
        u = held_displacement(structure.K, fixed, load)
    else:
        u = two_level_displacement(mesh, structure.K, fixed, load, rtol=RESIDUAL)
    sensors = structure.sensors
    curve = sensor_curve(variant, (sensors.rows @ u)[:, 0], 1e3, sensors.radius)
    return curve, structure.n_dofs


def change(curve, finer):
    """Largest difference, and those of orders N and 2 N, as shares."""
    n = finer.first_order
    largest = np.abs(curve.axial - finer.axial).max() / (np.ptp(finer.axial) / 2.0)
    orders = curve.axial_order_content() / finer.axial_order_content() - 1.0
    return float(largest), orders[n], orders[2 * n]


@pytest.mark.acceptance
@pytest.mark.parametrize("variant", ["stiff", "flexible"])
@pytest.mark.parametrize("name", SOLIDS)
def test_curves_at_the_default_size_are_those_at_half_of_it(name, variant, tmp_path):
    step, surfaces = write_solid(name, tmp_path)
    files = CarrierFiles(step, surfaces)
    size = files.element_size(None)
    (curve, n), (finer, n_finer) = (
        torque_curve(files, variant, each) for each in (size, size / 2.0)
    )
    largest, first, second = change(curve, finer)
    print(
        f"{name} {variant}: {size:.4f} m, {n} and {n_finer} unknowns, largest {largest:.2%}, "
        f"order N {first:+.2%}, 2 N {second:+.2%}"
    )
    # Every size is halved, so there are about eight times as many unknowns.
    assert 4.0 * n < n_finer < 9.0 * n
    assert largest < WANTED


@pytest.mark.acceptance
def test_two_levels_give_what_a_factorisation_gives(tmp_path):
    """The solver of :mod:`tests.fe.two_level_solver`, which the test above alone uses."""
    step, surfaces = write_solid("large_with_everything", tmp_path)
    mesh = CarrierFiles(step, surfaces).mesh("flexible", 0.1)
    structure, _ = given_structure("flexible", mesh, BODY_MATERIALS)
    load = structure.load_vector({"pin_1_upwind": np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])})
    fixed = dofs_of(np.unique(mesh.surface("shaft_face"))).ravel()
    expected = held_displacement(structure.K, fixed, load[:, None])
    u = two_level_displacement(mesh, structure.K, fixed, load[:, None], rtol=1e-9)
    assert_allclose(u, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.long
def test_the_default_size_follows_the_walls_and_a_given_one_stays(tmp_path):
    sizes = {}
    for name in ("fillet_oil_moved", "large_with_everything"):
        files = CarrierFiles(*write_solid(name, tmp_path))
        sizes[name] = files.element_size(None)
        assert files.element_size(0.05) == 0.05
    # 65 and 100 mm thick are their upwind plates.
    ratio = sizes["large_with_everything"] / sizes["fillet_oil_moved"]
    assert_allclose(ratio, 100.0 / 65.0, rtol=0.1)
    assert CarrierFiles().element_size(None) == 0.03


def web_wall(carrier):
    """Twice the area over the outline of the webs' section.

    At the radius r a web reaches from its middle plane to the pocket of radius c about the pin at
    the distance a, whose angle from that pin has the cosine (r^2 + a^2 - c^2) / 2 r a.
    """
    a, c, n = carrier.centre_distance, carrier.planet_clearance_radius, carrier.n_planets
    r = np.linspace(carrier.web_inner_radius, carrier.outer_radius, 20_001)
    to_pocket = np.arccos(np.clip((r**2 + a**2 - c**2) / (2.0 * r * a), -1.0, 1.0))
    half = np.pi / n - to_pocket
    area = 2.0 * n * np.trapezoid(half * r, r)
    sides = 2.0 * n * np.sqrt(np.diff(r) ** 2 + (r[1:] * np.diff(half)) ** 2).sum()
    return 2.0 * area / (sides + 2.0 * n * (r[0] * half[0] + r[-1] * half[-1]))


@pytest.mark.long
def test_thin_webs_limit_the_default_size(tmp_path):
    carrier, _ = SOLIDS["five_with_bolts_and_oil"]
    step, surfaces = write_solid("five_with_bolts_and_oil", tmp_path)
    size = CarrierFiles(step, surfaces).element_size(None)
    assert_allclose(size, 0.48 * web_wall(carrier), rtol=1e-4)
    volume, area = step_volume_and_area(step, read_cad_statements(surfaces), pins=False)
    assert size < 0.66 * 2.0 * volume / area
    # A frame of its own does not matter.
    moved = CarrierFiles(*write_solid("five_with_fillet_chamfer_moved", tmp_path))
    assert_allclose(moved.element_size(None), size, rtol=1e-6)

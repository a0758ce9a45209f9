"""Deflection curves of the default carrier.

Their shape, symmetry, sign and size (2012 paper, section 2.2).
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.carrier_curves import carrier_deflection, flexible_cases, named_curves
from carrierflex.fe.half_sector_curve import half_sector_curve
from carrierflex.fe.load_cases import (
    bonded_pin_load,
    gear_forces,
    simply_supported_pin_load,
    tangential,
)

DEFLECTIONS = pytest.mark.parametrize("variant", ["flexible_deflection", "stiff_deflection"])


def test_the_flexible_carrier_has_three_peaks_and_the_stiff_one_six(
    flexible_deflection, stiff_deflection
):
    flexible = named_curves(stiff_deflection, flexible_deflection)["delta_f"].peak_angles()
    stiff = named_curves(stiff_deflection, flexible_deflection)["delta_s"].peak_angles()
    assert_allclose(np.diff(flexible), 2.0 * math.pi / 3.0, rtol=0.0, atol=1e-9)
    assert len(flexible) == 3
    assert len(stiff) == 6
    assert_allclose(stiff[2:] - stiff[:-2], 2.0 * math.pi / 3.0, rtol=0.0, atol=1e-9)


def test_sizes_are_those_of_an_independent_hexahedral_model(flexible_deflection, stiff_deflection):
    # A separate code (hexahedra with incompatible modes, 120 deg sector) gave for these dimensions,
    # in um per kN m: flexible 0.191, 0.017, 0.006 and stiff 0.025, 0.023, 0.011 at orders 3, 6 and
    # 9. It loads nodes of the hole rims.
    flexible = flexible_deflection.curves["both"].axial_order_content()[[3, 6, 9]] * 1e6
    stiff = stiff_deflection.curves["both"].axial_order_content()[[3, 6, 9]] * 1e6
    assert_allclose(flexible[0], 0.191, rtol=0.05)
    assert_allclose(flexible[1:], [0.017, 0.006], rtol=0.0, atol=0.0015)
    # The small orders are differences of two large moments: a fifth of 0.025 is 3 % of the flexible
    # curve.
    assert_allclose(stiff, [0.025, 0.023, 0.011], rtol=0.0, atol=0.006)


@DEFLECTIONS
@pytest.mark.parametrize("case", ["tangential", "tilting", "both"])
def test_equal_pin_loads_excite_orders_of_three_only(variant, case, request):
    curve = request.getfixturevalue(variant).curves[case]
    content = curve.axial_order_content()
    assert np.delete(content, np.s_[::3]).max() < 1e-8 * content.max()


@DEFLECTIONS
def test_the_tangential_curve_is_odd_and_the_tilting_curve_even_about_every_pin(variant, request):
    curves = request.getfixturevalue(variant).curves
    for pin_degree in (0, 120, 240):
        for case, parity in (("tangential", -1.0), ("tilting", 1.0)):
            axial = np.roll(curves[case].axial, -pin_degree)
            mirrored = parity * np.roll(axial[::-1], 1)
            assert_allclose(mirrored, axial, rtol=0.0, atol=1e-9 * np.abs(axial).max())


@pytest.mark.parametrize(
    ("variant", "share"), [("flexible_deflection", 0.01), ("stiff_deflection", 0.07)]
)
def test_the_tilting_moment_is_insignificant_beside_the_tangential_load(variant, share, request):
    curves = request.getfixturevalue(variant).curves
    # Root mean square. One per cent is the paper's "insignificant"; the stiff curve it is compared
    # with is seven times less.
    rms = {
        case: float(np.sqrt(np.mean(curves[case].axial ** 2))) for case in ("tangential", "tilting")
    }
    assert 0.001 * rms["tangential"] < rms["tilting"] < share * rms["tangential"]


@DEFLECTIONS
def test_both_loads_superpose(variant, request):
    curves = request.getfixturevalue(variant).curves
    for kind in ("axial", "radial"):
        total = getattr(curves["tangential"], kind) + getattr(curves["tilting"], kind)
        assert_allclose(
            getattr(curves["both"], kind), total, rtol=0.0, atol=1e-10 * np.abs(total).max()
        )


@DEFLECTIONS
def test_the_torque_curve_is_three_pin_curves_times_the_pin_force(variant, request):
    curves = request.getfixturevalue(variant).curves
    for kind in ("axial", "radial"):
        pins = sum(getattr(curves[f"pin_{i}"], kind) for i in (1, 2, 3)) * 1000.0 / (3.0 * 0.308)
        result = getattr(curves["tangential"], kind)
        assert_allclose(result, pins, rtol=0.0, atol=1e-9 * np.abs(result).max())


@DEFLECTIONS
@pytest.mark.parametrize("kind", ["axial", "radial"])
def test_pin_2_answers_as_pin_1_at_an_angle_120_deg_larger(variant, kind, request):
    curves = request.getfixturevalue(variant).curves
    first = getattr(curves["pin_1"], kind)
    for pin, degrees in ((2, 120), (3, 240)):
        result = getattr(curves[f"pin_{pin}"], kind)
        assert_allclose(result, np.roll(first, degrees), rtol=0.0, atol=1e-9 * np.abs(first).max())
    # The same shift the other way does not do: the order of the pins is seen.
    assert (
        np.abs(curves["pin_2"].axial - np.roll(curves["pin_1"].axial, -120)).max()
        > 0.1 * np.abs(first).max()
    )


def test_under_positive_torque_the_pins_lag_behind_the_shaft(
    flexible_structure, flexible_deflection
):
    u = flexible_deflection.u.ravel()
    lag = {pilot.name: (pilot.G @ u)[:3] for pilot in flexible_structure.pilots}
    for pin in (1, 2, 3):
        t = tangential(2.0 * math.pi * (pin - 1) / 3.0)
        upwind, downwind = lag[f"pin_{pin}_upwind"] @ t, lag[f"pin_{pin}_downwind"] @ t
        # Towards decreasing angle, and plate B, which hangs on the webs, more than plate A on the
        # hub.
        assert downwind < upwind < 0.0


def test_torsional_stiffness_from_hub_to_pins_is_that_of_the_independent_model(
    flexible_structure, flexible_deflection
):
    u = flexible_deflection.u.ravel()
    turns = [
        -(pilot.G @ u)[:3] @ tangential(2.0 * math.pi * (int(pilot.name[4]) - 1) / 3.0) / 0.308
        for pilot in flexible_structure.pilots
        if pilot.name.startswith("pin")
    ]
    # 700 MN m/rad in the separate hexahedral code, which loads the hole rims: the same to a tenth.
    assert_allclose(1000.0 / np.mean(turns), 700e6, rtol=0.1)


def test_the_rim_dips_upwind_just_after_a_pin(flexible_deflection):
    """The sign of delta_f, by hand.

    Plate B is pulled back, -F t, and hangs on the webs at +-60 deg, so a web's foot carries the
    force -F t at the distance d along +x: the moment d x × (-F t) = F d e on plate A (x × t = -e).
    It turns the plate about e: at an angle a little less than the web's the displacement e × (-s t)
    = -s x is upwind. Between pin 1 and its web, 0 < angle < 60 deg, delta_f is negative; beyond the
    web, up to pin 2, positive.
    """
    axial = flexible_deflection.curves["both"].axial
    assert (axial[5:56] < 0.0).all()
    assert (axial[65:116] > 0.0).all()


@DEFLECTIONS
def test_the_clamp_takes_the_drive_torque_and_no_side_force(variant, request):
    deflection = request.getfixturevalue(variant)
    # The shaft drives the carrier: +T about x. Relative to 1 kN m, rounding of the solution.
    assert_allclose(deflection.reaction, [0.0, 0.0, 0.0, 1000.0, 0.0, 0.0], rtol=0.0, atol=1e-6)
    assert deflection.imbalance < 1e-11


@pytest.mark.parametrize("variant", ["flexible", "stiff"])
def test_the_half_sector_gives_the_curve_of_the_whole_carrier(variant, request, carrier, gear):
    force = gear_forces(1000.0, gear, 3).F_PLC
    load = (
        simply_supported_pin_load(1, force, 0.0, carrier)
        if variant == "flexible"
        else bonded_pin_load(1, force, 0.0, 3)
    )
    half = half_sector_curve(request.getfixturevalue(f"{variant}_half"), carrier, load)
    curve = request.getfixturevalue(f"{variant}_deflection").curves["tangential"]
    for kind in ("axial", "radial"):
        expected = getattr(curve, kind)
        assert_allclose(getattr(half, kind), expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_a_half_sector_refuses_the_tilting_moment(flexible_half, carrier):
    load = simply_supported_pin_load(1, 1000.0, 30.0, carrier)
    with pytest.raises(
        ValueError, match=r"load at pin_1_upwind is not antisymmetric about the pin's plane"
    ):
        half_sector_curve(flexible_half, carrier, load)


def test_the_four_curves_of_the_chain_carry_their_unit_loads(flexible_deflection, stiff_deflection):
    curves = named_curves(stiff_deflection, flexible_deflection)
    assert {name: curve.unit_load for name, curve in curves.items()} == {
        "delta_s": 1000.0, "delta_f": 1000.0, "g_s": 1.0, "g_f": 1.0
    }  # fmt: skip
    assert all(curve.name == name and curve.radius == 0.412 for name, curve in curves.items())
    assert curves["g_f"].axial is flexible_deflection.curves["pin_1"].axial
    assert curves["delta_s"].axial is stiff_deflection.curves["both"].axial
    assert list(flexible_deflection.curves) == [
        "tangential", "tilting", "both", "pin_1", "pin_2", "pin_3"
    ]  # fmt: skip


def test_a_body_without_sensor_circle_has_no_curve(pin_structure, one_pin_mesh, carrier):
    cases = {"both": {"pin_1_midspan": np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])}}
    with pytest.raises(
        ValueError,
        match="the body has no sensor circle; expected a carrier with the surface rim_face",
    ):
        carrier_deflection(pin_structure, np.unique(one_pin_mesh.surface("pin_1_upwind")), cases)


def test_a_load_on_the_pins_needs_a_carrier_with_pins(stiff_structure, carrier, gear):
    with pytest.raises(KeyError, match="stiff_carrier has no pilot 'pin_1_upwind'"):
        carrier_deflection(stiff_structure, np.arange(3), flexible_cases(carrier, gear))

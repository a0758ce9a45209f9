"""Mixes of two curves: exact where the answer is known, and never better than the freer kind."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.curve_mixes import convex_mix, least_squares_mix, nonnegative_mix
from carrierflex.fe.deflection_curves import DeflectionCurve

ANGLE = 2.0 * np.pi * np.arange(360) / 360
KINDS = (least_squares_mix, nonnegative_mix, convex_mix)


def curve(order_3, order_6, order_9=0.0, *, name="curve", radius=0.412, samples=360):
    angle = ANGLE[:samples]
    axial = 1e-7 * (
        order_3 * np.sin(3 * angle) + order_6 * np.sin(6 * angle) + order_9 * np.sin(9 * angle)
    )
    return DeflectionCurve(name, radius, 1000.0, axial, 2.0 * axial)


STIFF, FLEXIBLE = curve(-0.2, 0.3, name="stiff"), curve(-2.0, -0.2, name="flexible")


@pytest.mark.parametrize("mix", KINDS)
def test_a_mix_is_found_again(mix):
    made = curve(0.3 * -0.2 + 0.7 * -2.0, 0.3 * 0.3 + 0.7 * -0.2)
    result = mix(made, STIFF, FLEXIBLE)
    assert_allclose([result.rho_s, result.rho_f], [0.3, 0.7], rtol=1e-9)
    assert result.residual < 1e-9
    assert_allclose(result.curve.radial, made.radial, rtol=0.0, atol=1e-16)


def test_shares_need_not_add_up_to_one_except_in_the_convex_mix():
    made = curve(1.2 * -0.2 + 0.2 * -2.0, 1.2 * 0.3 + 0.2 * -0.2)
    free, convex = least_squares_mix(made, STIFF, FLEXIBLE), convex_mix(made, STIFF, FLEXIBLE)
    assert_allclose([free.rho_s, free.rho_f], [1.2, 0.2], rtol=1e-9)
    assert_allclose(convex.rho_s + convex.rho_f, 1.0, rtol=1e-14)
    # By hand, in units of (order 3, order 6): c - f = (1.36, 0.52), s - f = (1.8, 0.5).
    assert_allclose(convex.rho_s, (1.36 * 1.8 + 0.52 * 0.5) / (1.8**2 + 0.5**2), rtol=1e-9)
    assert convex.residual > 0.1


def test_a_negative_share_is_kept_out_of_the_nonnegative_mix():
    made = curve(-0.5 * -0.2 + 1.0 * -2.0, -0.5 * 0.3 + 1.0 * -0.2)
    assert_allclose(least_squares_mix(made, STIFF, FLEXIBLE).rho_s, -0.5, rtol=1e-9)
    result = nonnegative_mix(made, STIFF, FLEXIBLE)
    assert result.rho_s == 0.0
    # What is left is the projection on the flexible curve alone.
    a, b = np.array([-1.9, -0.35]), np.array([-2.0, -0.2])
    assert_allclose(result.rho_f, a @ b / (b @ b), rtol=1e-9)


def test_the_convex_mix_ends_at_the_curves_themselves():
    beyond = curve(-0.5 * -0.2 + 1.5 * -2.0, -0.5 * 0.3 + 1.5 * -0.2)
    result = convex_mix(beyond, STIFF, FLEXIBLE)
    assert (result.rho_s, result.rho_f) == (0.0, 1.0)


def test_what_neither_curve_holds_is_left():
    made = curve(-1.1, 0.05, 0.4)
    result = least_squares_mix(made, STIFF, FLEXIBLE)
    assert_allclose(result.residual, 0.4 / np.sqrt(1.1**2 + 0.05**2 + 0.4**2), rtol=1e-9)


def test_freer_mixes_never_leave_more():
    rng = np.random.default_rng(5)
    for _ in range(20):
        made = curve(*rng.standard_normal(3))
        residuals = [mix(made, STIFF, FLEXIBLE).residual for mix in KINDS]
        assert residuals[0] <= residuals[1] + 1e-12
        assert residuals[1] <= residuals[2] + 1e-12


def test_curves_that_cannot_be_compared_are_refused():
    with pytest.raises(
        ValueError, match=r"curve and flexible have radius 0.4 and 0.412; expected the same"
    ):
        least_squares_mix(
            curve(1.0, 0.0, radius=0.4), curve(1.0, 0.0, name="stiff", radius=0.4), FLEXIBLE
        )
    with pytest.raises(
        ValueError, match="curve and stiff have 180 and 360 samples; expected as many"
    ):
        nonnegative_mix(curve(1.0, 0.0, samples=180), STIFF, FLEXIBLE)
    with pytest.raises(ValueError, match="curve curve is zero everywhere"):
        convex_mix(curve(0.0, 0.0), STIFF, FLEXIBLE)

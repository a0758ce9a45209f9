"""The curve type itself: interpolation, orders and peaks of curves written down by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.deflection_curves import DeflectionCurve

ANGLE = 2.0 * np.pi * np.arange(360) / 360


def curve(axial, radial=None):
    return DeflectionCurve(
        "delta_f", 0.412, 1000.0, axial, np.zeros_like(axial) if radial is None else radial
    )


def shape(v):
    return 0.2 - 3.0 * np.sin(3 * v) + 0.5 * np.cos(7 * v)


@pytest.mark.parametrize("n", [16, 17, 360])
def test_a_curve_of_few_orders_is_exact_between_its_samples(n):
    v = 2.0 * np.pi * np.arange(n) / n
    asked = np.array([[0.1, -4.0], [7.7, 100.3]])
    result = curve(shape(v), 2.0 * shape(v))
    # Rounding: arguments reach 7 x 100 rad.
    assert_allclose(result.axial_at(asked), shape(asked), rtol=0.0, atol=1e-12)
    assert_allclose(result.radial_at(asked), 2.0 * shape(asked), rtol=0.0, atol=1e-12)


def test_samples_and_angles_belong_together():
    result = curve(shape(ANGLE))
    assert_allclose(result.angle, ANGLE, rtol=1e-15)
    assert_allclose(result.axial_at(result.angle), result.axial, rtol=0.0, atol=1e-13)
    assert result.axial_at(0.3).shape == ()


def test_orders_hold_cosine_as_real_and_sine_as_negative_imaginary_part():
    result = curve(shape(ANGLE))
    assert_allclose(result.axial_order(0), 0.2, rtol=1e-13)
    assert_allclose(result.axial_order(3), 3.0j, rtol=0.0, atol=1e-13)
    assert_allclose(result.axial_order(7), 0.5, rtol=0.0, atol=1e-13)
    expected = np.zeros(181)
    expected[[0, 3, 7]] = 0.2, 3.0, 0.5
    assert_allclose(result.axial_order_content(), expected, rtol=0.0, atol=1e-13)


def test_the_highest_order_of_an_even_number_of_samples_counts_once():
    result = curve(np.cos(4.0 * 2.0 * np.pi * np.arange(8) / 8))
    assert_allclose(result.axial_order_content()[4], 1.0, rtol=1e-14)
    assert_allclose(result.axial_order(4), 1.0, rtol=1e-14)


def test_peaks_lie_at_the_maxima():
    # -sin 3v is largest at 90, 210 and 330 deg; the search grid is 1/16 deg fine.
    assert_allclose(
        np.rad2deg(curve(-np.sin(3 * ANGLE)).peak_angles()),
        [90.0, 210.0, 330.0],
        rtol=0.0,
        atol=0.07,
    )


def test_a_peak_at_angle_zero_counts_once():
    assert_allclose(curve(np.cos(ANGLE)).peak_angles(), [0.0], rtol=0.0, atol=1e-12)


WRONG = [
    (np.zeros(7), np.zeros(7), "hold at least eight samples"),
    (
        np.zeros(9),
        np.zeros(8),
        r"axial \(9,\) and radial \(8,\) must be one-dimensional, equally long",
    ),
    (np.zeros((3, 3)), np.zeros((3, 3)), "one-dimensional"),
    (np.full(8, np.nan), np.zeros(8), "every displacement must be finite"),
    (np.zeros(8), np.full(8, np.inf), "every displacement must be finite"),
]


@pytest.mark.parametrize(("axial", "radial", "message"), WRONG)
def test_impossible_curves_are_refused(axial, radial, message):
    with pytest.raises(ValueError, match=rf"deflection curve delta_f: .*{message}"):
        DeflectionCurve("delta_f", 0.412, 1000.0, axial, radial)


def test_long_records_are_read_from_a_table_that_equals_the_series():
    rng = np.random.default_rng(3)
    curve = DeflectionCurve("rough", 0.412, 1.0, rng.standard_normal(360), rng.standard_normal(360))
    angle = rng.uniform(-50.0, 50.0, 20000)
    for at in (curve.axial_at, curve.radial_at):
        pieces = np.concatenate([at(piece) for piece in np.split(angle, 10)])
        assert_allclose(at(angle), pieces, rtol=0.0, atol=1e-9)

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.view import curves_figure, deformed_picture, orders_over_fit_figure
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve


def test_the_curves_figure_draws_both_curves_closed_and_marks_their_peaks():
    stiff, flexible = stiff_curve(), flexible_curve()
    figure = curves_figure(stiff, flexible, 3)
    for axis, curve, n_peaks in zip(figure.axes, (stiff, flexible), (6, 3), strict=True):
        line, peaks = axis.lines[0], axis.lines[1]
        assert_allclose(line.get_xdata()[[0, -1]], [0.0, 360.0], rtol=0.0, atol=1e-12)
        assert_allclose(line.get_ydata()[:-1], curve.axial * 1e6, rtol=1e-14)
        assert len(peaks.get_xdata()) == n_peaks
        assert f"{n_peaks} peaks" in axis.get_legend().get_texts()[0].get_text()


def test_the_orders_over_the_fit_are_lines_between_the_two_whole_models():
    stiff, flexible = stiff_curve(), flexible_curve()
    mixed = {1e6: flexible, 1e4: flexible, 1e8: stiff}
    figure = orders_over_fit_figure(mixed, flexible, stiff, 3)
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    order_3 = lines["order 3"]
    assert_allclose(order_3.get_xdata(), [1e4, 1e6, 1e8], rtol=1e-12)
    expected = [curve.axial_order_content()[3] * 1e6 for curve in (flexible, flexible, stiff)]
    assert_allclose(order_3.get_ydata(), expected, rtol=1e-12)
    ends = figure.axes[0].lines[1]
    assert_allclose(ends.get_xdata(), [1e3, 1e9], rtol=1e-12)
    assert_allclose(ends.get_ydata(), expected[::2], rtol=1e-12)


@pytest.mark.long
def test_the_deformed_picture_shows_opposite_colours_on_a_tilting_body(one_pin_mesh):
    u = np.zeros_like(one_pin_mesh.points)
    u[:, 0] = 1e-6 * (one_pin_mesh.points[:, 2] - 0.308)
    picture = deformed_picture(one_pin_mesh, u, "tilt").astype(int)
    redder = picture[..., 0] - picture[..., 2]
    assert (redder > 60).any()
    assert (redder < -60).any()


@pytest.mark.long
def test_the_deformed_picture_marks_points_by_name_and_has_the_arrow_of_the_torque(one_pin_mesh):
    u = np.zeros_like(one_pin_mesh.points)
    u[:, 0] = 1e-6
    plain, marked = (
        deformed_picture(one_pin_mesh, u, "shift", **options).astype(int)
        for options in (
            {},
            {
                "labels": {"pin 1": np.array([0.1, 0.0, 0.308])},
                "torque_at": np.array([-0.05, 0.0, 0.308]),
            },
        )
    )
    changed = np.abs(plain - marked).max(axis=2) > 60
    assert changed.mean() > 1e-3

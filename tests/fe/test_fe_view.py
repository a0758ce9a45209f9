import numpy as np
from numpy.testing import assert_allclose

from carrierflex.fe.view import curves_figure, deformed_picture, order_content_figure
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


def test_the_order_figure_draws_orders_3_to_12_in_micrometres():
    figure = order_content_figure(["flexible"], [flexible_curve()], 3)
    heights = [bar.get_height() for bar in figure.axes[0].patches]
    assert_allclose(heights, [0.19, 0.017, 0.0, 0.0], rtol=0.0, atol=1e-9)


def test_the_deformed_picture_shows_opposite_colours_on_a_tilting_body(one_pin_mesh):
    u = np.zeros_like(one_pin_mesh.points)
    u[:, 0] = 1e-6 * (one_pin_mesh.points[:, 2] - 0.308)
    picture = deformed_picture(one_pin_mesh, u, "tilt").astype(int)
    redder = picture[..., 0] - picture[..., 2]
    assert (redder > 60).any()
    assert (redder < -60).any()

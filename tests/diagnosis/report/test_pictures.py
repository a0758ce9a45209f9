from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.pictures import mean_turns, pins_passing, polar_pictures
from carrierflex.diagnosis.comparison.overlay import (
    GAP,
    LAW,
    REMAINDER,
    is_function,
    strip_means,
)
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.report.figures import panel_figure
from carrierflex.identification.campaign.order_analysis import highest_order
from tests.diagnosis.carrier.carrier_twin import NOISE, twin_problem
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    STIFFNESS,
    displacement_campaign,
    force_campaign,
)

MAX_ORDER = highest_order(3)
K3, FRICTION = 5e8, 1.5


def pictures_of(problem, effects):
    fit = fit_effects(problem, effects)
    return problem.pictures(fit.effects, fit.theta)


def traces(panel):
    return {trace.role: trace for trace in panel.traces}


@pytest.fixture(scope="module")
def cubic():
    return element_problem(displacement_campaign(lambda q, v: K3 * q**3, n=1500))


@pytest.fixture(scope="module")
def rubbing():
    return element_problem(displacement_campaign(lambda q, v: FRICTION * np.tanh(v / 1e-4), n=1500))


def test_unexplained_force_of_a_cubic_spring_is_its_cube(cubic):
    (picture,) = pictures_of(cubic, ("cubic_stiffness",))
    assert (picture.x_unit, picture.y_unit) == ("m", "N")
    for panel in picture.panels:
        by_name = traces(panel)
        x, y = by_name[GAP].x, by_name[GAP].y
        # Noise of 0.05 N on forces of several: the slope over the cube is good to a per cent where
        # those are large.
        assert_allclose(x**3 @ y / (x**3 @ x**3), K3, rtol=0.05)
        assert np.std(y - K3 * x**3) < 0.06
        assert_allclose(
            by_name[LAW].y, K3 * by_name[LAW].x ** 3, atol=0.05 * np.abs(by_name[LAW].y).max()
        )


def test_one_run_of_each_condition_is_drawn_the_largest_force_first(cubic):
    (picture,) = pictures_of(cubic, ("cubic_stiffness",))
    assert [panel.title for panel in picture.panels] == ["run R2", "run R1", "run R0"]
    records = tuple(replace(record, condition="one") for record in cubic.records)
    (picture,) = pictures_of(replace(cubic, records=records), ("cubic_stiffness",))
    assert [panel.title for panel in picture.panels] == ["run R2"]


def test_dry_friction_is_a_loop_over_deflection_and_a_line_over_speed(rubbing):
    # The true parameters, not fitted ones: in so short a record friction and viscous damping trade
    # a few per cent.
    truth = {"m": 0.0, "K1": STIFFNESS, "C1": DAMPING, "f0": 0.0, "Fc": FRICTION}
    theta = np.array(
        [truth[parameter.name] for parameter in rubbing.parameters(("coulomb_friction",))]
    )
    over_deflection, over_speed = rubbing.pictures(("coulomb_friction",), theta)
    for picture, is_line in ((over_deflection, False), (over_speed, True)):
        law = traces(picture.panels[0])[LAW]
        assert is_function(law.x, law.y) == is_line
    gap = traces(over_speed.panels[0])[GAP]
    fast = np.abs(gap.x) > 0.3 * np.abs(gap.x).max()
    # The end of the trusted band rings about the step of the force; its mean is the force.
    assert_allclose(np.mean(gap.y[fast] * np.sign(gap.x[fast])), FRICTION, rtol=0.02)
    assert over_speed.x_unit == "m/s"


def test_without_an_accepted_effect_the_gap_of_the_baseline_is_drawn_and_no_law(cubic):
    pictures = pictures_of(cubic, ())
    assert len(pictures) == 2
    assert all(set(traces(panel)) == {GAP} for picture in pictures for panel in picture.panels)
    largest = traces(pictures[0].panels[0])[GAP]
    # The refitted linear spring takes its share of the cube: (1 - 9/15)^1/2 is left of that of a
    # Gaussian motion.
    assert 0.4 < largest.y.std() / np.std(K3 * largest.x**3) < 0.8


@pytest.mark.long
def test_a_force_driven_element_shows_the_same_law():
    # Under a force of 8 N the motion is chaotic: rounding decides which one is met.
    problem = element_problem(force_campaign(lambda q, v: 2e9 * q**3, amplitudes=(2.0, 3.0, 5.0)))
    (picture,) = pictures_of(problem, ("cubic_stiffness",))
    by_name = traces(picture.panels[0])
    assert_allclose(
        by_name[GAP].x ** 3 @ by_name[GAP].y / np.sum(by_name[GAP].x ** 6), 2e9, rtol=0.05
    )


def test_what_the_baseline_already_contains_is_no_gap(cubic):
    problem = replace(cubic, model=replace(cubic.model, contained=("cubic_stiffness",)))
    gap = traces(pictures_of(problem, ())[0].panels[0])[GAP]
    assert gap.y.std() < 0.06


def test_a_missing_gap_between_stops_is_drawn_with_its_stiffness():
    size = 4e-4
    problem = element_problem(
        displacement_campaign(lambda q, v: -STIFFNESS * np.clip(q, -size, size), n=1500)
    )
    picture = pictures_of(problem, ("backlash",))[0]
    law = traces(picture.panels[0])[LAW]
    assert_allclose(np.abs(law.y).max(), STIFFNESS * size, rtol=0.1)


def test_polar_plot_of_a_tilted_carrier_is_its_order_one_and_nothing_is_left():
    problem = twin_problem("carrier_tilt", loads=((1.0, 0, 0), (0.5, 0, 0)), turns=8)
    by_sensor, by_run = pictures_of(problem, ("carrier_tilt",))
    assert by_sensor.is_polar
    # KNOWN and INJECTED of the twin: one and the same effect twice; the baseline lacks both.
    size = 0.412 * np.hypot(3e-4 + 5e-5, 5e-4 + 1e-4)
    assert [panel.title for panel in by_run.panels] == ["run run1", "run run2"]
    for panel in (*by_sensor.panels, *by_run.panels):
        by_name = traces(panel)
        order_one = 2.0 * np.mean(by_name[GAP].y[:-1] * np.exp(-1j * by_name[GAP].x[:-1]))
        assert_allclose(np.abs(order_one), size, rtol=0.02)
        assert_allclose(by_name[GAP].y, by_name[LAW].y + by_name[REMAINDER].y, atol=1e-12)
        assert np.std(by_name[REMAINDER].y) < NOISE


def test_mean_turns_average_revolutions_and_leave_out_sparse_ones():
    orders = np.zeros((4, 2, MAX_ORDER + 1), dtype=complex)
    orders[:, 0, 0], orders[:, 1, 3] = 2.0, [1.0, 3.0, np.nan, np.nan]
    turns = mean_turns(orders, np.array([0, 0, 0, 1]), 2)
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    assert_allclose(turns[0, 0], 2.0)
    assert_allclose(turns[0, 1], 2.0 * np.cos(3.0 * angle), atol=1e-12)
    assert np.isnan(turns[1]).all()


def test_polar_plots_leave_out_what_is_small_and_are_none_without_a_revolution():
    wave = np.cos(np.linspace(0.0, 2.0 * np.pi, 181))
    gap = np.array([[0.05 * wave, wave, 0.5 * wave]])
    names = {
        "runs": ("A",),
        "channels": ("a", "b", "c"),
        "passing": ({}, {"1": 0.4, "2": 2.5, "3": 4.6}, {}),
        "highest": 12,
    }
    picture, *others = polar_pictures(gap, 0.0 * gap, (), **names)
    assert picture.panels[0].marks == {"1": 0.4, "2": 2.5, "3": 4.6}
    assert "orders 0 to 12; " in picture.caption
    assert "flexible pins have three lobes" in picture.caption
    assert [panel.title for panel in picture.panels] == ["sensor b", "sensor c"]
    assert "1 sensor with a smaller gap is not drawn" in picture.caption
    assert others == []
    assert polar_pictures(np.nan * gap, gap, (), **names) == ()


def test_a_pin_is_marked_where_the_sensor_reads_its_bore():
    # At that carrier angle the curve under the sensor is the curve at the pin.
    for pin, theta in pins_passing(np.deg2rad(47.0), 3).items():
        assert_allclose(rem(np.deg2rad(47.0) - theta), rem(np.deg2rad(120.0 * (int(pin) - 1))))


def rem(angle):
    return np.round(angle % (2.0 * np.pi), 9)


def test_strips_keep_a_line_and_average_its_scatter():
    rng = np.random.default_rng(3)
    x = rng.uniform(-1.0, 1.0, 20_000)
    mean_x, mean_y = strip_means(x, 2.0 * x + rng.standard_normal(x.size))
    assert_allclose(mean_y, 2.0 * mean_x, atol=0.2)


def test_figures_scale_their_units(cubic):
    (picture,) = pictures_of(cubic, ("cubic_stiffness",))
    axes = panel_figure(picture, picture.panels[0]).axes[0]
    assert axes.get_xlabel() == "deflection [mm]"
    points = axes.collections[0].get_offsets()
    assert_allclose(
        np.abs(points[:, 0]).max(), 1e3 * np.abs(traces(picture.panels[0])[GAP].x).max()
    )


def test_pictures_and_overlays_of_a_carrier_keep_no_turns_twice():
    problem = twin_problem("carrier_tilt", loads=((1.0, 0, 0), (0.5, 0, 0)), turns=3)
    fit = fit_effects(problem, ("carrier_tilt",))
    # A view would keep the turns of all sensors in all runs, which are many more than six.
    for picture in problem.pictures(fit.effects, fit.theta):
        assert all(trace.y.base is None for panel in picture.panels for trace in panel.traces)
    before, after = (
        problem.overlays(effects, fit_effects(problem, effects).theta)
        for effects in ((), fit.effects)
    )
    assert len({id(overlay.x) for overlay in before}) == 1
    for old, new in zip(before, after, strict=True):
        assert np.shares_memory(old.measured, new.measured)

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.identification.carrier.carrier_identification import (
    axial_channels,
    fitted_signal,
    identify_each_run,
)
from carrierflex.identification.carrier.models import flexible_model, rigid_model
from carrierflex.identification.view import parameters_figure, rms_figure, signals_figure
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

CAMPAIGN = carrier_campaign()
M1, M2 = rigid_model(), flexible_model(stiff_curve(), flexible_curve())
ESTIMATES = {model.name: identify_each_run(CAMPAIGN, model) for model in (M1, M2)}


def test_signals_figure_shows_two_revolutions_of_every_axial_sensor():
    run, channels = CAMPAIGN.runs[0], axial_channels(CAMPAIGN)
    fits = [(M1, ESTIMATES["m1"]["LC1"]), (M2, ESTIMATES["m2"]["LC1"])]
    figure = signals_figure(run, channels, fits)
    assert len(figure.axes) == 4
    measured, _, m2 = figure.axes[1].lines
    turns = measured.get_xdata()
    assert 1.9 < turns[-1] < 2.0
    assert_allclose(measured.get_ydata(), 1e3 * run.signals["s137"][: turns.size])
    assert_allclose(m2.get_ydata(), 1e3 * fitted_signal(run, channels[1], *fits[1])[: turns.size])


def test_signals_figure_says_how_far_the_models_are_from_the_data_in_the_mean():
    """A sensor whose zero is 0.1 mm off leaves an offset, which no RMS shows."""
    run, channels = CAMPAIGN.runs[0], axial_channels(CAMPAIGN)
    moved = replace(run, signals={**run.signals, "s137": run.signals["s137"] + 1e-4})
    figure = signals_figure(moved, channels, [(M2, ESTIMATES["m2"]["LC1"])])
    assert "M2 0.100 mm RMS, mean +0.100" in figure.axes[1].get_title()
    assert "mean +0.000" in figure.axes[0].get_title().replace("-0.000", "+0.000")


def test_rms_figure_draws_every_run_and_model_in_millimetres():
    bars = rms_figure(ESTIMATES).axes[0].patches
    expected = [1e3 * ESTIMATES[model][run].rms for model in ("m1", "m2") for run in ("LC1", "LC2")]
    assert_allclose([bar.get_height() for bar in bars], expected)


def test_parameters_figure_has_a_panel_for_every_parameter_in_plotting_units():
    figure = parameters_figure(ESTIMATES)
    assert figure.legends[0].get_title().get_text() == "bars: 95 % intervals"
    panels = {panel.get_ylabel(): panel for panel in figure.axes}
    assert len(panels) == 7
    drawn = {
        label: panel.containers[0].lines[0].get_ydata().astype(float)
        for label, panel in panels.items()
    }
    assert_allclose(drawn[r"$\theta_{PLC}$ [deg]"], np.rad2deg(1.05), rtol=0.01)
    assert_allclose(drawn["$d_x$ [mm]"], [0.1, 0.06], rtol=0.02)

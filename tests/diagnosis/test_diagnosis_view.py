import numpy as np
from numpy.testing import assert_allclose

from diagnosis.gap_map import gap_map
from diagnosis.shrinkage import shrinkage
from diagnosis.view import cell_rms_um, gap_map_figure, ladder_figure
from identification.carrier_models import AXIAL_OFFSET, CARRIER_TILT, CarrierModel, flexible_model
from tests.identification.synthetic_campaigns import TRUTH, carrier_campaign
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

CAMPAIGN = carrier_campaign()


def test_gap_map_figure_draws_both_maps_in_micrometres():
    before = gap_map(CAMPAIGN, CarrierModel("axial_offset", (AXIAL_OFFSET,)))
    after = gap_map(CAMPAIGN, flexible_model(stiff_curve(), flexible_curve()))
    assert_allclose(cell_rms_um(before)[1, 1], 1e6 * 0.412 * TRUTH.phi_PLC / np.sqrt(2.0), rtol=0.01)
    figure = gap_map_figure(before, after)
    image = figure.axes[0].images[0]
    assert image.get_array().shape == (4, 13)
    assert_allclose(image.get_array()[1, 1], cell_rms_um(before)[1, 1])


def test_ladder_figure_draws_every_run_the_whole_and_the_floor():
    result = shrinkage(CAMPAIGN, [AXIAL_OFFSET], [CARRIER_TILT])
    lines = ladder_figure(result).axes[0].lines
    assert [line.get_label() for line in lines] == ["LC1", "LC2", "all runs", "noise floor"]
    assert_allclose(lines[2].get_ydata(), 1e6 * result.rms)

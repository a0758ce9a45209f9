import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.gap.findings import Scalar, cell_validations, scalar_gaps
from carrierflex.diagnosis.report.diagnosis_files import diagnosis_document
from tests.diagnosis.carrier.carrier_twin import INJECTED, KNOWN, twin_problem

pytestmark = pytest.mark.long


def cell(square, coherent, p_value=1e-9, order=1.0):
    return GapCell("m=+1", order, "R", square, coherent, 0.5, (0.4, 0.6), p_value)


def test_error_and_uncertainty_of_a_cell_by_hand():
    before = (
        cell(25e-12, 16e-12),
        cell(4e-12, 1e-12, order=2.0),
        cell(9e-12, 9e-12, p_value=0.5, order=3.0),
    )
    after = (cell(1e-12, -8e-12), cell(1e-12, 1e-12, order=2.0), cell(1e-12, 1e-12, order=3.0))
    first, second = cell_validations(before, after, 4e-6)
    assert_allclose(
        [first.error_before, first.error_after, first.u_val], [5e-6, 1e-6, 5e-6], rtol=1e-12
    )
    # Not beyond its uncertainty: no shrink may be claimed there.
    assert not first.is_beyond
    assert second.order == 2.0
    assert cell_validations(before, after, 0.0)[0].is_beyond


def test_area_between_distributions_is_their_shift_or_their_change_of_width():
    measured = np.linspace(0.0, 1.0, 101)
    shifted, wide = (
        Scalar("a", "m", measured, measured - 0.3),
        Scalar("b", "m", measured, 2.0 * measured - 0.5),
    )
    same = Scalar("a", "m", measured, measured[::-1]), Scalar("b", "m", measured, measured)
    gaps = scalar_gaps((shifted, wide), same)
    # The same mean with twice the width: integral of |x - 1/2| over the distribution.
    assert_allclose([each.area_before for each in gaps], [0.3, 0.25], rtol=0.02)
    assert_allclose([each.area_after for each in gaps], 0.0, atol=1e-12)


@pytest.fixture(scope="module")
def swash():
    return diagnose(twin_problem("carrier_tilt", turns=8), campaign="twin", kind="carrier")


def test_the_tilt_at_1x_closes_once_it_is_named(swash):
    assert swash.attribution.effects == ("carrier_tilt",)
    tilt = next(scalar for scalar in swash.gap.scalars if scalar.name == "1X axial")
    # R phi at R = 0.412 m; both components of the tilt are missing, that of the twin and the
    # injected one.
    components = np.add(KNOWN["carrier_tilt"], INJECTED["carrier_tilt"])
    assert_allclose(tilt.area_before, 0.412 * np.hypot(*components), rtol=0.01)
    assert tilt.area_after < 0.02 * tilt.area_before
    cells = [
        tilt_cell
        for tilt_cell in swash.gap.cells
        if (tilt_cell.channel_pattern, tilt_cell.order) == ("m=+1", 1.0)
    ]
    assert len(cells) == 6
    assert all(
        tilt_cell.is_beyond and tilt_cell.error_after < 0.05 * tilt_cell.error_before
        for tilt_cell in cells
    )


def test_the_file_holds_the_gap_beyond_the_map_and_the_contract_as_before(swash):
    document = diagnosis_document(swash)
    json.dumps(document, allow_nan=False)
    gap = document["gap"]
    assert set(gap) == {
        "text",
        "parity",
        "in_time",
        "drift",
        "incoherent",
        "growth",
        "cells",
        "scalars",
    }
    assert set(gap["in_time"][0]) == {"run", "time", "rms"}
    assert {row["run"] for row in gap["in_time"]} == {f"run{k}" for k in range(1, 7)}
    assert gap["growth"][0]["frame"] == "carrier"
    assert abs(gap["growth"][0]["exponents"]["torque"]["value"]) < 0.1
    assert gap["text"] in document["where_text"]
    contract = {"channel_pattern", "order", "run", "share", "share_ci95", "p_value"}
    assert all(contract <= set(row) for row in document["where"])

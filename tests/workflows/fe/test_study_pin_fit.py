"""The study of the pin fit on a coarse mesh.

Its ends are exact, its conclusions those of the docs.
"""

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.pin_fit import pin_fit_row
from carrierflex.workflows.fe import study_pin_fit
from carrierflex.workflows.fe.pin_fit_pictures import MORE_PEAKS, RESIDUALS
from carrierflex.workflows.screen.tables import pin_fit_table
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long

COARSE = 0.06


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pin_fit")


@pytest.fixture(scope="module")
def study(folder):
    return study_pin_fit.main(out=folder, size=COARSE, points_per_decade=1, quiet=True)


def rows_of(study, axial):
    return [row for row in study.rows if row.axial == axial]


def test_sliding_pins_without_stiffness_are_the_flexible_carrier_exactly(study):
    row = rows_of(study, "sliding")[0]
    assert row.stiffness == 0.0
    assert_allclose([row.rho_s, row.rho_f, row.residual], [0.0, 1.0, 0.0], rtol=0.0, atol=1e-8)


def test_both_ends_of_the_sweep_are_their_own_mix(study):
    for axial in ("tied", "sliding"):
        first, last = rows_of(study, axial)[0], rows_of(study, axial)[-1]
        assert (first.stiffness, last.stiffness) == (0.0, np.inf)
        assert_allclose(
            [first.rho_rigid, first.rho_free, last.rho_rigid, last.rho_free],
            [0, 1, 1, 0],
            rtol=0.0,
            atol=1e-9,
        )


def test_three_peaks_become_six_once_between_1e7_and_1e8(study):
    peaks = [row.peaks for row in study.tied]
    assert sorted(peaks) == peaks
    assert set(peaks) == {3, 6}
    change = study.changes[MORE_PEAKS]
    assert 1e7 < change < 1e8
    for factor, expected in ((0.99, 3), (1.01, 6)):
        assert pin_fit_row(study.family, factor * change, study.extremes).peaks == expected


def test_the_rms_of_table_4_is_met_where_the_study_says(study):
    row = pin_fit_row(study.family, study.changes["RMS of Table 4"], study.extremes)
    assert_allclose(row.rms, 0.083e-6, rtol=1e-4)
    assert_allclose(
        row.rms, np.sqrt(sum(order**2 for order in row.orders.values()) / 2.0), rtol=2e-3
    )


def test_a_mix_represents_every_fit_but_its_shares_are_no_fractions(study):
    rho_s, rho_f, residual = np.array(
        [(row.rho_s, row.rho_f, row.residual) for row in study.tied]
    ).T
    assert (np.diff(rho_s) > 0.0).all()
    assert (np.diff(rho_f) < 0.0).all()
    assert residual.max() < 0.1
    # A rigid fit is softer than bonded pins: more than all of the stiff curve, and some of the
    # flexible one.
    assert rho_s[-1] > 1.1
    assert 0.05 < rho_f[-1] < 0.3
    assert study.worst["tied"]["residual_convex"]["residual"] > 2.0 * residual.max()
    # The family itself is all but a straight line between its own ends.
    assert study.worst["tied"]["residual_ends"]["residual"] < 0.01
    assert study.worst["tied"]["residual_ends"]["residual"] > 1e-5


def test_sliding_or_tied_makes_no_difference_that_a_sensor_could_see(study):
    for tied, sliding in zip(rows_of(study, "tied"), rows_of(study, "sliding"), strict=True):
        assert_allclose(sliding.rms, tied.rms, rtol=2e-3)
        assert abs(sliding.residual - tied.residual) < 2e-3


def test_table_json_and_pictures_are_written(study, folder):
    with (folder / "pin_fit.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(study.rows)
    assert [float(row["residual"]) for row in rows] == pytest.approx(
        [row.residual for row in study.rows], rel=1e-8
    )
    assert float(rows[len(study.tied) - 1]["stiffness"]) == np.inf
    content = checked_document(folder / "pin_fit.json")
    assert set(content["worst"]["tied"]) == set(RESIDUALS)
    assert content["stiffness_of_changes"] == pytest.approx(study.changes)
    for name in ("pin_fit.png", "pin_fit_mixes.png"):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    pin_fit_table(study)


def test_a_useless_number_of_points_is_refused_before_any_work(tmp_path):
    with pytest.raises(ValueError, match="--points-per-decade is 0; expected 1 to 1000"):
        study_pin_fit.main(out=tmp_path / "out", points_per_decade=0)
    assert not (tmp_path / "out").exists()


def test_a_change_outside_the_range_is_refused(study):
    with pytest.raises(ValueError, match=r"nothing changes between 1e\+04 and 1e\+06 N m/rad"):
        study.family.stiffness_where(lambda curve: len(curve.peak_angles()) > 3, 1e4, 1e6)

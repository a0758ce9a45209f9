import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.gap_files import write_gap_csv, write_gap_json
from diagnosis.gap_map import gap_map
from diagnosis.gap_words import gap_parts, where_text
from diagnosis.order_map import PATTERNS
from identification.carrier_models import AXIAL_OFFSET, CarrierModel, flexible_model
from tests.identification.synthetic_campaigns import SENSORS, TRUTH, carrier_campaign, run_case
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

OFFSET = CarrierModel("axial_offset", (AXIAL_OFFSET,))
M2 = flexible_model(stiff_curve(), flexible_curve())
SADDLED = [run_case("LC1", replace(TRUTH, saddle=1e-4)), run_case("LC2", TRUTH)]


def cell(order, m):
    return order, PATTERNS.index(m)


def test_the_map_of_the_offset_holds_each_effect_in_its_own_cell():
    gap = gap_map(carrier_campaign(SADDLED), OFFSET)
    tilt, housing = 0.412 * TRUTH.phi_PLC, 0.412 * TRUTH.phi_H
    third = 360.0 * (0.19e-6 * TRUTH.rho_f + 0.01e-6 * TRUTH.rho_s)
    sixth = 360.0 * (0.017e-6 * TRUTH.rho_f + 0.05e-6 * TRUTH.rho_s)
    # Torque ripple of 1 % and noise of 5 um / sqrt(8 revolutions of 54 samples) bound the agreement.
    assert_allclose(gap.coherent[0][cell(1, 1)], tilt**2 / 2, rtol=0.01)
    assert_allclose(gap.coherent[0][cell(0, 1)], (housing / 2) ** 2, rtol=0.02)
    assert_allclose(gap.coherent[0][cell(0, -1)], (housing / 2) ** 2, rtol=0.02)
    assert_allclose(gap.coherent[0][cell(0, 2)], 1e-4**2, rtol=0.02)
    assert_allclose(gap.coherent[0][cell(3, -1)], third**2 / 2, rtol=0.05)
    assert_allclose(gap.coherent[0][cell(6, 2)], sixth**2 / 2, rtol=0.15)
    named = [cell(1, 1), cell(0, 1), cell(0, -1), cell(0, 2), cell(3, -1), cell(6, 2)]
    rest = gap.coherent[0].copy()
    for place in named:
        assert gap.adjusted_p_value[0][place] < 1e-6
        rest[place] = 0.0
    assert rest.max() < 1e-12  # a micrometre


def test_shares_add_to_one_and_noise_is_neither_clipped_nor_counted():
    gap = gap_map(carrier_campaign(SADDLED), OFFSET)
    assert_allclose(gap.share.sum(axis=(1, 2)), 1.0, rtol=1e-12)
    assert_allclose(gap.overall_share.sum(), 1.0, rtol=1e-12)
    quiet = np.ones(gap.coherent.shape, dtype=bool)
    for place in (cell(1, 1), cell(0, 1), cell(0, -1), cell(0, 2), cell(3, -1), cell(6, 2)):
        quiet[:, *place] = False
    assert (gap.coherent[quiet] < 0.0).mean() > 0.3


def test_p_values_of_cells_without_a_gap_are_uniform():
    p_values = []
    for seed in range(12):
        gap = gap_map(carrier_campaign(SADDLED, seed=seed), M2)
        p_values.append(gap.p_value[1, 7:12].ravel())
    p_values = np.concatenate(p_values)  # 240 cells
    for level in (0.1, 0.5):
        assert_allclose((p_values < level).mean(), level, atol=0.1)


def test_the_map_adds_up_to_the_mean_square_of_the_residual():
    gap = gap_map(carrier_campaign(SADDLED, noise_std=0.0), OFFSET)
    assert_allclose(gap.mean_square.sum(axis=(1, 2)), gap.rms**2, rtol=0.005)


def test_the_sentence_names_pattern_share_and_runs():
    text = where_text(gap_map(carrier_campaign(SADDLED), OFFSET))
    first, second, third = text.split("; ")
    assert first.endswith("of the gap is order 1, pattern m = +1 (tilt fixed to the carrier), in every run")
    assert second.endswith("is order 0, pattern m = ±1 (tilt fixed to the housing), in every run")
    assert third.endswith("is order 0, pattern m = 2 (saddle fixed to the housing), in LC1")
    shares = [int(part.split(" %")[0]) for part in (first, second, third)]
    tilt, housing, saddle = (0.412 * TRUTH.phi_PLC) ** 2 / 2, (0.412 * TRUTH.phi_H) ** 2 / 2, 1e-8 / 2
    assert_allclose(shares, 100 * np.array([tilt, housing, saddle]) / (tilt + housing + saddle), atol=2)


def test_without_a_gap_the_sentence_says_so():
    clean = carrier_campaign([run_case("LC1", TRUTH)])
    assert "stands out" in where_text(gap_map(clean, M2))


def test_parts_hold_every_share_once_and_largest_first():
    gap = gap_map(carrier_campaign(SADDLED), OFFSET)
    parts = gap_parts(gap)
    assert_allclose(sum(part.share for part in parts), 1.0, rtol=1e-12)
    assert [part.share for part in parts] == sorted((part.share for part in parts), reverse=True)


def test_sequence_of_runs_and_channels_does_not_matter():
    campaign = carrier_campaign(SADDLED)
    turned = replace(campaign, runs=campaign.runs[::-1], channels=campaign.channels[::-1])
    first, second = gap_map(campaign, OFFSET), gap_map(turned, OFFSET)
    assert second.runs == first.runs[::-1]
    assert_allclose(second.coherent[::-1], first.coherent, rtol=1e-6, atol=1e-18)


@pytest.mark.parametrize(
    ("campaign", "message"),
    [
        (carrier_campaign(sensors=SENSORS[:3]), "expected four sensors 90 deg apart"),
        (carrier_campaign([run_case(duration=4.0)]), "run LC1: 1 complete revolutions .*; expected at least two"),
        (carrier_campaign([run_case(sample_rate=8.0)]), "run LC1: 0 complete revolutions with samples dense enough"),
    ],
)
def test_what_cannot_be_mapped_is_refused(campaign, message):
    with pytest.raises(ValueError, match=message):
        gap_map(campaign, OFFSET)


def test_files_hold_every_cell(tmp_path):
    gap = gap_map(carrier_campaign(SADDLED), OFFSET)
    write_gap_json(tmp_path / "gap_map.json", gap)
    write_gap_csv(tmp_path / "gap_map.csv", gap)
    document = json.loads((tmp_path / "gap_map.json").read_text())
    assert document["where_text"] == where_text(gap)
    assert document["baseline"] == "axial_offset"
    assert document["parts"][0]["order"] == 1
    with (tmp_path / "gap_map.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(document["cells"]) == 2 * 13 * 4
    for row, entry in zip(rows, document["cells"], strict=True):
        assert float(row["coherent"]) == entry["coherent"]
    row = next(r for r in rows if (r["run"], r["order"], r["pattern"]) == ("LC2", "3", "-1"))
    assert float(row["share"]) == gap.share[1][cell(3, -1)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gap_map.csv", "gap_map.json"]

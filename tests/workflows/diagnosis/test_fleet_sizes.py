"""Sizes that a diagnosis.json states: the gap above its noise, parameters, classes."""

import numpy as np
import pytest

from carrierflex.workflows.diagnosis.fleet_sizes import (
    GAP,
    RMS,
    campaign_row,
    shown_size,
    size_name,
)

FLOOR, EXCESS = 3e-6, 4e-6


def document(*, scatter=0.02, n_blocks=60, seed=1, **keys):
    """What a row reads of a diagnosis whose baseline leaves EXCESS above the noise."""
    rng = np.random.default_rng(seed)
    square = (FLOOR**2 + EXCESS**2) * (1.0 + scatter * rng.standard_normal(n_blocks))
    blocks = [{"condition": "one", "samples": 400, "mean_square": float(one)} for one in square]
    far = {"noise_floor": FLOOR, "rho": None, "rho_ci95": [None, None]}
    return {
        "kind": "carrier", "unit": "m", "verdict": "class_named", "headline": "", "reason_id": "",
        "effects": [], "classes": [], "parameters": {}, "warnings": [],
        "how_far": far, "held_out": blocks, **keys,
    }  # fmt: skip


def test_the_gap_is_what_lies_above_the_noise_and_its_interval_holds():
    inside = []
    for seed in range(200):
        (size,) = campaign_row(document(seed=seed, scatter=0.3), "T1/a", "T1", "").sizes
        inside.append(size.ci95[0] < EXCESS < size.ci95[1])
    assert (size.cause, size.parameter, size.is_named) == (GAP, RMS, False)
    # Sixty blocks: 0.95 within the scatter of 200 intervals, and a bootstrap's smallness.
    assert 0.89 < np.mean(inside) <= 1.0
    row = campaign_row(document(scatter=1e-6), "T1/a", "T1", "")
    assert row.gap_floors == pytest.approx(EXCESS / FLOOR, rel=1e-5)


def test_loads_that_are_alike_on_all_days_are_in_the_error_but_not_between_repeats():
    far = {"noise_floor": FLOOR, "rho": None, "rho_ci95": [None, None]}
    rng = np.random.default_rng(2)
    blocks = [
        {"condition": name, "samples": 400,
         "mean_square": float(FLOOR**2 + (k * EXCESS) ** 2 * (1.0 + 0.02 * rng.standard_normal()))}
        for k, name in enumerate(("idle", "half", "full", "over")) for _ in range(15)
    ]  # fmt: skip
    row = campaign_row(document(held_out=blocks, how_far=far), "T1/a", "T1", "")
    (size,) = row.sizes
    assert row.conditions == ("full", "half", "idle", "over")
    # Squares of 0, 1, 4 and 9: a standard deviation of 1.75 about 3.5 in their mean, half in its
    # root; within the conditions 2 % of a block in the larger ones.
    np.testing.assert_allclose(size.std / size.value, 0.25, rtol=0.15)
    expected = 0.5 * 0.02 * np.sqrt((81.0 + 16.0 + 1.0) * 15.0) / (14.0 * 15.0)
    np.testing.assert_allclose(size.repeat_std / size.value, expected, rtol=0.4)


def test_a_class_without_a_law_has_the_root_of_its_share():
    finding = {"id": "carrier/waves/torque", "law": None, "share": 0.64, "share_ci95": [0.48, 0.80]}
    row = campaign_row(document(scatter=1e-6, classes=[finding]), "T1/a", "T1", "2026-01-31")
    size = row.sizes[-1]
    assert (size.cause, size.is_named, row.causes) == (finding["id"], True, (finding["id"],))
    # A share of 0.64 +- 0.16 has a root of 0.8 +- 0.1, as long as the gap has no error.
    expected = EXCESS * np.array([0.8, 0.7, 0.9])
    np.testing.assert_allclose((size.value, *size.ci95), expected, rtol=1e-4)
    # With one, the two add as squares; of a certain share the gap's relative error is left.
    sure = {**finding, "share_ci95": [0.64, 0.64]}
    gap, size = campaign_row(document(scatter=0.3, classes=[sure]), "T1/a", "T1", "").sizes
    np.testing.assert_allclose(size.std / size.value, gap.std / gap.value)


def test_directions_offsets_of_runs_and_unbounded_values_are_no_sizes():
    value = {"value": 1e-4, "std": 1e-6, "unit": "rad", "ci95": [9.8e-5, 1.02e-4]}
    parameters = {
        "carrier_tilt": {"phi_PLC": value, "theta_PLC": value},
        "axial_offset": {"d_x of run1": value},
        "flexible_pins": {"rho_f": {**value, "std": None}},
    }
    finding = {"check": "wiring", "about": "s047", "text": "is dead"}
    of_model = {"check": "drawing", "about": "carrier", "text": "more flexible than drawn"}
    row = campaign_row(
        document(parameters=parameters, warnings=[finding, of_model]), "T1/a", "T1", ""
    )
    assert [size.parameter for size in row.sizes] == ["rms", "phi_PLC"]
    assert row.faults == ("s047: is dead",)
    assert size_name("carrier_tilt", "phi_PLC") == "carrier tilt: tilt of the carrier"
    assert shown_size(1e-4, "phi_PLC", "rad", 1e-6) == "0.1 ± 0.002 mrad"


def test_a_campaign_without_a_diagnosis_has_no_sizes():
    far = {"noise_floor": None, "rho": None, "rho_ci95": [None, None]}
    row = campaign_row(document(held_out=[], how_far=far), "T1/a", "T1", "")
    assert row.sizes == ()
    assert np.isnan(row.gap_floors)

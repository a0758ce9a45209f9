"""Bands of the difference between a stage in time and its equilibria."""

import numpy as np
import pytest

from studies.tabulate_stage_dynamics import BANDS, BandDifference, bands, table

TURNS, SAMPLES, TEETH = 2, 720, 99


def test_every_wave_is_in_its_band_with_its_rms():
    angle = 2.0 * np.pi * np.arange(TURNS * SAMPLES) / SAMPLES
    still = 1e-6 + 2e-6 * np.cos(3.0 * angle)
    teeth = 3e-6 * np.cos((2 * TEETH - 3) * angle)
    swinging = 0.5e-6 * np.cos(5.5 * angle)
    of = bands(np.array([still + teeth + swinging, 0.1 * still]), TURNS, TEETH)
    low, mesh, rest = (of[name] for name in BANDS)
    assert low == pytest.approx(np.sqrt(1e-12 + 2e-12))
    assert mesh == pytest.approx(3e-6 / np.sqrt(2.0))
    assert rest == pytest.approx(0.5e-6 / np.sqrt(2.0))


def test_the_table_has_the_median_and_the_largest_load_in_micrometres():
    rows = [BandDifference((1.0, 0.0, 0.0), dict.fromkeys(BANDS, size)) for size in (1e-6, 3e-6)]
    lines = table([("clearances", 2.3)], [rows])
    assert lines[-1] == "| clearances | 2.3 |" + " 2.00, at most 3.00 |" * 3

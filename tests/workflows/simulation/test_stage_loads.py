"""Loads of a run that is much longer than what its picture shows."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.workflows.simulation import simulate_stage


def test_a_long_run_grows_its_file_and_shows_its_first_revolutions_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(
        simulate_stage,
        "load_columns",
        lambda _model, record, _loads: {"carrier_angle": record.angle},
    )
    shown = []
    monkeypatch.setattr(simulate_stage, "loads_figure", lambda _run, columns: shown.append(columns))
    monkeypatch.setattr(simulate_stage, "save_figure", lambda _path, _figure: None)
    # Pieces of 0.8 revolutions: the third ends beyond two, the fourth and fifth are not shown.
    angle = 2.0 * np.pi * np.arange(1, 41) / 10.0
    pieces = [
        SimpleNamespace(record=SimpleNamespace(time=piece, angle=piece), loads=None)
        for piece in np.split(angle, 5)
    ]
    passed = list(simulate_stage._with_loads(pieces, tmp_path, "LC1", model=None))
    assert passed == pieces
    with (tmp_path / "LC1_loads.csv").open(encoding="utf-8") as stream:
        assert len(list(csv.DictReader(stream))) == 40
    (columns,) = shown
    assert columns["carrier_angle"][-1] == pytest.approx(4.0 * np.pi)
    assert len(columns["carrier_angle"]) == 20

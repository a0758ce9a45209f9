"""A stage case from the command's function to a campaign folder."""

import numpy as np
import pytest

from fe.curve_files import write_curves
from identification.campaign_files import read_campaign
from simulation.case_files import shipped_case
from simulation.stage.stage_body import StageBody
from tests.simulation.synthetic_curves import curve_set
from workflows import simulate_stage
from workflows.simulate_load_case import main


@pytest.fixture
def curves(tmp_path):
    path = tmp_path / "curves.csv"
    write_curves(path, curve_set())
    return path


def short_case(tmp_path, *changes):
    text = shipped_case("stage_lc1").read_text(encoding="utf-8").replace("duration = 20.0", "duration = 5.5")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_stage_case_becomes_a_campaign_that_shows_three_peaks_a_revolution(tmp_path, curves, monkeypatch):
    coarse = simulate_stage.default_stage_body(1e6, 0.06)
    assert isinstance(coarse, StageBody)
    monkeypatch.setattr(simulate_stage, "default_stage_body", lambda *_: coarse)
    result = main(short_case(tmp_path), out=tmp_path / "campaign", curves=curves)
    assert result.imbalance["LC1"] < 1e-6
    campaign = read_campaign(result.folder)
    (run,) = campaign.runs
    assert set(run.signals) == {"s047", "s137", "s227", "s317", "r040", "r310"}
    turn = np.exp(-1j * np.outer(np.arange(6), run.inputs["carrier_angle"]))
    whole = run.inputs["carrier_angle"] < 4.0 * np.pi
    orders = 2.0 * np.abs((turn[:, whole] * run.signals["s047"][whole]).mean(axis=1))
    # Pin fit of 1e6 N m/rad: 0.18 um per kN m of order 3 (docs/pin_fit.md).
    assert 50e-6 < orders[3] < 80e-6
    assert orders[3] > 10.0 * orders[[2, 4, 5]].max()


def test_a_refused_stage_case_leaves_nothing(tmp_path, curves):
    with pytest.raises(ValueError, match="too large for the mesh period"):
        main(short_case(tmp_path, ("step = 1e-3 ", "step = 1e-2 ")), out=tmp_path / "campaign", curves=curves)
    assert not (tmp_path / "campaign").exists()

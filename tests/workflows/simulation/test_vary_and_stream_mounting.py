"""simulate on a mounting case: parameter sets, records as Parquet, energy balance."""

import csv
import io

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.mounting import energy
from carrierflex.simulation.mounting.time_integration import DivergedError
from carrierflex.workflows.screen.simulation_tables import campaign_table
from carrierflex.workflows.simulation import stream_mounting
from carrierflex.workflows.simulation.simulate_load_case import main

#: The shipped case with its events packed into 30 s, noise left out; 7000 samples.
SHORT = {
    "noise_std = 2e-6": "noise_std = 0.0",
    "duration = 655.0": "duration = 35.0",
    "sample_rate = 20.0": "sample_rate = 200.0",
    "radial_load_from = 60.0": "radial_load_from = 1.0",
    "radial_load_to = 105.0": "radial_load_to = 4.0",
    "start = 195.0": "start = 5.0",
    "full_speed = 530.0": "full_speed = 20.0",
    "stop_from = 260.0": "stop_from = 8.0",
    "stop_to = 300.0": "stop_to = 10.0",
    "torque_from = 535.0": "torque_from = 21.0\ntorque_rise = 5.0",
}


@pytest.fixture
def short_case(tmp_path):
    text = shipped_case("mounting_2011").read_text(encoding="utf-8")
    for old, new in SHORT.items():
        assert f"\n{old}" in text
        text = text.replace(f"\n{old}", f"\n{new}")
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def shown(result):
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(campaign_table(result))
    return console.export_text()


def test_stiffer_bushings_move_less_and_an_unstable_set_is_named(short_case, tmp_path):
    sets = tmp_path / "sets.csv"
    sets.write_text("K1, C1\n17.6e6, 1e5\n35.2e6, 1e5\n1e5, 0\n", encoding="utf-8")
    short_case.write_text(
        short_case.read_text()
        .replace("K3 = 65.05e9", "K3 = 0.0")
        .replace("K5 = 1.55e15", "K5 = 0.0")
    )
    result = main(short_case, out=tmp_path / "out", variants=sets, quiet=True)
    soft, stiff, unstable = result.rms["load_case"]
    # Statics of linear bushings: the readings are proportional to the flexibility.
    assert_allclose(soft[2:4], 2.0 * stiff[2:4], rtol=1e-2)
    assert np.isnan(unstable).all()
    with result.file.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert_allclose([float(row["rms_ssz [m]"]) for row in rows[:2]], [soft[2], stiff[2]], rtol=1e-8)
    assert rows[2]["K1 [N/m]"] == "100000"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["variants.csv"]
    assert "diverged" in shown(result)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("K1,K9\n1e7,1\n", "unknown parameter 'K9'; expected one of K1, C1"),
        ("K1\n", "columns K1, 0 sets; expected different names and a set or more"),
        (
            "K1\nsoft\n",
            "could not convert string to float: 'soft'; expected 1 numbers in every row",
        ),
        ("K1,C1\n1e7\n", "expected 2 numbers in every row"),
        ("K1\n1e7\n-1e7\n", "parameter set 1: parameter K1 is -1e.07 N/m"),
    ],
)
def test_wrong_sets_are_refused_with_one_line(short_case, tmp_path, text, message):
    (tmp_path / "sets.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        main(short_case, out=tmp_path / "out", variants=tmp_path / "sets.csv", quiet=True)
    assert not (tmp_path / "out" / "variants.csv").exists()


def test_a_streamed_campaign_is_the_one_in_memory(short_case, tmp_path, monkeypatch):
    monkeypatch.setattr(stream_mounting, "_PIECE", 1500)
    streamed = main(short_case, out=tmp_path / "streamed", parquet=True, quiet=True)
    main(short_case, out=tmp_path / "whole", quiet=True)
    (on_disk,), (in_memory,) = (
        read_campaign(tmp_path / name).runs for name in ("streamed", "whole")
    )
    assert on_disk.file == "load_case.parquet"
    assert streamed.n_samples == {"load_case": 7000} == {"load_case": len(on_disk.time)}
    assert_allclose(on_disk.time, in_memory.time, atol=1e-9)
    largest = np.abs(in_memory.signals["ssz"]).max()
    for name, signal in in_memory.signals.items():
        assert_allclose(on_disk.signals[name], signal, rtol=0.0, atol=1e-6 * largest)
    assert " 7000 " in shown(streamed)


def test_a_stream_that_diverges_keeps_its_record_and_says_so(short_case, tmp_path, monkeypatch):
    monkeypatch.setattr(stream_mounting, "_PIECE", 1500)
    text = short_case.read_text(encoding="utf-8").replace("K1 = 17.6e6", "K1 = 1e5")
    for name in ("K3 = 65.05e9", "K5 = 1.55e15", "C3 = 1.15e6"):
        text = text.replace(name, f"{name[:2]} = 0.0")
    short_case.write_text(text, encoding="utf-8")
    with pytest.raises(DivergedError, match="theta_x: diverged after 2"):
        main(short_case, out=tmp_path / "out", parquet=True, quiet=True)
    (run,) = read_campaign(tmp_path / "out").runs
    assert run.condition == f"figure 6, cut at {run.time[-1]:g} s: theta_x diverged"
    assert 21.0 < run.time[-1] < 35.0


@pytest.mark.long
def test_the_energy_balance_closes_and_a_poor_one_fails_the_command(
    short_case, tmp_path, monkeypatch
):
    result = main(short_case, out=tmp_path / "out", energy_balance=True, quiet=True)
    (balance,) = result.balances.values()
    assert balance.error < 1e-4
    assert 0.0 < balance.dissipated[-1] < balance.work[-1]
    assert result.met
    assert "energy balance, J" in shown(result)
    monkeypatch.setattr(energy, "LARGEST_IMBALANCE", 0.1 * balance.error)
    assert not result.met


def test_options_of_the_mounting_are_refused_elsewhere_and_where_they_exclude_one_another(
    short_case, tmp_path
):
    out = tmp_path / "out"
    with pytest.raises(
        ValueError, match=r"--energy-balance is for cases of kind mounting; stage_lc1\.toml is none"
    ):
        main(shipped_case("stage_lc1"), out=out, energy_balance=True)
    with pytest.raises(ValueError, match="--energy-balance and --parquet exclude one another"):
        main(short_case, out=out, parquet=True, energy_balance=True)
    with pytest.raises(ValueError, match="spread the sets of --variants; expected --variants too"):
        main(short_case, out=out, workers=2)
    assert not out.exists()

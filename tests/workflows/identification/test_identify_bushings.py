"""From a mounting campaign folder to tables 2 and 3.

On this machine and on a cluster that loses a worker.
"""

import io
import os
import signal
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.identification.identify_parameters import main
from carrierflex.workflows.screen.tables import estimate_table
from tests.identification.mounting.mounting_campaigns import (
    LINEAR_TRUTH,
    NONLINEAR_TRUTH,
    mounting_campaign,
)
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.workflows.checked_documents import checked_document


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("mounting") / "campaign"
    write_campaign(mounting_campaign(NONLINEAR_TRUTH, duration=40.0, rate=10.0), path)
    return path


@pytest.mark.long
def test_bushings_are_found_and_written_with_both_tables(folder, tmp_path):
    result = main(
        folder,
        model="nonlinear_bushing",
        out=tmp_path,
        profile=("K3",),
        compare_complex=False,
        quiet=True,
    )
    document = checked_document(tmp_path / "identification.json")
    assert document["model"] == "nonlinear_bushing"
    low, high = document["shared"]["K1"]["ci95"]
    assert low < document["shared"]["K1"]["value"] < high
    assert_allclose(document["shared"]["K1"]["value"], NONLINEAR_TRUTH["K1"], rtol=5e-3)
    assert document["shared"]["C1"]["unit"] == "N s/m^3"
    assert document["runs"]["R0"]["parameters"] == {}
    rows = document["models"][""]
    assert [row["model"] for row in rows] == ["linear_bushing", "nonlinear_bushing"]
    assert rows[1]["accuracy"] < 0.5 < rows[0]["accuracy"] == 1.0
    assert {path.name for path in result.files} == {
        "identification.json",
        "signals.png",
        "profiles.png",
    }
    console = Console(width=140, record=True, file=io.StringIO())
    console.print(estimate_table(result))
    text = console.export_text()
    assert "one simulation, s" in text
    assert "K5, N/m^5" in text
    assert "C1, N s/m " in text
    assert "C1, N s/m^3" in text
    # The screen gives the interval of the file, also where a bound cuts one of its ends.
    K1, C1 = (document["shared"][name] for name in ("K1", "C1"))
    assert f"{K1['value']:.4g} ± {K1['ci95'][1] - K1['value']:.2g}" in text
    assert f"{C1['value']:.4g} ± {C1['ci95'][1] - C1['value']:.2g}" in text


@pytest.mark.long
def test_a_model_that_does_not_describe_the_records_says_so_and_what_zero_means(folder, tmp_path):
    result = main(folder, model="linear_bushing", out=tmp_path / "linear", quiet=True)
    (actual,) = [warning for warning in result.warnings if warning.check == "fit"]
    assert actual.figure > 2.0
    estimate = result.estimates[""][-1]
    undetermined = {text.split()[0] for text in estimate.undetermined}
    for name, (low, high) in zip(estimate.fit.names, estimate.ci95, strict=True):
        assert (low <= 0.0 <= high) == (name in undetermined), name
    console = Console(width=140, record=True, file=io.StringIO())
    console.print(estimate_table(result))
    screen = " ".join(console.export_text().split())
    assert "the model does not describe these records" in screen
    complete = main(folder, model="nonlinear_bushing", out=tmp_path / "nonlinear", quiet=True)
    assert not [warning for warning in complete.warnings if warning.check == "fit"]


def test_per_run_everything_stands_under_its_run(folder, tmp_path):
    main(folder, model="linear_bushing", out=tmp_path, per_run=True, quiet=True)
    document = checked_document(tmp_path / "identification.json")
    assert document["shared"] == {}
    assert set(document["runs"]["R0"]["parameters"]) == {"K1", "C1", "P_T"}


@pytest.mark.long
def test_the_housing_motion_is_the_torques_roll_and_the_fit_leaves_noise(folder, tmp_path):
    result = main(folder, model="nonlinear_bushing", out=tmp_path, housing_motion=True, quiet=True)
    measured, residual = result.motion_rms["R0"]
    # Noise of 5 um at each sensor: 5 um sqrt(2) / (2 R_x) of roll.
    assert_allclose(residual[3], 5e-6 / np.sqrt(2.0) / 0.75, rtol=0.2)
    assert measured[3] == measured[3:].max() > 100.0 * residual[3]
    table = np.genfromtxt(
        tmp_path / "housing_motion_R0.csv", delimiter=",", names=True, deletechars=""
    )
    assert_allclose(np.sqrt(np.mean(table["theta_x_measured_[rad]"] ** 2)), measured[3], rtol=1e-6)
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(estimate_table(result))
    assert "residual" in console.export_text()


def test_the_housing_motion_needs_its_sensors_before_anything_is_fitted(tmp_path):
    campaign = mounting_campaign(LINEAR_TRUTH, duration=20.0, rate=10.0)
    five = replace(
        campaign,
        channels=campaign.channels[1:],
        runs=tuple(
            replace(run, signals={k: v for k, v in run.signals.items() if k != "ssx"})
            for run in campaign.runs
        ),
    )
    write_campaign(five, tmp_path / "campaign")
    with pytest.raises(ValueError, match=r"5 sensors .* see 5 of 6 coordinates"):
        main(
            tmp_path / "campaign",
            model="linear_bushing",
            out=tmp_path / "out",
            housing_motion=True,
            quiet=True,
        )
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_the_complex_method_stands_beside_the_fit(tmp_path):
    write_campaign(mounting_campaign(LINEAR_TRUTH, duration=20.0, rate=10.0), tmp_path / "campaign")
    main(
        tmp_path / "campaign",
        model="linear_bushing",
        out=tmp_path / "out",
        compare_complex=True,
        quiet=True,
    )
    (row,) = checked_document(tmp_path / "out" / "identification.json")["models"][""]
    assert row["complex_accuracy"] >= row["accuracy"] * (1.0 - 1e-9)
    assert row["complex_model_runs"] > 5 * row["model_runs"]


def test_wrong_choices_are_one_line_and_leave_nothing(folder, tmp_path):
    with pytest.raises(
        ValueError,
        match="--profile K9: linear_bushing has no such unknown; expected one of K1, C1, P_T",
    ):
        main(folder, model="linear_bushing", out=tmp_path / "out", profile=("K9",), quiet=True)
    write_campaign(carrier_campaign(), tmp_path / "carrier")
    with pytest.raises(
        ValueError, match="is of kind carrier; model linear_bushing is for kind mounting only"
    ):
        main(tmp_path / "carrier", model="linear_bushing", out=tmp_path / "out", quiet=True)
    assert not (tmp_path / "out").exists()


@pytest.mark.acceptance
def test_a_cluster_that_loses_a_worker_finds_the_same(folder, tmp_path):
    """Bootstrap refits on two workers, one killed while it works.

    Value for value what one process finds.
    """
    from distributed import Client, LocalCluster

    options = {"model": "linear_bushing", "bootstrap": 60, "seed": 3, "quiet": True}
    main(folder, out=tmp_path / "here", **options)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        with Client(cluster, set_as_default=False) as client:
            victim = client.submit(os.getpid, pure=False).result()
        killer = threading.Thread(target=_kill_soon, args=(victim,))
        killer.start()
        main(folder, out=tmp_path / "there", scheduler=cluster.scheduler_address, **options)
        killer.join()
    here, there = (
        checked_document(tmp_path / name / "identification.json")["shared"]
        for name in ("here", "there")
    )
    assert here == there


def _kill_soon(process):
    time.sleep(0.4)
    os.kill(process, signal.SIGKILL)


def test_the_command_tells_its_options(command):
    returncode, text, _ = command("identify", "--help")
    assert returncode == 0
    for option in ("--compare-complex", "--scheduler", "--weights", "hydrodynamic_bushing"):
        assert option in text

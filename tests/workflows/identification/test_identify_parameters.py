import weakref
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.curve_files import write_curves
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.workflows.identification.identify_parameters import main
from tests.identification.synthetic_campaigns import TRUTH, carrier_campaign
from tests.simulation.synthetic_curves import curve_set
from tests.workflows.checked_documents import checked_document


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("measured") / "campaign"
    measured = carrier_campaign()
    measured = replace(measured, rig={**measured.rig, "deflection_curves": "curves.csv"})
    write_campaign(
        measured, folder, more_files={"curves.csv": lambda path: write_curves(path, curve_set())}
    )
    return folder


@pytest.mark.long
def test_m2_finds_the_truth_and_writes_it_with_the_plots(tmp_path, campaign):
    result = main(campaign, model="m2", out=tmp_path / "out")
    document = checked_document(tmp_path / "out" / "identification.json")
    assert document["model"] == "m2"
    for name, value in document["shared"].items():
        low, high = value["ci95"]
        margin = high - low
        assert low - margin < getattr(TRUTH, name) < high + margin
    assert document["runs"]["LC1"]["rms"] < result.estimates["m1"]["LC1"].rms_by_run["LC1"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(
        path.name for path in result.files
    )
    pictures = [path for path in result.files if path.suffix == ".png"]
    assert {path.name for path in pictures} == {
        "rms.png",
        "parameters.png",
        "signals_LC1.png",
        "signals_LC2.png",
    }
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in pictures)


def test_each_plot_is_written_before_the_next_is_made_and_hundreds_are_not(
    tmp_path, campaign, monkeypatch
):
    module = "carrierflex.workflows.identification.identify_parameters"
    view = "carrierflex.identification.view"
    alive = weakref.WeakSet()
    most = []
    drawn = []

    class Plot:
        def __init__(self):
            alive.add(self)
            most.append(len(alive))

    def signals(run, channels, fits):
        estimate = fits[-1][1]
        drawn.append((run.name, estimate.rms_by_run[run.name]))
        by_channel = estimate.rms_by_channel[run.name]
        assert [channel.name for channel in channels] == [max(by_channel, key=by_channel.get)]
        return Plot()

    monkeypatch.setattr(f"{view}.signals_figure", signals)
    for name in ("rms_figure", "parameters_figure"):
        monkeypatch.setattr(f"{view}.{name}", lambda estimates: Plot())
    monkeypatch.setattr(f"{module}.save_figure", lambda path, figure: path.touch())
    monkeypatch.setattr(f"{module}._MOST_DRAWN", 1)
    result = main(campaign, model="m2", out=tmp_path / "out")
    # One that is written, and its successor.
    assert max(most) <= 2
    estimates = result.estimates["m2"]
    worst = max(estimates, key=lambda run: estimates[run].rms_by_run[run])
    assert drawn == [(worst, estimates[worst].rms_by_run[worst])]
    assert [path.name for path in result.files[3:]] == [f"signals_{worst}.png"]


@pytest.mark.long
def test_m1_needs_no_curves_and_per_run_leaves_nothing_shared(tmp_path, campaign):
    main(campaign, model="m1", out=tmp_path / "out", per_run=True)
    document = checked_document(tmp_path / "out" / "identification.json")
    assert document["shared"] == {}
    assert set(document["runs"]["LC2"]["parameters"]) == {
        "d_x",
        "phi_H",
        "theta_H",
        "phi_PLC",
        "theta_PLC",
    }


@pytest.mark.long
def test_resampling_weighs_angles_alike_where_the_speed_varies(tmp_path, campaign):
    uneven, even = (
        main(campaign, model="m2", out=tmp_path / name, samples_per_revolution=count, quiet=True)
        for name, count in (("whole", 0), ("even", 128))
    )
    values = [result.estimates["m2"]["LC1"].values for result in (uneven, even)]
    assert_allclose(values[1], values[0], rtol=0.05)
    assert (values[1] != values[0]).all()
    for path in even.files:
        assert path.is_file()
    with pytest.raises(ValueError, match="8 samples a revolution; expected at least 16"):
        main(campaign, model="m2", out=tmp_path / "x", samples_per_revolution=8, quiet=True)
    with pytest.raises(
        ValueError, match="--samples-per-revolution is for the motion of the carrier"
    ):
        main(
            campaign,
            model="linear_bushing",
            out=tmp_path / "x",
            samples_per_revolution=64,
            quiet=True,
        )
    with pytest.raises(
        ValueError, match="--housing-motion is for campaigns of the mounting; m1 fits the carrier"
    ):
        main(campaign, model="m1", out=tmp_path / "x", housing_motion=True, quiet=True)


def test_a_campaign_of_another_kind_is_refused_and_leaves_nothing(tmp_path):
    run = Run("A", "A.csv", "c", *_element_record())
    element = Campaign(
        "element",
        "mount",
        Baseline("model"),
        {"drive": "force"},
        (Channel("y", "displacement", "m"),),
        (run,),
    )
    write_campaign(element, tmp_path / "element")
    with pytest.raises(
        ValueError, match="'mount' is of kind element; models m1 and m2 are for kind carrier only"
    ):
        main(tmp_path / "element", model="m2", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_output_that_is_a_file_is_refused(tmp_path, campaign):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(OSError, match="cannot write into this output folder"):
        main(campaign, model="m1", out=tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"


def _element_record():
    return np.arange(3.0), {"force": np.zeros(3)}, {"y": np.zeros(3)}

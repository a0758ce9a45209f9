import json
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.files.json_files import save_json
from carrierflex.identification.carrier.carrier_identification import (
    identify_each_run,
    identify_jointly,
)
from carrierflex.identification.carrier.models import flexible_model
from carrierflex.identification.estimate_files import identification_document
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

M2 = flexible_model(stiff_curve(), flexible_curve())


def test_joint_document_separates_shared_parameters_from_those_of_the_runs(tmp_path):
    estimate = identify_jointly(carrier_campaign(), M2)
    path = tmp_path / "identification.json"
    save_json(path, identification_document("twin", estimate, seconds=0.1, model_runs=1))
    document = json.loads(path.read_text())
    assert list(document) == [
        *("format", "version", "campaign", "model", "software", "shared", "runs"),
        *(
            "undetermined",
            "outliers",
            "warnings",
            "covariance_source",
            "correlation",
            "model_runs",
            "seconds",
        ),
    ]
    assert (document["format"], document["version"]) == ("carrierflex-identification", 1)
    assert (document["campaign"], document["model"]) == ("twin", "m2")
    assert document["software"].startswith("carrierflex")
    assert set(document["shared"]) == {"phi_PLC", "theta_PLC", "rho_s", "rho_f"}
    assert set(document["runs"]["LC2"]["parameters"]) == {"d_x", "phi_H", "theta_H"}
    phi = document["shared"]["phi_PLC"]
    assert phi["unit"] == "rad"
    assert phi["ci95"][0] < phi["value"] < phi["ci95"][1]
    assert document["runs"]["LC1"]["rms"] == pytest.approx(5e-6, rel=0.1)
    assert set(document["runs"]["LC1"]["rms_by_channel"]) == {"s047", "s137", "s227", "s317"}
    assert [entry.name for entry in tmp_path.iterdir()] == ["identification.json"]


def test_of_many_parameters_only_those_of_all_runs_are_correlated(monkeypatch):
    estimate = identify_jointly(carrier_campaign(), M2)
    full = identification_document("twin", estimate, seconds=0.1, model_runs=1)["correlation"][""]
    monkeypatch.setattr("carrierflex.identification.estimate_files._MOST_CORRELATED", 5)
    few = identification_document("twin", estimate, seconds=0.1, model_runs=1)["correlation"][""]
    assert few["parameters"] == ["phi_PLC", "theta_PLC", "rho_s", "rho_f"]
    rows = [full["parameters"].index(name) for name in few["parameters"]]
    assert len(rows) < len(full["parameters"])
    np.testing.assert_array_equal(few["matrix"], np.array(full["matrix"])[np.ix_(rows, rows)])


def test_per_run_document_puts_every_parameter_under_its_run():
    document = identification_document(
        "twin", identify_each_run(carrier_campaign(), M2), seconds=0.1, model_runs=1
    )
    assert document["shared"] == {}
    expected = {"d_x", "phi_H", "theta_H", "phi_PLC", "theta_PLC", "rho_s", "rho_f"}
    for run in ("LC1", "LC2"):
        assert set(document["runs"][run]["parameters"]) == expected


def test_what_cannot_be_seen_is_null_and_said_in_words(tmp_path):
    estimates = identify_each_run(
        carrier_campaign(), flexible_model(flexible_curve(0.5), flexible_curve())
    )
    document = identification_document("twin", estimates, seconds=0.1, model_runs=1)
    assert document["runs"]["LC1"]["parameters"]["rho_f"] == {
        "value": None,
        "std": None,
        "ci95": [None, None],
        "unit": "1",
    }
    assert document["undetermined"][0].startswith(
        "LC1: rho_s of LC1 and rho_f of LC1 cannot be separated"
    )
    save_json(tmp_path / "i.json", document)


def test_what_json_cannot_hold_is_written_as_null(tmp_path):
    save_json(tmp_path / "i.json", {"value": float("nan")})
    assert json.loads((tmp_path / "i.json").read_text(encoding="utf-8")) == {"value": None}


def test_nan_of_a_silent_channel_becomes_null():
    campaign = carrier_campaign()
    run = campaign.runs[0]
    silent = {**run.signals, "s047": np.full(run.time.size, np.nan)}
    campaign = replace(campaign, runs=(replace(run, signals=silent),))
    document = identification_document(
        "twin", identify_jointly(campaign, M2), seconds=0.1, model_runs=1
    )
    assert document["runs"]["LC1"]["rms_by_channel"]["s047"] is None

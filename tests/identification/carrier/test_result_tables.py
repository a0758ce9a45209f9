from numpy.testing import assert_allclose

from carrierflex.identification.carrier.carrier_identification import (
    identify_each_run,
    identify_jointly,
)
from carrierflex.identification.carrier.models import flexible_model, rigid_model
from carrierflex.identification.carrier.result_tables import parameter_rows, rms_rows
from tests.identification.synthetic_campaigns import TRUTH, carrier_campaign
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

CAMPAIGN = carrier_campaign()
M1, M2 = rigid_model(), flexible_model(stiff_curve(), flexible_curve())


def test_rms_rows_are_table_4():
    estimates = {model.name: identify_each_run(CAMPAIGN, model) for model in (M1, M2)}
    rows = rms_rows(estimates)
    assert [row["run"] for row in rows] == ["LC1", "LC2"]
    assert rows[0]["m1"] == estimates["m1"]["LC1"].rms
    assert all(row["m2"] < row["m1"] for row in rows)


def test_shared_parameters_stand_once_and_the_others_once_a_run():
    joint = identify_jointly(CAMPAIGN, M2)
    rows = parameter_rows({"LC1": joint, "LC2": joint})
    assert len(rows) == 4 + 2 * 3
    shared = {row["parameter"]: row for row in rows if row["run"] == "all"}
    assert_allclose(shared["rho_f"]["value"], TRUTH.rho_f, rtol=0.02)
    assert shared["rho_f"]["low"] < shared["rho_f"]["value"] < shared["rho_f"]["high"]
    assert len(parameter_rows(identify_each_run(CAMPAIGN, M2))) == 2 * 7

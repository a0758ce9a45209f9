from carrierflex.identification.carrier.carrier_identification import (
    identify_each_run,
    identify_jointly,
)
from carrierflex.identification.carrier.models import flexible_model, rigid_model
from carrierflex.workflows.identification.identify_parameters import Identification
from carrierflex.workflows.screen.tables import estimate_table
from tests.identification.synthetic_campaigns import TRUTH, carrier_campaign
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

CAMPAIGN = carrier_campaign()
M1, M2 = rigid_model(), flexible_model(stiff_curve(), flexible_curve())


def _rows(estimates):
    """Cells of both tables, row by row."""
    shown = estimate_table(Identification("twin", "m2", estimates, 0.0, ()))
    tables = [part for part in shown.renderables if hasattr(part, "columns")]
    return [list(zip(*(column.cells for column in table.columns), strict=True)) for table in tables]


def test_rms_rows_are_table_4():
    estimates = {model.name: identify_each_run(CAMPAIGN, model) for model in (M1, M2)}
    rms, parameters = _rows(estimates)
    assert [row[0] for row in rms] == ["LC1", "LC2"]
    assert rms[0][1] == f"{estimates['m1']['LC1'].rms * 1e3:.4f}"
    assert all(float(m2) < float(m1) for _, m1, m2 in rms)
    assert len(parameters) == 2 * 7


def test_shared_parameters_stand_once_and_the_others_once_a_run():
    joint = identify_jointly(CAMPAIGN, M2)
    _, rows = _rows({"m2": {"LC1": joint, "LC2": joint}})
    assert len(rows) == 4 + 2 * 3
    shared = {name: numbers for name, run, *numbers in rows if run == "all"}
    value, _, low, high, _ = shared["rho_f"]
    assert abs(float(value) / TRUTH.rho_f - 1.0) < 0.02
    assert float(low) < float(value) < float(high)

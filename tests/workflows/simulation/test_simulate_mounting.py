import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.workflows.simulation.simulate_load_case import main


def test_the_shipped_load_history_becomes_a_campaign_that_the_model_reproduces(tmp_path):
    result = main(shipped_case("mounting_2011"), out=tmp_path / "campaign", quiet=True)
    campaign = read_campaign(result.folder)
    assert campaign.kind == "mounting"
    (run,) = campaign.runs
    inputs = MountingInputs.from_columns(run.time, run.inputs)
    rig = MountingRig.from_table(campaign.rig)
    again = simulate(rig, result.case.truth, inputs)
    for channel in campaign.channels:
        residual = run.signals[channel.name] - again.by_sensor()[channel.sensor]
        assert_allclose(np.std(residual), 2e-6, rtol=0.03)
    # Figure 6: rest, millimetres under the radial load, then ssz and spz part with the torque.
    roll = (run.signals["ssz"] - run.signals["spz"])[[0, 20 * 150, -1]] / (2.0 * rig.R_x)
    assert abs(roll[0]) < 1e-5
    assert roll[2] - roll[1] > 2e-3
    assert np.abs(run.signals["ssz"][20 * 120]) > 1e-3


def test_a_mounting_case_takes_no_curves_and_the_same_case_gives_the_same_files(tmp_path):
    case = shipped_case("mounting_2011")
    with pytest.raises(ValueError, match="a case of kind mounting has no deflection curves"):
        main(case, out=tmp_path / "x", curves=tmp_path / "curves.csv")
    for name in ("a", "b"):
        main(case, out=tmp_path / name, quiet=True)
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == [
        "campaign.toml",
        "case.toml",
        "load_case.csv",
    ]
    for name in ("campaign.toml", "load_case.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()

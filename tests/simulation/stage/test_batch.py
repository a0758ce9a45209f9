"""The stage under many load cases."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage import batch
from carrierflex.simulation.stage.batch import rms_of_signals, simulate_load_cases
from carrierflex.simulation.stage.response import CHUNK, StageDivergedError
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad

SENSORS = [Sensor(f"s{v}", AXIAL, np.deg2rad(v), 0.412) for v in (47, 137)]
RUN = {"duration": 0.2, "sample_rate": 200.0, "step": 1e-3}
LOADS = [SteadyLoad(torque) for torque in (360e3, 90e3, 180e3)]


@pytest.mark.parametrize("loads_a_piece", [1, 2])
def test_summaries_come_in_the_order_of_the_loads_and_are_those_of_single_runs(
    nominal_stage, monkeypatch, loads_a_piece
):
    monkeypatch.setattr(batch, "_LOADS_A_PIECE", loads_a_piece)
    with ThreadPoolExecutor(2) as executor:
        together = list(
            simulate_load_cases(
                nominal_stage, LOADS, SENSORS, summary=rms_of_signals, executor=executor, **RUN
            )
        )
    for rms, load in zip(together, LOADS, strict=True):
        (piece,) = simulate_stage(nominal_stage, load, SENSORS, **RUN)
        signals = np.array(list(piece.signals.values()))
        assert_array_equal(rms, np.sqrt(np.mean(signals**2, axis=1)))
    # Teeth that press harder bend the carrier further.
    assert (together[0] > together[2]).all()
    assert (together[2] > together[1]).all()


def test_a_run_that_diverges_takes_no_other_with_it(nominal_stage):
    loads = [LOADS[0], SteadyLoad(360e3, ntl_z=1e14), LOADS[1]]
    with ThreadPoolExecutor(1) as executor:
        good, bad, other = simulate_load_cases(
            nominal_stage, loads, SENSORS, summary=rms_of_signals, executor=executor, **RUN
        )
    assert isinstance(bad, StageDivergedError)
    elsewhere = pickle.loads(pickle.dumps(bad))
    assert (str(elsewhere), elsewhere.settled) == (str(bad), bad.settled)
    assert np.isfinite([good, other]).all()


def test_the_rms_of_a_run_is_that_of_all_its_pieces(nominal_stage):
    run = {"duration": 1.5 * CHUNK / 1000.0, "sample_rate": 1000.0, "step": 1e-3}
    pieces = list(simulate_stage(nominal_stage, LOADS[0], SENSORS, **run))
    assert len(pieces) == 2
    signals = np.concatenate([np.array(list(piece.signals.values())) for piece in pieces], axis=1)
    np.testing.assert_allclose(
        rms_of_signals(iter(pieces)), np.sqrt(np.mean(signals**2, axis=1)), rtol=1e-12
    )

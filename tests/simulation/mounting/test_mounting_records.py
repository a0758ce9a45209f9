"""Batches, records in pieces, load history, sweeps and cases of the mounting."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pyarrow.parquet as pa_parquet
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.mounting.batch import rms_of_sensors, simulate_batch
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import PARAMETERS
from carrierflex.simulation.mounting.record_files import marched_pieces, write_record
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import response_of, signal_pieces, simulate
from carrierflex.simulation.mounting.table_3 import TABLE_3
from carrierflex.simulation.mounting.time_integration import DivergedError
from carrierflex.simulation.mounting.torque_sweep import mounting_sweep
from tests.simulation.mounting.mounting_runs import BUSHINGS, shaking_inputs

RIG = MountingRig(zeroing_samples=20)


def pieces_of(inputs, size):
    for first in range(0, inputs.time.size, size):
        yield MountingInputs(
            *(values[first : first + size] for values in inputs.columns().values())
        )


def softer_to_stiffer(count):
    return np.array(
        [
            parameter_array(RIG, {**BUSHINGS["nonlinear"], "K1": K1})
            for K1 in np.linspace(15e6, 25e6, count)
        ]
    )


@pytest.mark.long  # a fresh process imports for seconds
def test_a_batch_survives_other_processes_and_a_set_that_diverges():
    inputs = shaking_inputs(1.0, torque=3e6)
    sets = np.array([parameter_array(RIG), parameter_array(RIG, {"C1": 1e5, "K1": 3e5})])
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        good, bad = simulate_batch(RIG, sets, inputs, summary=rms_of_sensors, executor=executor)
    assert_allclose(good, rms_of_sensors(simulate(RIG, sets[0], inputs)), rtol=0.0, atol=0.0)
    assert isinstance(bad, DivergedError)
    assert (bad.coordinate, bad.signals.shape) == ("theta_x", (bad.samples, 6))


@pytest.mark.long
def test_a_batch_gives_what_single_runs_give():
    inputs = shaking_inputs(0.5)
    sets = softer_to_stiffer(60)
    single = [rms_of_sensors(simulate(RIG, parameters, inputs)) for parameters in sets]
    with ThreadPoolExecutor(2) as executor:
        batch = list(simulate_batch(RIG, sets, inputs, summary=rms_of_sensors, executor=executor))
    assert_allclose(batch, single, rtol=0.0, atol=0.0)
    assert np.ptp([rms[2] for rms in single]) > 1e-5


def test_a_wrong_set_of_a_batch_is_named_before_anything_runs():
    sets = np.array([parameter_array(RIG), parameter_array(RIG)])
    sets[1, 0] = -1.0
    with (
        ThreadPoolExecutor(1) as executor,
        pytest.raises(ValueError, match="parameter set 1: parameter K1 is -1 N/m"),
    ):
        next(
            simulate_batch(
                RIG, sets, shaking_inputs(0.5), summary=rms_of_sensors, executor=executor
            )
        )


@pytest.mark.long
@pytest.mark.parametrize("name", ["linear", "hydro-dynamic"])
def test_a_record_in_pieces_equals_the_whole_one(tmp_path, name):
    inputs, parameters = (
        shaking_inputs(2.0),
        parameter_array(RIG, {**BUSHINGS[name], "gain_spz": 1.1, "zero_sbx": 1e-4}),
    )
    path = tmp_path / "record.parquet"
    written = write_record(
        marched_pieces(RIG, parameters, pieces_of(inputs, 37), largest_loads=inputs.loads), path
    )
    assert written == inputs.time.size
    table = pa_parquet.read_table(path)
    signals = np.stack([table[sensor].to_numpy() for sensor in SENSORS], axis=1)
    assert_allclose(signals, simulate(RIG, parameters, inputs).signals, rtol=0.0, atol=1e-14)
    assert_allclose(table["torque"].to_numpy(), inputs.torque, rtol=0.0, atol=0.0)
    assert_allclose(table["time"].to_numpy(), inputs.time, rtol=0.0, atol=0.0)


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["linear", pytest.param("nonlinear", marks=pytest.mark.long), "hydro-dynamic"]
)
def test_a_run_in_pieces_equals_the_whole_one_and_may_end_early(name):
    # 4500 samples: two whole pieces and a part of one.
    inputs, parameters = (
        shaking_inputs(45.0),
        parameter_array(RIG, {**BUSHINGS[name], "gain_spz": 1.1, "delay": 0.02}),
    )
    pieces = list(signal_pieces(RIG, parameters, inputs))
    assert [len(piece) for piece in pieces] == [1, 2000, 2000, 500]
    at_once = simulate(RIG, parameters, inputs).signals
    joined = response_of(RIG, parameters, inputs, np.concatenate(pieces))
    assert_allclose(joined.signals, at_once, rtol=0.0, atol=1e-14)
    early = response_of(RIG, parameters, inputs, np.concatenate(pieces[:2]))
    assert_allclose(early.time, inputs.time[:2001])
    assert_allclose(early.signals, at_once[:2001], rtol=0.0, atol=1e-14)


def test_a_run_that_ends_early_on_an_uneven_grid_keeps_the_times_it_covers():
    even, parameters = shaking_inputs(1.0, rate=400.0), parameter_array(RIG, BUSHINGS["linear"])
    chosen = np.unique(np.concatenate([np.arange(0, 401, 3), np.arange(0, 401, 7)]))
    inputs = MountingInputs(*(values[chosen] for values in even.columns().values()))
    (signals,) = list(signal_pieces(RIG, parameters, inputs))[1:]
    shortened = response_of(RIG, parameters, inputs, signals[:50].copy())
    assert inputs.grid[48] < shortened.time[-1] <= inputs.grid[49]
    full = simulate(RIG, parameters, inputs).signals
    assert len(shortened.signals) == len(shortened.time) < len(full)


def test_a_diverging_record_keeps_what_was_written(tmp_path):
    calm, storm = shaking_inputs(1.0, torque=1e3, radial=1e3), shaking_inputs(1.0, torque=3e6)
    storm = MountingInputs(storm.time + 1.01, *list(storm.columns().values())[1:])
    parameters = parameter_array(RIG, {"C1": 1e5, "K1": 3e5})
    path = tmp_path / "record.parquet"
    pieces = marched_pieces(RIG, parameters, iter([calm, storm]), largest_loads=storm.loads)
    with pytest.raises(
        DivergedError, match=r"theta_x: diverged after 1.*; the signals up to there are kept"
    ) as caught:
        write_record(pieces, path)
    assert caught.value.time > 1.2
    written = pa_parquet.read_table(path)["time"].to_numpy()
    assert_allclose(written[-1], caught.value.time, atol=1e-9)
    assert [file.name for file in tmp_path.iterdir()] == ["record.parquet"]


def test_pieces_that_do_not_fit_are_refused(tmp_path):
    inputs, parameters = shaking_inputs(1.0), parameter_array(RIG)
    with pytest.raises(ValueError, match=r"expected at most .* as announced"):
        list(
            marched_pieces(RIG, parameters, pieces_of(inputs, 40), largest_loads=0.5 * inputs.loads)
        )
    first, _, third = pieces_of(inputs, 40)
    with pytest.raises(
        ValueError, match=r"begins at 0\.8 s after one that ended at 0\.39 s; expected one interval"
    ):
        list(marched_pieces(RIG, parameters, [first, third], largest_loads=inputs.loads))
    delayed = parameter_array(RIG, {"delay": 0.1})
    with pytest.raises(ValueError, match="a sensor delay is not possible piece by piece"):
        list(marched_pieces(RIG, delayed, [first], largest_loads=inputs.loads))


@pytest.mark.long
def test_every_effect_of_the_contract_has_parameters_within_bounds():
    from carrierflex.identification.campaign.campaign_kinds import MOUNTING

    assert {parameter.effect for parameter in PARAMETERS} - {""} == set(MOUNTING.effects)
    neutral = parameter_array(RIG)
    inputs = shaking_inputs(1.0)
    base = simulate(RIG, neutral, inputs).signals
    values = {
        "K3": 1e11,
        "K5": 1e16,
        "C3": 1e11,
        "k": 5e6,
        "c": 5e5,
        "Kp": 8e6,
        "Fy": 3e4,
        "P_T": 0.1,
        "k_x": 1e7,
    }
    values |= {
        "main_bearing_compliance": 1e-9,
        "ntl_angle": 0.1,
        "starboard_excess": 0.1,
        "m": 10.0,
        "delay": 0.05,
    }
    values |= {f"gain_{s}": 1.05 for s in SENSORS} | {f"zero_{s}": 1e-4 for s in SENSORS}
    for effect in MOUNTING.effects:
        chosen = {
            parameter.name: values[parameter.name]
            for parameter in PARAMETERS
            if parameter.effect == effect
        }
        changed = simulate(RIG, parameter_array(RIG, chosen), inputs).signals
        assert np.abs(changed - base).max() > 1e-6, effect
    for index, parameter in enumerate(PARAMETERS):
        assert parameter.lower <= neutral[index] <= parameter.upper


def test_the_load_history_has_the_events_of_figure_6():
    history = LoadHistory(ntl_y=20e3)
    inputs = history_inputs(history)
    assert inputs.time.size == 65500

    def at(time, values):
        return values[round(time * 100)]

    for time in (0.0, 30.0, 59.0):
        assert at(time, inputs.ntl_z) == at(time, inputs.torque) == at(time, inputs.speed) == 0.0
    assert -100e3 < at(80.0, inputs.ntl_z) < -10e3
    assert_allclose([at(110.0, inputs.ntl_z), at(110.0, inputs.ntl_y)], [-100e3, 20e3])
    assert at(195.0, inputs.speed) == 0.0
    assert at(255.0, inputs.speed) > 0.3
    assert_allclose(at(280.0, inputs.speed), 0.0, atol=1e-12)
    assert_allclose(at(531.0, inputs.speed), 2.3143)
    assert np.abs(inputs.torque[: 535 * 100]).max() == 0.0
    assert_allclose(at(600.0, inputs.torque), 80e3, rtol=0.03)
    # The angle is the integral of the speed.
    assert_allclose(
        np.diff(inputs.carrier_angle),
        0.01 * 0.5 * (inputs.speed[1:] + inputs.speed[:-1]),
        atol=1e-4,
    )
    window = history_inputs(history, 40.0, 560.0)
    assert window.time.size == 52000
    assert_allclose(window.torque[-1], at(559.99, inputs.torque))


def test_a_load_history_out_of_order_is_refused():
    with pytest.raises(
        ValueError, match=r"start is 700.* s and stop_from 260.* s; expected them in that order"
    ):
        LoadHistory(start=700.0)
    with pytest.raises(ValueError, match="torque is nan; expected a finite number"):
        LoadHistory(torque=float("nan"))


def test_torque_sweeps_of_the_bushings_give_both_stiffnesses():
    # Two bushings: 22.7 MN m/rad. The paper's 11.4 is K1 R_x², one bushing or K1 for the pair.
    two = mounting_sweep(MountingRig(), parameter_array(MountingRig()), 80e3)
    one = mounting_sweep(MountingRig(), parameter_array(MountingRig(), {"K1": 20.2e6 / 2}), 80e3)
    assert_allclose([two.stiffness, one.stiffness], [22.7e6, 11.4e6], rtol=5e-3)
    with pytest.raises(
        ValueError, match=r"torque is -1.0 N m, duration 60.0 s; expected positive numbers"
    ):
        mounting_sweep(MountingRig(), parameter_array(MountingRig()), -1.0)


def test_a_case_takes_a_column_of_table_3_and_constants_beside_it(tmp_path):
    before, rest = shipped_case("mounting_2011").read_text().split("\n[truth]\n")
    runs = rest.split("\n[[runs]]\n")[1]
    path = tmp_path / "case.toml"
    path.write_text(f'{before}\n[truth]\ntable_3 = "hydrodynamic"\nm = 0.0\n\n[[runs]]\n{runs}')
    case = read_mounting_case(path)
    assert_allclose(case.truth, parameter_array(case.rig, {**TABLE_3["hydrodynamic"], "m": 0.0}))
    path.write_text(path.read_text().replace('"hydrodynamic"', '"rubber"'))
    with pytest.raises(
        ValueError,
        match="key 'table_3' is 'rubber'; expected one of linear, nonlinear, hydrodynamic",
    ):
        read_mounting_case(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("K3 = 65.05e9", "K4 = 65.05e9", r"mounting_2011.toml: \[truth\]: unknown key 'K4'"),
        (
            "K1 = 17.6e6",
            "K1 = -17.6e6",
            r"toml: \[truth\]: key 'K1' is -17600000.0; expected a value from 100000 to 1e\+09 N/m",
        ),
        (
            "R_x = 0.75 ",
            "R_x = -0.75 ",
            r"mounting_2011.toml: \[rig\]: key 'R_x' is -0.75; expected a positive number",
        ),
        (
            "start = 195.0",
            "start = 95.0",
            r"\[\[runs\]\] 1, \[history\]: .*radial_load_to is 105.0 s and start 95.0",
        ),
        ("version = 1", "version = 2", "written by a newer version; expected 1"),
    ],
)
def test_a_wrong_mounting_case_is_refused_with_one_line(tmp_path, old, new, message):
    text = shipped_case("mounting_2011").read_text()
    assert old in text
    path = tmp_path / "mounting_2011.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError, match=message) as caught:
        read_mounting_case(path)
    assert "\n" not in str(caught.value)

"""The stage as a co-simulation unit: the nonlinear stage with its flexible bodies is inside."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.fmi.functional_mockup import c_compiler, write_fmu
from carrierflex.simulation.sensing import SensorError
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.quasi_static import rest_readings
from carrierflex.simulation.stage.readings import ReadingEffects, sensor_signals
from carrierflex.simulation.stage.response import (
    joined_records,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.stage_data import BearingData, RollerBearingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.stage_unit import stage_unit
from carrierflex.simulation.stage.statics import SteadyLoad
from tests.simulation.fmi.fmpy_tool import Tool
from tests.simulation.stage.conftest import SPEED

fmpy = pytest.importorskip("fmpy", reason="fmpy checks and runs the unit")
pytestmark = pytest.mark.skipif(c_compiler() is None, reason="no C compiler")

LOAD = SteadyLoad(360e3, ntl_y=50e3, ntl_z=-200e3)
STEP = 1e-3
SENSORS = (
    Sensor("axial", "axial_displacement", 0.8, 0.412),
    Sensor("radial", "radial_displacement", 5.1, 0.412),
)
READING = ReadingEffects(sensors={"axial": SensorError(0.1, 0.05, 1e-5)})
#: Carrier angle of the rest reading [rad].
REST = 0.4
SHAFTS = ("carrier_angle", "carrier_speed", "generator_speed", "generator_torque")


@pytest.fixture(scope="module")
def loose(stage_body):
    """Rollers, clearances, unequal bearings, a spline, a kink: every channel of the stage."""
    bearings = replace(
        BearingData(),
        upwind_clearance=0.14e-3,
        downwind_y_factor=0.6,
        planet_clearance=40e-6,
        sun_radial=3e8,
        sun_friction=0.05,
        sun_clearance=0.3e-3,
    )
    data = StageData(bearings=bearings, planet_rollers=RollerBearingData())
    return stage_model(stage_body, data, effects=StageEffects(phi_PLC=1e-3), speed=SPEED)


@pytest.fixture(scope="module")
def unit_model(loose):
    return stage_unit(loose, LOAD, SENSORS, step=STEP, effects=READING, rest_angle=REST)


@pytest.fixture(scope="module")
def tool(unit_model, tmp_path_factory):
    """The unit in FMI 3; tests/simulation/fmi compares both versions."""
    folder = tmp_path_factory.mktemp("stage")
    file = folder / "stage.fmu"
    write_fmu(unit_model, file, version="3", compiler=c_compiler(), notes={"test": "1"})
    return Tool(file, folder / "unit")


def drive(model, time):
    """Torque, set speed and radial loads that swing."""
    rows = steady_drive(model, LOAD)(time)
    rows[:, 0] *= 1.0 + 0.2 * np.sin(40.0 * time)
    rows[:, 1] += 0.5 * np.sin(30.0 * time)
    rows[:, 2:] *= np.cos(25.0 * time)[:, None]
    return rows


def reference(model, time):
    """Outputs of the Python integrator, its drive linear between the instants."""
    inputs = drive(model, time)
    records = run_stage(
        model,
        lambda t: np.column_stack([np.interp(t, time, column) for column in inputs.T]),
        quasi_static_start(model, LOAD),
        duration=time[-1],
        sample_rate=1.0 / (time[1] - time[0]),
        step=STEP,
    )
    record = joined_records(list(records))
    generator = model.layout.rows["generator"][0]
    speed = record.c_rate @ model.L[generator]
    torque = model.data.chain.generator_constant * (record.drive[:, 1] - speed)
    signals = sensor_signals(model, record, SENSORS, effects=READING)
    zero = rest_readings(model, SENSORS, REST, effects=READING)
    columns = [record.c[:, 0], record.c_rate[:, 0], speed, torque]
    return np.column_stack([*columns, *(signals[s.name] - zero[s.name] for s in SENSORS)])


@pytest.mark.parametrize("version", ["2", "3"])
def test_a_unit_of_the_stage_is_valid_and_says_what_it_starts_with(unit_model, version, tmp_path):
    from fmpy.validation import validate_fmu

    file = tmp_path / "stage.fmu"
    write_fmu(unit_model, file, version=version, compiler=None, notes={"test": "1"})
    assert validate_fmu(str(file)) == []
    description = fmpy.read_model_description(str(file))
    start = {v.name: v.start for v in description.modelVariables}
    assert float(start["torque"]) == LOAD.torque
    assert float(start["ntl_z"]) == LOAD.ntl_z
    assert not description.coSimulation.providesDirectionalDerivative
    assert description.coSimulation.canGetAndSetFMUstate
    assert all(v.description and v.unit for v in description.modelVariables)


@pytest.mark.parametrize("size", [1e-4, 0.0037, 0.05])
def test_steps_of_any_size_equal_the_integrator_of_the_stage(tool, loose, size):
    """Both end Newton's method near 1e-13 m; contacts that open and close make it grow."""
    time = np.arange(max(4, round(0.05 / size)) + 1) * size
    assert tool.outputs == [*SHAFTS, *(sensor.name for sensor in SENSORS)]
    signals = tool.steps(tool.started(), time, drive(loose, time))[1:]
    expected = reference(loose, time)
    error = np.abs(signals - expected).max(axis=0) / np.abs(expected).max(axis=0)
    assert (error < 1e-6).all(), error


def test_a_state_set_again_gives_the_same_bits(tool, loose):
    time = np.arange(30) * 0.0037
    inputs = drive(loose, time)
    unit = tool.started()
    tool.steps(unit, time[:10], inputs[:10])
    stored = unit.store(unit.get_state())
    first = tool.steps(unit, time[9:], inputs[9:])
    other = tool.started()
    other.doStep(0.0, 0.01)
    other.set_state(other.restore(stored))
    np.testing.assert_array_equal(tool.steps(other, time[9:], inputs[9:]), first)


def test_what_the_unit_of_a_stage_does_not_offer_is_an_error_with_a_message(tool):
    unit = tool.started()
    with pytest.raises(fmpy.fmi1.FMICallException):
        tool.partials(unit, ["carrier_speed"], ["torque"])
    assert "directional derivatives are not offered" in tool.messages[-1]
    unit.set(tool.references(["torque"]), [1e15])
    with pytest.raises(fmpy.fmi1.FMICallException):
        unit.doStep(0.0, 0.1)
    assert "--time-step" in tool.messages[-1] or "small motions" in tool.messages[-1]


def test_effects_and_steps_that_a_unit_does_not_hold_are_refused(loose):
    effects = ReadingEffects(phi_H=1e-3, delay=0.1)
    with pytest.raises(ValueError, match=r"\[reading\] phi_H, \[reading\] delay: not inside"):
        stage_unit(loose, LOAD, SENSORS, step=STEP, effects=effects)
    with pytest.raises(ValueError, match="too large for the mesh period"):
        stage_unit(loose, LOAD, SENSORS, step=0.01)

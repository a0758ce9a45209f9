"""The stage as a co-simulation unit: the nonlinear stage with its flexible bodies is inside."""

import zipfile
from dataclasses import replace
from xml.etree import ElementTree

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
from tests.simulation.fmi.fmpy_tool import Tool, central
from tests.simulation.stage.conftest import SPEED

fmpy = pytest.importorskip("fmpy", reason="fmpy checks and runs the unit")
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(c_compiler() is None, reason="no C compiler"),
]

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
def tools(unit_model, tmp_path_factory):
    """The unit by version of the standard."""
    folder = tmp_path_factory.mktemp("stage")
    for version in "23":
        file = folder / f"stage{version}.fmu"
        write_fmu(unit_model, file, version=version, compiler=c_compiler(), notes={"test": "1"})
    return {version: Tool(folder / f"stage{version}.fmu", folder / version) for version in "23"}


@pytest.fixture
def tool(tools):
    """The unit in FMI 3; tests/simulation/fmi compares both versions."""
    return tools["3"]


def read_offers(file):
    """Attributes of CoSimulation; fmpy reads some of FMI 2's only."""
    with zipfile.ZipFile(file) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    return root.find("CoSimulation").attrib


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
    offers = read_offers(file)
    assert offers[f"providesDirectionalDerivative{'s' * (version == '3')}"] == "true"
    assert description.coSimulation.canGetAndSetFMUstate
    assert all(v.description and v.unit for v in description.modelVariables)


@pytest.mark.parametrize("size", [1e-4, 0.0037, 0.05])
@pytest.mark.usefixtures("all_modes")
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


#: Times; at the last, every law of force acts and no contact opens within the differences.
SMOOTH = np.arange(38) * 0.0037


def moving(tool, model):
    """The unit after some steps; its states and their derivatives without the velocities."""
    unit = tool.started()
    tool.steps(unit, SMOOTH, drive(model, SMOOTH))
    motions = [name for name in tool.at if name.startswith("mode[")]
    states = [*motions, *(f"der({name})" for name in motions)]
    return unit, states, [f"der({name},2)" for name in motions]


@pytest.mark.parametrize("version", ["2", "3"])
def test_derivatives_equal_central_differences(tools, loose, version):
    """Outputs and state derivatives over inputs and states; `rounding` is that of their sums."""
    tool = tools[version]
    unit, states, accelerations = moving(tool, loose)
    unknowns, knowns = [*tool.outputs, *accelerations], [*tool.inputs, *states]
    exact = tool.partials(unit, unknowns, knowns)
    base = unit.get_state()
    values = np.array(unit.get(tool.references(knowns)))

    def shifted(i, change):
        """Unknowns with one known changed."""
        if i < 4:
            unit.set(tool.references(knowns[i : i + 1]), values[i : i + 1] + change)
        else:
            unit.set_state(tool.partner(unit, knowns[i], change))
        result = np.array(unit.get(tool.references(unknowns)))
        unit.set_state(base)
        return result

    n = len(accelerations)
    steps = np.concatenate([1e-3 * np.abs(values[:4]), np.full(n, 1e-7), np.full(n, 1e-4)])
    # The free motion of the drive, which no force resists: 10 urad of the carrier's angle.
    steps[4] = 1e-5 / abs(exact[0, 4])
    numeric = np.column_stack([central(shifted, i, step) for i, step in enumerate(steps)])
    rounding = 5e-15 * (np.abs(exact) @ np.abs(values))[:, None] / steps
    assert (np.abs(exact - numeric) <= 1e-7 * np.abs(exact) + rounding).all()
    assert (rounding < 1e-8 * np.abs(exact)).sum() > 10000


def test_derivatives_are_those_that_the_steps_follow(tool, loose):
    """A step of the midpoint rule is the mean of the derivatives at its ends, to order h^2."""
    unit, states, accelerations = moving(tool, loose)
    n, h = len(accelerations), 1e-6
    tool.set_inputs(unit, drive(loose, SMOOTH[-1:])[0], [1e6, 1.0, 1e6, -1e6])
    read = tool.references([*states, *tool.outputs, *accelerations])

    def values_and_derivatives():
        values = np.array(unit.get(read))
        return values[:-n], np.concatenate(
            [values[n : 2 * n], values[-n:], tool.output_derivatives(unit)]
        )

    before, first = values_and_derivatives()
    unit.doStep(SMOOTH[-1], h)
    after, last = values_and_derivatives()
    slope, expected = (after - before) / h, 0.5 * (first + last)
    scale = np.abs(expected)
    scale[:n], scale[n + 1 : 2 * n] = scale[:n].max(), scale[n : 2 * n].max()
    # The carrier's acceleration, an output, is a small sum of large ones of the modes.
    tolerance = np.repeat([1e-10, 1e-7, 1e-6, 1e-4], [n, 1, n - 1, len(tool.outputs)])
    assert (np.abs(slope - expected) < tolerance * scale).all()


def test_adjoint_derivatives_are_the_rows_of_the_directional_ones(tool, loose):
    unit, states, accelerations = moving(tool, loose)
    unknowns, knowns = [*tool.outputs, *accelerations], [*tool.inputs, *states]
    seed = np.linspace(-1.0, 1.0, len(unknowns))
    expected = seed @ tool.partials(unit, unknowns, knowns)
    adjoint = unit.getAdjointDerivative(
        tool.references(unknowns), tool.references(knowns), seed, len(knowns)
    )
    np.testing.assert_allclose(adjoint, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def test_what_the_unit_of_a_stage_does_not_offer_is_an_error_with_a_message(tool):
    unit = tool.started()
    with pytest.raises(fmpy.fmi1.FMICallException):
        tool.partials(unit, ["carrier_speed"], ["axial"])
    assert "a known is refused" in tool.messages[-1]
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

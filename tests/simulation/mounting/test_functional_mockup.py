"""The co-simulation unit: valid, and equal to the project's own integrator."""

import ctypes
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from carrierflex.simulation.mounting.functional_mockup import c_compiler, mounting_system, write_fmu
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.time_integration import marched, mounting_model, state_at_rest
from carrierflex.workflows.simulation.export_fmu import main

fmpy = pytest.importorskip("fmpy", reason="fmpy checks and runs the unit")
needs_compiler = pytest.mark.skipif(
    c_compiler() is None, reason="no C compiler: the unit holds sources only"
)

STEP = 0.01
TIME = np.arange(1001) * STEP
LOADS = np.column_stack(
    [2e5 * np.sin(1.3 * TIME) + 1e5, 3e4 * np.cos(2.0 * TIME), -1e5 * np.tanh(TIME - 5.0)]
)
INPUTS = ("torque", "ntl_y", "ntl_z")


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    return main(out=tmp_path_factory.mktemp("unit") / "mounting.fmu", time_step=STEP)


@pytest.fixture
def model():
    return mounting_model(MountingRig(), parameter_array(MountingRig()), LOADS, STEP)


@pytest.fixture
def slave(unit, tmp_path):
    folder = fmpy.extract(str(unit.file), unzipdir=str(tmp_path))
    description = fmpy.read_model_description(folder)
    found = fmpy.fmi2.FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="unit",
    )
    found.instantiate()
    yield found
    found.terminate()
    found.freeInstance()


def started(slave, loads):
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.setReal([0, 1, 2], loads)
    slave.exitInitializationMode()


def read(slave):
    return slave.getReal([3 + i for i in range(len(SENSORS))])


def test_the_unit_is_valid(unit):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit.file)) == []


@needs_compiler
def test_simulated_by_fmpy_it_equals_the_own_integrator(unit, model):
    kinds = [("time", float), *((name, float) for name in INPUTS)]
    record = np.array(list(zip(TIME, *LOADS.T, strict=True)), dtype=kinds)
    found = fmpy.simulate_fmu(
        str(unit.file), stop_time=TIME[-1], output_interval=STEP, input=record
    )
    # Without input derivatives a load stays what it was at the start of its step.
    state, expected = state_at_rest(model, LOADS[0]), []
    for load in LOADS[:-1]:
        signals, state = marched(model, state, np.stack([load, load]))
        expected.append(signals[1])
    got = np.column_stack([found[name] for name in SENSORS])[1:]
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@needs_compiler
@pytest.mark.parametrize("steps", [1, 10])
def test_with_input_derivatives_linear_loads_are_exact(slave, model, steps):
    coarse = LOADS[:: 10 if steps == 10 else 1]
    fine = np.column_stack(
        [np.interp(TIME, TIME[:: 10 if steps == 10 else 1], column) for column in coarse.T]
    )
    expected, _ = marched(model, state_at_rest(model, fine[0]), fine)
    started(slave, coarse[0])
    size, got = steps * STEP, [read(slave)]
    for k, (now, after) in enumerate(pairwise(coarse)):
        slave.setReal([0, 1, 2], now)
        slave.setRealInputDerivatives([0, 1, 2], [1, 1, 1], (after - now) / size)
        slave.doStep(currentCommunicationPoint=k * size, communicationStepSize=size)
        got.append(read(slave))
    np.testing.assert_allclose(
        got, expected[::steps], rtol=0.0, atol=1e-10 * np.abs(expected).max()
    )


@needs_compiler
def test_a_step_that_does_not_fit_and_an_infinite_load_are_refused(slave):
    started(slave, [0.0, 0.0, 0.0])
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=1.5 * STEP)
    for endless in (1e15, np.inf, np.nan):
        with pytest.raises(fmpy.fmi1.FMICallException):
            slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=endless)
    slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=1000 * STEP)
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.setReal([0], [np.inf])


def test_the_description_names_every_variable_and_promises_no_steps_of_any_size(unit):
    description = fmpy.read_model_description(str(unit.file))
    assert not description.coSimulation.canHandleVariableCommunicationStepSize
    assert all(variable.description for variable in description.modelVariables)
    assert [v.description[-1] for v in description.modelVariables if v.name[:3] == "ntl"] == [
        "y",
        "z",
    ]


@needs_compiler
def test_a_unit_without_a_name_is_instantiated(slave):
    library = slave.dll
    library.fmi2Instantiate.restype = ctypes.c_void_p
    made = library.fmi2Instantiate(None, 1, slave.guid.encode(), None, None, 0, 0)
    assert made
    library.fmi2FreeInstance(ctypes.c_void_p(made))


def test_without_a_compiler_the_unit_holds_its_sources(tmp_path):
    found = main(out=tmp_path / "sources.fmu", sources_only=True)
    assert not found.compiled
    folder = Path(fmpy.extract(str(found.file), unzipdir=str(tmp_path / "unit")))
    assert {file.name for file in (folder / "sources").iterdir()} == {
        "fmi2_linear_system.c",
        "linear_system.h",
    }
    assert not (folder / "binaries").exists()


def test_wrong_units_are_refused(tmp_path):
    rig = MountingRig()
    with pytest.raises(ValueError, match="step is 0"):
        mounting_system(rig, parameter_array(rig), step=0.0)
    with pytest.raises(ValueError, match="bushings are nonlinear"):
        mounting_system(rig, parameter_array(rig, {"K3": 65e9}), step=STEP)
    with pytest.raises(ValueError, match=r"ends in \.fmu"):
        write_fmu(
            mounting_system(rig, parameter_array(rig), step=STEP),
            tmp_path / "m.zip",
            compiler=None,
            notes={},
        )

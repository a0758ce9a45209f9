"""Co-simulation units: valid, equal to the project's integrators, and safe in wrong hands."""

import ctypes
import re
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from carrierflex.simulation.fmi.functional_mockup import c_compiler, write_fmu
from carrierflex.simulation.mounting.mounting_unit import mounting_unit
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.table_3 import TABLE_3
from carrierflex.simulation.mounting.time_integration import (
    marched,
    mounting_model,
    state_at_rest,
)
from carrierflex.workflows.simulation.export_fmu import main
from tests.simulation.fmi.fmpy_tool import Tool, central

fmpy = pytest.importorskip("fmpy", reason="fmpy checks and runs the unit")
needs_compiler = pytest.mark.skipif(
    c_compiler() is None, reason="no C compiler: the unit holds sources only"
)

#: Every force and every coordinate of the mounting at once: fluid with mass, friction, hardening,
#: damping over deflection, bearing, axial motion, gains, zeros and weight.
RIG = MountingRig(axial_motion=True)
EVERYTHING = parameter_array(
    RIG,
    {
        **TABLE_3["hydrodynamic"],
        "Fy": 5e3,
        "C1": 1e5,
        "C3": 1e9,
        "main_bearing_compliance": 1e-9,
        "starboard_excess": 0.1,
        "gravity": 9.81,
        "gain_spz": 1.1,
        "zero_ssz": 1e-4,
    },
)
LARGEST_STEP = 1e-3
LARGEST_LOADS = np.array([[3.1e5, 3e4, 1e5]])
INPUTS = ("torque", "ntl_y", "ntl_z")


def loads(time):
    return np.column_stack(
        [
            2e5 * np.sin(13.0 * time) + 1e5,
            3e4 * np.cos(20.0 * time),
            -1e5 * np.tanh(5.0 * time - 2.0),
        ]
    )


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A unit of everything by version of the standard."""
    folder = tmp_path_factory.mktemp("units")
    model = mounting_unit(RIG, EVERYTHING, step=LARGEST_STEP, loads=LARGEST_LOADS)
    for version in "23":
        file = folder / f"everything{version}.fmu"
        write_fmu(model, file, version=version, compiler=c_compiler(), notes={"test": "1"})
    return {version: folder / f"everything{version}.fmu" for version in "23"}


@pytest.fixture(params=["2", "3"])
def tool(request, files, tmp_path):
    return Tool(files[request.param], tmp_path / "unit")


def reference(time, rig=RIG, parameters=EVERYTHING):
    """Signals of the Python integrator at the unit's own steps."""
    inputs = loads(time)
    model = mounting_model(rig, parameters, inputs, time[1] - time[0], step=LARGEST_STEP)
    signals, _ = marched(model, state_at_rest(model, inputs[0]), inputs)
    gains = [1.1 if name == "spz" else 1.0 for name in SENSORS]
    zeros = [1e-4 if name == "ssz" else 0.0 for name in SENSORS]
    return signals * gains + zeros


@pytest.mark.parametrize("version", ["2", "3"])
def test_a_unit_is_valid_and_names_every_variable(files, version, tmp_path):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(files[version])) == []
    description = Tool(files[version], tmp_path / "unit").description
    assert all(v.description and v.unit for v in description.modelVariables)
    words = {v.name: v.description for v in description.modelVariables}
    assert words["ntl_y"].endswith("along y")
    assert words["ssz"].startswith("Displacement of the housing at sensor ssz, along z")
    assert description.coSimulation.canHandleVariableCommunicationStepSize


@pytest.mark.long
@needs_compiler
@pytest.mark.parametrize("size", [1e-4, 1e-3, 0.0037, 0.01, 0.05])
def test_steps_of_any_size_equal_the_integrator(tool, size):
    """0.0037 s is no multiple of the step inside; the integrator's tolerance is 1e-8 of a force."""
    time = np.arange(round(min(2.0, 1000 * size) / size) + 1) * size
    unit = tool.started(loads(time)[0])
    signals = tool.steps(unit, time, loads(time))
    np.testing.assert_allclose(unit.get(tool.references(INPUTS)), loads(time)[-1], rtol=1e-12)
    if tool.version == "2":
        # An input derivative holds for one step.
        unit.doStep(time[-1], size)
        np.testing.assert_allclose(unit.get(tool.references(INPUTS)), loads(time)[-1], rtol=1e-12)
    expected = reference(time)
    np.testing.assert_allclose(signals, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


@needs_compiler
def test_uneven_steps_reach_the_same_place(tool):
    """Loads linear over the whole record: only the steps inside differ, by their fourth order."""
    time = np.concatenate([[0.0], np.cumsum(np.tile([0.0004, 0.013, 0.05, 0.0021], 10))])
    first, last = loads(time)[0], loads(time)[-1]
    slope = (last - first) / time[-1]
    ends = []
    for instants in (time, time[[0, -1]]):
        unit = tool.started(first)
        for begin, end in pairwise(instants):
            tool.set_inputs(unit, first + slope * begin, slope)
            unit.doStep(begin, end - begin)
        ends.append(tool.read(unit))
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-6 * np.abs(ends[1]).max())


@pytest.mark.long
@needs_compiler
@pytest.mark.parametrize("version", ["2", "3"])
def test_simulated_by_fmpy_with_held_inputs(files, version):
    size = 0.004
    time = np.arange(101) * size
    kinds = [("time", float), *((name, float) for name in INPUTS)]
    record = np.array(list(zip(time, *loads(time).T, strict=True)), dtype=kinds)
    result = fmpy.simulate_fmu(
        str(files[version]),
        stop_time=time[-1],
        output_interval=size,
        input=record,
        fmi_type="CoSimulation",
    )
    model = mounting_model(RIG, EVERYTHING, loads(time), size, step=LARGEST_STEP)
    state, expected = state_at_rest(model, loads(time)[0]), []
    for load in loads(time)[:-1]:
        signals, state = marched(model, state, np.stack([load, load]))
        expected.append(signals[1])
    signals = np.column_stack([result[name] for name in SENSORS])[1:] - [
        1e-4 if name == "ssz" else 0.0 for name in SENSORS
    ]
    signals /= [1.1 if name == "spz" else 1.0 for name in SENSORS]
    np.testing.assert_allclose(signals, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


@needs_compiler
def test_derivatives_equal_central_differences(tool):
    """In step mode over inputs and states, of a place where all forces act and friction slips."""
    structure = tool.description
    unknowns = [u.variable.name for u in (*structure.outputs, *structure.derivatives)]
    states = [u.variable.derivative.name for u in structure.derivatives]
    unit = tool.started(loads(np.zeros(1))[0])
    tool.steps(unit, np.arange(38) * 0.01, loads(np.arange(38) * 0.01))
    # A force that slips stands on the kink of its own law.
    friction = [name for name in states if name.startswith("friction")]
    slips = [name for name in friction if abs(unit.get([tool.at[name]])[0]) == 5e3]
    assert 0 < len(slips) < len(friction)
    knowns = [*INPUTS, *(name for name in states if name not in slips)]
    exact = tool.partials(unit, unknowns, knowns)
    base = unit.get_state()
    values = np.array(unit.get(tool.references(knowns)))

    def shifted(i, change):
        """Unknowns with one known changed."""
        if i < len(INPUTS):
            unit.set(tool.references(knowns[i : i + 1]), values[i : i + 1] + change)
        else:
            unit.set_state(tool.partner(unit, knowns[i], change))
        result = np.array(unit.get(tool.references(unknowns)))
        unit.set_state(base)
        return result

    steps = 1e-3 * np.abs(values)
    numeric = np.column_stack([central(shifted, i, step) for i, step in enumerate(steps)])
    # Rounding of the sums that make an unknown, over the change of the known.
    rounding = 1e-15 * (np.abs(exact) @ np.abs(values))[:, None] / steps
    assert (np.abs(exact - numeric) <= 1e-7 * np.abs(exact) + rounding).all()
    assert (rounding < 1e-8 * np.abs(exact)).sum() > 80


@needs_compiler
def test_derivatives_of_the_rest_equal_central_differences(tool):
    unit = tool.instance()
    tool.begin(unit)
    at = np.array([1e5, 5e4, -3e4])
    unit.set(tool.references(INPUTS), at)
    exact = tool.partials(unit, SENSORS, INPUTS)

    def shifted(i, change):
        unit.set(tool.references(INPUTS), at + change * np.eye(3)[i])
        return np.array(tool.read(unit))

    numeric = np.column_stack([central(shifted, i, 200.0) for i in range(3)])
    np.testing.assert_allclose(exact, numeric, rtol=1e-7, atol=1e-9 * np.abs(exact).max())


@needs_compiler
def test_output_derivatives_are_those_of_the_outputs(tool):
    unit = tool.started(loads(np.zeros(1))[0])
    tool.steps(unit, np.arange(20) * 0.01, loads(np.arange(20) * 0.01))
    rates = tool.output_derivatives(unit)
    before = np.array(tool.read(unit))
    unit.set(tool.references(INPUTS), loads(np.array([0.19]))[0])
    unit.doStep(0.19, 1e-6)
    slope = (np.array(tool.read(unit)) - before) / 1e-6
    np.testing.assert_allclose(rates, slope, rtol=0.0, atol=1e-4 * np.abs(slope).max())


@needs_compiler
def test_a_state_set_again_gives_the_same_bits(tool):
    time = np.arange(60) * 0.0037
    unit = tool.started(loads(time)[0])
    tool.steps(unit, time[:20], loads(time[:20]))
    state = unit.get_state()
    stored = unit.store(state)
    first = tool.steps(unit, time[19:], loads(time[19:]))
    unit.set_state(state)
    np.testing.assert_array_equal(tool.steps(unit, time[19:], loads(time[19:])), first)
    # Other steps in between leave matrices of another length behind.
    other = tool.started()
    other.doStep(0.0, 0.05)
    other.set_state(other.restore(stored))
    np.testing.assert_array_equal(tool.steps(other, time[19:], loads(time[19:])), first)


@needs_compiler
def test_two_instances_share_no_state(tool):
    time = np.arange(40) * 0.003
    alone = tool.steps(tool.started(loads(time)[0]), time, loads(time))
    one, two = tool.started(loads(time)[0]), tool.started()
    signals = [tool.read(one)]
    for begin, end in pairwise(time):
        signals.append(tool.steps(one, np.array([begin, end]), loads(np.array([begin, end])))[1])
        two.set(tool.references(INPUTS), [3e5, 0.0, 1e5])
        two.doStep(begin, end - begin)
    np.testing.assert_array_equal(signals, alone)


@needs_compiler
def test_a_reset_unit_starts_again(tool):
    time = np.arange(40) * 0.003
    unit = tool.started(loads(time)[0])
    first = tool.steps(unit, time, loads(time))
    unit.terminate()
    unit.reset()
    assert list(unit.get(list(range(4)))) == [0.0] * 4
    tool.begin(unit)
    unit.set(tool.references(INPUTS), loads(time)[0])
    unit.exitInitializationMode()
    np.testing.assert_array_equal(tool.steps(unit, time, loads(time)), first)


@needs_compiler
def test_wrong_calls_are_errors_with_a_message(tool):
    unit = tool.started()
    calls = {
        "not positive": lambda: unit.doStep(0.0, 0.0),
        "not positive;": lambda: unit.doStep(0.0, -1.0),
        "a million steps": lambda: unit.doStep(0.0, 1e9),
        "another time": lambda: unit.doStep(3.0, 0.01),
        "not finite": lambda: unit.set(tool.references(["torque"]), [np.nan]),
        "no input": lambda: unit.set(tool.references(["ssx"]), [0.0]),
        "reference is unknown": lambda: unit.get([999]),
        "begun before": lambda: tool.begin(unit),
        "of another unit": lambda: unit.restore(b"\0" * len(unit.store(unit.get_state()))),
        "known is refused": lambda: tool.partials(unit, ["ssx"], ["spz"]),
        "did not converge": lambda: (
            unit.set(tool.references(["torque"]), [1e12]),
            unit.doStep(0.0, 0.01),
        ),
    }
    for message, call in calls.items():
        tool.messages.clear()
        with pytest.raises(fmpy.fmi1.FMICallException, match="error"):
            call()
        assert [m for m in tool.messages if message in m], (message, tool.messages)
    fresh = tool.instance()
    with pytest.raises(fmpy.fmi1.FMICallException):
        fresh.doStep(0.0, 0.01)
    assert "before the initialization" in tool.messages[-1]
    # The unit goes on from where it was.
    unit.set(tool.references(["torque"]), [0.0])
    unit.doStep(0.0, 0.01)


@needs_compiler
@pytest.mark.parametrize("version", ["2", "3"])
def test_the_sources_agree_with_the_headers_of_the_standard(files, version, tmp_path):
    """fmpy brings the headers: every function is there, with the types that they declare."""
    headers = Path(fmpy.__file__).parent / "c-code"
    folder = Path(fmpy.extract(str(files[version]), unzipdir=str(tmp_path)))
    wanted = set(
        re.findall(
            rf"fmi{version}\w+TYPE\s+(fmi{version}\w+);",
            (headers / f"fmi{version}Functions.h").read_text(),
        )
    )
    source = folder / "sources" / f"fmi{version}.c"
    options = ["-std=c99", "-Werror", "-Wall", "-Wextra", "-Wno-unused-parameter", "-c"]
    command = [c_compiler(), *options, "-DSTANDARD_HEADERS", f"-I{headers}", str(source)]
    subprocess.run([*command, "-o", str(tmp_path / "checked.o")], check=True)
    (library,) = (folder / "binaries").rglob("carrierflex_mounting.*")
    loaded = ctypes.CDLL(str(library))
    assert len(wanted) > 40
    assert [name for name in wanted if not hasattr(loaded, name)] == []


@needs_compiler
def test_a_unit_without_a_name_is_instantiated_and_another_token_is_not(files, tmp_path):
    tool = Tool(files["2"], tmp_path / "unit")
    library = tool.instance().dll
    library.fmi2Instantiate.restype = ctypes.c_void_p
    token = tool.description.guid.encode()
    made = library.fmi2Instantiate(None, 1, token, None, None, 0, 0)
    assert made
    library.fmi2FreeInstance(ctypes.c_void_p(made))
    assert not library.fmi2Instantiate(None, 1, b"{another}", None, None, 0, 0)


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_without_a_compiler_the_unit_holds_its_sources(tmp_path, fmi):
    written = main(
        out=tmp_path / "sources.fmu", case=Path("mounting_2011"), fmi=fmi, sources_only=True
    )
    assert not written.compiled
    folder = Path(fmpy.extract(str(written.file), unzipdir=str(tmp_path / "unit")))
    names = {file.name for file in (folder / "sources").iterdir()}
    more = {"buildDescription.xml"} if fmi == "3" else set()
    assert (
        names
        == {f"fmi{fmi}.c", "unit.c", "unit.h", "mounting_unit.c", "model.h", "model_data.h"} | more
    )
    assert not (folder / "binaries").exists()


def test_wrong_units_are_refused(tmp_path):
    unit = mounting_unit(RIG, EVERYTHING, step=LARGEST_STEP, loads=LARGEST_LOADS)
    with pytest.raises(ValueError, match="step is 0"):
        mounting_unit(RIG, EVERYTHING, step=0.0, loads=LARGEST_LOADS)
    with pytest.raises(ValueError, match="too large for the bushings"):
        mounting_unit(RIG, EVERYTHING, step=0.5, loads=LARGEST_LOADS)
    late = parameter_array(RIG, {"delay": 0.1})
    with pytest.raises(ValueError, match="delay"):
        mounting_unit(RIG, late, step=LARGEST_STEP, loads=LARGEST_LOADS)
    with pytest.raises(ValueError, match=r"ends in \.fmu"):
        write_fmu(unit, tmp_path / "m.zip", version="2", compiler=None, notes={})
    with pytest.raises(ValueError, match="FMI version is '1'"):
        write_fmu(unit, tmp_path / "m.fmu", version="1", compiler=None, notes={})
    with pytest.raises(ValueError, match="no equations of motion"):
        main(out=tmp_path / "m.fmu", case=Path("carrier_lc1_to_lc4"))
    with pytest.raises(ValueError, match="--run"):
        main(out=tmp_path / "m.fmu", run="LC1")
    with pytest.raises(ValueError, match=r"phi_face, \[reading\] saddle: not inside"):
        main(out=tmp_path / "m.fmu", case=Path("stage_papers_gap"), quiet=True)

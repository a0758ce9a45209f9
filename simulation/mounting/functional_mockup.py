"""The linear mounting model as a functional mock-up unit.

FMI 2.0 for co-simulation, with its C sources.

The unit takes the exact steps of :mod:`carrierflex.simulation.mounting.propagators`; inputs are
linear in time where the importing tool sets their derivatives, otherwise constant over a
communication step.
"""

import hashlib
import shutil
import subprocess
import sys
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from carrierflex.files.whole_files import whole_file
from carrierflex.files.whole_folders import scratch_folder
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray, check_parameters
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.propagators import propagator
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig

Array = NDArray[np.float64]

#: Name that the standard's files carry.
IDENTIFIER = "carrierflex_mounting"
_C_FILE = Path(__file__).with_name("fmi2_linear_system.c")
_INPUTS = {"torque": "N.m", "ntl_y": "N", "ntl_z": "N"}
_INPUT_WORDS = {
    "torque": "Torque on the main shaft about x",
    "ntl_y": "Non-torque load at the coupling along y",
    "ntl_z": "Non-torque load at the coupling along z",
}
#: SI base units of the units used, as the standard spells them.
_BASE_UNITS = {
    "N.m": {"kg": "1", "m": "2", "s": "-2"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "m": {"m": "1"},
}


@dataclass(frozen=True, eq=False)
class DiscreteSystem:
    """``x(t + h) = E x + B_0 u(t) + B_1 u(t + h)``, ``y = C x + y_0``, at rest ``x = S u``.

    Parameters
    ----------
    step : float
        h [s].
    E, B_0, B_1, C, S : ndarray, shapes (n, n), (n, 3), (n, 3), (6, n), (n, 3)
        Matrices in SI units; inputs torque, ntl_y, ntl_z, outputs the six sensors.
    y_0 : ndarray, shape (6,)
        Zeros of the sensors [m].
    """

    step: float
    E: Array
    B_0: Array
    B_1: Array
    C: Array
    S: Array
    y_0: Array


def mounting_system(rig: MountingRig, parameters: ParameterArray, *, step: float) -> DiscreteSystem:
    """Exact discrete form of the linear mounting model.

    Raises
    ------
    ValueError
        Where the step is not positive, a parameter is out of bounds, a bushing is not linear, or
        sensors have a delay.
    """
    if not (np.isfinite(step) and step > 0.0):
        raise ValueError(f"step is {step} s; expected a positive number")
    check_parameters(parameters)
    blocks = mounting_blocks(rig, parameters)
    if not all(block.is_linear for block in blocks):
        raise ValueError(
            "the bushings are nonlinear; expected K3, K5, C3 and Kp or Fy of zero for a unit of "
            "linear steps"
        )
    if parameters[INDEX["delay"]] != 0.0:
        raise ValueError(
            f"sensor delay is {parameters[INDEX['delay']]} s; expected none in a co-simulation unit"
        )
    E = []
    B_0 = []
    B_1 = []
    C = []
    S = []
    for block in blocks:
        end = propagator(block, step).end
        n = len(end)
        C.append(np.hstack([block.output, np.zeros((len(SENSORS), n - len(block.names)))]))
        at_rest = np.zeros((n, 3))
        at_rest[: len(block.names)] = np.linalg.solve(block.K, block.G)
        E.append(end[:, :n])
        B_0.append(end[:, n : n + 3])
        B_1.append(end[:, n + 3 : n + 6])
        S.append(at_rest)
    gains = np.array([parameters[INDEX[f"gain_{name}"]] for name in SENSORS])
    zeros = np.array([parameters[INDEX[f"zero_{name}"]] for name in SENSORS])
    rows = gains[:, None] * np.hstack(C)
    return DiscreteSystem(
        step, block_diag(*E), np.vstack(B_0), np.vstack(B_1), rows, np.vstack(S), zeros
    )


def c_header(system: DiscreteSystem, guid: str = "") -> str:
    """Sizes and matrices as C declarations; 17 digits, which give back every double."""
    lines = [
        f'#define MODEL_GUID "{guid}"',
        f"#define STEP {system.step!r}",
        f"enum {{ N_X = {len(system.E)}, N_U = {len(_INPUTS)}, N_Y = {len(SENSORS)} }};",
        f"static const double Y_0[N_Y] = {_braced(system.y_0)};",
    ]
    for name, shape in (
        ("E", "[N_X][N_X]"),
        ("B_0", "[N_X][N_U]"),
        ("B_1", "[N_X][N_U]"),
        ("C", "[N_Y][N_X]"),
        ("S", "[N_X][N_U]"),
    ):
        rows = ",\n    ".join(_braced(row) for row in getattr(system, name))
        lines.append(f"static const double {name}{shape} = {{\n    {rows}}};")
    return "\n".join(lines) + "\n"


def _braced(values: Array) -> str:
    return "{" + ", ".join(f"{value:.17g}" for value in values) + "}"


def model_description(system: DiscreteSystem, guid: str, notes: Mapping[str, str]) -> bytes:
    """XML description of the unit; `notes` names what it was made with."""
    tag = ElementTree.SubElement
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="2.0", modelName="carrierflex mounting model", guid=guid,
        version="1", generationTool="carrierflex",
        description="; ".join(f"{name} {value}" for name, value in notes.items()),
        variableNamingConvention="flat", numberOfEventIndicators="0",
    )  # fmt: skip
    unit = tag(
        root, "CoSimulation", modelIdentifier=IDENTIFIER, canInterpolateInputs="true",
        canHandleVariableCommunicationStepSize="false", maxOutputDerivativeOrder="0",
        canNotUseMemoryManagementFunctions="true",
    )  # fmt: skip
    tag(tag(unit, "SourceFiles"), "File", name=_C_FILE.name)
    units = tag(root, "UnitDefinitions")
    for name, base in _BASE_UNITS.items():
        tag(tag(units, "Unit", name=name), "BaseUnit", base)
    tag(root, "DefaultExperiment", startTime="0", stepSize=repr(system.step))
    _add_variables(root)
    ElementTree.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root)


def _add_variables(root: ElementTree.Element) -> None:
    """Inputs, then outputs; value references count up from 0, indices from 1."""
    tag = ElementTree.SubElement
    variables, structure = tag(root, "ModelVariables"), tag(root, "ModelStructure")
    for reference, (name, unit_name) in enumerate(_INPUTS.items()):
        entry = tag(
            variables,
            "ScalarVariable",
            name=name,
            description=_INPUT_WORDS[name],
            valueReference=str(reference),
            causality="input",
            variability="continuous",
        )
        tag(entry, "Real", start="0", unit=unit_name)
    outputs, unknowns = tag(structure, "Outputs"), tag(structure, "InitialUnknowns")
    for reference, name in enumerate(SENSORS, start=len(_INPUTS)):
        entry = tag(
            variables,
            "ScalarVariable",
            name=name,
            description=f"Displacement of the housing at sensor {name}, along {name[-1]}, from the "
            "equilibrium under gravity",
            valueReference=str(reference),
            causality="output",
            variability="continuous",
            initial="calculated",
        )
        tag(entry, "Real", unit="m")
        # A communication step ends before its outputs are read: none depends on an input set after
        # it.
        tag(outputs, "Unknown", index=str(reference + 1), dependencies="")
        tag(
            unknowns,
            "Unknown",
            index=str(reference + 1),
            dependencies=" ".join(str(i + 1) for i in range(len(_INPUTS))),
        )


def write_fmu(
    system: DiscreteSystem, path: Path, *, compiler: str | None, notes: Mapping[str, str]
) -> None:
    """Write the unit; without a compiler as C sources only, for the importing tool to compile.

    Parameters
    ----------
    system : DiscreteSystem
        The system.
    path : Path
        File to write, suffix ``.fmu``.
    compiler : str or None
        C compiler; see :func:`c_compiler`.
    notes : mapping
        What the unit was made with.

    Raises
    ------
    ValueError
        Where the suffix is another one.
    RuntimeError
        Where the compiler fails; its first line is told.
    """
    if path.suffix != ".fmu":
        raise ValueError(f"{path}: expected a file name that ends in .fmu")
    digest = hashlib.sha256(
        (c_header(system) + _C_FILE.read_text(encoding="utf-8")).encode()
    ).hexdigest()
    # The same matrices give the same identity, others another one.
    guid = "{" + str(uuid.UUID(digest[:32])) + "}"
    with whole_file(path) as part, scratch_folder(path) as folder:
        shutil.copyfile(_C_FILE, folder / _C_FILE.name)
        (folder / "linear_system.h").write_text(c_header(system, guid), encoding="ascii")
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", model_description(system, guid, notes))
            for source in (_C_FILE.name, "linear_system.h"):
                archive.write(folder / source, f"sources/{source}")
            if compiler is not None:
                library = _compiled(folder, compiler)
                archive.write(library, f"binaries/{_platform()}/{library.name}")


def c_compiler() -> str | None:
    """C compiler of the system; None where there is none or the standard has no such platform."""
    return (shutil.which("cc") or shutil.which("gcc")) if _platform() else None


def _platform() -> str:
    """The standard's name of this platform; empty for others than Linux and macOS of 64 bits."""
    if sys.maxsize < 2**32:
        return ""
    return {"linux": "linux64", "darwin": "darwin64"}.get(sys.platform, "")


def _compiled(folder: Path, compiler: str) -> Path:
    library = folder / (IDENTIFIER + (".dylib" if sys.platform == "darwin" else ".so"))
    command = [
        compiler,
        "-O2",
        "-std=c99",
        "-shared",
        "-fPIC",
        "-fvisibility=hidden",
        "-o",
        str(library),
    ]
    done = subprocess.run(
        [*command, str(folder / _C_FILE.name), "-lm"], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"{compiler} failed: {(done.stderr.splitlines() or ['no message'])[0]}")
    return library

"""A functional mock-up unit: model description, C sources, library of this platform.

FMI 2.0 and FMI 3.0 for co-simulation. ``unit.c`` holds what both versions share (modes, values,
derivatives, states), ``fmi2.c`` and ``fmi3.c`` the functions of each; the model brings one C file
of its own, and its numbers as headers.

References
----------
.. [1] Modelica Association, "Functional Mock-up Interface for Model Exchange and Co-Simulation",
   version 2.0.4.
.. [2] Modelica Association, "Functional Mock-up Interface Specification", version 3.0.1.
"""

import hashlib
import platform
import shutil
import subprocess
import sys
import uuid
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.files.whole_folders import scratch_folder

Array = NDArray[np.float64]
Element = ElementTree.Element
_tag = ElementTree.SubElement

#: Versions of the standard: words and keys of both differ.
VERSIONS = ("2", "3")
#: Unit of the motion in a mode of unit mass.
MODAL_UNIT = "kg(1/2).m"
_HERE = Path(__file__).parent
_SHARED = ("unit.h", "unit.c")
#: SI base units of the units used: exponents of kg, m, s, rad.
_BASE_UNITS: Mapping[str, tuple[int, int, int, int]] = {
    "s": (0, 0, 1, 0),
    "N.m": (1, 2, -2, 0),
    "N.m/s": (1, 2, -3, 0),
    "N": (1, 1, -2, 0),
    "N/s": (1, 1, -3, 0),
    "m": (0, 1, 0, 0),
    "m/s": (0, 1, -1, 0),
    "m/s2": (0, 1, -2, 0),
    "rad": (0, 0, 0, 1),
    "rad/s": (0, 0, -1, 1),
    "rad/s2": (0, 0, -2, 1),
    "rad/s/s": (0, 0, -2, 1),
}


@dataclass(frozen=True)
class Variable:
    """Name, unit, description and value at the start, as the importing tool shows them."""

    name: str
    unit: str
    description: str
    start: float = 0.0


@dataclass(frozen=True)
class ContinuousState:
    """A state and its derivative.

    Parameters
    ----------
    variable : Variable
        The state.
    derivative : Variable
        Its derivative; one with the name of another state is that state.
    """

    variable: Variable
    derivative: Variable


def coordinate_states(variable: Variable) -> tuple[ContinuousState, ContinuousState]:
    """A coordinate and its velocity as states; name, unit and words of both derivatives follow."""
    name, unit, words = variable.name, variable.unit, variable.description
    velocity = Variable(f"der({name})", f"{unit}/s", f"{words}, velocity")
    acceleration = Variable(f"der({name},2)", f"{unit}/s2", f"{words}, acceleration")
    return ContinuousState(variable, velocity), ContinuousState(velocity, acceleration)


@dataclass(frozen=True, eq=False)
class UnitModel:
    """What a model gives to become a unit.

    Parameters
    ----------
    identifier : str
        Name that the library carries.
    title : str
        Name of the model.
    description : str
        What is inside, in a sentence.
    inputs, outputs : tuple of Variable
        Variables in the order of the C file's ``u`` and ``y``.
    states : tuple of ContinuousState
        States in the order of ``x``.
    dependencies : mapping of str to tuple of str
        Inputs and states that each output depends on at the same instant, by name.
    source : Path
        C file that implements the functions of ``unit.h`` under "Of the model".
    data : mapping
        Constants of that file by name: integers are sizes, numbers and arrays doubles.
    memory : int
        Numbers that its step remembers beside the states.
    step : float
        Communication step that the description proposes [s].
    """

    identifier: str
    title: str
    description: str
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    states: tuple[ContinuousState, ...]
    dependencies: Mapping[str, tuple[str, ...]]
    source: Path
    data: Mapping[str, int | float | Array]
    memory: int
    step: float


@dataclass(frozen=True)
class _Row:
    """A variable as the description lists it, with the reference of the state it derives."""

    reference: int
    variable: Variable
    causality: str
    initial: str = ""
    derivative_of: int | None = None


def _rows(model: UnitModel, version: str) -> list[_Row]:
    """Variables with their references, which are those of ``unit.h``."""
    n_u, n_x = len(model.inputs), len(model.states)
    outputs = 1 + 2 * n_u
    states = outputs + len(model.outputs)
    rows = [_Row(0, Variable("time", "s", "Time"), "independent")]
    rows += [_Row(1 + i, variable, "input") for i, variable in enumerate(model.inputs)]
    if version == "3":
        # FMI 2 has a function for input derivatives, FMI 3 has none.
        rows += [
            _Row(
                1 + n_u + i,
                Variable(
                    f"{variable.name}_rate",
                    f"{variable.unit}/s",
                    f"Rate of {variable.name} over the next communication step",
                ),
                "input",
            )
            for i, variable in enumerate(model.inputs)
        ]
    rows += [
        _Row(outputs + i, variable, "output", "calculated")
        for i, variable in enumerate(model.outputs)
    ]
    names = [state.variable.name for state in model.states]
    derives = {state.derivative.name: states + i for i, state in enumerate(model.states)}
    rows += [
        _Row(states + i, state.variable, "local", "calculated", derives.get(names[i]))
        for i, state in enumerate(model.states)
    ]
    rows += [
        _Row(states + n_x + i, state.derivative, "local", "calculated", states + i)
        for i, state in enumerate(model.states)
        if state.derivative.name not in names
    ]
    return rows


def model_description(
    model: UnitModel, version: str, token: str, notes: Mapping[str, str]
) -> bytes:
    """``modelDescription.xml`` of a unit; `notes` names what it was made with."""
    rows = _rows(model, version)
    made = "; ".join(f"{name} {value}" for name, value in notes.items())
    about = {
        "modelName": model.title,
        "description": f"{model.description} ({made})",
        "version": "1",
        "generationTool": "carrierflex",
        "variableNamingConvention": "structured",
    }
    abilities = {
        "modelIdentifier": model.identifier,
        "canHandleVariableCommunicationStepSize": "true",
        "maxOutputDerivativeOrder": "1",
        "canGetAndSetFMUstate" if version == "2" else "canGetAndSetFMUState": "true",
        "canSerializeFMUstate" if version == "2" else "canSerializeFMUState": "true",
    }
    if version == "2":
        root = Element("fmiModelDescription", about, fmiVersion="2.0", guid=token)
        unit = _tag(
            root, "CoSimulation", abilities, canInterpolateInputs="true",
            providesDirectionalDerivative="true", canNotUseMemoryManagementFunctions="true",
        )  # fmt: skip
        files = _tag(unit, "SourceFiles")
        for name in _c_files(model, version):
            _tag(files, "File", name=name)
    else:
        root = Element("fmiModelDescription", about, fmiVersion="3.0", instantiationToken=token)
        _tag(
            root, "CoSimulation", abilities,
            providesDirectionalDerivatives="true", providesAdjointDerivatives="true",
        )  # fmt: skip
    units = _tag(root, "UnitDefinitions")
    for name in sorted({row.variable.unit for row in rows}):
        entry = _tag(units, "Unit", name=name)
        # The standard has no roots of base units.
        if not name.startswith(MODAL_UNIT):
            powers = zip(("kg", "m", "s", "rad"), _BASE_UNITS[name], strict=True)
            _tag(entry, "BaseUnit", {key: str(power) for key, power in powers if power})
    _tag(_tag(root, "LogCategories"), "Category", name="logStatusError")
    _tag(root, "DefaultExperiment", startTime="0", stepSize=repr(model.step))
    add = _add_variables_2 if version == "2" else _add_variables_3
    add(root, rows, model)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)


def _add_variables_2(root: Element, rows: list[_Row], model: UnitModel) -> None:
    """Variables and structure of FMI 2, which counts variables by their place from 1."""
    index_of = {row.reference: str(i) for i, row in enumerate(rows, start=1)}
    variables, structure = _tag(root, "ModelVariables"), _tag(root, "ModelStructure")
    for row in rows:
        entry = _tag(variables, "ScalarVariable", _attributes(row))
        real = _tag(entry, "Real", _type_attributes(row))
        if row.derivative_of is not None:
            real.set("derivative", index_of[row.derivative_of])
    unknowns = {kind: list(entries) for kind, entries in _unknowns(rows, model)}
    for kind, name in (("Output", "Outputs"), ("ContinuousStateDerivative", "Derivatives"),
                       ("InitialUnknown", "InitialUnknowns")):  # fmt: skip
        # The schema wants no empty list.
        below = _tag(structure, name) if unknowns[kind] else structure
        for reference, dependencies in unknowns[kind]:
            entry = _tag(below, "Unknown", index=index_of[reference])
            if dependencies is not None:
                entry.set("dependencies", " ".join(index_of[r] for r in dependencies))


def _add_variables_3(root: Element, rows: list[_Row], model: UnitModel) -> None:
    """Variables and structure of FMI 3, which names variables by their reference."""
    variables, structure = _tag(root, "ModelVariables"), _tag(root, "ModelStructure")
    for row in rows:
        entry = _tag(variables, "Float64", _attributes(row) | _type_attributes(row))
        if row.derivative_of is not None:
            entry.set("derivative", str(row.derivative_of))
    for kind, entries in _unknowns(rows, model):
        for reference, dependencies in entries:
            entry = _tag(structure, kind, valueReference=str(reference))
            if dependencies is not None:
                entry.set("dependencies", " ".join(map(str, dependencies)))


def _attributes(row: _Row) -> dict[str, str]:
    attributes = {
        "name": row.variable.name,
        "valueReference": str(row.reference),
        "description": row.variable.description,
        "causality": row.causality,
        "variability": "continuous",
    }
    return attributes | ({"initial": row.initial} if row.initial else {})


def _type_attributes(row: _Row) -> dict[str, str]:
    return {"unit": row.variable.unit} | (
        {"start": f"{row.variable.start:.17g}"} if row.causality == "input" else {}
    )


def _unknowns(
    rows: list[_Row], model: UnitModel
) -> Iterator[tuple[str, list[tuple[int, list[int] | None]]]]:
    """Outputs, derivatives and initial unknowns: reference and references they depend on.

    None: on all.
    """
    reference = {row.variable.name: row.reference for row in rows}
    yield (
        "Output",
        [
            (reference[name], [reference[other] for other in others])
            for name, others in model.dependencies.items()
        ],
    )
    derivatives = sorted(
        (row.derivative_of, row.reference) for row in rows if row.derivative_of is not None
    )
    yield "ContinuousStateDerivative", [(reference, None) for _, reference in derivatives]
    yield "InitialUnknown", [(row.reference, None) for row in rows if row.initial]


def _c_files(model: UnitModel, version: str) -> tuple[str, ...]:
    return (f"fmi{version}.c", "unit.c", model.source.name)


def c_headers(model: UnitModel, token: str = "") -> dict[str, str]:
    """``model.h`` with sizes and token, ``model_data.h`` with the model's constants."""
    sizes = {
        "N_U": len(model.inputs),
        "N_X": len(model.states),
        "N_Y": len(model.outputs),
        "N_MEMORY": model.memory,
    }
    lines = [f'#define TOKEN "{token}"']
    lines += [f"#define {name} {value}" for name, value in sizes.items()]
    start = np.array([variable.start for variable in model.inputs])
    lines.append(f"#define START_VALUES {_braced(start)}")
    data = [_declared(name, value) for name, value in model.data.items()]
    return {"model.h": "\n".join(lines) + "\n", "model_data.h": "\n".join(data) + "\n"}


def _declared(name: str, value: int | float | Array) -> str:
    """A constant in C; 17 digits give back every double."""
    if isinstance(value, int):
        return f"enum {{ {name} = {value} }};"
    if isinstance(value, float):
        return f"#define {name} {value!r}"
    kind = "int" if np.issubdtype(value.dtype, np.integer) else "double"
    # C has no arrays of nothing.
    shape = "".join(f"[{max(n, 1)}]" for n in value.shape)
    return f"static const {kind} {name}{shape} = {_braced(value)};"


def _braced(values: Array) -> str:
    if values.size == 0:
        return "{0}"
    if values.ndim > 1:
        return "{\n    " + ",\n    ".join(map(_braced, values)) + "}"
    return "{" + ", ".join(f"{value:.17g}" for value in values) + "}"


def _build_description(model: UnitModel) -> bytes:
    """``buildDescription.xml``, which FMI 3 has beside the sources."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    build = _tag(root, "BuildConfiguration", modelIdentifier=model.identifier)
    files = _tag(build, "SourceFileSet", language="C99")
    for name in _c_files(model, "3"):
        _tag(files, "SourceFile", name=name)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)


def write_fmu(
    model: UnitModel, path: Path, *, version: str, compiler: str | None, notes: Mapping[str, str]
) -> None:
    """Write the unit; without a compiler as C sources only, for the importing tool to compile.

    Parameters
    ----------
    model : UnitModel
        The model.
    path : Path
        File to write, suffix ``.fmu``.
    version : {"2", "3"}
        Of the standard.
    compiler : str or None
        C compiler; see :func:`c_compiler`.
    notes : mapping
        What the unit was made with.

    Raises
    ------
    ValueError
        Where the suffix is another one, or the version.
    RuntimeError
        Where the compiler fails, with its first line.
    """
    if path.suffix != ".fmu":
        raise ValueError(f"{path}: expected a file name that ends in .fmu")
    if version not in VERSIONS:
        raise ValueError(f"FMI version is {version!r}; expected one of {', '.join(VERSIONS)}")
    sources = [_HERE / name for name in (*_SHARED, f"fmi{version}.c")] + [model.source]
    text = "".join(c_headers(model).values())
    text += "".join(source.read_text(encoding="utf-8") for source in sources)
    # The same model gives the same identity, another one another.
    token = "{" + str(uuid.UUID(hashlib.sha256(text.encode()).hexdigest()[:32])) + "}"
    with whole_file(path) as temporary, scratch_folder(path) as folder:
        for source in sources:
            shutil.copyfile(source, folder / source.name)
        for name, header in c_headers(model, token).items():
            (folder / name).write_text(header, encoding="ascii")
        if version == "3":
            (folder / "buildDescription.xml").write_bytes(_build_description(model))
        stored = sorted(folder.iterdir())
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            description = model_description(model, version, token, notes)
            archive.writestr("modelDescription.xml", description)
            for file in stored:
                archive.write(file, f"sources/{file.name}")
            if compiler is not None:
                library = _compiled(folder, compiler, model, version)
                archive.write(library, f"binaries/{_platform(version)}/{library.name}")


def c_compiler() -> str | None:
    """C compiler of the system; None where there is none or the standard has no such platform."""
    return (shutil.which("cc") or shutil.which("gcc")) if _platform("2") else None


def _platform(version: str) -> str:
    """The standard's name of this platform; empty for others than Linux and macOS of 64 bits."""
    if sys.maxsize < 2**32:
        return ""
    if version == "2":
        return {"linux": "linux64", "darwin": "darwin64"}.get(sys.platform, "")
    machine = {"arm64": "aarch64", "AMD64": "x86_64"}.get(platform.machine(), platform.machine())
    return f"{machine}-{sys.platform}"


def _compiled(folder: Path, compiler: str, model: UnitModel, version: str) -> Path:
    suffix = ".dylib" if sys.platform == "darwin" else ".so"
    library = folder / f"{model.identifier}{suffix}"
    options = ["-O2", "-std=c99", "-shared", "-fPIC", "-fvisibility=hidden"]
    files = [str(folder / name) for name in _c_files(model, version)]
    done = subprocess.run(
        [compiler, *options, "-o", str(library), *files, "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise RuntimeError(f"{compiler} failed: {(done.stderr.splitlines() or ['no message'])[0]}")
    return library

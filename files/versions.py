"""What made a result: the versions of this project and of the packages that can change it."""

import importlib.metadata
import json
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated

#: Packages whose version can change a result.
_RECORDED_PACKAGES = ("carrierflex", "numpy", "scipy", "scikit-fem", "gmsh", "pygmsh")

#: Packages of the extras, and what needs them.
OPTIONAL_PACKAGES = {
    "mkl": "faster factorisation",
    "k3d": "view --html",
    "nicegui": "app",
    "nptdms": "TDMS files of loggers",
    "pyuff": "UFF files",
    "asammdf": "MDF files",
    "python-calamine": "Excel workbooks",
    "openfast-io": "OpenFAST's binary output",
    "ansys-mapdl-reader": "Ansys .full files",
    "exudyn": "tests of exported bodies",
    "control": "to_control of state spaces",
    "distributed": "--scheduler",
}

#: What a JSON document says of both, with the words of its schema.
Versions = Annotated[Mapping[str, str], "Versions of Python and of packages that change a result"]
Software = Annotated[str, "Name and version of this software"]


def software_name() -> str:
    """Name and version of this software: ``carrierflex 0.1.0``."""
    try:
        return f"carrierflex {version('carrierflex')}"
    except PackageNotFoundError:
        return "carrierflex (not installed)"


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that can change a result."""
    return {"python": platform.python_version()} | {
        name: importlib.metadata.version(name) for name in _RECORDED_PACKAGES
    }


def installed() -> str:
    """Versions, one a line: carrierflex, Python, packages of results, optional packages."""
    required = (f"{name} {number}" for name, number in versions().items() if name != "carrierflex")
    optional = []
    for name, purpose in OPTIONAL_PACKAGES.items():
        try:
            optional.append(f"{name} {version(name)} ({purpose})")
        except PackageNotFoundError:
            optional.append(f"{name} not installed ({purpose})")
    return "\n".join([software_name(), *required, *optional])


def provenance(**inputs: object) -> dict[str, str]:
    """Inputs and versions as text, for files that record what made them.

    Dataclasses are spelled out.
    """
    # Late: it needs numpy, for which `carrierflex --version` should not wait.
    from carrierflex.files.json_files import plain

    return {name: json.dumps(plain(value)) for name, value in inputs.items()} | versions()

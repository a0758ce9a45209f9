"""What is installed, what works here, and what this machine offers.

Each library that a damaged installation can bring down is tried in a process of its own.
"""

import importlib.metadata
import os
import platform
import re
import resource
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from carrierflex.files.child_process import in_child
from carrierflex.files.versions import OPTIONAL_PACKAGES, software_name

if TYPE_CHECKING:
    from carrierflex.geometry.tet_mesh import TetMesh

State = Literal["ok", "fail", "optional"]

#: Memory [bytes] with which the default job runs, and disk [bytes] that it writes.
_MEMORY_OF_RUN = 2_000_000_000
_DISK_OF_RUN = 500_000_000
_REQUIREMENT = re.compile(r"([\w.-]+)>=([\d.]+)$")


@dataclass(frozen=True)
class Item:
    """One thing that is required ("ok", "fail") or may be there ("optional")."""

    name: str
    state: State
    value: str


@dataclass(frozen=True)
class Installation:
    """All items; met where nothing that is required is missing."""

    items: tuple[Item, ...]

    @property
    def met(self) -> bool:
        """Whether everything that is required works."""
        return all(item.state != "fail" for item in self.items)


def main() -> Installation:
    """Check the installation and this machine; the exit code is 1 where a requirement fails.

    Returns
    -------
    Installation
        Python and packages with their versions, trials of mesh, equations and pictures, optional
        packages, threads, memory and disk.
    """
    return Installation((*_packages(), *_trials(), *_optional(), *_machine()))


def _packages() -> Iterator[Item]:
    number = platform.python_version()
    yield Item("Python", "ok", f"{number} ({platform.system()}, {platform.machine()})")
    try:
        required = importlib.metadata.requires("carrierflex") or []
    except importlib.metadata.PackageNotFoundError:
        yield Item("carrierflex", "fail", "not installed; expected `make` or `pip install .`")
        return
    yield Item("carrierflex", "ok", software_name())
    for requirement in required:
        matched = _REQUIREMENT.match(requirement)
        if matched:
            yield _package(*matched.groups())


def _package(name: str, least: str) -> Item:
    try:
        number = importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return Item(name, "fail", f"not installed; expected {least} or newer")
    is_new = _numbers(number) >= _numbers(least)
    return Item(
        name,
        "ok" if is_new else "fail",
        number if is_new else f"{number}; expected {least} or newer",
    )


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version)[:3])


def _trials() -> Iterator[Item]:
    trials: dict[str, tuple[Callable[[], str], str]] = {
        "mesh of a pin": (_mesh, "gmsh"),
        "sparse equations": (_equations, "the solver"),
        "picture without a screen": (_picture, "VTK"),
    }
    for name, (trial, what) in trials.items():
        try:
            yield Item(name, "ok", in_child(trial, about=Path(name), what=what))
        except Exception as error:
            yield Item(name, "fail", " ".join(str(error).split()))


def _pin() -> "TetMesh":
    from carrierflex.geometry.carrier_mesh import pin_mesh
    from carrierflex.geometry.parameters import CarrierParameters, PinParameters

    return pin_mesh(CarrierParameters(), PinParameters(), 0.06)


def _mesh() -> str:
    return f"{len(_pin().points)} nodes"


def _equations() -> str:
    import numpy as np
    import scipy.sparse as sp

    from carrierflex.fe.factorisation import factorise

    n = 50
    A = sp.csr_array(2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    factor, b = factorise(A), np.ones(n)
    error = abs(A @ factor.solve(b) - b).max()
    if error > 1e-9:
        raise ValueError(f"a solution is wrong by {error:.1e}; expected rounding errors")
    return f"{type(factor).__name__.strip('_')} solves"


def _picture() -> str:
    from carrierflex.geometry.view import mesh_picture

    picture = mesh_picture(_pin(), "pin")
    if picture.std() == 0.0:
        raise ValueError("the picture is empty; expected a mesh")
    return f"{picture.shape[1]} x {picture.shape[0]} pixels"


def _optional() -> Iterator[Item]:
    for name, purpose in OPTIONAL_PACKAGES.items():
        try:
            number = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            number = "not installed"
        yield Item(name, "optional", f"{number} ({purpose})")
    compiler = shutil.which("cc") or shutil.which("gcc")
    yield Item("C compiler", "optional", f"{compiler or 'not installed'} (fmu: binary of the unit)")


def _machine() -> Iterator[Item]:
    n_cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    limit = os.environ.get("OMP_NUM_THREADS", "not limited")
    yield Item("cores", "ok", f"{n_cores}; OMP_NUM_THREADS: {limit}; --threads N limits them")
    free = _free_memory()
    soft = resource.getrlimit(resource.RLIMIT_AS)[0]
    allowed = "" if soft == resource.RLIM_INFINITY else f"; `ulimit -v` allows {soft / 1e9:.1f} GB"
    if free is not None:
        yield _enough("free memory", free, _MEMORY_OF_RUN, allowed)
    yield _enough("free disk here", shutil.disk_usage(Path.cwd()).free, _DISK_OF_RUN, "")


def _enough(name: str, free: int, needed: int, note: str) -> Item:
    value = f"{free / 1e9:.1f} GB (carrierflex run takes {needed / 1e9:g} GB){note}"
    return Item(name, "ok" if free >= needed else "fail", value)


def _free_memory() -> int | None:
    """Memory that programs can still have [bytes]; None where the system does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    available = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    return 1024 * int(available[0]) if available else None

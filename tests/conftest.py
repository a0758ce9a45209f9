"""Meshes, matrices and reductions that many tests look at, made once a session, never changed.

With CI=true in the environment a test that skips fails, save those with the marker `may_skip`.
"""

import gc
import importlib
import logging
import os
import signal
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from carrierflex.fe.carrier_curves import carrier_deflection, flexible_cases, stiff_cases
from carrierflex.fe.structural_model import (
    PIN_PILOTS,
    flexible_carrier_pilots,
    stiff_carrier_pilots,
    structural_model,
)
from carrierflex.geometry.carrier_mesh import (
    flexible_carrier_mesh,
    flexible_half_sector,
    pin_mesh,
    stiff_carrier_mesh,
    stiff_half_sector,
)
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.workflows import command_line
from carrierflex.workflows.cached_results import FOLDER_VARIABLE

ROOT = Path(__file__).parents[1]
#: Coarse [m]: identities of the method hold on any mesh, and the curves' orders are within a few
#: per cent already.
SIZE = 0.06

COMPILES_STAGE = "test_response.py"
EVERY_CHECK_RUNS = os.environ.get("CI") == "true"


@pytest.hookimpl(trylast=True)
def pytest_configure(config):
    """Let an interruption interrupt: a process in the background, and its children, ignore it.

    Compile what is compiled at import before there are several processes to do it at once.
    Processes that tests start import the packages of this checkout, as the tests do
    (``pythonpath`` in pyproject.toml), also in the environment of another one.
    """
    path = (str(ROOT), os.environ.get("PYTHONPATH"))
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, path))
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if config.getoption("numprocesses", None):
        importlib.import_module("carrierflex.simulation.element.kernels")


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect without the garbage collector, and keep it from what was collected.

    Modules and tests stay to the end. It would walk them again and again: a third of the time of
    collection, and most of a second whenever a test makes it look at everything. Tests that import
    pyyeti set how numpy and pandas print in the whole process: it is as before afterwards.
    """
    gc.disable()
    try:
        with np.printoptions():
            return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(config, items):
    """Where processes share the files out, those with slow tests go first.

    So all end at about the same time.

    Before them the file that compiles the stage: the others then find the compiled code and none
    compiles it a second time.
    """
    if hasattr(config, "workerinput"):
        slow = {item.path for item in items if item.get_closest_marker("slow")}
        items.sort(key=lambda item: (item.path.name != COMPILES_STAGE, item.path not in slow))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if EVERY_CHECK_RUNS and item.get_closest_marker("may_skip") is None:
        fail_skipped(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    report = yield
    if EVERY_CHECK_RUNS:
        fail_skipped(report)
    return report


def fail_skipped(report):
    """Turn the report of a test or a file that was skipped into a failure that tells the reason."""
    if report.skipped and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        report.outcome = "failed"
        report.longrepr = f"{report.nodeid}: {reason}; with CI=true every check has to run"


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory):
    """A cache of the test run's own.

    No result of another run is taken, none is left with the user.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(tmp_path_factory.mktemp("cache")))
        yield


class Ended(NamedTuple):
    """How a command ended, with the names of subprocess.CompletedProcess."""

    returncode: int
    stdout: str
    stderr: str


@contextmanager
def own_log_handlers():
    """Handlers of a command end with it, as with its process: its log file is no later one's."""
    loggers = [logging.getLogger(), logging.getLogger("carrierflex")]
    before = [(set(logger.handlers), logger.level) for logger in loggers]
    try:
        yield
    finally:
        for logger, (handlers, level) in zip(loggers, before, strict=True):
            logger.setLevel(level)
            for handler in set(logger.handlers) - handlers:
                logger.removeHandler(handler)
                handler.close()


@pytest.fixture
def command(monkeypatch, capfd, tmp_path):
    """Function that runs the command in the test's folder, in this process.

    Another one would import for seconds.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["carrierflex", *map(str, arguments)])
        capfd.readouterr()
        try:
            with own_log_handlers():
                command_line.main()
            code = 0
        except SystemExit as end:
            code = end.code
        return Ended(code, *capfd.readouterr())

    return run


@pytest.fixture(scope="session")
def carrier():
    return CarrierParameters()


@pytest.fixture(scope="session")
def pin():
    return PinParameters()


@pytest.fixture(scope="session")
def gear():
    return GearData()


@pytest.fixture(scope="session")
def flexible_mesh(carrier):
    return flexible_carrier_mesh(carrier, SIZE)


@pytest.fixture(scope="session")
def stiff_mesh(carrier, pin):
    return stiff_carrier_mesh(carrier, pin, SIZE)


@pytest.fixture(scope="session")
def one_pin_mesh(carrier, pin):
    return pin_mesh(carrier, pin, SIZE)


@pytest.fixture(scope="session")
def flexible_half(carrier):
    return flexible_half_sector(carrier, SIZE)


@pytest.fixture(scope="session")
def stiff_half(carrier, pin):
    return stiff_half_sector(carrier, pin, SIZE)


@pytest.fixture(scope="session")
def flexible_structure(flexible_mesh, carrier):
    return structural_model("flexible_carrier", flexible_mesh, carrier, flexible_carrier_pilots(3))


@pytest.fixture(scope="session")
def stiff_structure(stiff_mesh, carrier):
    return structural_model("stiff_carrier", stiff_mesh, carrier, stiff_carrier_pilots(3))


@pytest.fixture(scope="session")
def pin_structure(one_pin_mesh, carrier):
    return structural_model("pin", one_pin_mesh, carrier, PIN_PILOTS)


@pytest.fixture(scope="session")
def flexible_deflection(flexible_structure, flexible_mesh, carrier, gear):
    face = np.unique(flexible_mesh.surface("shaft_face"))
    return carrier_deflection(flexible_structure, face, flexible_cases(carrier, gear))


@pytest.fixture(scope="session")
def stiff_deflection(stiff_structure, stiff_mesh, gear):
    return carrier_deflection(
        stiff_structure, np.unique(stiff_mesh.surface("shaft_face")), stiff_cases(gear, 3)
    )


@pytest.fixture(scope="session")
def flexible_reduction(flexible_structure):
    # Eleven modes, not ten or twelve: no pair of equal frequencies is cut in two.
    return craig_bampton(flexible_structure, 11, provenance={"mesh size": f"{SIZE} m"})


@pytest.fixture(scope="session")
def pin_reduction(pin_structure):
    return craig_bampton(pin_structure, 4)

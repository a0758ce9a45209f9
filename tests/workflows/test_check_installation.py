"""`carrierflex doctor`: what is required and missing fails, what is optional does not."""

import importlib.metadata

import pytest

from carrierflex.workflows import check_installation
from carrierflex.workflows.check_installation import Item, main


def state_of(installation, name):
    return next(item.state for item in installation.items if item.name == name)


@pytest.fixture
def without_trials(monkeypatch):
    monkeypatch.setattr(check_installation, "_trials", lambda: iter(()))


@pytest.mark.long
def test_this_installation_works():
    installation = main()
    failing = [item for item in installation.items if item.state == "fail"]
    assert not [item for item in failing if not item.name.startswith("free ")]
    for name in ("mesh of a pin", "sparse equations", "picture without a screen"):
        assert state_of(installation, name) == "ok"


@pytest.mark.usefixtures("without_trials")
@pytest.mark.parametrize(
    ("name", "installed", "state"),
    [
        ("scipy", None, "fail"),
        ("scipy", "1.2.0", "fail"),
        ("scipy", "1.100.0", "ok"),
        ("mkl", None, "optional"),
    ],
)
def test_a_package_that_is_missing_or_old_fails_where_it_is_required(
    monkeypatch, name, installed, state
):
    there = importlib.metadata.version

    def version(asked):
        if asked != name:
            return there(asked)
        if installed is None:
            raise importlib.metadata.PackageNotFoundError(name)
        return installed

    monkeypatch.setattr("importlib.metadata.version", version)
    installation = main()
    assert state_of(installation, name) == state
    assert installation.met is all(item.state != "fail" for item in installation.items)
    if state == "fail":
        assert not installation.met


@pytest.mark.long
def test_a_library_that_ends_its_process_is_told(monkeypatch):
    monkeypatch.setattr(check_installation, "_mesh", abort)
    items = {item.name: item for item in check_installation._trials()}
    assert items["mesh of a pin"].state == "fail"
    assert "gmsh ended by SIGABRT" in items["mesh of a pin"].value
    assert items["sparse equations"].state == "ok"


def abort():
    import os

    os.abort()


@pytest.mark.usefixtures("without_trials")
def test_the_exit_code_is_1_where_something_required_fails(monkeypatch, command):
    assert command("doctor").returncode == 0
    broken = Item("picture without a screen", "fail", "VTK ended by SIGSEGV")
    monkeypatch.setattr(check_installation, "_trials", lambda: iter((broken,)))
    ended = command("doctor")
    assert ended.returncode == 1
    assert "VTK ended by SIGSEGV" in ended.stdout

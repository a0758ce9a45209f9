"""An installed copy: one import name, its data files, and the command from any folder."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CHAIN = ("files", "geometry", "fe", "reduction", "simulation", "identification", "diagnosis")
FOLDERS = ("carrierflex", *CHAIN, "blind_check", "workflows")
FILES = ("pyproject.toml", "README.md", "LICENSE")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, built from a copy so that nothing is left in the checkout."""
    source = tmp_path_factory.mktemp("source")
    for folder in FOLDERS:
        shutil.copytree(
            ROOT / folder,
            source / folder,
            symlinks=True,
            ignore=shutil.ignore_patterns("__pycache__"),
        )
    for file in FILES:
        shutil.copy(ROOT / file, source / file)
    options = ("--no-deps", "--no-build-isolation", "--no-cache-dir", "-q", "-w", "dist", ".")
    command = [sys.executable, "-m", "pip", "wheel", *options]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    (path,) = (source / "dist").glob("carrierflex-*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Folder that holds the unpacked wheel and nothing else of the project."""
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def test_the_wheel_holds_one_package_and_no_generic_name(installed):
    names = {path.name for path in installed.iterdir() if not path.name.endswith(".dist-info")}
    assert names == {"carrierflex"}
    packages = {path.name for path in (installed / "carrierflex").iterdir() if path.is_dir()}
    assert packages == {*CHAIN, "blind_check", "workflows"}


def test_every_source_and_data_file_is_in_the_wheel(installed):
    suffixes = {".py", ".typed", ".toml", ".json", ".csv", ".j2", ".c"}
    for folder in FOLDERS:
        inside = installed / "carrierflex" / (folder if folder != "carrierflex" else "")
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in suffixes and "__pycache__" not in path.parts:
                assert (inside / path.relative_to(ROOT / folder)).is_file(), path


@pytest.mark.long
def test_the_installed_command_runs_from_another_folder(installed, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(installed)}

    def python(*arguments):
        command = [sys.executable, *arguments]
        result = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert result.returncode == 0, result.stderr
        return result.stdout

    where = python("-c", "import carrierflex.fe as fe; print(fe.__file__)")
    assert Path(where.strip()).is_relative_to(installed)
    assert python("-m", "carrierflex", "--version").startswith("carrierflex ")
    case = installed / "carrierflex" / "simulation" / "cases" / "mounting_2011.toml"
    assert case.is_file()
    python("-m", "carrierflex", "mesh", "--variant", "flexible", "--size", "0.06", "--out", "a.msh")
    assert (tmp_path / "a.msh").stat().st_size > 0

"""Binary files with one wrong byte end in one line, whatever they do to the library that reads."""

import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from carrierflex.files import hdf5_trial
from carrierflex.identification.logs import log_files
from carrierflex.identification.logs.log_files import read_log
from carrierflex.reduction.body_files import BodyFileError, read_body


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr(hdf5_trial, "_SECONDS", 1)
    monkeypatch.setattr(log_files, "_SECONDS", 1)


def endless(path):
    """HDF5 whose heap of texts states an entry of no size: the library never gets past it."""
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(4.0)
        file["x"].attrs["unit"] = "mm"
    content = bytearray(path.read_bytes())
    content[content.index(b"GCOL") + 24] = 0
    path.write_bytes(content)
    return path


@pytest.mark.long
def test_an_endless_body_is_told_in_one_line(tmp_path):
    path = endless(tmp_path / "a.h5")
    with pytest.raises(BodyFileError, match=r"a\.h5: HDF5 did not come to an end with it"):
        read_body(path)


def test_an_endless_log_is_told_in_one_line(tmp_path):
    path = endless(tmp_path / "a.h5")
    with pytest.raises(ValueError, match=r"a\.h5: the reader did not come to an end with it"):
        read_log(path)


def test_reading_an_endless_file_is_interrupted_by_ctrl_c(tmp_path):
    path = endless(tmp_path / "a.h5")
    program = (
        "import sys; from pathlib import Path; from carrierflex.files import hdf5_trial; "
        "hdf5_trial._SECONDS = 600; print('reading', flush=True); "
        "hdf5_trial.try_hdf5(Path(sys.argv[1]))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == "reading\n"
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT
    assert "KeyboardInterrupt" in stderr


def test_a_file_is_tried_once(tmp_path, monkeypatch):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.arange(4.0)
    tried = []
    monkeypatch.setattr(hdf5_trial, "in_child", lambda *_, about, what: tried.append(about))
    hdf5_trial.try_hdf5(tmp_path / "a.h5")
    hdf5_trial.try_hdf5(tmp_path / "a.h5")
    assert len(tried) == 1
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["y"] = np.arange(4.0)
    hdf5_trial.try_hdf5(tmp_path / "a.h5")
    assert len(tried) == 2


@pytest.mark.parametrize("length", [5, 20, 126, 200])
def test_mat_files_that_are_cut_are_refused(tmp_path, monkeypatch, length):
    monkeypatch.setattr(
        log_files, "in_child", lambda function, *given, about, what: function(*given)
    )
    savemat(tmp_path / "whole.mat", {"t": np.arange(50.0)})
    (table,) = read_log(tmp_path / "whole.mat")
    assert table.columns["t"].tolist() == list(range(50))
    (tmp_path / "cut.mat").write_bytes((tmp_path / "whole.mat").read_bytes()[:length])
    with pytest.raises(ValueError, match=r"cut\.mat: .*expected"):
        read_log(tmp_path / "cut.mat")


def misnamed(path):
    with h5py.File(path, "w") as file:
        file["abcdefgh"] = np.arange(4.0)
    path.write_bytes(path.read_bytes().replace(b"abcdefgh", b"abc\xc8efgh"))


def of_unknown_numbers(path):
    with h5py.File(path, "w") as file:
        space = h5py.h5s.create_simple((4,))
        h5py.h5d.create(file.id, b"x", h5py.h5t.UNIX_D32LE, space)


@pytest.mark.parametrize("damage", [misnamed, of_unknown_numbers])
def test_names_and_numbers_of_another_kind_are_no_traceback(damage, tmp_path, monkeypatch):
    monkeypatch.setattr(log_files, "in_child", lambda read, *given, about, what: read(*given))
    damage(tmp_path / "a.h5")
    with pytest.raises(ValueError, match=r"a\.h5: not an HDF5 file: "):
        read_log(tmp_path / "a.h5")

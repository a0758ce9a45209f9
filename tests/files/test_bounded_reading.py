"""No file makes its reader wait, grow or crash: refused before anything is taken for it."""

import os
import resource
import signal
import subprocess
import sys
import tempfile
import time

import pytest

from carrierflex.files.child_process import in_child, limited
from carrierflex.files.json_files import read_json
from carrierflex.files.plain_files import check_plain_file
from carrierflex.files.shown_values import literal, printable
from carrierflex.files.toml_files import TomlKind, toml_document

KIND = TomlKind("a campaign", most_bytes=1_000_000)


def device(path):
    path.symlink_to("/dev/zero")


def holes(path):
    path.touch()
    os.truncate(path, 50_000)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (os.mkfifo, "a device or a pipe"),
        (device, "a device or a pipe"),
        (os.mkdir, "a folder"),
        (holes, "has a gap without stored data"),
        (lambda path: path.symlink_to(path), "symbolic links"),
        (lambda path: path.write_bytes(bytes(100_001)), "100001 bytes; expected a list of at most"),
    ],
)
def test_only_files_are_read(tmp_path, make, reason):
    make(tmp_path / "a")
    with pytest.raises(ValueError, match=rf"/a: .*{reason}") as caught:
        read_json(tmp_path / "a", "a list", most_bytes=100_000)
    assert "\n" not in str(caught.value)


def test_sizes_are_looked_at_without_reading(tmp_path):
    (tmp_path / "a").touch()
    os.truncate(tmp_path / "a", 10**12)
    with pytest.raises(ValueError, match="1000000000000 bytes; expected a thing of at most 9"):
        check_plain_file(tmp_path / "a", "a thing", 9)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (".".join(["a"] * 100_000) + " = 1", "key of more than 20 parts in line 1"),
        ("x = 1\n[" + " . ".join(['"a b"'] * 50) + "]", "key of more than 20 parts in line 2"),
        ("a = {" + ".".join(["b"] * 50) + " = 1}", "key of more than 20 parts"),
        ("a = " + "[" * 5000 + "]" * 5000, "nested too deep"),
        ("[rig]\nn_planets = 1" + "0" * 30, r"key 'rig\.n_planets' is 1000.* of 64 bits"),
        ("a = " + "9" * 5000, "not a TOML file"),
        ("[[channels]]\nnoise_std = 1e300", r"'channels\.noise_std' is 1e\+300; .* 1e\+30 at most"),
        ("mass = 1e-300", "'mass' is 1e-300; expected 0, or 1e-30 at least"),
    ],
)
def test_costly_toml_is_refused_at_once(tmp_path, text, reason):
    (tmp_path / "a.toml").write_text(text)
    begin = time.process_time()
    with pytest.raises(ValueError, match=rf"a\.toml: .*{reason}"):
        toml_document(tmp_path / "a.toml", KIND)
    # A key of 100 000 parts takes a minute where it is not refused.
    assert time.process_time() - begin < 20.0


def test_ordinary_toml_passes(tmp_path):
    text = '"a.b.c" = [1.0, 2.5, 3.75]\nsentence = "one. two. three. four"\nx.y.z = 1\n'
    (tmp_path / "a.toml").write_text(text)
    assert toml_document(tmp_path / "a.toml", KIND)["x"] == {"y": {"z": 1}}


def test_names_are_shown_as_they_are():
    assert printable("a\x1b[2Jb\nc\udcff") == r"a\x1b[2Jb c\udcff"
    assert len(printable("x" * 10_000)) < 2100
    assert literal("$x$") == r"\$x\$"


def leave_file():
    number, _ = tempfile.mkstemp()
    os.close(number)


def crash(path):
    leave_file()
    os.kill(os.getpid(), signal.SIGSEGV)


def refuse(path):
    leave_file()
    print("a library that prints")
    raise ValueError(f"{path}: not this one")


def run_on(path):
    leave_file()
    with limited(1, 10**9):
        while True:
            pass


def swell(path):
    leave_file()
    with limited(60, 50_000_000):
        return bytearray(2_000_000_000)


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (crash, "x.step: reader ended by SIGSEGV while reading it; the file may be damaged"),
        (refuse, "x.step: not this one"),
        (run_on, "x.step: reader did not come to an end with it; the file may be damaged"),
        (swell, "x.step: reader needs more memory than a sound file of this size"),
    ],
)
def test_a_reader_that_dies_is_one_line_and_leaves_no_file(tmp_path, monkeypatch, function, reason):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    path = tmp_path / "x.step"
    with pytest.raises(ValueError, match=r"x\.step: ") as caught:
        in_child(function, path, about=path, what="reader")
    assert reason in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    # Limits are those of the other process.
    assert resource.getrlimit(resource.RLIMIT_CPU)[0] == resource.RLIM_INFINITY


def test_a_call_in_a_child_gives_what_it_gives_here(tmp_path):
    assert in_child(os.path.basename, tmp_path / "a", about=tmp_path, what="os") == "a"


def test_a_reader_without_room_for_temporary_files_reads(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    assert in_child(os.path.basename, tmp_path / "a", about=tmp_path, what="os") == "a"


def test_temporary_files_of_a_killed_process_are_removed_by_the_next(tmp_path, monkeypatch):
    program = (
        "import os, signal\n"
        "from carrierflex.files.child_process import temporary_folder\n"
        "with temporary_folder():\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", program], env={**os.environ, "TMPDIR": str(tmp_path)})
    assert len(list(tmp_path.iterdir())) == 1
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    in_child(os.path.basename, tmp_path / "a", about=tmp_path, what="os")
    assert list(tmp_path.iterdir()) == []

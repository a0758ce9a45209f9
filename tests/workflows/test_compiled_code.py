"""Damaged compiled code is compiled again, and the user is told."""

import os
import subprocess
import sys

import pytest

from carrierflex.workflows.compiled_code import with_sound_cache

#: A kernel kept in a cache of its own, called as a command would.
PROGRAM = """
import sys
from carrierflex.workflows.compiled_code import with_sound_cache
sys.path.insert(0, sys.argv[1])
def call():
    import kernel
    return kernel.doubled(21.0)
print(with_sound_cache(call))
"""
KERNEL = """
from numba import njit
@njit(cache=True)
def doubled(x):
    return 2.0 * x
"""


def run(folder):
    return subprocess.run(
        [sys.executable, "-P", "-c", PROGRAM, str(folder)],
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )


@pytest.mark.long
def test_a_damaged_index_is_compiled_again(tmp_path):
    (tmp_path / "kernel.py").write_text(KERNEL)
    assert run(tmp_path).stdout == "42.0\n"
    (index,) = tmp_path.rglob("*.nbi")
    index.write_bytes(b"garbage")
    again = run(tmp_path)
    assert again.stdout == "42.0\n"
    assert "compiled code is damaged; removed" in again.stderr
    assert run(tmp_path).stderr == ""


def test_other_errors_pass(tmp_path):
    calls = []

    def fails():
        calls.append(1)
        raise EOFError("another")

    try:
        with_sound_cache(fails)
    except EOFError:
        pass
    assert calls == [1]

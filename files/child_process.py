"""Calls in a process of their own, for libraries that a damaged file can bring down.

A new Python is started and answers once. Unlike processes of `multiprocessing` it does not import
the caller's script again, so that it also serves scripts without a guarded main part.
"""

import os
import pickle
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from carrierflex.files.temporary_names import remove_abandoned, unfinished_name

T = TypeVar("T")

#: What the new process runs: the same packages, the call from its standard input.
_PROGRAM = (
    "import sys; sys.path[:] = {path!r}; "
    "from carrierflex.files import child_process; child_process._answer()"
)
#: What a folder of temporary files is to become, in the terms of `temporary_names`: nothing.
_TEMPORARY = "reader"
_is_child = False


def in_child(function: Callable[..., T], *arguments: Any, about: Path, what: str) -> T:
    """Result of a call in a process of its own.

    Parameters
    ----------
    function : callable
        Function of a module; its arguments, result and errors are copied.
    *arguments
        Its arguments.
    about : Path
        File that it reads, for the message.
    what : str
        Who reads it, for the message: ``OpenCASCADE``.

    Raises
    ------
    ValueError
        Where the process ends without an answer; one line that names the file.
    Exception
        What the function raises.
    """
    program = _PROGRAM.format(path=sys.path)
    with temporary_folder() as folder:
        # Threads of algebra are not needed to read a file and take memory each.
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={
                **os.environ,
                "OPENBLAS_NUM_THREADS": "1",
                "MKL_NUM_THREADS": "1",
                "TMPDIR": folder,
            },
        )
        try:
            answer, _ = process.communicate(pickle.dumps((function, arguments)))
        finally:
            process.kill()
            process.wait()
    return answered(answer, process.returncode, about, what)


@contextmanager
def temporary_folder() -> Iterator[str]:
    """Folder for the temporary files of a process that may be killed, removed behind the block.

    Libraries leave files there where they are killed or meet damage: asammdf a copy of its file.

    Yields
    ------
    str
        The folder, below that of this process; TMPDIR as it is where none can be made.
    """
    try:
        parent = Path(tempfile.gettempdir())
        folder = parent / unfinished_name(_TEMPORARY)
        folder.mkdir(mode=0o700)
    except OSError:
        # The library says what it cannot write, if it writes anything.
        yield os.environ.get("TMPDIR", "")
        return
    # Of a process that was itself killed.
    remove_abandoned(parent, _TEMPORARY)
    try:
        yield str(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def answered(answer: bytes, code: int, about: Path, what: str) -> Any:
    """Result in the answer of a process that ended by `code`; errors as of :func:`in_child`."""
    if not answer:
        raise ValueError(f"{about}: {_death(code, what)}; the file may be damaged")
    succeeded, result = pickle.loads(answer)  # of this program's own process
    if isinstance(result, MemoryError):
        raise ValueError(
            f"{about}: {what} needs more memory than a sound file of this size; the file may be "
            "damaged"
        )
    if not succeeded:
        raise result
    return result


@contextmanager
def limited(seconds: int, more_bytes: int) -> Iterator[None]:
    """Limits to what this process may take while the block runs, where it is one of `in_child`.

    Parameters
    ----------
    seconds : int
        Processor time [s].
    more_bytes : int
        Memory beyond what it has now [bytes].
    """
    if not _is_child:
        yield
        return
    used = resource.getrusage(resource.RUSAGE_SELF)
    cpu, data = (resource.getrlimit(kind) for kind in (resource.RLIMIT_CPU, resource.RLIMIT_DATA))
    taken = int(used.ru_utime + used.ru_stime) + 1
    _lower(resource.RLIMIT_CPU, taken + seconds, cpu[1])
    _lower(resource.RLIMIT_DATA, _data_bytes() + more_bytes, data[1])
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_CPU, cpu)
        resource.setrlimit(resource.RLIMIT_DATA, data)


def _lower(kind: int, soft: int, hard: int) -> None:
    allowed = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
    resource.setrlimit(kind, (allowed, hard))


def _data_bytes() -> int:
    """Memory that this process has taken for data [bytes]; 0 where the system does not tell."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith("VmData")), 0)


def _death(code: int, what: str) -> str:
    if code == -signal.SIGXCPU:
        return f"{what} did not come to an end with it"
    name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    return f"{what} ended by {name} while reading it"


def _answer() -> None:
    """Serve one call: what the new process does."""
    global _is_child
    _is_child = True
    answer = os.fdopen(os.dup(1), "wb")
    # What libraries print is no part of the answer.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    function, arguments = pickle.load(sys.stdin.buffer)
    try:
        content = pickle.dumps((True, function(*arguments)))
    except Exception as error:
        content = _copied(error)
    with answer:
        answer.write(content)
    os._exit(0)


def _copied(error: Exception) -> bytes:
    """An error as it can be sent; as a ValueError where its class does not let itself be copied."""
    try:
        content = pickle.dumps((False, error))
        if str(pickle.loads(content)[1]) == str(error):
            return content
    except (pickle.PicklingError, AttributeError, TypeError):
        return pickle.dumps((False, ValueError(str(error))))
    return pickle.dumps((False, ValueError(str(error))))

"""Readers in forks of the tests' process: a start of Python for each would take longer."""

import os
import pickle
import signal
import tempfile

from carrierflex.files import child_process


def read_in_forks(monkeypatch, *modules):
    """Let modules start forks for their readers, in place of new processes."""
    for module in modules:
        monkeypatch.setattr(module, "in_child", forked)


def forked(function, *arguments, about, what):
    """As `in_child` in a fork of this process: a crash or a loop ends the fork alone."""
    with child_process.temporary_folder() as folder:
        return _forked(folder, function, arguments, about, what)


def _forked(folder, function, arguments, about, what):
    answer, into = os.pipe()
    if (number := os.fork()) == 0:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        child_process._is_child = True
        tempfile.tempdir = folder
        try:
            content = pickle.dumps((True, function(*arguments)))
        except Exception as error:
            content = child_process._copied(error)
        with os.fdopen(into, "wb") as file:
            file.write(content)
        os._exit(0)
    os.close(into)
    with os.fdopen(answer, "rb") as file:
        content = file.read()
    code = os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])
    return child_process.answered(content, code, about, what)

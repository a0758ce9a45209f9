"""Work of a campaign whose process may be lost; light, as every process of a test imports it."""

import os
import signal

from carrierflex.files.json_files import save_json


def write_or_die(task):
    """Finish; "kills" never does, "once" does at the second try, "raises" refuses."""
    task.out.mkdir(parents=True, exist_ok=True)
    save_json(task.out / "batch.json", {"state": "begun", "run": task.run, "error": None})
    mark = task.out / "tried"
    if task.name == "kills" or (task.name == "once" and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if task.name == "raises":
        raise OSError("no space left")
    save_json(task.out / "batch.json", {"state": "finished", "error": None})

"""Files and folders are whole at every moment; what a kill leaves is finished or removed."""

import errno
import os
import subprocess
import sys
import time

import pytest

from carrierflex.files import temporary_names, whole_folders
from carrierflex.files.temporary_names import remove_abandoned, unfinished_name
from carrierflex.files.whole_files import whole_file
from carrierflex.files.whole_folders import check_writable, taken_up, whole_folder

#: Writes a folder in place of another and is killed after the first renaming of the two.
KILLED = """
import os, signal, sys
from pathlib import Path
from carrierflex.files import temporary_names, whole_folders
from carrierflex.files.whole_folders import whole_folder
folder = Path(sys.argv[1])
if sys.argv[2] == "no exchange":
    whole_folders._exchanged = lambda one, other: False
replace, exchanged, removed = os.replace, whole_folders._exchanged, whole_folders.shutil.rmtree
def killed(call):
    def then_dies(*arguments, **options):
        result = call(*arguments, **options)
        if result is not False:
            os.kill(os.getpid(), signal.SIGKILL)
        return result
    return then_dies
os.replace, whole_folders._exchanged = killed(replace), killed(exchanged)
with whole_folder(folder) as new:
    (new / "content").write_text("new")
"""


@pytest.mark.parametrize("how", ["exchange", "no exchange"])
def test_a_kill_between_the_renames_loses_no_folder(tmp_path, how):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "content").write_text("old")
    ended = subprocess.run([sys.executable, "-P", "-c", KILLED, str(folder), how], check=False)
    assert ended.returncode == -9
    assert len(list(tmp_path.iterdir())) > 1 or not folder.exists()
    taken_up(folder)
    assert (folder / "content").read_text() == ("new" if how == "exchange" else "old")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("exchange", [True, False])
def test_a_folder_is_replaced_with_all_that_was_in_it(tmp_path, monkeypatch, exchange):
    if not exchange:
        monkeypatch.setattr(whole_folders, "_exchanged", lambda one, other: False)
    for name in ("old", "new"):
        with whole_folder(tmp_path / "out") as new:
            (new / name).touch()
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "new"]


def test_an_interruption_between_the_renames_puts_the_old_folder_back(tmp_path, monkeypatch):
    monkeypatch.setattr(whole_folders, "_exchanged", lambda one, other: False)
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "old").touch()
    replace = os.replace

    def interrupted(source, target):
        replace(source, target)
        monkeypatch.undo()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), whole_folder(folder):
        monkeypatch.setattr(whole_folders.os, "replace", interrupted)
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "old"]


def test_what_killed_processes_left_goes_and_what_others_write_stays(tmp_path):
    program = (
        "from carrierflex.files.temporary_names import unfinished_name; "
        "print(unfinished_name('a.csv'))"
    )
    dead = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True
    ).stdout.strip()
    alive = unfinished_name("a.csv")
    mark, machine, process, start, rest = alive.split("-", 4)
    # Its number, another start; that of the parent may be the same, to a hundredth of a second.
    again = "-".join((mark, machine, process, str(int(start) + 1), rest))
    foreign = dead.replace(dead.split("-")[1], "0" * 8)
    for name in (dead, alive, again, foreign, ".part-mine", "a.csv"):
        (tmp_path / name).write_text(name)
    remove_abandoned(tmp_path, "b.csv")
    assert len(list(tmp_path.iterdir())) == 6
    remove_abandoned(tmp_path, "a.csv")
    remaining = {path.name for path in tmp_path.iterdir()}
    assert remaining == {alive, foreign, ".part-mine", "a.csv"}
    yesterday = time.time() - 2 * 86_400
    os.utime(tmp_path / foreign, (yesterday, yesterday))
    remove_abandoned(tmp_path)
    assert not (tmp_path / foreign).exists()


def test_what_cannot_be_asked_for_its_start_stays(tmp_path, monkeypatch):
    """A system without a free descriptor tells no start: the process may well be at work."""
    alive = unfinished_name("a.csv")
    (tmp_path / alive).write_text("at work")
    monkeypatch.setattr(temporary_names, "_start", lambda process: 0)
    remove_abandoned(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [alive]


def test_names_stay_short_and_keep_their_suffix():
    name = unfinished_name("n" * 240 + ".parquet")
    assert len(name.encode()) < 255
    assert name.endswith(".parquet")


def test_the_next_writing_of_a_file_removes_its_litter(tmp_path):
    program = (
        "import os, sys; from pathlib import Path; "
        "from carrierflex.files.whole_files import whole_file\n"
        "with whole_file(Path(sys.argv[1])) as part: part.write_text('half'); "
        "os.kill(os.getpid(), 9)"
    )
    path = tmp_path / "a.json"
    subprocess.run([sys.executable, "-P", "-c", program, str(path)], check=False)
    assert len(list(tmp_path.iterdir())) == 1
    with whole_file(path) as temporary:
        temporary.write_text("whole")
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
        (OSError("13905 requested and 3558 written"), "13905 requested and 3558 written"),
        (RuntimeError("(file write failed: errno = 28, error message = '')"), "No space left"),
    ],
)
def test_a_full_disk_names_the_file(tmp_path, error, reason):
    path = tmp_path / "a.h5"
    path.write_text("earlier")

    def fails():
        with whole_file(path) as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(OSError, match=rf"a\.h5: cannot be written \({reason}"):
        fails()
    assert path.read_text() == "earlier"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.h5"]


def test_an_error_about_another_file_stays_as_it_is(tmp_path):
    with pytest.raises(FileNotFoundError, match="source"), whole_file(tmp_path / "a"):
        (tmp_path / "source").read_bytes()


def test_trying_to_write_touches_no_file_of_the_user(tmp_path):
    (tmp_path / ".write-test").write_text("mine")
    check_writable(tmp_path)
    assert (tmp_path / ".write-test").read_text() == "mine"
    with pytest.raises(OSError, match="cannot write into this output folder"):
        check_writable(tmp_path / ".write-test" / "out")

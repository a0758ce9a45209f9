"""Kept results: taken when nothing changed.

Computed again when anything did or an entry is damaged.
"""

import inspect
import json
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.workflows import cached_results
from carrierflex.workflows.cached_results import (
    FOLDER_VARIABLE,
    CacheStore,
    cache_folder,
    cache_key,
    cached_files,
)
from carrierflex.workflows.reduction import certified_body, reduce_body


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "cache"))
    return tmp_path


def run(folder, text="curve", *, use=True, quiet=True, **inputs):
    """Ask for result.csv; tells whether it came from the cache."""
    out = folder / "result.csv"
    out.unlink(missing_ok=True)
    from_cache = cached_files(
        {"a.csv": out}, lambda: out.write_text(text), use=use, quiet=quiet, inputs=inputs
    )
    assert out.exists()
    return from_cache, out.read_text()


def test_an_unchanged_result_is_taken_and_said_in_one_line(folder, capsys):
    assert run(folder, size=0.03) == (False, "curve")
    assert capsys.readouterr().err == ""
    assert run(folder, "not computed again", quiet=False, size=0.03) == (True, "curve")
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "result.csv taken from the cache" in said
    assert run(folder, quiet=True, size=0.03)[0]
    assert capsys.readouterr().err == ""


def test_another_input_and_no_cache_compute(folder):
    run(folder, size=0.03)
    assert run(folder, "finer", size=0.02) == (False, "finer")
    assert run(folder, "again", use=False, size=0.03) == (False, "again")
    assert run(folder, size=0.03) == (True, "curve")


def test_the_key_follows_parameters_materials_program_and_libraries(monkeypatch):
    keys = [
        cache_key(carrier=CarrierParameters(), size=0.03),
        cache_key(carrier=CarrierParameters(plate_gap=0.241), size=0.03),
    ]
    keys.append(cache_key(carrier=CarrierParameters(), size=0.03 + 1e-15))
    for name, value in (
        ("BODY_MATERIALS", {}),
        ("_numerics", lambda: "changed"),
        ("versions", dict),
    ):
        with monkeypatch.context() as changed:
            changed.setattr(cached_results, name, value)
            keys.append(cache_key(carrier=CarrierParameters(), size=0.03))
    assert len(set(keys)) == len(keys)
    assert cache_key(size=0.03, carrier=CarrierParameters()) == keys[0]


def test_every_option_that_changes_a_body_is_in_its_key(tmp_path, monkeypatch):
    recorded = {}

    def remember(files, compute, *, use, quiet, inputs):
        recorded.update(inputs)
        raise KeyboardInterrupt

    monkeypatch.setattr(certified_body, "cached_files", remember)
    with pytest.raises(KeyboardInterrupt):
        reduce_body.main(body="pin", out=tmp_path / "pin.h5")
    not_in_the_body = {"out", "preview", "cache", "quiet"}
    # The unit of a mesh is part of its file's entry.
    files = {"step", "surfaces", "mesh", "length_unit", "stiffness", "mass", "interfaces"}
    assert set(inspect.signature(reduce_body.main).parameters) - not_in_the_body - files == set(
        recorded
    ) - {
        "kind",
        "files",
    }


DAMAGES = [
    ("a.csv", lambda text: text[:-1]),
    ("a.csv", lambda text: text.replace("c", "k")),
    ("a.csv", None),
    ("entry.json", lambda text: text[: len(text) // 2]),
    ("entry.json", lambda text: text.replace('"version": 1', '"version": 2')),
    ("entry.json", lambda text: "[]"),
    ("entry.json", None),
]


@pytest.mark.parametrize(("name", "damage"), DAMAGES)
def test_a_damaged_entry_is_computed_again_and_replaced(folder, caplog, name, damage):
    run(folder, size=0.03)
    [entry] = cache_folder().iterdir()
    if damage is None:
        (entry / name).unlink()
    else:
        (entry / name).write_text(damage((entry / name).read_text()))
    assert run(folder, "fresh", size=0.03) == (False, "fresh")
    assert "removed, to be computed again" in caplog.text
    assert run(folder, size=0.03) == (True, "fresh")
    assert [path.name for path in cache_folder().iterdir()] == [entry.name]


def test_entries_name_their_inputs(folder):
    run(folder, size=0.03, carrier=CarrierParameters())
    [entry] = cache_folder().iterdir()
    header = json.loads((entry / "entry.json").read_text())
    assert header["format"] == "carrierflex-cache-entry"
    assert header["inputs"]["carrier"]["plate_gap"] == 0.24


def test_many_writers_at_once_leave_one_whole_entry(tmp_path):
    def write(number):
        source = tmp_path / f"{number}.csv"
        source.write_text("x" * 100_000)
        CacheStore(tmp_path / "cache").keep("key", {"a.csv": source}, {})
        return CacheStore(tmp_path / "cache").lookup("key", ["a.csv"])

    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(write, range(32))) == {tmp_path / "cache" / "key"}
    assert [path.name for path in (tmp_path / "cache").iterdir()] == ["key"]


def test_a_cache_that_cannot_be_written_is_told_and_the_result_stays(folder, caplog):
    (folder / "cache").write_text("a file in the way")
    assert run(folder, size=0.03) == (False, "curve")
    assert "cannot write into the cache" in caplog.text


def test_a_failed_computation_keeps_nothing(folder):
    def fail():
        raise ValueError("no mesh")

    with pytest.raises(ValueError, match="no mesh"):
        cached_files({"a.csv": folder / "a.csv"}, fail, use=True, quiet=True, inputs={})
    assert not cache_folder().exists()


def test_the_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"
    monkeypatch.delenv(FOLDER_VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "carrierflex"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder() == Path.home() / ".cache" / "carrierflex"


def test_reduced_bodies_come_back_from_the_cache_as_the_same_file(folder, capsys):
    first = reduce_body.main(body="pin", out=folder / "first.h5", modes=2, size=0.08, quiet=True)
    again = reduce_body.main(body="pin", out=folder / "again.h5", modes=2, size=0.08)
    assert "again.h5 taken from the cache" in capsys.readouterr().err
    assert (folder / "first.h5").read_bytes() == (folder / "again.h5").read_bytes()
    assert (first.K == again.K).all()
    reduce_body.main(body="pin", out=folder / "more.h5", modes=3, size=0.08)
    assert "cache" not in capsys.readouterr().err
    assert cached_results.cache_folder() == folder / "cache"


def test_a_full_cache_loses_what_was_not_used_for_the_longest_time(tmp_path):
    source = tmp_path / "source"
    source.write_bytes(bytes(1000))
    store = CacheStore(tmp_path / "cache", limit=4000)
    for age, key in enumerate(("first", "second", "third")):
        store.keep(key, {"file": source}, {})
        os.utime(tmp_path / "cache" / key, (age, age))
    assert store.lookup("first", ["file"])  # used: now the youngest
    store.keep("fourth", {"file": source}, {})
    assert sorted(path.name for path in (tmp_path / "cache").iterdir()) == [
        "first",
        "fourth",
        "third",
    ]


def test_an_entry_larger_than_the_limit_stays_until_the_next(tmp_path):
    source = tmp_path / "source"
    source.write_bytes(bytes(1000))
    store = CacheStore(tmp_path / "cache", limit=10)
    store.keep("first", {"file": source}, {})
    assert store.lookup("first", ["file"])
    store.keep("second", {"file": source}, {})
    assert [path.name for path in (tmp_path / "cache").iterdir()] == ["second"]

"""Arrays on disk read as they were written, and leave nothing behind."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from carrierflex.files import temporary_store
from carrierflex.files.temporary_store import (
    StoredRows,
    TemporaryStore,
    stored_columns,
    stored_rows,
    zero_rows,
)

VALUES = np.random.default_rng(0).standard_normal((7, 3, 5))


def test_rows_are_read_as_they_were_written():
    rows = zero_rows(VALUES.shape, 0)
    assert isinstance(rows, StoredRows)
    assert not rows[:].any()
    rows[2:5] = VALUES[2:5]
    np.testing.assert_array_equal(rows[1:6][1:4], VALUES[2:5])
    assert not rows[:2].any()
    assert rows[7:].shape == (0, 3, 5)
    assert rows.nbytes == VALUES.nbytes


def test_small_rows_stay_in_memory(monkeypatch):
    assert isinstance(zero_rows((10,), 80), np.ndarray)
    monkeypatch.setattr(TemporaryStore, "has_room", staticmethod(lambda n_bytes: False))
    assert isinstance(zero_rows((10,), 0), np.ndarray)


def test_what_is_stored_goes_to_another_process():
    copy = pickle.loads(pickle.dumps(stored_rows(VALUES)))
    np.testing.assert_array_equal(copy[:], VALUES)
    columns = stored_columns({"a": VALUES[0, 0], "b": VALUES[1, 0]}, TemporaryStore())
    copied = pickle.loads(pickle.dumps(columns))
    assert list(copied) == ["a", "b"]
    np.testing.assert_array_equal(copied["b"], VALUES[1, 0])


def test_columns_of_several_records_share_a_store():
    store = TemporaryStore()
    first = stored_columns({"a": VALUES[0, 0]}, store)
    second = stored_columns({"a": VALUES[1, 0], "b": VALUES[2, 0]}, store)
    np.testing.assert_array_equal(first["a"], VALUES[0, 0])
    np.testing.assert_array_equal(second["b"], VALUES[2, 0])
    assert stored_columns({}, store) == {}
    with pytest.raises(KeyError):
        first["b"]


def test_a_store_has_no_name(tmp_path, monkeypatch):
    monkeypatch.setattr(temporary_store.tempfile, "tempdir", str(tmp_path))
    rows = stored_rows(VALUES)
    assert list(tmp_path.iterdir()) == []
    np.testing.assert_array_equal(rows[:], VALUES)


def test_a_full_temporary_folder_is_told_by_name(monkeypatch, tmp_path):
    monkeypatch.setattr(temporary_store.tempfile, "tempdir", str(tmp_path))
    store = TemporaryStore(Path("/dev/full").open("r+b", buffering=0))
    with pytest.raises(OSError, match=f"{tmp_path}: cannot hold .*No space left.*TMPDIR"):
        store.write(0, VALUES)
    # Whether there is a folder at all is asked before.
    monkeypatch.setattr(temporary_store.tempfile, "tempdir", str(tmp_path / "none"))
    assert not TemporaryStore.has_room(1)

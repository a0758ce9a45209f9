"""Law files with one text exchanged."""

import pytest

from carrierflex.simulation.law_files import read_measured_law, write_measured_law


def check_refused(law, old, new, told, folder):
    """Write a law, put `new` for the first `old`, and expect a refusal that names the file."""
    path = folder / "law.toml"
    write_measured_law(path, law)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=told) as refused:
        read_measured_law(path)
    assert str(path) in str(refused.value)

"""Damage that files meet: lost and doubled parts, other numbers and encodings, hostile values."""

import json
import re
from collections.abc import Callable, Iterator
from typing import Any

import h5py
import numpy as np
from hypothesis import strategies as st

#: Values that stand for a number or a word.
HOSTILE = [
    "",
    "0",
    "-1",
    "1e308",
    "-1e-308",
    "1e400",
    "nan",
    "inf",
    "9" * 25,
    "9" * 5000,
    "1_0",
    "0x10",
    "true",
    "''",
    '"[/x]"',
    '"\\u001b]0;x"',
    '"../../etc/passwd"',
    "[]",
    "[[]]",
    "{}",
    "{a=1}",
    "[1, 'a']",
    "2026-01-01",
    "null",
    "[" * 3000,
    ".".join(["a"] * 2000),
    "x" * 20_000,
    "\x00",
    "ÿ",
    "=",
    "#",
    ",",
    ";",
    "\n[rig]\n",
    '"',
    "'''",
]
_TOKEN = re.compile(r"-?\d[\w.+-]*|\"[^\"\n]*\"|\w+")
_ENDS = [b"", b"\xef\xbb\xbf", b"\xff\xfe", b"\x00" * 64, b"\xf0\x9f", b"\r\r\n", b"\x1a"]

Mutation = Callable[[bytes], bytes]


def _tokens(draw: st.DrawFn, content: bytes) -> bytes:
    """Replace a number, a word or a text by something else."""
    text = content.decode("latin-1")
    result = list(_TOKEN.finditer(text))
    if not result:
        return content
    token = result[draw(st.integers(0, len(result) - 1))]
    other = draw(st.sampled_from([*HOSTILE, *(each.group() for each in result[:60])]))
    return (text[: token.start()] + other + text[token.end() :]).encode("latin-1", "replace")


def _lines(draw: st.DrawFn, content: bytes) -> bytes:
    """Lose, double or move lines."""
    lines = content.split(b"\n")
    first = draw(st.integers(0, len(lines) - 1))
    last = min(first + draw(st.integers(1, 4)), len(lines))
    block = lines[first:last]
    what = draw(st.sampled_from(["lose", "double", "move"]))
    rest = lines[:first] + lines[last:] if what != "double" else lines
    if what != "lose":
        index = draw(st.integers(0, len(rest)))
        rest = rest[:index] + block + rest[index:]
    return b"\n".join(rest)


def _bytes(draw: st.DrawFn, content: bytes) -> bytes:
    """Overwrite, insert or cut bytes."""
    if not content:
        return content
    offset = draw(st.integers(0, len(content) - 1))
    what = draw(st.sampled_from(["overwrite", "insert", "cut", "end", "begin"]))
    new = draw(st.binary(min_size=1, max_size=8))
    if what == "overwrite":
        return content[:offset] + new + content[offset + len(new) :]
    if what == "insert":
        return content[:offset] + new + content[offset:]
    if what == "cut":
        return content[:offset] + content[offset + draw(st.integers(1, 200)) :]
    mark = draw(st.sampled_from(_ENDS))
    return content[:offset] + mark if what == "end" else mark + content


@st.composite
def damaged(draw: st.DrawFn, content: bytes) -> bytes:
    """Content with one to three kinds of damage."""
    for _ in range(draw(st.integers(1, 3))):
        content = draw(st.sampled_from([_tokens, _tokens, _lines, _bytes]))(draw, content)
    return content


#: Values of a JSON document that stand for another.
_OTHERS = [
    None,
    True,
    -1,
    0,
    10**25,
    0.5,
    1e308,
    float("nan"),
    "",
    "1e-30",
    "x" * 9000,
    [],
    [0.0],
    {},
]


def _leaves(container: Any) -> Iterator[tuple[Any, Any]]:
    """Containers and keys of the values of a JSON document."""
    for key, value in container.items() if isinstance(container, dict) else enumerate(container):
        if isinstance(value, dict | list) and value:
            yield from _leaves(value)
        else:
            yield container, key


@st.composite
def damaged_values(draw: st.DrawFn, content: bytes) -> bytes:
    """JSON that is read, with one to five hostile values, or those of other places."""
    leaves = list(_leaves(document := json.loads(content)))
    indices = st.integers(0, len(leaves) - 1)
    for _ in range(draw(st.integers(1, 5))):
        (container, key), (other, other_key) = leaves[draw(indices)], leaves[draw(indices)]
        container[key] = draw(st.sampled_from([other[other_key], *_OTHERS]))
    return json.dumps(document).encode()


_VALUES = [
    np.float64(np.nan),
    np.array(-1.0),
    np.zeros((2, 2)),
    np.arange(3),
    np.zeros(0),
    b"x",
    "text",
    ["a\nb", "c"],
    np.full((22, 22), -1.0),
    np.array(1 + 2j),
]
_TYPES = ["f8", "i1", "S1000000", "S5", "bool", "f4", h5py.string_dtype()]
_SHAPES = [(), (0,), (3,), (22, 22), (20_000, 20_000), (6, 22, 22), (10**6, 10**6), (1, 1)]


@st.composite
def damaged_hdf5(draw: st.DrawFn, names: list[str]) -> Callable[[h5py.File], None]:
    """Change of one part of an HDF5 file: lost, replaced, declared and never written, renamed."""
    name = draw(st.sampled_from(names))
    what = draw(st.sampled_from(["lose", "replace", "declare", "swap", "attribute", "link"]))
    value = draw(st.sampled_from(_VALUES))
    shape, dtype = draw(st.sampled_from(_SHAPES)), draw(st.sampled_from(_TYPES))
    other = draw(st.sampled_from(names))

    def change(file: h5py.File) -> None:
        if what == "attribute":
            keys = [*sorted(file.attrs), "cut_off_hz"]
            file.attrs[keys[len(name) % len(keys)]] = value
            return
        content = file[other][()] if what == "swap" else None
        del file[name]
        if what == "replace":
            file[name] = value
        elif what == "declare":
            chunks = tuple(min(n, 64) for n in shape) if 0 not in shape and shape else None
            file.create_dataset(name, shape=shape, dtype=dtype, chunks=chunks)
        elif what == "swap":
            file[name] = content
        elif what == "link":
            file[name] = h5py.SoftLink(f"/{other}")

    return change

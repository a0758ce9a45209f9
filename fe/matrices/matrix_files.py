"""Which reader takes a file of a stiffness or a mass matrix."""

import io
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.matrices.dmig_input_files import chosen_name, read_dmig
from carrierflex.fe.matrices.op4_input_files import read_op4
from carrierflex.fe.matrices.stored_matrix import (
    MOST_DOFS,
    MOST_ENTRIES,
    DofNames,
    StoredMatrix,
    from_entries,
    names_of_keys,
    refuse_twice,
)
from carrierflex.fe.matrices.text_numbers import number_table, numbers, whole_numbers
from carrierflex.files.archives import DAMAGED_ARCHIVE
from carrierflex.files.child_process import in_child, limited
from carrierflex.files.plain_files import check_plain_file, plain_content
from carrierflex.files.shown_values import shown

#: Larger files [bytes] are refused: some hundred million entries in text.
MOST_BYTES = 20_000_000_000
#: Suffixes, and what a file of that suffix is.
SUFFIXES = {
    ".op4": "Nastran output4",
    ".pch": "Nastran DMIG punch",
    ".bdf": "Nastran DMIG bulk data",
    ".dat": "Nastran DMIG bulk data",
    ".mtx": "Abaqus matrix or MatrixMarket",
    ".mm": "MatrixMarket",
    ".sti": "CalculiX stiffness",
    ".mas": "CalculiX mass",
    ".rsa": "Harwell-Boeing",
    ".hb": "Harwell-Boeing",
    ".matrix": "Harwell-Boeing",
    ".npz": "scipy sparse matrix",
    ".full": "Ansys, needs the extra ansys",
}
_EXPECTED = "a stiffness or mass matrix"
_Reader = Callable[[Path, bytes, str], StoredMatrix]


_EXTRA = "pip install carrierflex[ansys]"


_BANNER = re.compile(rb"%%MatrixMarket\s+matrix\s+(\w+)\s+(\w+)\s+(\w+)", re.I)
#: Arrays of a sparse matrix in npz, as scipy.sparse.save_npz names them.
_SPARSE_ARRAYS = {
    "csr": ("data", "indices", "indptr"),
    "csc": ("data", "indices", "indptr"),
    "coo": ("data", "row", "col"),
}
#: All arrays may be this many times as large as the file, and this large whatever is stored
#: [bytes]. One of equal numbers packs better, but never all three.
_PACKED, _SMALL = 100, 100_000
#: What zip and numpy raise of damaged files, besides ValueError.
_DAMAGED = (*DAMAGED_ARCHIVE, TypeError, OverflowError, MemoryError)


#: ``(1P,3E26.18)``, ``(8I10)``, ``(4D20.12)``: repeat count, kind and width.
_FORMAT = re.compile(r"\(\s*(?:\d*P\s*,?)?\s*(\d*)\s*([IEDFG])\s*(\d+)(?:\.\d+(?:E\d+)?)?\s*\)")
#: Real, symmetric or general, assembled.
_KINDS = ("RSA", "RUA")
_WIDEST = 200


_KEYWORD = re.compile(rb"^[ \t]*\*(?!\*)[ \t]*([^\r\n]*)", re.MULTILINE)
_COMMENT = re.compile(rb"^[ \t]*\*\*[^\r\n]*", re.MULTILINE)
_COMPONENTS = 6


def read_matrix(path: Path, quantity: str) -> StoredMatrix:
    """Read the stiffness or mass matrix of another program.

    Parameters
    ----------
    path : Path
        File; :data:`SUFFIXES` lists what is known. A .mtx file is MatrixMarket where it begins with
        that word, else Abaqus.
    quantity : str
        ``stiffness`` or ``mass``: which one of a file that holds both.

    Returns
    -------
    StoredMatrix
        Its numbers as printed, with the names of the degrees of freedom where the file has them.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is of no known kind, damaged, or holds no such matrix; the message names it.
    """
    suffix = path.suffix.lower()
    if suffix == ".full":
        return _read_full(path, check_plain_file(path, _EXPECTED, MOST_BYTES), quantity)
    if suffix not in SUFFIXES:
        check_plain_file(path, _EXPECTED, MOST_BYTES)
        known = ", ".join(SUFFIXES)
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected one of {known}")
    content = plain_content(path, _EXPECTED, MOST_BYTES)
    return _reader(suffix, content)(path, content, quantity)


def _reader(suffix: str, content: bytes) -> _Reader:
    if suffix == ".op4":
        return read_op4
    if suffix in (".pch", ".bdf", ".dat"):
        return read_dmig
    if suffix == ".npz":
        return lambda path, content, quantity: _read_npz(path, content)
    if suffix in (".rsa", ".hb", ".matrix"):
        return lambda path, content, quantity: _read_harwell_boeing(path, content)
    if suffix == ".mm" or re.match(rb"%%MatrixMarket", content, re.I):
        return lambda path, content, quantity: _read_matrix_market(path, content)
    return _read_abaqus_matrix


def _read_full(path: Path, size: int, quantity: str) -> StoredMatrix:
    """Stiffness or mass of a .full file, with nodes and directions."""
    return in_child(_by_reader, path, size, quantity, about=path, what="ansys-mapdl-reader")


def _by_reader(path: Path, size: int, quantity: str) -> StoredMatrix:
    try:
        from ansys.mapdl import reader  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise ValueError(
            f"{path}: .full files are read by ansys-mapdl-reader, which is not installed; {_EXTRA}"
        ) from error
    try:
        with limited(60 + size // 500_000, 1_000_000_000 + 60 * size):
            dofs, K, M = reader.read_binary(str(path)).load_km(sort=False)
            chosen = sp.coo_array(K if quantity == "stiffness" else M)
            rows, columns = (np.asarray(i, dtype=np.int64) for i in chosen.coords)
            names = DofNames(
                np.asarray(dofs[:, 0], dtype=np.int64), np.asarray(dofs[:, 1], dtype=np.int64)
            )
            values = chosen.data.astype(np.float64)
            return StoredMatrix(from_entries(rows, columns, values, len(names)), names)
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(
            f"{path}: not a .full file that ansys-mapdl-reader takes ({reason})"
        ) from error


def _read_matrix_market(path: Path, content: bytes) -> StoredMatrix:
    """Real matrix of a MatrixMarket file: coordinate, symmetric or general."""
    banner = _BANNER.match(content)
    if banner is None:
        raise ValueError(f"{path}: no %%MatrixMarket banner; expected one in the first line")
    layout, field, symmetry = (word.decode("latin-1").lower() for word in banner.groups())
    if layout != "coordinate" or field not in ("real", "integer", "double"):
        raise ValueError(
            f"{path}: MatrixMarket {layout} {field}; expected a coordinate matrix of real numbers"
        )
    if symmetry not in ("symmetric", "general"):
        raise ValueError(f"{path}: MatrixMarket {shown(symmetry)}; expected symmetric or general")
    # scipy's reader is left aside: it ends the process at a NUL among the numbers.
    n, n_entries, begin = _market_sizes(path, content)
    try:
        table = number_table(content[begin:], 3, "the entries")
        if len(table) != n_entries:
            raise ValueError(f"{len(table)} entries; its line of sizes states {n_entries}")
        rows, columns = whole_numbers(table[:, :2], "rows and columns").T - 1
        A = from_entries(rows, columns, table[:, 2], n)
        refuse_twice(rows, columns, n)
    except ValueError as error:
        raise ValueError(f"{path}: no sound MatrixMarket file ({error})") from error
    return StoredMatrix(A)


def _market_sizes(path: Path, content: bytes) -> tuple[int, int, int]:
    """Rows and entries that the file states, checked against its length; where entries begin."""
    sizes = re.search(
        rb"^[ \t]*(\d{1,12})[ \t]+(\d{1,12})[ \t]+(\d{1,12})[ \t]*\r?$", content, re.M
    )
    if sizes is None:
        raise ValueError(f"{path}: no line of sizes; expected rows, columns and entries")
    n, m, entries = (int(word) for word in sizes.groups())
    # An entry takes "1 1 1" and a line end at least.
    if n != m or not 0 < n <= MOST_DOFS or 6 * entries > len(content) + 6:
        raise ValueError(
            f"{path}: states {n} rows, {m} columns and {entries} entries in {len(content)} bytes; "
            "expected a square matrix and a line an entry"
        )
    return n, entries, sizes.end()


def _read_npz(path: Path, content: bytes) -> StoredMatrix:
    """Matrix that scipy.sparse.save_npz wrote."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _refuse_unstored(path, archive, len(content))
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return StoredMatrix(_sparse(path, arrays))
    except _DAMAGED as error:
        raise ValueError(f"{path}: not a complete npz file ({_reason(error)})") from error
    except (ValueError, NotImplementedError, RuntimeError) as error:
        if str(error).startswith(str(path)):
            raise
        raise ValueError(
            f"{path}: not a sparse matrix of scipy.sparse.save_npz ({_reason(error)})"
        ) from error


def _refuse_unstored(path: Path, archive: zipfile.ZipFile, size: int) -> None:
    unpacked = sum(entry.file_size for entry in archive.infolist())
    if unpacked > _PACKED * size + _SMALL:
        raise ValueError(
            f"{path}: its arrays unpack to {unpacked} bytes from {size}; expected at most "
            f"{_PACKED} times the file"
        )
    for entry in archive.infolist():
        with archive.open(entry) as member:
            _refuse_other_shape(path, entry.filename, entry.file_size, member)


def _refuse_other_shape(path: Path, name: str, size: int, stream: IO[bytes]) -> None:
    """Refuse an array whose header states more than the bytes behind it."""
    version = np.lib.format.read_magic(stream)
    reader = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, _, dtype = reader(stream)
    if dtype.hasobject or int(np.prod(shape, dtype=object)) * dtype.itemsize > size:
        raise ValueError(
            f"{path}: {shown(name)} states the shape {shown(shape)} of {shown(dtype)} in {size} "
            "bytes; expected as many"
        )


def _sparse(path: Path, arrays: "np.lib.npyio.NpzFile") -> sp.csr_array:
    if "format" not in arrays:
        raise ValueError(
            f"{path}: holds {shown(', '.join(arrays.files))}, a dense array or others; expected a "
            "sparse matrix: scipy.sparse.save_npz(file, scipy.sparse.csr_array(A)) writes one"
        )
    layout = bytes(np.asarray(arrays["format"])).decode("latin-1").strip("\0")
    if layout not in _SPARSE_ARRAYS:
        raise ValueError(f"{path}: format {shown(layout)}; expected {', '.join(_SPARSE_ARRAYS)}")
    shape = np.asarray(arrays["shape"]).ravel().tolist()
    data, first, second = (np.asarray(arrays[name]) for name in _SPARSE_ARRAYS[layout])
    kinds = (data.dtype.kind, first.dtype.kind, second.dtype.kind)
    if len(shape) != 2 or kinds[0] not in "fiu" or set(kinds[1:]) - set("iu"):
        raise ValueError(f"{path}: shape {shown(shape)} and types {kinds}; expected real numbers")
    if shape[0] != shape[1] or not 0 < shape[0] <= MOST_DOFS:
        raise ValueError(
            f"{path}: {shape[0]} rows and {shape[1]} columns; expected a square matrix"
        )
    data = data.astype(np.float64, copy=False)
    if layout == "coo":
        indices = (first.astype(np.int64), second.astype(np.int64))
        return from_entries(*indices, data, int(shape[0]))
    kind = sp.csr_array if layout == "csr" else sp.csc_array
    A = kind((data, first, second), shape=(int(shape[0]), int(shape[1])))
    A.check_format(full_check=True)
    coo = A.tocoo()
    rows, columns = (index.astype(np.int64) for index in coo.coords)
    return from_entries(rows, columns, coo.data, int(shape[0]))


def _reason(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


@dataclass(frozen=True)
class _Header:
    kind: str
    n_rows: int
    n_columns: int
    n_entries: int
    lines: tuple[int, int, int]
    fields: tuple[tuple[int, int], tuple[int, int], tuple[int, int]]


def _read_harwell_boeing(path: Path, content: bytes) -> StoredMatrix:
    """Matrix of a Harwell-Boeing file of type RSA, or RUA with both triangles."""
    lines = content.split(b"\n", 5)
    if len(lines) < 5:
        raise ValueError(f"{path}: {len(lines)} lines; expected a Harwell-Boeing header of four")
    header = _header(path, [line.decode("latin-1") for line in lines[:4]])
    has_right_side = _count(lines[1].decode("latin-1")[56:70]) > 0
    body = content.split(b"\n", 5 if has_right_side else 4)[-1]
    starts_at, rows_at, values_at = np.cumsum([0, *header.lines])[:3]
    text_lines = body.split(b"\n")
    n = header.n_columns
    counts = (n + 1, header.n_entries, header.n_entries)
    names = ("column starts", "row numbers", "values")
    read = []
    for first, n_lines, (per_line, width), count, name in zip(
        (starts_at, rows_at, values_at), header.lines, header.fields, counts, names, strict=True
    ):
        text = b"\n".join(text_lines[first : first + n_lines])
        read.append(_numbers(text, width, per_line, count, f"{path}: the {name}"))
    starts, rows = (
        whole_numbers(array, f"{path}: the {name}") - 1
        for array, name in zip(read[:2], names[:2], strict=True)
    )
    if starts[0] != 0 or starts[-1] != header.n_entries or (np.diff(starts) < 0).any():
        raise ValueError(
            f"{path}: column starts go from {starts[0] + 1} to {starts[-1] + 1}; expected "
            f"ascending ones from 1 to {header.n_entries + 1}"
        )
    columns = np.repeat(np.arange(n), np.diff(starts))
    try:
        return StoredMatrix(from_entries(rows, columns, read[2], n))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _numbers(text: bytes, width: int, per_line: int, count: int, what: str) -> NDArray[np.float64]:
    """Numbers in columns of fixed width, or between blanks where the header's width is not kept."""
    try:
        values = numbers(_fixed_fields(text, width, per_line, count, what), what)
    except ValueError:
        values = np.zeros(0)
    if len(values) != count:
        values = numbers(text, what)
    if len(values) != count:
        raise ValueError(f"{what} are {len(values)}; the header states {count}: cut short")
    return values


def _header(path: Path, lines: list[str]) -> _Header:
    words = lines[2].split()
    kind = words[0].upper() if words else ""
    if kind not in _KINDS:
        raise ValueError(
            f"{path}: Harwell-Boeing type {shown(kind)}; expected RSA (real, symmetric, assembled)"
        )
    sizes = [_count(lines[2][start : start + 14]) for start in (14, 28, 42)]
    n_lines = tuple(_count(lines[1][start : start + 14]) for start in (14, 28, 42))
    if min(*sizes, *n_lines) < 1 or sizes[0] != sizes[1]:
        raise ValueError(
            f"{path}: the header states {sizes[0]} rows, {sizes[1]} columns, {sizes[2]} entries on "
            f"{n_lines[0]}, {n_lines[1]} and {n_lines[2]} lines; expected a square matrix of whole "
            "numbers in columns of 14"
        )
    if sizes[0] > MOST_DOFS or sizes[2] > MOST_ENTRIES:
        raise ValueError(f"{path}: states {sizes[0]} rows and {sizes[2]} entries; too many")
    fields = []
    for text in (lines[3][:16], lines[3][16:32], lines[3][32:52]):
        match = _FORMAT.fullmatch(text.strip().upper())
        if match is None:
            raise ValueError(
                f"{path}: the header's format is {shown(text.strip())}; expected one as (10I8) or "
                "(3E26.18)"
            )
        per_line, width = int(match[1] or 1), int(match[3])
        if not (0 < per_line <= _WIDEST and 0 < width <= _WIDEST):
            raise ValueError(f"{path}: the header's format {shown(text.strip())} has no such line")
        fields.append((per_line, width))
    return _Header(
        kind,
        *(sizes[0], sizes[1], sizes[2]),
        (n_lines[0], n_lines[1], n_lines[2]),
        (fields[0], fields[1], fields[2]),
    )


def _count(text: str) -> int:
    """Whole number of a field of the header; 0 where it is none."""
    word = text.strip()
    return int(word) if word.isascii() and word.isdigit() and len(word) <= 14 else 0


def _fixed_fields(text: bytes, width: int, per_line: int, count: int, what: str) -> bytes:
    """The fields of lines of fixed width, one blank between them."""
    n_lines = -(-count // per_line)
    lines = text.split(b"\n")[:n_lines]
    if len(lines) < n_lines:
        raise ValueError(f"{what} end after {len(lines)} of {n_lines} lines: cut short")
    length = width * per_line
    block = b"".join(line.rstrip(b"\r")[:length].ljust(length) for line in lines)
    fields = np.frombuffer(block, dtype=np.uint8).reshape(-1, width)[:count]
    spaced = np.full((count, width + 1), ord(" "), dtype=np.uint8)
    spaced[:, :width] = fields
    return spaced.tobytes()


class _Block(NamedTuple):
    """Data lines below one keyword."""

    keyword: str
    data: bytes

    @property
    def options(self) -> str:
        """What follows the keyword, without blanks."""
        return self.keyword.partition(",")[2].replace(" ", "")


def _read_abaqus_matrix(path: Path, content: bytes, quantity: str) -> StoredMatrix:
    """Matrix of a .mtx file in any of the three layouts."""
    try:
        plain, *blocks = _blocks(content)
        if any(block.keyword.startswith("USER ELEMENT") for block in blocks):
            return _element_matrix(content, blocks, quantity)
        listed = [b for b in (plain, *blocks) if b is plain or "MATRIX" in b.keyword]
        chosen = _chosen([b for b in listed if b.data.strip() or "INPUT=" in b.options], quantity)
        _refuse_options(chosen)
        return _listed_entries(chosen.data)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _blocks(content: bytes) -> list[_Block]:
    """What stands before the first keyword, then the data lines of every keyword."""
    text = _COMMENT.sub(b"", content)
    marks = list(_KEYWORD.finditer(text))
    ends = [*(mark.start() for mark in marks), len(text)]
    blocks = [_Block("", text[: ends[0]])]
    for mark, end in zip(marks, ends[1:], strict=True):
        keyword = re.sub(r"\s+", " ", mark[1].decode("latin-1")).strip().upper()
        blocks.append(_Block(keyword, text[mark.end() : end]))
    return blocks


def _chosen(blocks: list[_Block], quantity: str) -> _Block:
    """The one block with entries; of several, that whose NAME says the quantity."""
    if len(blocks) < 2:
        return blocks[0] if blocks else _Block("", b"")
    names = []
    for block in blocks:
        name = re.search(r"\bNAME ?= ?([^,]+)", block.keyword)
        names.append(name[1] if name else f"*{block.keyword}")
    return blocks[names.index(chosen_name(names, quantity))]


def _refuse_options(block: _Block) -> None:
    """Refuse what makes another matrix of the entries that are listed."""
    odd = re.search(r"\b(INPUT|SCALEFACTOR)=[^,]+", block.options)
    if odd is not None and odd[0] not in ("SCALEFACTOR=1", "SCALEFACTOR=1.", "SCALEFACTOR=1.0"):
        what = {
            "INPUT": "give that file itself",
            "SCALEFACTOR": "multiply them",
        }[odd[1]]
        raise ValueError(
            f"*{block.keyword}: {odd[0]} is not followed; expected the entries as they are "
            f"meant: {what}"
        )


def _listed_entries(data: bytes) -> StoredMatrix:
    first = next((line for line in data.split(b"\n") if line.strip()), b"")
    n_columns = len(first.replace(b",", b" ").split())
    if n_columns not in (3, 5):
        raise ValueError(
            f"the first data line is {shown(first.decode('latin-1')[:60])}; expected row, column, "
            "value, or node, direction, node, direction, value, or *USER ELEMENT"
        )
    table = number_table(data, n_columns, "the entries")
    if n_columns == 3:
        index = whole_numbers(table[:, :2], "rows and columns") - 1
        n = int(index.max(initial=-1)) + 1
        A = from_entries(index[:, 0], index[:, 1], table[:, 2], n)
        refuse_twice(index[:, 0], index[:, 1], n)
        return StoredMatrix(A, states_order=False)
    # Nodes of negative number are internal degrees of freedom: Lagrange multipliers, tied contact.
    if (table[:, [0, 2]] < 1.0).any():
        odd = float(table[:, [0, 2]].min())
        raise ValueError(f"node {odd:g} is an internal variable; expected nodes of the model only")
    index = whole_numbers(table[:, :4], "nodes and directions")
    _refuse_other_directions(index[:, [1, 3]])
    keys = np.stack([_keys(index[:, 0], index[:, 1]), _keys(index[:, 2], index[:, 3])])
    unique_keys, inverse = np.unique(keys, return_inverse=True)
    rows, columns = inverse.reshape(2, -1)
    names = names_of_keys(unique_keys)
    refuse_twice(rows, columns, len(names), names)
    return StoredMatrix(from_entries(rows, columns, table[:, 4], len(names)), names)


def _keys(nodes: NDArray[np.int64], directions: NDArray[np.int64]) -> NDArray[np.int64]:
    return DofNames(nodes, directions - 1).keys


def _element_matrix(content: bytes, blocks: list[_Block], quantity: str) -> StoredMatrix:
    names = _element_dofs(content, blocks)
    wanted = f"TYPE={quantity.upper()}"
    parsed = [
        block.data
        for block in blocks
        if block.keyword.startswith("MATRIX") and wanted in block.keyword.replace(" ", "")
    ]
    if len(parsed) != 1:
        raise ValueError(f"{len(parsed)} blocks *MATRIX, {wanted}; expected one")
    values = numbers(parsed[0], f"the {quantity} matrix")
    n = len(names)
    rows, columns = np.tril_indices(n)
    if len(values) != len(rows):
        raise ValueError(
            f"the {quantity} matrix holds {len(values)} numbers; expected {len(rows)}, the lower "
            f"triangle of {n} degrees of freedom"
        )
    return StoredMatrix(from_entries(rows, columns, values, n), names)


def _element_dofs(content: bytes, blocks: list[_Block]) -> DofNames:
    """Nodes from the comment ``** ELEMENT NODES``, directions from the lines of *USER ELEMENT."""
    comment = re.search(
        rb"\*\*[ \t]*ELEMENT NODES[^\r\n]*\r?\n((?:[ \t]*\*\*[^\r\n]*\r?\n)+)", content, re.I
    )
    if comment is None:
        raise ValueError("no comment ** ELEMENT NODES; expected the nodes of the element there")
    nodes = whole_numbers(numbers(comment[1].replace(b"*", b" "), "the element's nodes"), "nodes")
    block = next(block for block in blocks if block.keyword.startswith("USER ELEMENT"))
    lines = [line for line in block.data.split(b"\n") if line.strip()]
    # Positions at which a list of directions begins to hold; the first line has none.
    directions: dict[int, list[int]] = {}
    for number, line in enumerate(lines):
        entries = whole_numbers(numbers(line, "the directions"), "directions").tolist()
        if not entries:
            raise ValueError(
                "a line below *USER ELEMENT has no number; expected a position and its directions"
            )
        position, listed = (1, entries) if number == 0 else (entries[0], entries[1:])
        directions[position] = listed
    if not directions or max(directions) > len(nodes) or min(directions) < 1:
        raise ValueError(
            f"directions of {len(directions)} positions for {len(nodes)} nodes; expected lists of "
            "directions below *USER ELEMENT"
        )
    dof_nodes: list[int] = []
    dof_directions: list[int] = []
    listed = []
    for position, node in enumerate(nodes.tolist(), start=1):
        listed = directions.get(position, listed)
        dof_nodes += [node] * len(listed)
        dof_directions += listed
    chosen = np.array(dof_directions, dtype=np.int64)
    _refuse_other_directions(chosen)
    names = DofNames(np.array(dof_nodes, dtype=np.int64), chosen - 1)
    if len(np.unique(names.keys)) != len(names):
        raise ValueError("a direction of a node occurs twice; expected every one once")
    return names


def _refuse_other_directions(directions: NDArray[np.int64]) -> None:
    if directions.size and not (1 <= directions.min() and directions.max() <= _COMPONENTS):
        odd = int(directions[(directions < 1) | (directions > _COMPONENTS)].flat[0])
        raise ValueError(f"direction {odd}; expected 1 to 6, displacements and rotations only")

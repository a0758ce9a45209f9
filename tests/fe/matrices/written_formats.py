"""Matrices in the text forms of programs that are not at hand, number by number."""

import numpy as np
import scipy.sparse as sp


def abaqus_input(path, K, n_components):
    """Lower triangle as node, direction, node, direction, value."""
    lower = sp.coo_array(sp.tril(K))
    lines = [
        f"{i // n_components + 1},{i % n_components + 1}, {j // n_components + 1},"
        f"{j % n_components + 1}, {value:.17e}"
        for i, j, value in zip(*lower.coords, lower.data, strict=True)
    ]
    path.write_text("** assembled\n" + "\n".join(lines) + "\n")


def abaqus_coordinates(path, K):
    """Both triangles as row, column, value."""
    entries = sp.coo_array(K)
    rows = zip(*entries.coords, entries.data, strict=True)
    path.write_text("".join(f"{i + 1:8d} {j + 1:8d} {value: .17e}\n" for i, j, value in rows))


def harwell_boeing(path, K, digits, width=None):
    """Lower triangle in fixed columns (RSA); gives the matrix of the printed numbers."""
    lower = sp.csc_array(sp.tril(K))
    lower.sort_indices()
    width = width or digits + 8
    words = [f"{value:{width}.{digits - 1}E}" for value in lower.data]
    assert all(len(word) == width for word in words)
    blocks = [
        _lines([f"{i + 1:10d}" for i in lower.indptr], 8),
        _lines([f"{i + 1:10d}" for i in lower.indices], 8),
        _lines(words, 3),
    ]
    counts = [len(block) for block in blocks]
    n = K.shape[0]
    header = [
        f"{'stiffness':72s}KEY     ",
        "".join(f"{count:14d}" for count in (sum(counts), *counts, 0)),
        f"{'RSA':14s}{n:14d}{n:14d}{lower.nnz:14d}{0:14d}",
        f"{'(8I10)':16s}{'(8I10)':16s}{f'(1P,3E{width}.{digits - 1})':20s}{'':20s}",
    ]
    path.write_text("\n".join([*header, *(line for block in blocks for line in block)]) + "\n")
    lower.data = np.array([float(word) for word in words])
    return sp.csr_array(lower + sp.tril(lower, -1).T)


def _lines(words, per_line):
    return ["".join(words[i : i + per_line]) for i in range(0, len(words), per_line)]

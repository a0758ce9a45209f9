"""Standard input data with the numbers and in the layout of a public sample.

From EMBSlib/Resources/Data/cartopPragV32.SID_FEM of vwaurich/EMBS_ModelicaLib (commit 76b56fcc): a
plate of 1 m x 1.3 m held by its four corners, whose modes are the three that its tools kept; the
corners and one node of the surface.
"""

import numpy as np

MASS = 9.0824
FIRST_MOMENT = np.array([4.5442607688, 5.9075380912, 0.0])
#: xx yy zz xy xz yz.
J = np.array([5.10031, 3.01849, 8.103, -2.95574, 0.0, 0.0])
#: Rows as of J, columns the modes.
J1 = np.zeros((6, 3))
J1[4] = -1.42715277734, 7.9631797843e-1, 0.0
J1[5] = -1.85529861136, 0.0, -1.044551261
CT = np.zeros((3, 3))
CT[0, 2] = 2.86504294718
CR = np.array([
    [1.86227791549, -1.43252147282, 0.0],
    [0.0, 7.92827686133e-1, 0.0],
    [1.05739230034, 0.0, 0.0],
])  # fmt: skip
KE = np.diag([5.09132204329e1, 2.58144317827e2, 3.37082285396e2])
KE[0, 1], KE[1, 0] = 2.02088088255e-7, 2.02092648331e-7
KE[1, 2], KE[2, 1] = -4.14704672487e-7, -4.14708632918e-7
DE = np.array([2.85414002272e-1, 6.42674807755e-1, 7.34392031978e-1])
#: Oe m1(i, i, xx), (i, i, yy), (i, i, zz): 0.7 % from what the mass Me says.
OE1 = (
    (-9.92968648349e-1, -9.92968648349e-1, -1.93431685582e-4),
    (-9.91560795669e-1, -9.91560795669e-1, -3.80460006398e-4),
    (-9.84049163511e-1, -9.84049163511e-1, -4.27242785205e-4),
)
_AT_REST = np.zeros((3, 3))
#: Number, place, translations and rotations by mode.
NODES = (
    (1, (0.0, 0.0, 0.0), _AT_REST,
     np.array([[1.04021859657, 1.92374657101, -7.17350935557e-1],
               [-4.98586866521e-1, -1.85756559538e-1, 2.22998287017], [0.0, 0.0, 0.0]])),
    (2, (1.0, 0.0, 0.0), _AT_REST,
     np.array([[1.04021859109, -1.92374656672, -7.17350954279e-1],
               [4.98586865787e-1, -1.85756533908e-1, -2.22998286907], [0.0, 0.0, 0.0]])),
    (12, (1.0, 1.3, 0.0), _AT_REST,
     np.array([[-1.04021859456, 1.92374657352, -7.17350940499e-1],
               [4.98586864547e-1, -1.85756554775e-1, 2.22998286129], [0.0, 0.0, 0.0]])),
    (26, (0.0, 1.3, 0.0), _AT_REST,
     np.array([[-1.04021859655, -1.9237465634, -7.17350957341e-1],
               [-4.98586864381e-1, -1.85756535592e-1, -2.22998286442], [0.0, 0.0, 0.0]])),
    (78, (0.3, 3.71428571429e-1, 0.0),
     np.array([[0.0] * 3, [0.0] * 3, [3.68796223522e-1, 2.60437413784e-1, -3.19844936368e-1]]),
     np.array([[4.84457359548e-1, 4.65754091339e-1, 9.46005048948e-1],
               [-1.01022196181e-1, 1.25736422214, 4.50703911507e-1], [0.0, 0.0, 0.0]])),
)  # fmt: skip
#: Frequencies that the file's header prints [Hz].
FREQUENCIES_HZ = (1.135, 2.557, 2.922)
_ZERO, _DIAGONAL, _SYMMETRIC, _FULL, _IDENTITY = range(5)


def sample():
    """Text of the sample."""
    n = len(KE)
    lines = [
        f"    {len(NODES)}\t\t   {n}    :No. nodes, No. modes:S refmod frame new node",
        " part ",
        "      new modal                                 =",
        "           refmod ",
        _line(16, "mass", _number(MASS)),
        _line(16, "nelastq", f"   {n}"),
        *(
            _line(16, f"ielastq ({i:4d})", f"Eigen Mode {i:4d} : {f:12.3f} Hz     ")
            for i, f in enumerate(FREQUENCIES_HZ, start=1)
        ),
        "           end refmod ",
        "           frame ",
    ]
    for number, position, phi, psi in NODES:
        lines += [_line(16, "new node", f"   {number}"), _line(21, "rframe", "   body ref")]
        lines += _block(21, "origin", np.array(position)[:, None], phi[:, :, None])
        lines += _block(21, "phi", phi)
        lines += _block(21, "psi", psi)
        lines += _block(21, "AP", np.eye(3), np.zeros((3, n, 3)), _IDENTITY)
        lines.append("                end node")
    lines.append("           end frame ")
    cr1, oe1 = np.zeros((n, n, 3)), np.zeros((n, n, 6))
    oe1[range(n), range(n), :3] = OE1
    lines += _block(11, "mdCM", FIRST_MOMENT[:, None], CT.T[:, :, None])
    lines += _block(11, "J", J[:, None], J1[:, :, None])
    lines += _block(11, "Ct", CT)
    lines += _block(11, "Cr", CR, cr1)
    lines += _block(11, "Me", np.eye(n), None, _IDENTITY)
    lines += _block(11, "Gr", np.zeros((3, 3 * n)))
    lines += _block(11, "Ge", np.zeros((n, 3 * n)))
    lines += _block(11, "Oe", np.zeros((n, 6)), oe1)
    lines += _block(11, "ksigma", np.zeros((n, 1)))
    lines += _block(11, "Ke", KE, None, _SYMMETRIC)
    lines += _block(11, "De", np.diag(DE), None, _DIAGONAL)
    return "\n".join([*lines, "      end modal ", " end part ", ""])


def _block(indent, name, m0, m1=None, structure=_FULL):
    """One block: sizes and the entries that are not zero, the first order by row, mode, column."""
    if structure == _FULL and not m0.any() and (m1 is None or not m1.any()):
        structure = _ZERO
    counts = {"order": int(m1 is not None), "nrow": m0.shape[0], "ncol": m0.shape[1]}
    counts |= {"nq": len(KE), "nqn": 0, "structure": structure}
    yield f"{'':{indent}}{name}"
    yield from (_line(indent + 5, key, f"   {count:2d}") for key, count in counts.items())
    for letter, entries in (("m0", m0), ("m1", m1)):
        if entries is None or structure == _IDENTITY:
            continue
        for index in np.argwhere(entries):
            indices = ",".join(f"{i + 1:2d}" for i in index)
            yield _line(indent + 5, f"{letter}({indices})", _number(entries[tuple(index)]))
    yield f"{'':{indent}}end {name}"


def _number(value):
    return f"{value: .11E}".replace("E", "D")


def _line(indent, key, value):
    return f"{'':{indent}}{key:<{48 - indent}}={value}"

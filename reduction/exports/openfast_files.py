"""A body as superelement of OpenFAST's module ExtPtfm: one interface of six coordinates and modes.

The interface is one pilot p, the other coordinates f. With ``Ψ = -K_ff⁻¹ K_fp`` and all modes V of
the body whose interface is held,

    T = [I 0; Ψ V],  M_r = Tᵀ M T,  K_r = diag(K_pp + K_pf Ψ, ω²),  C_r = Tᵀ D T

span what the body file spans: nothing is lost. Two forms of the files are written.

``current``
    The redesigned form of OpenFAST's pull request 3210 (2026): matrices with self-weight, and the
    other pilots as connection points.
``flex5``
    FlexASCII of OpenFAST 2.4 and later, before that: matrices, and the self-weight as a load that
    lasts ("Flex 5 format"). `NActiveDOFList = 0` in it is Guyan's reduction.

References
----------
OpenFAST documentation, ExtPtfm, input files: r-test 5MW_OC4Jckt_ExtPtfm, and pull request 3210.
Branlard et al. (2020), Journal of Physics: Conference Series 1452, 012033.
"""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.exports.ordered_body import FRAME, UNITS
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import constrained_solution

Array = NDArray[np.float64]
Form = Literal["current", "flex5"]

#: Standard acceleration of gravity [m/s²], along -z; OpenFAST's default.
GRAVITY = 9.80665
#: Stiffness over that of the interface with all else held, below which it is rounding.
_FREE = 1e-9
#: OpenFAST reads lines of loads into a text of this length.
_LONGEST_LINE = 4096
#: Seconds for which the load of `flex5` lasts; OpenFAST interpolates between its two rows.
_LOAD_SECONDS = 1e5
_LOADS = ("IntrfFx", "IntrfFy", "IntrfFz", "IntrfMx", "IntrfMy", "IntrfMz")


@dataclass(frozen=True, eq=False)
class Superelement:
    """Matrices of a body at one interface.

    Parameters
    ----------
    name, pilot : str
        Of the body, and of the interface.
    M, K, C : ndarray, shape (6 + n_modes, 6 + n_modes)
        Mass, stiffness, damping; Tx Ty Tz Rx Ry Rz of the interface, then mass-normalised modes.
    W_0, K_W : ndarray, shape (6 + n_modes,) and (6 + n_modes, 6 + n_modes)
        Self-weight ``W_0 - K_W q`` in the frame that follows the interface; zero where the body is
        held to the ground, which carries its weight.
    points : ndarray, shape (m, 3)
        Places of the other pilots [m] in the body's frame.
    displacement : ndarray, shape (3 m, 6 + n_modes)
        Their translations per coordinate.
    is_free : bool
        Whether nothing holds the body: its motions without stiffness are the interface's.
    """

    name: str
    pilot: str
    M: Array
    K: Array
    C: Array
    W_0: Array
    K_W: Array
    points: Array
    displacement: Array
    is_free: bool


def superelement(model: ReducedModel, pilot: str | None = None) -> Superelement:
    """Bring a body or joined group to one interface.

    Parameters
    ----------
    model : ReducedModel
        Free, or held to the ground.
    pilot : str, optional
        The interface, a pilot of six components; the first by default.

    Raises
    ------
    KeyError, ValueError
        Where the body has no such pilot, or it has fewer components; where some of its six rigid
        motions are held and others free, or a motion has no mass.
    LinAlgError
        Where the interface, held, leaves a motion free.
    """
    name = next(iter(model.pilots)) if pilot is None else pilot
    p = model.coordinates_of(name)
    f = np.setdiff1d(np.arange(model.n_coordinates), p)
    n_free = model.n_free_motions
    if n_free not in (0, 6):
        raise ValueError(
            f"{model.name}: {n_free} of its rigid motions are free; expected all six or none: hold "
            "the others, or none of them"
        )
    K, M = (model.K + model.K.T) / 2.0, (model.M + model.M.T) / 2.0
    force = np.zeros((model.n_coordinates, 6))
    force[f] = -K[np.ix_(f, p)]
    T_p = constrained_solution(model, p, force, f"holding {name}") if f.size else force
    T_p[p] = np.eye(6)
    none = np.zeros(0), np.zeros((0, 0))
    omega_squared, V = dense_modes(K[np.ix_(f, f)], M[np.ix_(f, f)]) if f.size else none
    if len(omega_squared) < len(f):
        raise ValueError(
            f"{model.name}: {len(f) - len(omega_squared)} motions have stiffness and no mass; "
            "expected mass in every coordinate: leave the pilots' components without mass out of "
            "the interfaces and reduce again"
        )
    T = np.zeros_like(K)
    T[:, :6] = T_p
    T[f, 6:] = V
    M_r = T.T @ M @ T
    M_r[6:, 6:] = np.eye(len(f))
    K_pp = K[p] @ T_p
    if n_free == 6:
        size = np.sqrt(K.diagonal()[p])
        if (np.abs(K_pp) > _FREE * np.outer(size, size)).any():
            raise ValueError(
                f"{model.name}: its rigid motions meet a stiffness, and are free by its record; "
                "expected none: reduce again, or state free_rigid_motions in its provenance"
            )
        # What a free body has there is rounding, and OpenFAST takes it for a fault.
        K_pp = np.zeros((6, 6))
    others = [pilot for pilot in model.pilots if pilot != name]
    rows = [_translations(model, pilot) @ T for pilot in others]
    is_free = n_free == 6
    return Superelement(
        model.name,
        name,
        (M_r + M_r.T) / 2.0,
        scipy.linalg.block_diag((K_pp + K_pp.T) / 2.0, np.diag(omega_squared)),
        T.T @ ((model.D + model.D.T) / 2.0) @ T,
        *_self_weight(M_r if is_free else np.zeros_like(M_r)),
        np.array([model.pilots[pilot] for pilot in others]).reshape(-1, 3),
        np.vstack([np.zeros((0, len(T))), *rows]),
        is_free,
    )


def _translations(model: ReducedModel, pilot: str) -> Array:
    """Rows (3, n) of a pilot's translations; zero along those that it does not have."""
    result = np.zeros((3, model.n_coordinates))
    for row, component in zip(model.rows_of(pilot), model.components_of(pilot), strict=True):
        if component < 3:
            result[component, row] = 1.0
    return result


def _self_weight(M: Array) -> tuple[Array, Array]:
    """W_0 and K_W of a free body: gravity is an acceleration of the rigid motion.

    In the frame of the interface turned by (θx, θy) gravity is ``g (θy, -θx, -1)``, and the forces
    are ``M`` times it; a mode moves the weight, which turns about x and y.
    """
    W_0 = -GRAVITY * M[:, 2]
    K_W = np.zeros_like(M)
    K_W[:, 3], K_W[:, 4] = GRAVITY * M[:, 1], -GRAVITY * M[:, 0]
    K_W[3, 6:], K_W[4, 6:] = GRAVITY * M[1, 6:], -GRAVITY * M[0, 6:]
    return W_0, K_W


def openfast_files(path: Path, form: Form) -> tuple[Path, ...]:
    """Module file and what it names: ``NAME.dat``, ``NAME_SE.dat`` and ``NAME_Conn.dat``."""
    suffixes = ("_SE.dat", "_Conn.dat") if form == "current" else ("_SE.dat",)
    return (path, *(path.with_name(path.stem + suffix) for suffix in suffixes))


def write_openfast(body: Superelement, path: Path, form: Form) -> tuple[Path, ...]:
    """Write the module file of ExtPtfm and the files that it names.

    Parameters
    ----------
    body : Superelement
        The body at its interface.
    path : Path
        Module file of suffix .dat; the others stand beside it.
    form : str
        ``current`` or ``flex5``, as above.

    Returns
    -------
    tuple of Path
        The files.

    Raises
    ------
    ValueError
        Where the suffix is another, or a row of loads is longer than OpenFAST reads.
    """
    if path.suffix != ".dat":
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected .dat")
    files = openfast_files(path, form)
    contents: list[Iterator[str]] = [_flex5_module(body, files), _flex5_matrices(body)]
    if form == "current":
        contents = [_module(body, files), _matrices(body), _connections(body)]
    with ExitStack() as stack:
        targets = [stack.enter_context(whole_file(file)) for file in files]
        for target, lines in zip(targets, contents, strict=True):
            target.write_text("\n".join(lines) + "\n", encoding="ascii")
    return files


def _head(body: Superelement) -> Iterator[str]:
    yield f"! Body {body.name}, interface {body.pilot}, written by carrierflex; {UNITS}"
    yield f"! {FRAME}"
    yield "! Order: Tx Ty Tz Rx Ry Rz of the interface, then mass-normalised modes, interface held"


def _rows(matrix: Array) -> Iterator[str]:
    """Rows of 17 digits, which give back every double."""
    yield from (" ".join(f"{value: .16e}" for value in row) for row in np.atleast_2d(matrix))


def _matrices(body: Superelement) -> Iterator[str]:
    yield from _head(body)
    yield f"!Dimension: {len(body.M)}"
    for title, matrix in (
        ("Mass Matrix (Units (kg,m))", body.M),
        ("Stiffness Matrix (Units (N,m))", body.K),
        ("Damping Matrix (Units (N,m,kg))", body.C),
        (f"Weight constant (Units (N,m)), g = {GRAVITY} m/s^2", body.W_0),
        ("Weight stiffness (Units (N,m))", body.K_W),
    ):
        yield from ("", f"!{title}", *_rows(matrix))


def _connections(body: Superelement) -> Iterator[str]:
    yield from _head(body)
    yield f"!nConn: {len(body.points)}"
    yield from ("", "!Connections (m)", *_rows(body.points))
    yield from ("", "!Displacement (m)", *_rows(body.displacement))


def _flex5_matrices(body: Superelement) -> Iterator[str]:
    n = len(body.M)
    # Line 2 has to hold these words.
    yield from ("! ExtPtfm superelement", "! Flex 5 Format", *_head(body))
    yield f"!Dimension: {n}"
    yield f"!Time increment in simulation: {_LOAD_SECONDS!r}"
    yield f"!Total simulation time in file: {_LOAD_SECONDS!r}"
    for title, matrix in (
        ("Mass Matrix (Units (kg,m))", body.M),
        ("Stiffness Matrix (Units (N,m))", body.K),
        ("Damping Matrix (Units (N,m,kg))", body.C),
    ):
        yield from ("", f"!{title}", f"!Dimension: {n}", *_rows(matrix))
    yield from ("", "!Loading and Wave Elevation (Units (N,m)): self-weight, no waves")
    yield f"!Dimension: 1 time column - {n} force columns - 1 wave elevation column"
    for time in (0.0, _LOAD_SECONDS):
        row = " ".join(f"{value: .11e}" for value in (time, *body.W_0, 0.0))
        if len(row) > _LONGEST_LINE:
            raise ValueError(
                f"{body.name}: {n} coordinates make a row of loads of {len(row)} characters; "
                f"expected at most {_LONGEST_LINE}, which OpenFAST reads: reduce with fewer modes, "
                "or write --format openfast"
            )
        yield row


def _module(body: Superelement, files: tuple[Path, ...]) -> Iterator[str]:
    has_points = len(body.points) > 0
    yield from _module_head(body)
    yield _entry(
        2 if body.is_free else 0, "RBMod", "Method for handling rigid-body motion (switch)"
    )
    yield _entry(f'"{files[1].name}"', "Red_FileName", "Guyan/Craig-Bampton inputs")
    yield from _modes_and_start()
    yield _ruled("CONNECTION INPUTS")
    yield _entry(has_points, "Connections", "Flag for connection points on the structure (flag)")
    yield _entry(f'"{files[2].name}"', "Conn_FileName", "Connection points: the other pilots")
    yield _ruled("USER FORCING INPUTS")
    for flag, file in (("UserForcing", "Force_FileName"), ("ConnForcing", "FConn_FileName")):
        yield _entry(False, flag, "Flag for forces of the user (flag)")
        yield _entry('"not_used"', file, "Time series of the forces (-)")
    yield from _output()


def _flex5_module(body: Superelement, files: tuple[Path, ...]) -> Iterator[str]:
    yield from _module_head(body)
    yield _entry(1, "FileFormat", "File Format {0:Guyan; 1:FlexASCII} (switch)")
    yield _entry(f'"{files[1].name}"', "Red_FileName", "Guyan/Craig-Bampton inputs")
    yield _entry('"NA"', "RedCst_FileName", "Constant inputs (-) (currently unused)")
    yield from _modes_and_start()
    yield from _output()


def _module_head(body: Superelement) -> Iterator[str]:
    yield _ruled("EXTPTFM INPUT FILE")
    yield f"Body {body.name}, interface {body.pilot}, written by carrierflex; {UNITS}"
    yield _ruled("SIMULATION CONTROL")
    yield _entry(False, "Echo", "Echo input data to <RootName>.ech (flag)")
    yield _entry('"default"', "DT", 'Communication interval (s) (or "default")')
    yield _entry(3, "IntMethod", "Integration Method {1:RK4; 2:AB4, 3:ABM4} (switch)")
    yield _ruled("REDUCTION INPUTS")


def _modes_and_start() -> Iterator[str]:
    yield _entry(-1, "NActiveDOFList", "Number of active CB modes, -1 for all (integer)")
    yield _entry("", "ActiveDOFList", "List of active CB modes [unused if NActiveDOFList<=0]")
    for kind, what in (("Pos", "positions"), ("Vel", "velocities")):
        yield _entry(0, f"NInit{kind}List", f"Number of initial {what}, 0: all are 0 (integer)")
        yield _entry("0,", f"Init{kind}List", f"Initial {what} of the modes [unused]")


def _output() -> Iterator[str]:
    yield _ruled("OUTPUT")
    yield _entry(True, "SumPrint", "Print summary data to <RootName>.sum (flag)")
    yield _entry(1, "OutFile", "(currently unused)")
    yield _entry(True, "TabDelim", "(currently unused)")
    yield _entry('"G0"', "OutFmt", "(currently unused)")
    yield _entry(0, "TStart", "(currently unused)")
    yield _entry("", "OutList", "The next lines hold output channels")
    yield from (f'"{channel}"' for channel in _LOADS)
    yield "END of input file"
    yield "-" * 80


def _entry(value: object, key: str, words: str) -> str:
    return f"{value!s:<28} {key:<16} - {words}"


def _ruled(title: str) -> str:
    return f"{'-' * 22} {title} ".ljust(80, "-")


def checks(body: Superelement) -> dict[str, float]:
    """What a reader of a superelement looks at first, as SubDyn prints it.

    Returns
    -------
    dict of str to float
        Modes; mass [kg] and centre of mass from the interface [m]; how far the mass is from a rigid
        body's; the lowest frequency with the interface held [Hz]; of a held body the stiffness in
        torsion [N m/rad] and along x [N/m] at the interface.
    """
    m = float(body.M[0, 0])
    rigid = body.M[:6, :6]
    centre = np.array([rigid[1, 5], -rigid[0, 5], rigid[0, 4]]) / m
    figures = {
        "modes": float(len(body.M) - 6),
        "mass [kg]": m,
        **{f"centre of mass, {axis} [m]": float(c) for axis, c in zip("xyz", centre, strict=True)},
        "lowest frequency, interface held [Hz]": float(np.sqrt(body.K[6, 6]) / (2.0 * np.pi))
        if len(body.K) > 6
        else 0.0,
    }
    if body.is_free:
        return figures | {"mass away from a rigid body's, relative": _rigid_error(rigid, centre)}
    compliance = np.linalg.inv(body.K[:6, :6])
    return figures | {
        "stiffness in torsion about x [N m/rad]": float(1.0 / compliance[3, 3]),
        "stiffness along x [N/m]": float(1.0 / compliance[0, 0]),
    }


def _rigid_error(rigid: Array, centre: Array) -> float:
    """Largest entry, over mass, of what a rigid body of this centre does not have there."""
    m = rigid[0, 0]
    expected = np.block([[m * np.eye(3), -m * _cross(centre)], [m * _cross(centre), rigid[3:, 3:]]])
    return float(np.abs(rigid - expected).max() / m)


def _cross(r: Iterable[float]) -> Array:
    x, y, z = r
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])

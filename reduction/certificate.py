"""The reduction certificate: what was checked of a reduced body, wanted beside reached."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.couplings import Pilot
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.pins import planets_of
from carrierflex.reduction.craig_bampton import Reduction, numbered_coordinates
from carrierflex.reduction.cyclic_symmetry import (
    asymmetry_ppm,
    modal_asymmetry_ppm,
    unlike_response,
)
from carrierflex.reduction.dynamic_stiffness import (
    FullResponse,
    full_response,
    response_error,
)
from carrierflex.reduction.free_interface import FreeInterfaceReduction
from carrierflex.reduction.free_modes import (
    frequency_errors,
    full_free_modes,
    group_mac,
    reduced_free_modes,
)
from carrierflex.reduction.held_structure import Grounded, HeldStructure
from carrierflex.reduction.modes.mode_rules import CUT_OFF_SHARE, FREE_CUT_OFF_SHARE
from carrierflex.reduction.reduced_model import FREE_MOTIONS, ReducedModel
from carrierflex.reduction.reduced_static import pilot_compliance
from carrierflex.reduction.rigid_body_checks import (
    eigen_rigid_modes,
    geometric_rigid_modes,
    grounding,
    mass_difference,
    mass_properties_from,
    stiffness_rigid_modes,
)

#: Free modes computed at first; more where the last of them lies below the cut-off.
_FREE_MODES = 12
#: Shares of the time of :func:`certify` that are over after the static compliance and after the
#: free modes, measured on the default carrier.
_COMPLIANCE_SHARE = 0.055
_RESPONSE_FROM = 0.33
_LIMITS = {
    "static compliance": 1e-8,
    "free frequency": 0.01,
    "MAC": 0.99,
    # A frequency error of 0.2 % moves a resonance of 4 % loss that much.
    "response": 0.1,
    "mass": 1e-8,
    "grounding": 1e-9,
    "asymmetry": 1.0,
    # A hundredth of what is allowed to the response itself.
    "unlike pilots": 1e-3,
}

#: Entry of a body's provenance that says its mesh has no symmetry of its own.
FREE_MESH = ("symmetry_order", "1")
#: Singular value of pilots' rigid motions over the largest below which one is not held.
_RANK_TOLERANCE = 1e-8


@dataclass(frozen=True)
class Check:
    """One line of the certificate.

    Parameters
    ----------
    name : str
        What was checked.
    wanted : str
        What is wanted, as ``< 1e-8``.
    reached : float
        What was reached.
    met : bool
        Whether that is enough.
    """

    name: str
    wanted: str
    reached: float
    met: bool

    @property
    def share_of_limit(self) -> float | None:
        """Reached over allowed; None where there is no upper limit."""
        try:
            return self.reached / float(self.wanted.removeprefix("< "))
        except (ValueError, ZeroDivisionError):
            return None


@dataclass(frozen=True)
class Certificate:
    """All checks of one body; `cut_off_hz` is the frequency up to which it was checked."""

    cut_off_hz: float
    checks: tuple[Check, ...]

    @property
    def met(self) -> bool:
        """Whether every check is met."""
        return all(check.met for check in self.checks)

    @property
    def closest(self) -> Check | None:
        """Check that comes closest to its upper limit, or is furthest beyond it."""
        limited = [check for check in self.checks if check.share_of_limit is not None]
        return max(limited, key=lambda check: check.share_of_limit or 0.0, default=None)


def certify(
    structure: StructuralModel,
    reduction: Reduction,
    *,
    cut_off_hz: float | None = None,
    seed: int = 0,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> Certificate:
    """Compare a reduced body with the full one it stands for, and check it in itself.

    Parameters
    ----------
    structure : StructuralModel
        The full body.
    reduction : Reduction
        Its reduction with basis and factor.
    cut_off_hz : float, optional
        Frequency up to which the body is used; by default a quarter of the highest fixed-interface
        frequency kept.
    seed : int
        Seed of the starting block of the free modes.
    note : callable
        Told each check with the share of the work that is done.

    Returns
    -------
    Certificate
        Static compliance at every pilot, free frequencies and MAC, frequency response up to the
        cut-off, and :func:`inner_checks`.
    """
    if cut_off_hz is None:
        cut_off_hz = fixed_interface_cut_off(reduction.modes.omega)
    note("static compliance", 0.0)
    checks = compliance_checks(compliance_errors(structure, reduction))
    note("free modes", _COMPLIANCE_SHARE)
    checks += _free_modes_of_body(structure, reduction, cut_off_hz, seed)
    if cut_off_hz:

        def note_term(share: float) -> None:
            note("frequency response", _RESPONSE_FROM + (1.0 - _RESPONSE_FROM) * share)

        checks += response_checks(full_response(structure, reduction, note=note_term), cut_off_hz)
    return Certificate(cut_off_hz, (*checks, *inner_checks(reduction.model, cut_off_hz)))


def fixed_interface_cut_off(omega: NDArray[np.float64]) -> float:
    """Frequency [Hz] up to which a body of the fixed-interface modes `omega` [rad/s] is used."""
    return CUT_OFF_SHARE * float(omega[-1]) / (2.0 * np.pi) if len(omega) else 0.0


def certify_free_interface(
    structure: StructuralModel,
    reduction: FreeInterfaceReduction,
    *,
    cut_off_hz: float | None = None,
    seed: int = 1,
) -> Certificate:
    """Compare a body of free modes and residual flexibility with the full one.

    The reduced body is also checked in itself.

    Parameters
    ----------
    structure : StructuralModel
        The full body.
    reduction : FreeInterfaceReduction
        Its reduction.
    cut_off_hz : float, optional
        Frequency up to which the body is used; by default half the highest free frequency kept.
    seed : int
        Seed of the starting block of the free modes, other than the reduction's: the modes are
        found again.

    Returns
    -------
    Certificate
        Static compliance at every pilot, free frequencies and MAC up to the cut-off, and
        :func:`inner_checks`.
    """
    omega = reduction.modes.omega
    if cut_off_hz is None:
        cut_off_hz = FREE_CUT_OFF_SHARE * float(omega[-1]) / (2.0 * np.pi) if len(omega) else 0.0
    checks = [
        *compliance_checks(compliance_errors(structure, reduction)),
        *_free_modes_of_body(structure, reduction, cut_off_hz, seed),
    ]
    return Certificate(cut_off_hz, (*checks, *inner_checks(reduction.model, cut_off_hz)))


def inner_checks(model: ReducedModel, cut_off_hz: float) -> tuple[Check, ...]:
    """Checks that need nothing but the reduced matrices.

    A reader of the body file can repeat them.

    Mass, centre and inertia from three kinds of rigid-body modes, and grounding. Where the pilots
    map onto one another under the rotation by the pins' pitch: the symmetry of their stiffness and
    mass, that of what the modes add, and how alike they answer up to `cut_off_hz` [Hz].
    """
    if model.provenance.get(FREE_MOTIONS, "6") != "6":
        free = float(model.provenance[FREE_MOTIONS])
        name = "rigid motions that nothing holds; mass and grounding are those of a free body"
        return (Check(name, "reported", free, True),)
    kinds = {
        "geometry": geometric_rigid_modes,
        "stiffness": stiffness_rigid_modes,
        "eigenvalues": eigen_rigid_modes,
    }
    length = float(np.ptp(np.array(list(model.pilots.values())), axis=0).max()) or 1.0
    checks = []
    for kind, rigid_modes in kinds.items():
        properties = mass_properties_from(model, rigid_modes(model))
        difference = mass_difference(properties, model.mass_properties, length)
        checks.append(
            _below(f"mass, centre, inertia by rigid modes from {kind}", difference, _LIMITS["mass"])
        )
    checks.append(_below("grounding over own stiffness", grounding(model), _LIMITS["grounding"]))
    return (*checks, *_symmetry_checks(model, cut_off_hz))


def _symmetry_checks(model: ReducedModel, cut_off_hz: float) -> list[Check]:
    pitch = 360.0 / planets_of(model.pilots)
    figures = {
        f"asymmetry under {pitch:.4g} deg, ppm": (asymmetry_ppm(model), _LIMITS["asymmetry"]),
        "asymmetry of the modal part, ppm": (modal_asymmetry_ppm(model), _LIMITS["asymmetry"]),
        "unlike response of equal pilots up to the cut-off": (
            unlike_response(model, cut_off_hz) if cut_off_hz > 0.0 else None,
            _LIMITS["unlike pilots"],
        ),
    }
    # A free mesh, of a CAD model or of another program, has no symmetry that rounding alone could
    # disturb.
    free_mesh = model.provenance.get(FREE_MESH[0]) == FREE_MESH[1]
    return [
        Check(name, "reported (free mesh)", reached, True)
        if free_mesh
        else _below(name, reached, limit)
        for name, (reached, limit) in figures.items()
        if reached is not None
    ]


def _below(name: str, reached: float, limit: float) -> Check:
    return Check(name, f"< {limit:g}", float(reached), bool(reached < limit))


def compliance_errors(
    structure: StructuralModel, reduction: Reduction | FreeInterfaceReduction
) -> dict[str, float]:
    """Largest relative error of the static compliance of every pilot but the first.

    The first one is fixed, with as many more as a body needs that one of fewer components does not
    hold; none of a body that is held to the ground. Errors by pilot.

    Every entry is compared over the geometric mean of its two diagonal entries in the full body.
    """
    reference, others = _holding_pilots(structure)
    if not others:
        return {}
    G = sp.csr_array(sp.vstack([pilot.G for pilot in others]))
    if reference:
        motions = np.zeros((sum(len(pilot.components) for pilot in reference), G.shape[0]))
        answer = HeldStructure(reduction.body, reference).solve(G.T.toarray(), motions)[0]
    else:
        answer = reduction.body.displacement(G.T.toarray())
    exact = G @ answer
    names = [pilot.name for pilot in reference]
    return _by_pilot(
        pilot_compliance(reduction.model, names) - exact, exact, numbered_coordinates(others)
    )


def compliance_errors_by_fields(
    structure: StructuralModel, model: ReducedModel, Psi: NDArray[np.float64]
) -> dict[str, float]:
    """The errors of :func:`compliance_errors` without a factor of the full body.

    With the stiffness of :func:`stiffness_of_fields` and the compliance C of the reduced body the
    error is ``C (K_full - K_bb) C``.

    Parameters
    ----------
    structure : StructuralModel
        The full body, all pilots with six components.
    model : ReducedModel
        Its reduction, the pilots' coordinates first.
    Psi : ndarray, shape (n_dofs, m)
        Constraint modes of the reduction at the nodes of the full body.
    """
    G = sp.csr_array(sp.vstack([pilot.G for pilot in structure.pilots]))
    m = Psi.shape[1]
    return compliance_errors_of_stiffness(
        model, stiffness_of_fields(structure.K, G, Psi, model.K[:m, :m])
    )


def stiffness_of_fields(
    K: sp.csr_array, G: sp.csr_array, Psi: NDArray[np.float64], K_bb: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Stiffness of the full body at its pilots, from the constraint modes of any reduction.

    They are put into the full body's equations,

        K_full = (G Ψ)ᵀ K_bb + K_bb G Ψ - Ψᵀ K Ψ,

    right but for the square of the error of Ψ, every field being its own adjoint.

    Parameters
    ----------
    K : csr_array, shape (n, n)
        Stiffness of the full body, or of a block of it.
    G : csr_array, shape (m, n)
        Its pilots.
    Psi : ndarray, shape (n, m)
        Constraint modes.
    K_bb : ndarray, shape (m, m)
        Stiffness that the reduction has.

    References
    ----------
    Pierce and Giles (2000), SIAM Review 42(2), 247-264, equation 2.6.
    """
    moved = G @ Psi
    return np.asarray(moved.T @ K_bb + K_bb @ moved - Psi.T @ (K @ Psi))


def compliance_errors_of_stiffness(
    model: ReducedModel, K_full: NDArray[np.float64]
) -> dict[str, float]:
    """The errors of :func:`compliance_errors` from the full body's stiffness at its pilots.

    All pilots have six coordinates; K_full has the shape (6 p, 6 p).
    """
    reference, *others = model.pilots
    first = len(model.coordinates_of(reference))
    C = pilot_compliance(model, [reference])
    difference = (K_full - model.K[: len(K_full), : len(K_full)])[first:, first:]
    rows = {name: model.coordinates_of(name) - first for name in others}
    return _by_pilot(C @ difference @ C, C, rows)


def _by_pilot(
    difference: NDArray[np.float64],
    compliance: NDArray[np.float64],
    rows: Mapping[str, NDArray[np.int64]],
) -> dict[str, float]:
    """Largest entry of every pilot over the geometric mean of its two diagonal entries."""
    diagonal = compliance.diagonal()
    relative = np.abs(difference) / np.sqrt(np.outer(diagonal, diagonal))
    return {name: float(relative[of_pilot].max()) for name, of_pilot in rows.items()}


def _holding_pilots(structure: StructuralModel) -> tuple[tuple[Pilot, ...], tuple[Pilot, ...]]:
    """The first pilots, as many as hold the body's free motions, and the others."""
    R = structure.rigid_modes
    if structure.free_motions is not None:
        R = R @ structure.free_motions
    unit = R / np.abs(R).max(axis=0, initial=np.finfo(float).tiny)
    for count in range(len(structure.pilots) + 1):
        moved = [pilot.G @ unit for pilot in structure.pilots[:count]]
        motion = np.concatenate([np.zeros((0, R.shape[1])), *moved])
        size = np.linalg.svd(motion, compute_uv=False)
        if R.shape[1] == 0 or np.count_nonzero(size > _RANK_TOLERANCE * size[:1]) == R.shape[1]:
            return structure.pilots[:count], structure.pilots[count:]
    raise ValueError(
        f"{structure.name}: its pilots leave the body free to move; expected pilots that hold it"
    )


def compliance_checks(errors: Mapping[str, float]) -> list[Check]:
    """Lines of the certificate on the errors of :func:`compliance_errors`."""
    limit = _LIMITS["static compliance"]
    return [
        _below(f"static compliance at {pilot}", error, limit) for pilot, error in errors.items()
    ]


def _free_modes_of_body(
    structure: StructuralModel,
    reduction: Reduction | FreeInterfaceReduction,
    cut_off_hz: float,
    seed: int,
) -> list[Check]:
    model = reduction.model
    errors = free_mode_errors(
        structure.M, reduction.body, (model.K, model.M), reduction.basis, cut_off_hz, seed=seed
    )
    return free_mode_checks(errors, cut_off_hz)


@dataclass(frozen=True, eq=False)
class FreeModeErrors:
    """How well a reduction has the free modes of the full body, or of a block of it.

    Parameters
    ----------
    omega : ndarray, shape (k,)
        Angular frequencies of the full body [rad/s], ascending, the last beyond the cut-off.
    errors : ndarray, shape (k,)
        Relative errors of the reduced ones.
    mac : ndarray, shape (k,)
        Modal assurance, as :func:`carrierflex.reduction.free_modes.group_mac` has it.
    """

    omega: NDArray[np.float64]
    errors: NDArray[np.float64]
    mac: NDArray[np.float64]

    @classmethod
    def together(cls, blocks: Sequence["FreeModeErrors"]) -> "FreeModeErrors":
        """Those of all blocks of a body."""
        order = np.argsort(np.concatenate([block.omega for block in blocks]), kind="stable")
        return cls(
            np.concatenate([block.omega for block in blocks])[order],
            np.concatenate([block.errors for block in blocks])[order],
            np.concatenate([block.mac for block in blocks])[order],
        )

    def repeated(self, times: int) -> "FreeModeErrors":
        """Each mode so many times: the partners of a pair."""
        return FreeModeErrors(
            np.repeat(self.omega, times), np.repeat(self.errors, times), np.repeat(self.mac, times)
        )


def free_mode_errors(
    M: sp.csr_array,
    body: Grounded,
    reduced_matrices: tuple[NDArray[np.float64], NDArray[np.float64]],
    basis: NDArray[np.float64],
    cut_off_hz: float,
    *,
    n_modes: int = _FREE_MODES,
    seed: int = 0,
) -> FreeModeErrors:
    """Free modes of a full problem up to the cut-off, and the errors of the reduced ones.

    Parameters
    ----------
    M : csr_array, shape (n, n)
        Mass matrix [kg] of the full body, or of a block of it.
    body : Grounded
        Its factor.
    reduced_matrices : tuple of ndarray
        K and M of its reduction.
    basis : ndarray, shape (n, k)
        Fields of the reduced coordinates.
    cut_off_hz : float
        Frequency that the last mode is beyond.
    n_modes : int
        Modes computed at first.
    seed : int
        Seed of the starting block.
    """
    while True:
        full = full_free_modes(M, body, n_modes, rng=np.random.default_rng(seed))
        # A small body may have no more of them.
        if len(full.omega) < n_modes or full.omega[-1] >= 2.0 * np.pi * cut_off_hz:
            break
        n_modes *= 2
    n_rigid = body.rigid_modes.shape[1]
    reduced = reduced_free_modes(*reduced_matrices, basis, 2 * len(full.omega), n_rigid=n_rigid)
    errors = np.abs(frequency_errors(full, reduced))
    k = len(errors)
    return FreeModeErrors(full.omega[:k], errors, group_mac(M, full, reduced)[:k])


def free_mode_checks(modes: FreeModeErrors, cut_off_hz: float) -> list[Check]:
    """Lines of the certificate on the free modes below the cut-off [Hz]."""
    n = int(np.count_nonzero(modes.omega < 2.0 * np.pi * cut_off_hz))
    if not len(modes.errors):
        return [Check("free frequencies: the body has none", "reported", 0.0, True)]
    if n == 0:
        first = modes.omega[0] / (2.0 * np.pi)
        name = f"free frequencies: none below the cut-off; error of the first, {first:.0f} Hz"
        return [Check(name, "reported", float(modes.errors[0]), True)]
    mac = float(modes.mac[:n].min())
    return [
        _below(
            f"free frequencies, {n} below the cut-off",
            modes.errors[:n].max(),
            _LIMITS["free frequency"],
        ),
        Check(f"MAC of these {n} modes", f"> {_LIMITS['MAC']:g}", mac, mac > _LIMITS["MAC"]),
    ]


def response_checks(response: FullResponse, cut_off_hz: float) -> list[Check]:
    """Lines of the certificate on the frequency response up to the cut-off [Hz]."""
    band = 2.0 * np.pi * np.linspace(0.05, 1.0, 20) * cut_off_hz
    errors = np.array(
        [response_error(response, float(omega), len(response.omega)) for omega in band]
    )
    checks = [
        _below(
            "frequency response at the pilots up to the cut-off",
            errors[:, 0].max(),
            _LIMITS["response"],
        )
    ]
    if len(response.sensors_static):
        checks.append(
            _below(
                "frequency response at the sensors up to the cut-off",
                errors[:, 1].max(),
                _LIMITS["response"],
            )
        )
    return checks

"""The reduction certificate: what was checked of a reduced body, wanted beside reached."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.craig_bampton import Reduction
from carrierflex.reduction.cyclic_symmetry import asymmetry_ppm
from carrierflex.reduction.dynamic_stiffness import full_response, response_error
from carrierflex.reduction.free_modes import (
    frequency_errors,
    full_free_modes,
    group_mac,
    reduced_free_modes,
)
from carrierflex.reduction.held_structure import HeldStructure
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import pilot_compliance
from carrierflex.reduction.rigid_body_checks import (
    eigen_rigid_modes,
    geometric_rigid_modes,
    grounding,
    mass_difference,
    mass_properties_from,
    stiffness_rigid_modes,
)

#: Share of the highest fixed-interface frequency up to which the body is meant to be used, and is
#: checked.
CUT_OFF_SHARE = 0.25
#: Free modes compared at the most.
_MOST_FREE_MODES = 12
_LIMITS = {
    "static compliance": 1e-8,
    "free frequency": 0.01,
    "MAC": 0.99,
    # A frequency error of 0.2 % moves a resonance of 4 % loss that much.
    "response": 0.1,
    "mass": 1e-8,
    "grounding": 1e-9,
    "asymmetry": 1.0,
}

#: Entry of a body's provenance that says its mesh has no symmetry of its own.
FREE_MESH = ("symmetry_order", "1")


@dataclass(frozen=True)
class Check:
    """One line of the certificate."""

    name: str
    wanted: str
    reached: float
    met: bool


@dataclass(frozen=True)
class Certificate:
    """All checks of one body; `cut_off_hz` is the frequency up to which it was checked."""

    cut_off_hz: float
    checks: tuple[Check, ...]

    @property
    def met(self) -> bool:
        """Whether every check is met."""
        return all(check.met for check in self.checks)


def certify(structure: StructuralModel, reduction: Reduction, *, seed: int = 0) -> Certificate:
    """Compare a reduced body with the full one it stands for, and check it in itself.

    Parameters
    ----------
    structure : StructuralModel
        The full body.
    reduction : Reduction
        Its reduction with basis and factor.
    seed : int
        Seed of the starting block of the free modes.

    Returns
    -------
    Certificate
        Static compliance at every pilot, free frequencies and MAC, frequency response up to the
        cut-off, and :func:`inner_checks`.
    """
    cut_off_hz = (
        CUT_OFF_SHARE * float(reduction.modes.omega[-1]) / (2.0 * np.pi)
        if len(reduction.modes.omega)
        else 0.0
    )
    checks = [
        *_compliance_checks(structure, reduction),
        *_free_mode_checks(structure, reduction, cut_off_hz, seed),
    ]
    if cut_off_hz:
        checks += _response_checks(structure, reduction, cut_off_hz)
    return Certificate(cut_off_hz, (*checks, *inner_checks(reduction.model)))


def inner_checks(model: ReducedModel) -> tuple[Check, ...]:
    """Checks that need nothing but the reduced matrices, so that a reader of the body file can repeat them.

    Mass, centre and inertia from three kinds of rigid-body modes, grounding, and the symmetry of
    the pilots' stiffness and mass under the rotation by 120 degrees where the pilots have it.
    """
    kinds = {
        "geometry": geometric_rigid_modes,
        "stiffness": stiffness_rigid_modes,
        "eigenvalues": eigen_rigid_modes,
    }
    length = float(np.ptp(np.array(list(model.pilots.values())), axis=0).max()) or 1.0
    checks = []
    for kind, rigid_modes in kinds.items():
        found = mass_properties_from(model, rigid_modes(model))
        difference = mass_difference(found, model.mass_properties, length)
        checks.append(
            _below(f"mass, centre, inertia by rigid modes from {kind}", difference, _LIMITS["mass"])
        )
    checks.append(_below("grounding over own stiffness", grounding(model), _LIMITS["grounding"]))
    ppm = asymmetry_ppm(model)
    if ppm is not None:
        name = "asymmetry under 120 deg, ppm"
        # A free mesh, of a CAD model or of another program, has no symmetry that rounding alone
        # could disturb.
        free_mesh = model.provenance.get(FREE_MESH[0]) == FREE_MESH[1]
        told = Check(name, "told (free mesh)", ppm, True)
        checks.append(told if free_mesh else _below(name, ppm, _LIMITS["asymmetry"]))
    return tuple(checks)


def _below(name: str, reached: float, limit: float) -> Check:
    return Check(name, f"< {limit:g}", float(reached), bool(reached < limit))


def compliance_errors(structure: StructuralModel, reduction: Reduction) -> dict[str, float]:
    """Largest relative error of the static compliance of every pilot but the first, which is held, by pilot.

    Every entry is compared over the geometric mean of its two diagonal entries in the full body.
    """
    held, others = structure.pilots[0], structure.pilots[1:]
    G = sp.csr_array(sp.vstack([pilot.G for pilot in others]))
    exact = (
        G
        @ HeldStructure(reduction.body, (held,)).solve(G.T.toarray(), np.zeros((6, G.shape[0])))[0]
    )
    difference = np.abs(pilot_compliance(reduction.model, [held.name]) - exact)
    relative = difference / np.sqrt(np.outer(exact.diagonal(), exact.diagonal()))
    return {pilot.name: float(relative[6 * i : 6 * i + 6].max()) for i, pilot in enumerate(others)}


def _compliance_checks(structure: StructuralModel, reduction: Reduction) -> list[Check]:
    limit = _LIMITS["static compliance"]
    errors = compliance_errors(structure, reduction)
    return [
        _below(f"static compliance at {pilot}", error, limit) for pilot, error in errors.items()
    ]


def _free_mode_checks(
    structure: StructuralModel, reduction: Reduction, cut_off_hz: float, seed: int
) -> list[Check]:
    full = full_free_modes(
        structure, reduction.body, _MOST_FREE_MODES, rng=np.random.default_rng(seed)
    )
    reduced = reduced_free_modes(reduction, 2 * _MOST_FREE_MODES)
    inside = full.omega < 2.0 * np.pi * cut_off_hz
    if not inside.any():
        return []
    n = int(np.count_nonzero(inside))
    error = np.abs(frequency_errors(full, reduced)[inside]).max()
    mac = float(group_mac(structure, full, reduced)[inside].min())
    return [
        _below(f"free frequencies, {n} below the cut-off", error, _LIMITS["free frequency"]),
        Check(f"MAC of these {n} modes", f"> {_LIMITS['MAC']:g}", mac, mac > _LIMITS["MAC"]),
    ]


def _response_checks(
    structure: StructuralModel, reduction: Reduction, cut_off_hz: float
) -> list[Check]:
    response = full_response(structure, reduction)
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
    if structure.sensors:
        checks.append(
            _below(
                "frequency response at the sensors up to the cut-off",
                errors[:, 1].max(),
                _LIMITS["response"],
            )
        )
    return checks

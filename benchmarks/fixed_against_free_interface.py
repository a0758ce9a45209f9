"""Craig-Bampton against the free-interface basis on the same body: errors against the full body.

    python -m benchmarks.fixed_against_free_interface [SIZE]

Errors of the first 20 free frequencies (largest and median), of the pilots' response up to 1000 Hz,
and of the same at 1 Hz (statics).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from benchmarks.measured import measured
from benchmarks.ratio import TIME, Quantity, Ratio
from benchmarks.run import run_alone
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.dynamic_stiffness import LOSS_FACTOR, FullResponse, full_response
from carrierflex.reduction.free_interface import free_interface_reduction
from carrierflex.reduction.free_modes import full_free_modes
from carrierflex.reduction.held_structure import GroundedBody
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.residual_vectors import body_loads
from carrierflex.workflows.fe.bodies import body_structure

QUICK = {"size": 0.08, "mode_counts": (10, 40), "n_responses": 5}

N_FREQUENCIES = 20
BAND_HZ = 1000.0
_ERRORS = ("largest frequency error", "median frequency error", "response error", "static error")


@dataclass(frozen=True, eq=False)
class FullBody:
    """The body before any reduction: free frequencies [rad/s] and the pilots' response."""

    structure: StructuralModel
    body: GroundedBody
    omega: NDArray[np.float64]
    response: FullResponse


def ratios(
    size: float = 0.05, *, mode_counts: Sequence[int] = (5, 10, 20, 40), n_responses: int = 20
) -> Iterator[Ratio]:
    """Errors and time of the fixed-interface basis, without and with residual vectors.

    Parameters
    ----------
    size
        Element edge length [m].
    mode_counts
        Modes kept.
    n_responses
        Frequencies at which the response is compared.
    """
    full = _full_body(size)
    structure, body = full.structure, full.body
    loads = body_loads(structure)
    for n in mode_counts:
        fixed = {
            f"{n} modes": partial(craig_bampton, structure, n, body=body),
            f"{n} modes + residual": partial(
                craig_bampton, structure, n, body=body, residual_loads=loads
            ),
        }
        free = measured(partial(free_interface_reduction, structure, n, body=body))
        their_errors = _errors(free.result.model, full, n_responses)
        for case, reduced in fixed.items():
            ours = measured(reduced)
            errors = _errors(ours.result.model, full, n_responses)
            n_ours, n_free = ours.result.model.n_coordinates, free.result.model.n_coordinates
            sizes = f"{n_ours} and {n_free} coordinates"
            for name, error, other in zip(_ERRORS, errors, their_errors, strict=True):
                yield Ratio(case, Quantity(name), error, "free interface", other, note=sizes)
                sizes = ""
            yield Ratio(case, TIME, ours.wall, "free interface", free.wall)


def _full_body(size: float) -> FullBody:
    _, structure = body_structure("flexible_carrier", read_parameters(None), size)
    body = GroundedBody(structure.K, structure.points, structure.rigid_points)
    reference = craig_bampton(structure, 80, body=body)
    rng = np.random.default_rng(0)
    omega = full_free_modes(structure.M, body, N_FREQUENCIES, rng=rng).omega
    return FullBody(structure, body, omega, full_response(structure, reference))


def _errors(model: ReducedModel, full: FullBody, n_responses: int) -> tuple[float, ...]:
    """The four errors, in the order of their names."""
    omega = _free_omega(model)[:N_FREQUENCIES]
    error = np.abs(omega / full.omega[: omega.size] - 1.0)
    error_at = partial(_response_error, model, full.response)
    worst = max(error_at(f) for f in np.linspace(1.0 / n_responses, 1.0, n_responses) * BAND_HZ)
    return float(error.max()), float(np.median(error)), worst, error_at(1.0)


def _free_omega(model: ReducedModel) -> NDArray[np.float64]:
    """Elastic angular frequencies [rad/s] of the free reduced body."""
    scale = 1.0 / np.sqrt(np.diag(model.M))
    both = np.outer(scale, scale)
    squared = scipy.linalg.eigh(model.K * both, model.M * both, eigvals_only=True)
    return np.sqrt(np.abs(squared))[6:]


def _response_error(model: ReducedModel, response: FullResponse, frequency_hz: float) -> float:
    """Frobenius error of the pilots' receptance, scaled by the pilots' own stiffness."""
    omega = 2.0 * np.pi * frequency_hz
    m = len(response.K_bb)
    H, _ = response.at(omega, len(response.omega), with_rest=True)
    scale = 1.0 / np.sqrt(np.diag(model.K))
    both = np.outer(scale, scale)
    D = (1.0 + 1j * LOSS_FACTOR) * model.K - omega**2 * model.M
    reduced = (np.linalg.inv(D * both) * both)[:m, :m]
    W = np.sqrt(np.diag(response.K_bb))
    weight = np.outer(W, W)
    return float(np.linalg.norm((reduced - H) * weight) / np.linalg.norm(H * weight))


if __name__ == "__main__":
    run_alone(ratios)

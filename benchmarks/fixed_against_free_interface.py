"""Craig-Bampton against the free-interface basis on the same body.

Frequencies, response, statics, size, time.

    python benchmarks/fixed_against_free_interface.py [SIZE]

The flexible carrier at element size SIZE [m] (default 0.04); errors against the full body.
"""

import sys
import time

import numpy as np
import scipy.linalg

from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.dynamic_stiffness import LOSS_FACTOR, full_response
from carrierflex.reduction.free_interface import free_interface_reduction
from carrierflex.reduction.free_modes import full_free_modes
from carrierflex.reduction.held_structure import GroundedBody
from carrierflex.reduction.residual_vectors import body_loads
from carrierflex.workflows.support.named_bodies import body_structure

MODE_COUNTS = (5, 10, 20, 40)
N_FREQUENCIES = 20
BAND_HZ = 1000.0


def main() -> None:
    size = float(sys.argv[1]) if len(sys.argv) > 1 else 0.04
    _, structure = body_structure("flexible_carrier", read_parameters(None), size)
    body = GroundedBody(structure.K, structure.points, structure.rigid_points)
    reference = craig_bampton(structure, 80, body=body)
    response = full_response(structure, reference)
    exact = full_free_modes(structure, body, N_FREQUENCIES, rng=np.random.default_rng(0)).omega
    print(
        f"{structure.n_dofs} unknowns, {len(structure.pilots)} pilots; errors against the full body: the first {N_FREQUENCIES}"
    )
    print(
        f"free frequencies (largest, median), the pilots' response up to {BAND_HZ:.0f} Hz, and at 1 Hz (statics)"
    )
    heads = ("coordinates", "frequency", "median", "response", "statics", "time, s")
    print(f"{'basis':22}", *(f"{head:>11}" for head in heads))
    loads = body_loads(structure)
    for n in MODE_COUNTS:
        for name, reduce in (
            (f"fixed, {n}", lambda n=n: craig_bampton(structure, n, body=body)),
            (
                f"fixed, {n} + residual",
                lambda n=n: craig_bampton(structure, n, body=body, residual_loads=loads),
            ),
            (f"free, {n}", lambda n=n: free_interface_reduction(structure, n, body=body)),
        ):
            start = time.perf_counter()
            model = reduce().model
            seconds = time.perf_counter() - start
            frequency = _frequencies(model)[:N_FREQUENCIES]
            error = np.abs(frequency / exact[: frequency.size] - 1.0)
            statics = _response_error(model, response, 1.0)
            worst = max(
                _response_error(model, response, f) for f in np.linspace(0.05, 1.0, 20) * BAND_HZ
            )
            figures = (error.max(), np.median(error), worst, statics, seconds)
            print(
                f"{name:22} {model.n_coordinates:11d}", *(f"{figure:11.1e}" for figure in figures)
            )


def _frequencies(model):
    scale = 1.0 / np.sqrt(np.diag(model.M))
    squared = scipy.linalg.eigh(
        model.K * np.outer(scale, scale), model.M * np.outer(scale, scale), eigvals_only=True
    )
    return np.sqrt(np.abs(squared))[6:]


def _response_error(model, response, frequency_hz):
    """Frobenius error of the pilots' receptance, scaled by the pilots' own stiffness."""
    omega = 2.0 * np.pi * frequency_hz
    m = len(response.K_bb)
    H, _ = response.at(omega, len(response.omega), with_rest=True)
    scale = 1.0 / np.sqrt(np.diag(model.K))
    D = (1.0 + 1j * LOSS_FACTOR) * model.K - omega**2 * model.M
    own = (np.linalg.inv(D * np.outer(scale, scale)) * np.outer(scale, scale))[:m, :m]
    W = np.sqrt(np.diag(response.K_bb))
    return float(np.linalg.norm((own - H) * np.outer(W, W)) / np.linalg.norm(H * np.outer(W, W)))


if __name__ == "__main__":
    main()

"""Frequency response of the full body at its pilots and sensors.

From the reduction and what it leaves out.

With hysteretic damping, ``K (1 + i η)``, and ``L_i = φ_iᵀ M Ψ`` the full body's dynamic stiffness
at the pilots is

    D(ω) = (1 + i η) Ψᵀ K Ψ - ω² Ψᵀ M Ψ - ω⁴ Σ_i L_iᵀ L_i / ((1 + i η) ω_i² - ω²)

over all fixed-interface modes. The kept modes are summed as they are. The rest answers far below
resonance and is a geometric series in (ω / ω_i)², whose moments are found by repeated static
solves; every term gains the square of the ratio between the frequency and the first mode that was
left out.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.craig_bampton import Reduction
from carrierflex.reduction.fixed_interface_modes import FixedInterfaceModes
from carrierflex.reduction.held_structure import HeldStructure

#: Loss factor η of the comparison: twice the 2 % of critical damping that the bodies have.
LOSS_FACTOR = 0.04
#: Terms of the series; at half the first left-out frequency they leave a share of (1/4)^8 = 1.5e-5
#: of the rest.
_TERMS = 8


@dataclass(frozen=True, eq=False)
class FullResponse:
    """What the frequency response of the full body is made of.

    Parameters
    ----------
    K_bb, M_bb : ndarray, shape (m, m)
        Static stiffness and mass of the constraint modes.
    omega : ndarray, shape (k,)
        Angular frequencies of the kept modes [rad/s].
    L : ndarray, shape (k, m)
        Their inertial coupling to the pilots, ``Φᵀ M Ψ``.
    moments : ndarray, shape (n_terms, m, m)
        ``Σ_{i > k} L_iᵀ L_i / ω_i^(2 j + 2)`` for j = 0, 1, ...
    sensors_static, sensors_modal : ndarray, shape (n_sensors, m) and (n_sensors, k)
        Sensor readings of constraint modes and kept modes.
    sensor_moments : ndarray, shape (n_terms, n_sensors, m)
        ``Σ_{i > k} (s φ_i) L_i / ω_i^(2 j + 2)``.
    """

    K_bb: NDArray[np.float64]
    M_bb: NDArray[np.float64]
    omega: NDArray[np.float64]
    L: NDArray[np.float64]
    moments: NDArray[np.float64]
    sensors_static: NDArray[np.float64]
    sensors_modal: NDArray[np.float64]
    sensor_moments: NDArray[np.float64]

    @property
    def weights(self) -> NDArray[np.float64]:
        """Square roots of the pilots' static stiffness, shape (m,).

        Of their mass where a free body has one pilot, whose constraint modes are rigid.
        """
        stiffness = self.K_bb.diagonal()
        return np.sqrt(stiffness if (stiffness > 0.0).all() else self.M_bb.diagonal())

    def at(
        self, omega: float, n_modes: int, *, with_rest: bool
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Receptance of the free body at one frequency.

        Parameters
        ----------
        omega : float
            Angular frequency [rad/s].
        n_modes : int
            Number of kept modes that take part; all of them with `with_rest`.
        with_rest : bool
            Whether the modes that the reduction leaves out take part: the full body.

        Returns
        -------
        H : ndarray, shape (m, m)
            Pilot motion per unit force and moment at the pilots.
        Y : ndarray, shape (n_sensors, m)
            Sensor reading per unit force and moment at the pilots.
        """
        loss = 1.0 + 1j * LOSS_FACTOR
        amplitudes = self.L[:n_modes] / (loss * self.omega[:n_modes, None] ** 2 - omega**2)
        D = loss * self.K_bb - omega**2 * self.M_bb - omega**4 * (self.L[:n_modes].T @ amplitudes)
        S = self.sensors_static + omega**2 * (self.sensors_modal[:, :n_modes] @ amplitudes)
        if with_rest:
            weights = omega ** (2 * np.arange(len(self.moments))) / loss ** (
                np.arange(len(self.moments)) + 1
            )
            D = D - omega**4 * np.tensordot(weights, self.moments, axes=1)
            S = S + omega**2 * np.tensordot(weights, self.sensor_moments, axes=1)
        scale = 1.0 / self.weights
        H = np.asarray(
            np.linalg.inv(D * np.outer(scale, scale)) * np.outer(scale, scale), dtype=np.complex128
        )
        return H, np.asarray(S @ H, dtype=np.complex128)


def full_response(
    structure: StructuralModel,
    reduction: Reduction,
    *,
    note: Callable[[float], None] = lambda share: None,
) -> FullResponse:
    """Collect the full body's frequency response.

    `_TERMS` block solves with the reduction's factor.

    Parameters
    ----------
    structure : StructuralModel
        The full body.
    reduction : Reduction
        Its reduction, with basis and factor.
    note : callable
        Told before each solve what share of them is done.
    """
    rows = structure.sensors.rows if structure.sensors else sp.csr_array((0, structure.n_dofs))
    m = reduction.Psi.shape[1]
    return response_of_fields(
        HeldStructure(reduction.body, structure.pilots),
        structure.M,
        reduction.Psi,
        reduction.model.K[:m, :m],
        reduction.modes,
        rows,
        note=note,
    )


def response_of_fields(
    fixed_interface: HeldStructure,
    M: sp.csr_array,
    Psi: NDArray[np.float64],
    K_bb: NDArray[np.float64],
    modes: FixedInterfaceModes,
    rows: sp.csr_array,
    *,
    note: Callable[[float], None] = lambda share: None,
) -> FullResponse:
    """The same from the fields of the reduction: of a body, or of a block of a symmetric one.

    Parameters
    ----------
    fixed_interface : HeldStructure
        The problem with its pilots held, m coordinates, n unknowns.
    M : csr_array, shape (n, n)
        Its mass matrix [kg].
    Psi : ndarray, shape (n, m)
        Constraint modes.
    K_bb : ndarray, shape (m, m)
        Their stiffness.
    modes : FixedInterfaceModes
        Fixed-interface modes kept.
    rows : csr_array, shape (n_sensors, n)
        Sensor readings.
    note : callable
        Told before each solve what share of them is done.
    """
    m = Psi.shape[1]
    F = M @ Psi
    L = modes.Phi.T @ F
    moments, sensor_moments = [], []
    force = F - M @ (modes.Phi @ L)
    for term in range(_TERMS):
        note(term / _TERMS)
        X = fixed_interface.solve(force, np.zeros((m, m)))[0]
        # Rounding brings the kept modes back; left in, they would grow from term to term.
        X -= modes.Phi @ (modes.Phi.T @ (M @ X))
        moments.append(F.T @ X)
        sensor_moments.append(rows @ X)
        force = M @ X
    return FullResponse(
        K_bb=K_bb,
        M_bb=Psi.T @ F,
        omega=modes.omega,
        L=L,
        moments=np.array(moments),
        sensors_static=rows @ Psi,
        sensors_modal=rows @ modes.Phi,
        sensor_moments=np.array(sensor_moments),
    )


def response_error(response: FullResponse, omega: float, n_modes: int) -> tuple[float, float]:
    """Error of the reduced body's frequency response at one frequency.

    At the pilots and at the sensors.

    Parameters
    ----------
    response : FullResponse
        The full body's.
    omega : float
        Angular frequency [rad/s].
    n_modes : int
        Fixed-interface modes of the reduced body.

    Returns
    -------
    pilots, sensors : float
        ``|W (H_reduced - H) W| / |W H W|`` and ``|(Y_reduced - Y) W| / |Y W|`` in Frobenius norms.
        W, the square root of the pilots' static stiffness, makes translations and rotations
        comparable, and a norm over all pilots does not blow up at the antiresonances of single
        entries.
    """
    H, Y = response.at(omega, len(response.omega), with_rest=True)
    H_reduced, Y_reduced = response.at(omega, n_modes, with_rest=False)
    W = response.weights
    pilots = float(
        np.linalg.norm((H_reduced - H) * np.outer(W, W)) / np.linalg.norm(H * np.outer(W, W))
    )
    sensors = float(np.linalg.norm((Y_reduced - Y) * W) / np.linalg.norm(Y * W)) if len(Y) else 0.0
    return pilots, sensors


def modes_needed(response: FullResponse, frequency_hz: float, tolerance: float) -> int:
    """Smallest number of fixed-interface modes that meets a tolerance of the response.

    The error stays below `tolerance` up to `frequency_hz`.

    Parameters
    ----------
    response : FullResponse
        From a reduction with more modes than will be needed.
    frequency_hz : float
        Upper end of the band [Hz].
    tolerance : float
        Largest error of :func:`response_error` allowed, pilots and sensors.

    Raises
    ------
    ValueError
        Where the reduction it was made from has too few modes.
    """
    band = 2.0 * np.pi * np.linspace(0.05, 1.0, 20) * frequency_hz

    def worst(n_modes: int) -> float:
        """Largest error over the band with so many modes."""
        return max(max(response_error(response, float(omega), n_modes)) for omega in band)

    most = len(response.omega)
    error = worst(most)
    if error > tolerance:
        raise ValueError(
            f"{most} fixed-interface modes leave an error of {error:.1e} up to {frequency_hz:g} "
            f"Hz; expected at most {tolerance:g}: reduce with more modes"
        )
    low, high = 0, most
    # The error falls with the mode count, up to steps where half of a degenerate pair is kept:
    # bisection finds a count from which on one more mode never makes it necessary to go back.
    while low < high:
        middle = (low + high) // 2
        if worst(middle) <= tolerance:
            high = middle
        else:
            low = middle + 1
    return high

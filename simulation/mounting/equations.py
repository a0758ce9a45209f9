"""Equations of motion of the mounting in two uncoupled blocks, ready for the exact propagator.

``M q̈ + C q̇ + K q + Σ w_e r_e (F_fl,e + phi_e) = G (T, F_y, F_z)``, one row ``r_e`` and weight
``w_e`` for each bushing element; ``phi_e`` is all of a bushing's force that is not linear. With the
fluid branch's coordinate ``u_m`` the linear part is ``ẋ = A x + B loads + N phi``.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.force_laws import ForceLaw
from carrierflex.simulation.mounting.bushings import (
    elasto_plastic_force,
    hardening_force,
    hardening_stiffness,
)
from carrierflex.simulation.mounting.measured_laws.bushing_laws import (
    bushing_force,
    bushing_slopes,
)
from carrierflex.simulation.mounting.measured_laws.bushing_memory_kernels import springs_of
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import MountingRig

#: Damping ratio of the main bearing's compliance; assumed, as for the other structural parts (2 %).
_BEARING_DAMPING_RATIO = 0.02

#: Steps of the static solution and its tolerance relative to the load.
_STATIC_ITERATIONS, _STATIC_TOLERANCE = 100, 1e-13

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Block:
    """Coordinates that move together, their linear part and their bushing elements.

    Parameters
    ----------
    names : tuple of str
        Coordinates, length n_q.
    M, C, K : ndarray, shape (n_q, n_q)
        Mass, damping, stiffness with the bushings' linear parts.
    G : ndarray, shape (n_q, 3)
        Generalised forces of torque, ntl_y, ntl_z.
    rows, weights : ndarray, shape (n_elements, n_q), (n_elements,)
        Deflection of each element over the coordinates; how many times its force counts.
    fluid : tuple of float
        k, c, m of the fluid branch; zeros where there is none.
    law : ndarray, shape (5,)
        K3, K5, C3, Kp, Fy.
    preload : ndarray, shape (n_elements,)
        Linear static deflection under gravity [m].
    output : ndarray, shape (6, n_q)
        Sensors over the coordinates.
    user_law : ForceLaw, optional
        A force law that a user adds to every element.
    tables : ndarray, optional
        Packed measured laws in the planes of the bushings; the elements are then starboard and port
        in z, starboard and port in y.
    """

    names: tuple[str, ...]
    M: Array
    C: Array
    K: Array
    G: Array
    rows: Array
    weights: Array
    fluid: tuple[float, float, float]
    law: Array
    preload: Array
    output: Array
    user_law: ForceLaw | None = None
    tables: Array | None = None

    @property
    def is_linear(self) -> bool:
        """Whether no element has a force beside its linear part."""
        K3, K5, C3, Kp, Fy = self.law
        is_plain = self.user_law is None and self.tables is None
        return is_plain and bool(K3 == K5 == C3 == 0.0 and (Kp == 0.0 or Fy == 0.0))

    @property
    def needs_rates(self) -> bool:
        """Whether a nonlinear force depends on the rate of the deflection."""
        has_tables = self.tables is not None
        return has_tables or self.user_law is not None or bool(self.law[2] > 0.0)

    def state_matrices(self) -> tuple[Array, Array, Array]:
        """A, B, N of ``ẋ = A x + B loads + N phi``.

        States ``q, q̇, u_m`` and, with a fluid mass, ``u̇_m``.
        """
        n_q, n_e = len(self.names), len(self.weights)
        k, c, m = self.fluid
        branches = (n_e if m == 0.0 else 2 * n_e) if k > 0.0 and c > 0.0 else 0
        n = 2 * n_q + branches
        A = np.zeros((n, n))
        B = np.zeros((n, 3))
        N = np.zeros((n, n_e))
        v = slice(n_q, 2 * n_q)
        u_m = slice(2 * n_q, 2 * n_q + n_e)
        v_m = slice(2 * n_q + n_e, n)
        inverse = np.linalg.inv(self.M)
        push = -inverse @ (self.rows.T * self.weights)
        A[:n_q, v] = np.eye(n_q)
        A[v, :n_q], A[v, v] = -inverse @ self.K, -inverse @ self.C
        B[v], N[v] = inverse @ self.G, push
        if branches == n_e:
            # Spring and damper in series: both carry k u_m, so u̇_m = u̇ - (k / c) u_m.
            A[u_m, v] = self.rows
            A[u_m, u_m] = -np.eye(n_e) * k / c
            A[v, u_m] = push * k
        elif branches:
            # Equation (6) with the sign of c put right; F_fl = c (u̇ - u̇_m), equation (5).
            A[u_m, v_m] = np.eye(n_e)
            A[v_m, u_m] = -np.eye(n_e) * k / m
            A[v_m, v_m] = -np.eye(n_e) * c / m
            A[v_m, v] = self.rows * c / m
            A[v, v] += c * push @ self.rows
            A[v, v_m] = -c * push
        return A, B, N

    def static_solution(self, loads: Array) -> tuple[Array, Array]:
        """Coordinates at rest under `loads` and the elasto-plastic forces of a first loading.

        Returns
        -------
        q, F_ep : ndarray, shape (n_q,), (n_elements,)
            Coordinates beside the linear deflection under gravity; forces [N].

        Raises
        ------
        ArithmeticError
            Where Newton's method does not reach the equilibrium.
        """
        _, _, _, Kp, Fy = self.law
        force, q = self.G @ loads, np.zeros(len(self.names))
        scale = np.abs(force) + np.abs(self.K).max() * 1e-9
        for _ in range(_STATIC_ITERATIONS):
            u = self.preload + self.rows @ q
            friction = np.array(
                [elasto_plastic_force.py_func(0.0, deflection, Kp, Fy) for deflection in u]
            )
            phi = self.force_at_rest(u) + friction
            residual = force - self.K @ q - self.rows.T @ (self.weights * phi)
            if (np.abs(residual) <= _STATIC_TOLERANCE * scale.max()).all():
                return q, friction
            sticks = np.diag(np.where(np.abs(friction) < Fy, Kp, 0.0))
            tangent = self.K + self._of_elements(self._slopes_at_rest(u)[0] + sticks)
            try:
                step = np.linalg.solve(tangent, residual)
            except np.linalg.LinAlgError:  # In free play no spring acts: the linear one leads out.
                step = np.linalg.solve(self.K, residual)
            q = q + step
        raise ArithmeticError(
            f"no static equilibrium under torque, ntl_y, ntl_z = {loads}; residual {residual}"
        )

    def tangent_stiffness(self, loads: Array) -> Array:
        """Stiffness at rest under `loads` [N/m, N m/rad]; nothing slips or relaxes."""
        _, _, _, Kp, Fy = self.law
        u = self.preload + self.rows @ self.static_solution(loads)[0]
        at_rest = np.eye(len(u)) * (Kp if Fy > 0.0 else 0.0)
        if self.tables is not None:
            at_rest = at_rest + np.diag(np.tile(springs_of(self.tables), len(u) // 2))
        return self.K + self._of_elements(self._slopes_at_rest(u)[0] + at_rest)

    def tangent_damping(self, loads: Array) -> Array:
        """Damping of small motions about the rest under `loads` [N s/m, N m s/rad]."""
        u = self.preload + self.rows @ self.static_solution(loads)[0]
        return self.C + self._of_elements(self._slopes_at_rest(u)[1])

    def _of_elements(self, slopes: Array) -> Array:
        """Matrix over the coordinates of one over the elements, shape (n_q, n_q)."""
        return np.asarray((self.rows.T * self.weights) @ slopes @ self.rows)

    def force_at_rest(self, u: Array) -> Array:
        """Nonlinear forces without memory [N] at deflections `u` [m], zero rate, (n_elements,)."""
        force = hardening_force.py_func(u, self.law[0], self.law[1])
        if self.user_law is not None:
            force = force + self.user_law.at_rest(u)
        if self.tables is not None:
            across = np.roll(u, len(u) // 2)
            pairs = enumerate(zip(u.tolist(), across.tolist(), strict=True))
            forces = [bushing_force(self.tables, e % 2, *pair, 0.0, 0.0) for e, pair in pairs]
            force = force + np.array(forces)
        return force

    def _slopes_at_rest(self, u: Array) -> tuple[Array, Array]:
        """Derivatives of these forces by deflections [N/m] and rates [N s/m].

        Each has the shape (n_elements, n_elements).
        """
        stiffness = np.diag(hardening_stiffness.py_func(u, self.law[0], self.law[1]))
        damping = np.diag(self.law[2] * u**2)
        if self.user_law is not None:
            over_u, over_rate = self.user_law.slopes_at_rest(u)
            stiffness = stiffness + np.diag(over_u)
            damping = damping + np.diag(over_rate)
        if self.tables is not None:
            half = len(u) // 2
            added = np.zeros((2, *stiffness.shape))
            for e in range(len(u)):
                other = (e + half) % len(u)
                slopes = bushing_slopes(self.tables, e % 2, u[e], u[other], 0.0, 0.0)
                added[:, e, e] = slopes[0], slopes[2]
                added[:, e, other] = slopes[1], slopes[3]
            stiffness = stiffness + added[0]
            damping = damping + added[1]
        return stiffness, damping


def mounting_blocks(
    rig: MountingRig, parameters: ParameterArray, user_law: ForceLaw | None = None
) -> tuple[Block, Block]:
    """Vertical (roll, pitch, bearing in z) and horizontal (yaw, bearing in y, housing in x) block.

    Parameters
    ----------
    rig : MountingRig
        Geometry and masses.
    parameters : ndarray
        Flat parameter set.
    user_law : ForceLaw, optional
        Force that a user adds to the radial force of both bushings, in y and in z.

    Returns
    -------
    tuple of Block
        Vertical, horizontal.
    """
    vertical, horizontal = _blocks_without_law(rig, np.asarray(parameters, np.float64).tobytes())
    if user_law is None:
        return vertical, horizontal
    return replace(vertical, user_law=user_law), replace(horizontal, user_law=user_law)


@lru_cache(maxsize=64)
def _blocks_without_law(rig: MountingRig, parameters: bytes) -> tuple[Block, Block]:
    """Blocks of a parameter set, which are the same for every record of a campaign."""
    p = np.frombuffer(parameters)
    return _vertical(rig, p), _horizontal(rig, p)


def _masses(rig: MountingRig) -> tuple[float, float, float]:
    """Total mass, its first and its second moment about the main bearing."""
    arms = np.array(
        [
            rig.housing_cg_x + rig.main_bearing_x,
            rig.shaft_cg_x + rig.main_bearing_x,
            -rig.coupling_arm,
        ]
    )
    masses = np.array([rig.housing_mass, rig.shaft_mass, rig.coupling_mass])
    return float(masses.sum()), float(masses @ arms), float(masses @ arms**2)


def _vertical(rig: MountingRig, p: ParameterArray) -> Block:
    total, first, second = _masses(rig)
    L, angle = rig.main_bearing_x, p[INDEX["ntl_angle"]]
    M = np.array(
        [
            [rig.housing_inertia[0], 0, 0],
            [0, rig.housing_inertia[1] + second, -first],
            [0, -first, total],
        ]
    )
    rows = np.array([[rig.R_x, -L, 1.0], [-rig.R_x, -L, 1.0]])
    excess = p[INDEX["starboard_excess"]]
    lift = np.array([0.0, np.sin(angle), np.cos(angle)])  # F_z of a radial load turned about x
    share = 1.0 - 1.0 / rig.gear_ratio
    roll = share * np.array([1.0, 0.0, p[INDEX["P_T"]]])
    G = np.array([roll, rig.coupling_arm * lift, lift])
    to_motion = np.zeros((6, 3))
    to_motion[2] = [0.0, -L, 1.0]
    to_motion[3, 0] = 1.0
    to_motion[4, 1] = 1.0
    weight = p[INDEX["gravity"]] * np.array([0.0, first, -total])
    return _block(
        rig,
        p,
        names=("theta_x", "theta_y", "b_z"),
        masses=(M, total),
        bushings=(rows, np.array([1.0 + excess, 1.0 - excess])),
        axial=(np.zeros((0, 3)), np.zeros(0)),
        loads=(G, weight),
        to_motion=to_motion,
    )


def _horizontal(rig: MountingRig, p: ParameterArray) -> Block:
    total, first, second = _masses(rig)
    L, angle = rig.main_bearing_x, p[INDEX["ntl_angle"]]
    M = np.array(
        [[rig.housing_inertia[2] + second, first, 0], [first, total, 0], [0, 0, rig.housing_mass]]
    )
    excess = p[INDEX["starboard_excess"]]
    side = np.array([0.0, np.cos(angle), -np.sin(angle)])
    to_motion = np.zeros((6, 3))
    to_motion[0, 2] = 1.0
    to_motion[1] = [L, 1.0, 0.0]
    to_motion[5, 0] = 1.0
    return _block(
        rig,
        p,
        names=("theta_z", "b_y", "d_x"),
        masses=(M, total),
        bushings=(np.array([[L, 1.0, 0.0]]), np.array([2.0])),
        axial=(
            np.array([[-rig.R_x, 0.0, 1.0], [rig.R_x, 0.0, 1.0]]),
            np.array([1.0 + excess, 1.0 - excess]),
        ),
        loads=(np.array([-rig.coupling_arm * side, side, np.zeros(3)]), np.zeros(3)),
        to_motion=to_motion,
    )


def _block(
    rig: MountingRig,
    p: ParameterArray,
    *,
    names: tuple[str, ...],
    masses: tuple[Array, float],
    bushings: tuple[Array, Array],
    axial: tuple[Array, Array],
    loads: tuple[Array, Array],
    to_motion: Array,
) -> Block:
    """Assemble a block over the coordinates that this rig and parameter set leave free."""
    compliance = p[INDEX["main_bearing_compliance"]]
    free = [i for i, name in enumerate(names) if _is_free(name, rig, compliance)]
    M, total = masses
    rows, weights = bushings
    axial_rows, axial_weights = axial
    K = (
        p[INDEX["K1"]] * (rows.T * weights) @ rows
        + p[INDEX["k_x"]] * (axial_rows.T * axial_weights) @ axial_rows
    )
    C = (
        p[INDEX["C1"]] * (rows.T * weights) @ rows
        + p[INDEX["c_x"]] * (axial_rows.T * axial_weights) @ axial_rows
    )
    for i, name in enumerate(names):
        if name in ("b_y", "b_z") and compliance > 0.0:
            K[i, i] += 1.0 / compliance
            C[i, i] += 2.0 * _BEARING_DAMPING_RATIO * np.sqrt(total / compliance)
    K = K[np.ix_(free, free)]
    G, weight = loads
    rows = np.ascontiguousarray(rows[:, free])
    return Block(
        names=tuple(names[i] for i in free),
        M=M[np.ix_(free, free)],
        C=C[np.ix_(free, free)],
        K=K,
        G=G[free],
        rows=rows,
        weights=weights,
        fluid=(p[INDEX["k"]], p[INDEX["c"]], p[INDEX["m"]]),
        law=np.array([p[INDEX[name]] for name in ("K3", "K5", "C3", "Kp", "Fy")]),
        preload=rows @ np.linalg.solve(K, weight[free]) if weight.any() else np.zeros(len(rows)),
        output=np.ascontiguousarray(rig.sensor_matrix @ to_motion[:, free]),
    )


def _is_free(name: str, rig: MountingRig, compliance: float) -> bool:
    if name in ("b_y", "b_z"):
        return compliance > 0.0
    return name != "d_x" or rig.axial_motion

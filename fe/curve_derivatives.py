"""Deflection curves of a body with dihedral symmetry, and their derivatives, from its half sector.

The shaft face is held node by node. In every block of :mod:`carrierflex.fe.symmetry_blocks`

    K z = f,   K z' = f' - K' z,

with ``f = Gᵀ X_kᵀ F`` of the load F at the pilots and the coordinates X_k of partner k: one
factorisation a block serves the curves and their derivatives by all parameters. Of the motion g of
the group, the block's displacement on the half sector is that of the partners' mixture ``Σ_k
D_kj(g) z_k``; a sensor on image g reads it there.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.carrier_curves import (
    UNIT_PIN_FORCE,
    UNIT_TORQUE,
    flexible_cases,
    sensor_curve,
    stiff_cases,
)
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.factorisation import Factorisation, factorise
from carrierflex.fe.half_sector_derivatives import HalfSectorDerivative
from carrierflex.fe.half_sector_sensors import HalfSectorSensors, half_sector_sensors
from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.structural_model import (
    carrier_pilot_points,
    flexible_carrier_pilots,
    stiff_carrier_pilots,
)
from carrierflex.fe.symmetry_blocks import HalfSector, SymmetryBlock, half_sector, symmetry_block
from carrierflex.geometry.carrier_interface import CarrierInterface
from carrierflex.geometry.dihedral_group import dihedral_group
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData
from carrierflex.geometry.tet_mesh import TetMesh

#: Load cases of the two curves of a variant.
_CASES = ("both", "pin_1")


@dataclass(frozen=True, eq=False)
class _ClampedBlock:
    block: SymmetryBlock
    factor: Factorisation

    @property
    def partners(self) -> list[sp.csr_array]:
        """``T_j`` of every partner."""
        T, d = self.block.T, self.block.representation.dimension
        n = T.shape[0] // d
        return [T[j * n : (j + 1) * n] for j in range(d)]

    def forces(self, G: sp.csr_array, loads: NDArray[np.float64]) -> NDArray[np.float64]:
        """``Gᵀ X_kᵀ F`` of loads (6 p, c), shape (d, n, c)."""
        return np.stack([G.T @ (X.T @ loads) for X in self.block.pilot_coordinates])

    def solved(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Unknowns (d, n, c) under forces of the same shape."""
        d, n, c = f.shape
        right = np.ascontiguousarray(f.transpose(1, 0, 2)).reshape(n, d * c)
        return np.asarray(self.factor.solve(right)).reshape(n, d, c).transpose(1, 0, 2)

    def coupling_derivative(self, dG_half: sp.csr_array) -> sp.csr_array:
        """Of the block's G from the half sector's share of it."""
        X = self.block.pilot_coordinates
        terms = [
            sp.csr_array(X_j.T) @ dG_half @ T_j for X_j, T_j in zip(X, self.partners, strict=True)
        ]
        return sp.csr_array(
            np.sqrt(1.0 / self.block.representation.share) * sum(terms[1:], terms[0])
        )

    def stiffness_forces(self, dK: sp.bsr_array, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """``K' z = Σ_i T_iᵀ dK T_i z`` of unknowns (d, n, c)."""
        d, n, c = z.shape
        columns = z.transpose(1, 0, 2).reshape(n, d * c)
        total = sum(T_i.T @ (dK @ (T_i @ columns)) for T_i in self.partners)
        return np.asarray(total).reshape(n, d, c).transpose(1, 0, 2)


@dataclass(frozen=True, eq=False)
class ClampedHalfSector:
    """A body held at its shaft face, factorised once.

    Parameters
    ----------
    half : HalfSector
        Its half sector.
    sensors : HalfSectorSensors
        Rows that read the curves.
    blocks : tuple
        The blocks of its symmetry with their factors; :func:`clamped_half_sector` makes them.
    """

    half: HalfSector
    sensors: HalfSectorSensors
    blocks: tuple[_ClampedBlock, ...]

    def statics(self, loads: NDArray[np.float64]) -> "HalfSectorStatics":
        """Displacement under loads (6 p, c) at the pilots [N, N m]."""
        z = [block.solved(block.forces(block.block.G, loads)) for block in self.blocks]
        return HalfSectorStatics(self, loads, tuple(z))

    def readings(self, z: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Sensors' readings (n_sensors, c) of the blocks' unknowns (d, n, c) [m]."""
        images, rows = self.sensors.images, self.sensors.rows
        read = np.zeros((len(images), z[0].shape[2]))
        for number in np.unique(images):
            u = 0.0
            for solved_block, z_block in zip(self.blocks, z, strict=True):
                kind = solved_block.block.representation
                turned = np.einsum("kj,knc->jnc", kind.matrices[number], z_block)
                fields = (T_j @ z_j for T_j, z_j in zip(solved_block.partners, turned, strict=True))
                u = u + np.sqrt(kind.share) * sum(fields)
            on_image = images == number
            read[on_image] = rows[on_image] @ u
        return read


@dataclass(frozen=True, eq=False)
class HalfSectorStatics:
    """Displacement under c loads, and its derivatives.

    Parameters
    ----------
    body : ClampedHalfSector
        The held body.
    loads : ndarray, shape (6 p, c)
        At the pilots [N, N m].
    z : tuple of ndarray, shape (d, n, c)
        Unknowns of every block.
    """

    body: ClampedHalfSector
    loads: NDArray[np.float64]
    z: tuple[NDArray[np.float64], ...]

    @property
    def readings(self) -> NDArray[np.float64]:
        """Readings of the sensors, shape (n_sensors, c) [m]."""
        return self.body.readings(self.z)

    @property
    def compliance(self) -> NDArray[np.float64]:
        """Motion along each load under every other, ``C = Fᵀ G K⁻¹ Gᵀ F``, shape (c, c)."""
        blocks = zip(self.body.blocks, self.z, strict=True)
        return np.sum(
            [
                _work(solved_block.forces(solved_block.block.G, self.loads), z)
                for solved_block, z in blocks
            ],
            axis=0,
        )

    def compliance_derivative(self, of: HalfSectorDerivative) -> NDArray[np.float64]:
        """``C' = f'ᵀ z + zᵀ f' - zᵀ K' z`` by one parameter, under the same loads, (c, c)."""
        dG_half = of.of_couplings(self.body.half)
        total = np.zeros((self.loads.shape[1],) * 2)
        for solved_block, z in zip(self.body.blocks, self.z, strict=True):
            by_couplings = _work(
                solved_block.forces(solved_block.coupling_derivative(dG_half), self.loads), z
            )
            total += (
                by_couplings + by_couplings.T - _work(z, solved_block.stiffness_forces(of.dK, z))
            )
        return total

    def forces(
        self, of: HalfSectorDerivative, d_loads: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], ...]:
        """``f' - K' z`` of every block by one parameter, each of the shape (d, n, c).

        Parameters
        ----------
        of : HalfSectorDerivative
            Derivative of the half sector.
        d_loads : ndarray, shape (6 p, c)
            Of the loads [N, N m per unit].
        """
        dG_half = of.of_couplings(self.body.half)
        right = []
        for solved_block, z in zip(self.body.blocks, self.z, strict=True):
            f = solved_block.forces(solved_block.coupling_derivative(dG_half), self.loads)
            f += solved_block.forces(solved_block.block.G, d_loads)
            right.append(f - solved_block.stiffness_forces(of.dK, z))
        return tuple(right)

    def derivatives(self, forces: Sequence[tuple[NDArray[np.float64], ...]]) -> NDArray[np.float64]:
        """Derivatives of the readings by k parameters, shape (k, n_sensors, c) [m per unit].

        `forces` are those of :meth:`forces`: all are solved for at once.

        Notes
        -----
        The rows that read the sensors do not change: the nodes of the sensor circle keep their
        angles (:func:`carrierflex.geometry.shape_velocity.parametric_motion`).
        """
        dz = [
            solved_block.solved(np.concatenate(of_block, axis=2))
            for solved_block, of_block in zip(
                self.body.blocks, zip(*forces, strict=True), strict=True
            )
        ]
        read = self.body.readings(dz)
        return read.reshape(len(read), len(forces), -1).transpose(1, 0, 2)


def _work(f: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Work of every force (d, n, c) along every motion (d, n, e), shape (c, e)."""
    return np.einsum("dnc,dne->ce", f, z, optimize=True)


def clamped_half_sector(
    half: HalfSector, sensors: HalfSectorSensors, shaft_face: NDArray[np.int64]
) -> ClampedHalfSector:
    """Hold a body at its shaft face and factorise its blocks.

    Parameters
    ----------
    half : HalfSector
        Its half sector.
    sensors : HalfSectorSensors
        Rows that read the curves.
    shaft_face : ndarray of int
        Nodes of the half sector that are held in all directions.

    Raises
    ------
    SingularMatrixError
        Where they do not hold the body.
    """
    displacement = np.zeros(half.structure.n_dofs)
    displacement[dofs_of(np.unique(shaft_face)).ravel()] = 1.0
    blocks = []
    for kind in half.group.representations:
        block = symmetry_block(half, kind)
        fixed = np.flatnonzero(abs(block.T).T @ np.tile(displacement, kind.dimension) > 0.0)
        blocks.append(_ClampedBlock(block, factorise(block.K, fixed=fixed)))
    return ClampedHalfSector(half, sensors, tuple(blocks))


def half_sector_structure(
    half: TetMesh, stage: StageParameters, *, materials: Mapping[str, Material] = BODY_MATERIALS
) -> tuple[HalfSector, HalfSectorSensors]:
    """Finite elements and sensors of a variant of the parametric carrier.

    Parameters
    ----------
    half : TetMesh
        Half sector of :mod:`carrierflex.geometry.carrier_mesh`, with pins (stiff) or without.
    stage : StageParameters
        Its dimensions.
    materials : mapping of str to Material
        Material of every body of the mesh.

    Raises
    ------
    ValueError
        Where the mesh does not belong to the dimensions.
    """
    pins, n = "pins" in half.bodies, stage.carrier.n_planets
    names = stiff_carrier_pilots(n) if pins else flexible_carrier_pilots(n)
    points = carrier_pilot_points(stage.carrier)
    body = half_sector(
        "stiff_carrier" if pins else "flexible_carrier",
        half,
        {name: points[name] for name in names},
        dihedral_group(n),
        materials=materials,
    )
    return body, half_sector_sensors(half, stage.carrier.sensor_radius, n)


def clamped_carrier(
    half: TetMesh, stage: StageParameters, *, materials: Mapping[str, Material] = BODY_MATERIALS
) -> ClampedHalfSector:
    """A variant of the parametric carrier, held at its shaft face.

    Parameters as of :func:`half_sector_structure`.

    Raises
    ------
    ValueError, SingularMatrixError
        Where the mesh does not belong to the dimensions, or is not one piece.
    """
    body, sensors = half_sector_structure(half, stage, materials=materials)
    return clamped_half_sector(body, sensors, half.surface("shaft_face"))


def unit_loads(
    pilots: Iterable[str], carrier: CarrierParameters | CarrierInterface, gear: GearData
) -> NDArray[np.float64]:
    """Loads of 1 kN m of torque and of 1 N on pin 1, pilot by pilot, shape (6 p, 2) [N, N m]."""
    names = tuple(pilots)
    cases = (
        stiff_cases(gear, carrier.n_planets) if is_stiff(names) else flexible_cases(carrier, gear)
    )
    none = np.zeros(6)
    columns = [np.concatenate([cases[case].get(name, none) for name in names]) for case in _CASES]
    return np.stack(columns, axis=1)


def is_stiff(pilots: Iterable[str]) -> bool:
    """Whether pilots are those of a carrier with bonded pins."""
    return any("midspan" in name for name in pilots)


def curves_of_readings(
    suffix: str, readings: NDArray[np.float64], radius: float
) -> dict[str, DeflectionCurve]:
    """Curves ``delta_<suffix>`` and ``g_<suffix>`` of the readings (n_sensors, 2) of both loads."""
    units = {f"delta_{suffix}": UNIT_TORQUE, f"g_{suffix}": UNIT_PIN_FORCE}
    return {
        name: sensor_curve(name, column, unit, radius)
        for (name, unit), column in zip(units.items(), readings.T, strict=True)
    }


def clamped_curves(
    clamped: ClampedHalfSector, stage: StageParameters
) -> dict[str, DeflectionCurve]:
    """The two curves of a held variant, ``delta_f`` and ``g_f`` or ``delta_s`` and ``g_s``.

    `stage` are its dimensions and gear.
    """
    pilots = tuple(clamped.half.pilots)
    loads = unit_loads(pilots, stage.carrier, stage.gear)
    suffix = "s" if is_stiff(pilots) else "f"
    return curves_of_readings(suffix, clamped.statics(loads).readings, stage.carrier.sensor_radius)


def half_sector_curves(
    half: TetMesh, stage: StageParameters, *, materials: Mapping[str, Material] = BODY_MATERIALS
) -> dict[str, DeflectionCurve]:
    """The two curves of a variant, ``delta_f`` and ``g_f`` or ``delta_s`` and ``g_s``.

    Those of :func:`carrierflex.fe.carrier_curves.carrier_deflection` at a fraction of its work.
    Parameters and errors as in :func:`clamped_carrier`.
    """
    return clamped_curves(clamped_carrier(half, stage, materials=materials), stage)

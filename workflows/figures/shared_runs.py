"""Runs that several figures are drawn from, each made once and only when a figure asks for it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from carrierflex.fe.carrier_curves import named_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.craig_bampton import Reduction, craig_bampton
from carrierflex.reduction.pin_joints import PAPER_STIFFNESS, carrier_with_pins
from carrierflex.simulation.stage.stage_body import (
    ShaftData,
    StageBody,
    beam_shaft,
    joined_to_shaft,
)
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.torque_sweep import StageSweeps, stage_sweeps
from carrierflex.workflows.fe.bodies import body_structure
from carrierflex.workflows.fe.carrier_variants import (
    CarrierVariant,
    flexible_variant,
    stiff_variant,
)
from carrierflex.workflows.figures.mounting_records import MountingRecords, mounting_records
from carrierflex.workflows.figures.stage_records import StageRecords, stage_records

#: Fixed-interface modes kept of carrier, pin and main shaft.
_N_MODES = {"carrier": 20, "pin": 4, "main_shaft": 10}
#: Torque up to which figure 11 of the 2011 paper is drawn: its axis ends at 8 mrad, and the gearbox
#: has 27 MN m/rad [N m].
_SWEEP = 27e6 * 8e-3


@dataclass(frozen=True, eq=False)
class BodyReduction:
    """Mesh of a body and its reduction."""

    mesh: TetMesh
    reduction: Reduction


@dataclass(frozen=True, eq=False)
class SharedRuns:
    """What the figures are drawn from."""

    size: Annotated[float, "Element edge length [m]"]
    duration: Annotated[float, "Length of the stage's runs [s]"]
    evaluations: Annotated[int, "Simulations that a search by the complex method may take"]

    @cached_property
    def parameters(self) -> StageParameters:
        """Default dimensions."""
        return read_parameters(None)

    @cached_property
    def flexible(self) -> CarrierVariant:
        """Carrier without pins under the unit load cases."""
        return flexible_variant(self.parameters, self.size)

    @cached_property
    def stiff(self) -> CarrierVariant:
        """Carrier with bonded pins under the unit load cases."""
        return stiff_variant(self.parameters, self.size)

    @cached_property
    def curves(self) -> dict[str, DeflectionCurve]:
        """Deflection curves of both carriers."""
        return named_curves(self.stiff.deflection, self.flexible.deflection)

    @cached_property
    def bodies(self) -> dict[str, BodyReduction]:
        """Reduced carrier without pins, pin and main shaft."""
        carrier = self.flexible
        reduced = {
            "carrier": BodyReduction(
                carrier.mesh, craig_bampton(carrier.structure, _N_MODES["carrier"])
            )
        }
        for name in ("pin", "main_shaft"):
            mesh, structure = body_structure(name, self.parameters, self.size)
            reduced[name] = BodyReduction(mesh, craig_bampton(structure, _N_MODES[name]))
        return reduced

    def stage_body(self, pin_fit: float, main_shaft: str = "beam") -> StageBody:
        """Elastic body of the stage with a pin fit [N m/rad]; the shaft as in a stage case."""
        carrier = carrier_with_pins(
            self.bodies["carrier"].reduction.model, self.bodies["pin"].reduction.model, pin_fit
        )
        if main_shaft == "finite_elements":
            return joined_to_shaft(carrier, self.bodies["main_shaft"].reduction.model)
        return joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))

    @cached_property
    def stage(self) -> StageRecords:
        """LC1 to LC4 measured and identified, LC2 simulated."""
        return stage_records(self.stage_body, self.curves, self.duration)

    @cached_property
    def torque_sweep(self) -> StageSweeps:
        """Torque over rotation of main shaft and gearbox."""
        model = stage_model(self.stage_body(PAPER_STIFFNESS), speed=0.0)
        return stage_sweeps(model, _SWEEP * np.linspace(0.1, 1.0, 10))

    @cached_property
    def mounting(self) -> MountingRecords:
        """The load history of 2011, measured and identified with three bushing models."""
        return mounting_records(self.evaluations)

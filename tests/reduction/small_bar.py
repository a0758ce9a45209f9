"""A bar with a pilot on each end, small enough for dense linear algebra."""

import numpy as np

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness
from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.materials import STEEL
from carrierflex.fe.structural_model import StructuralModel
from tests.fe.box_meshes import box_mesh

LENGTH = 0.3


def bar(cells=(4, 1, 1), name="bar", offset=0.0):
    """Steel bar of 30 x 50 mm from x = offset, pilots ``<name>_start`` and ``<name>_end`` at the middle of its ends."""
    mesh = box_mesh((LENGTH, 0.03, 0.05), cells)
    mesh.points[:] += [offset, -0.015, -0.025]
    pilots = []
    for end, x in (("start", offset), ("end", offset + LENGTH)):
        pilot = distributing_pilot(mesh, end, np.array([x, 0.0, 0.0]))
        pilots.append(type(pilot)(f"{name}_{end}", pilot.point, pilot.G))
    materials = {"carrier": STEEL}
    K, M = assemble_stiffness(mesh, materials), assemble_mass(mesh, materials)
    return StructuralModel(name, K, M, mesh.points, tuple(pilots))

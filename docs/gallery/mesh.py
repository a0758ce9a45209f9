"""Carrier without pins: quadratic tetrahedra, 60 mm.

Command: mesh, carrier
"""

import sys
from pathlib import Path

from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.view import mesh_picture
from carrierflex.workflows.outputs import save_image

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

mesh = flexible_carrier_mesh(CarrierParameters(), size=0.06)
save_image(picture, mesh_picture(mesh, f"{len(mesh.tets)} quadratic tetrahedra"))

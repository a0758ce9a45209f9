"""Jobs of CalculiX whose matrices several tests read."""

import subprocess

import pytest

from carrierflex.fe.materials import STEEL
from tests.fe.box_meshes import box_mesh
from tests.independent_codes.calculix import run_calculix

STORE_MATRICES = ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP"]
SUBSTRUCTURE = """*NODE, NSET=ALL
1,0,0,0
2,1,0,0
3,1,1,0
4,0,1,0
5,0,0,1
6,1,0,1
7,1,1,1
8,0,1,1
*ELEMENT,TYPE=C3D8,ELSET=E
1,1,2,3,4,5,6,7,8
*MATERIAL,NAME=M
*ELASTIC
2.1e11,.3
*DENSITY
7850.
*SOLID SECTION,ELSET=E,MATERIAL=M
*STEP
*SUBSTRUCTURE GENERATE
*RETAINED NODAL DOFS
5,1,3
6,1,3
7,1,3
*SUBSTRUCTURE MATRIX OUTPUT,STIFFNESS=YES,OUTPUT FILE=USER DEFINED,FILE NAME=sub
*END STEP
"""


@pytest.fixture(scope="session")
def steel_bar():
    """Steel bar of 0.3 m, surfaces start and end."""
    return box_mesh((0.3, 0.03, 0.05), (3, 1, 1))


@pytest.fixture(scope="session")
def calculix_job(tmp_path_factory, steel_bar):
    """Folder with mesh.inp, and job.sti, job.mas and job.dof of the bar by CalculiX."""
    folder = tmp_path_factory.mktemp("ccx")
    run_calculix(folder, steel_bar, {"carrier": STEEL}, STORE_MATRICES)
    return folder


@pytest.fixture(scope="session")
def calculix_substructure(tmp_path_factory):
    """Folder with sub.mtx, the substructure of a brick by CalculiX."""
    folder = tmp_path_factory.mktemp("substructure")
    (folder / "job.inp").write_text(SUBSTRUCTURE)
    subprocess.run(["ccx", "-i", "job"], cwd=folder, check=True, capture_output=True, timeout=60)
    return folder

"""Valid files of other programs' matrices, nodes and interfaces, and who reads them."""

from functools import partial

import numpy as np
import scipy.io
import scipy.sparse as sp

from carrierflex.fe.matrices.interface_files import read_interfaces
from carrierflex.fe.matrices.matrix_files import read_matrix
from carrierflex.fe.matrices.node_files import read_dofs, read_nodes
from carrierflex.files.pyyeti_modules import op4
from tests.fe.matrices.written_formats import abaqus_coordinates, abaqus_input, harwell_boeing

_matrix = partial(read_matrix, quantity="stiffness")
MATRIX_READERS = {
    "dense.op4": _matrix,
    "sparse.op4": _matrix,
    "text.op4": _matrix,
    "k.pch": _matrix,
    "k.rsa": _matrix,
    "input.mtx": _matrix,
    "coordinates.mtx": _matrix,
    "element.mtx": _matrix,
    "market.mtx": _matrix,
    "k.sti": _matrix,
    "k.npz": _matrix,
    "nodes.inp": read_nodes,
    "nodes.bdf": read_nodes,
    "k.dof": read_dofs,
    "k.mapping": read_dofs,
    "interfaces.toml": read_interfaces,
}
_INTERFACES = """format = "carrierflex-interfaces"
version = 1
name = "a"
[units]
length = 0.001
[nodes]
positions = [[1, 0.0, 0.0, 0.0], [2, 1.0, 0.0, 0.0]]
dofs = [[1, "Tx"], [2, "Tx"]]
[[pilots]]
name = "p"
type = "distributing"
nodes = [1, 2]
weights = [1.0, 2.0]
components = ["Tx"]
[[sensors]]
name = "s"
node_set = "ALL"
direction = [1.0, 0.0, 0.0]
"""


def matrix_contents(folder):
    """Content of a valid file of every kind."""
    K = sp.csr_array(4.0 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1))
    dense = {"kaa": K.toarray()}
    op4.write(str(folder / "dense.op4"), dense, sparse="dense")
    op4.write(str(folder / "sparse.op4"), dense, sparse="bigmat")
    op4.write(str(folder / "text.op4"), dense, binary=False)
    harwell_boeing(folder / "k.rsa", K, 17)
    abaqus_input(folder / "input.mtx", K, 3)
    abaqus_coordinates(folder / "coordinates.mtx", K)
    abaqus_coordinates(folder / "k.sti", K)
    scipy.io.mmwrite(folder / "market.mtx", sp.coo_matrix(K), precision=17)
    sp.save_npz(folder / "k.npz", K)
    texts = {
        "k.pch": "DMIG,K,0,6,2,0\nDMIG,K,1,1,,1,1,1.5\n,2,1,-7.00-3\nDMIG,K,2,1,,2,1,9.9D5\n",
        "element.mtx": "*USER ELEMENT,NODES=2,LINEAR\n** ELEMENT NODES\n** 5, 6\n1,2\n2,3\n"
        "*MATRIX,TYPE=STIFFNESS\n1.,\n0.,1.,\n0.,0.,1.\n",
        "nodes.inp": "*NODE, NSET=ALL\n1,0,0,0\n2,1.,0.,0.\n*NSET,NSET=A,GENERATE\n1,2,1\n"
        "*NSET,NSET=B\nA\n*ELEMENT,TYPE=T3D2\n1,1,2\n",
        "nodes.bdf": "GRID,1,,0.,0.,0.\nGRID           2              1.      0.      0.\n",
        "k.dof": "1.1\n1.2\n2.1\n2.2\n",
        "k.mapping": " Matrix Eqn   Node   DOF\n 1 1 UX\n 2 1 UY\n",
        "interfaces.toml": _INTERFACES,
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    return {path.name: path.read_bytes() for path in folder.iterdir()}

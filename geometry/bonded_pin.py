"""A pin taken out of the mesh of a carrier with bonded pins: for carriers without parameters."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.carrier_interface import carrier_interface
from carrierflex.geometry.tet_mesh import TetMesh

#: Bodies and surfaces of a pin.
_BODY, _SURFACES = "pins", ("pin_1_upwind", "pin_1_midspan", "pin_1_downwind")
#: Nodes of a facet seen from its other side.
_OTHER_SIDE = [0, 2, 1, 5, 4, 3]


def bonded_pin(mesh: TetMesh) -> TetMesh:
    """Pin 1 of a carrier with bonded pins, as a body of its own.

    Parameters
    ----------
    mesh : TetMesh
        Carrier with a body ``pins``, in its own frame.

    Returns
    -------
    TetMesh
        Elements of pin 1 alone, body ``pins``; surfaces ``pin_1_upwind`` and ``_downwind``, where
        it is bonded into the bores, and ``_midspan``.

    Raises
    ------
    KeyError, ValueError
        As :func:`carrier_interface`; where the mesh has no body ``pins``.
    """
    if _BODY not in mesh.bodies:
        raise ValueError(
            f"the mesh has no body '{_BODY}', it has {', '.join(mesh.bodies)}; expected a carrier "
            "with bonded pins"
        )
    tets = mesh.tets[mesh.bodies[_BODY]]
    interface = carrier_interface(mesh)
    middle = interface.points["pin_1_midspan"][1:]
    # Half-way to the next pin's axis, or nearer.
    reach = interface.centre_distance * np.sin(np.pi / interface.n_planets)
    distance = np.linalg.norm(mesh.points[tets[:, :4], 1:].mean(axis=1) - middle, axis=1)
    tets = tets[distance < reach]
    nodes = np.unique(tets)
    row = np.full(len(mesh.points), -1, dtype=np.int64)
    row[nodes] = np.arange(len(nodes))

    def seen_from_pin(name: str) -> NDArray[np.int64]:
        facets = row[mesh.surface(name)]
        return facets if name.endswith("midspan") else facets[:, _OTHER_SIDE]

    surfaces = {name: seen_from_pin(name) for name in _SURFACES}
    return TetMesh(mesh.points[nodes], row[tets], surfaces, {_BODY: np.arange(len(tets))})

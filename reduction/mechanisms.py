"""Matrices of other programs may hold mechanisms: refused with the nodes that take part."""

import numpy as np

from carrierflex.fe.factorisation import SingularMatrixError
from carrierflex.fe.matrices.given_structure import GivenBody
from carrierflex.fe.matrices.rigid_freedom import described_mechanism
from carrierflex.reduction.held_structure import Grounded, grounded

#: Share by which the answer to its own forces may differ from a motion; a mechanism is found by
#: rounding alone and differs by as much as the motion.
_SAME_MOTION = 1e-3


def sound_grounding(body: GivenBody) -> Grounded:
    """A body held statically determinately, factorised, where nothing else in it is loose.

    Parameters
    ----------
    body : GivenBody
        The body.

    Raises
    ------
    ValueError
        Where it has a mechanism; the message names nodes.
    """
    grounding = grounded(body.structure)
    try:
        if not _finds_motions_again(body, grounding):
            raise SingularMatrixError
    except SingularMatrixError as error:
        K, R = body.structure.K, grounding.rigid_modes
        raise ValueError(
            f"{body.structure.name}: the stiffness has {described_mechanism(K, R, body.layout)}; "
            "expected a stiffness against every motion but rigid ones"
        ) from error
    return grounding


def _finds_motions_again(body: GivenBody, supported: Grounded) -> bool:
    """Whether the forces of a motion give the motion back, but for a rigid one."""
    K, R = body.structure.K, supported.rigid_modes
    root = np.sqrt(K.diagonal())
    motion = np.random.default_rng(0).standard_normal(len(root)) / root
    again = supported.displacement(K @ motion)
    Q = np.linalg.qr(root[:, None] * R)[0]
    difference = root * (again - motion)
    difference -= Q @ (Q.T @ difference)
    return bool(np.linalg.norm(difference) < _SAME_MOTION * np.sqrt(len(root)))

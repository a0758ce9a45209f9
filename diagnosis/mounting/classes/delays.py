"""Delays of the loads that explain most of the gap, each by one column."""

from collections.abc import Mapping, Sequence

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import IntArray
from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.classes.catalogue import DELAY_WAYS, FORCE_GROUPS
from carrierflex.diagnosis.mounting.classes.forces import ForceGroup
from carrierflex.diagnosis.mounting.classes.maps import DELAYS, delay_columns, signals_of
from carrierflex.diagnosis.mounting.classes.motion import BushingMotion
from carrierflex.diagnosis.mounting.classes.rigid_body import RigidBody

#: Directions of columns, and squares of a column that others leave, below which they are rounding.
_ROUNDING = 1e-10
#: Either sign: loads may be late, or signals.
_CANDIDATES = np.concatenate([DELAYS, -DELAYS])


def nearest_delays(
    body: RigidBody,
    motions: Sequence[BushingMotion],
    groups: Sequence[ForceGroup],
    channels: FloatArray,
    constants: ClassConstants,
) -> dict[str, float]:
    """Delay of every way that leaves least of the gap, alone or beside one force of the bushings.

    Beside a force where that takes half of what the best delay leaves alone: a force that does not
    is not missing, and a delay of another size may serve it.

    A delay that is sought beside stiffness and damping alone takes up what a force makes of them:
    beside a loop of the bushings, which holds the motion back, it gets the wrong size, and both
    together explain half of what they are.

    Parameters
    ----------
    body : RigidBody
        Housing on the fitted linear bushings.
    motions : sequence of BushingMotion
        Runs.
    groups : sequence of ForceGroup
        Forces of the bushings.
    channels : ndarray, shape (m, n_channels)
        Weights of the channels in m sums of unit noise that show every free motion.
    constants : ClassConstants
        How well the noise is known, and the part of what is left that a richer answer must take.

    Returns
    -------
    dict
        Delay [s] by way.
    """
    places: Mapping[str, IntArray] = {}
    gram = np.zeros((0, 0))
    floor = 0.0
    for own in motions:
        rows, places = _rows(body, own, groups, channels)
        products = rows @ rows.T
        gram = gram + products if gram.size else products
        floor += float(len(channels) * np.isfinite(own.gap).all(axis=0).sum())
    shares = Shares(gram[:1, 0], np.array([floor]), constants)
    sets = [(), *FORCE_GROUPS.values()]
    columns = [np.concatenate([places[name] for name in ("base", *own)]) for own in sets]
    found = {}
    for way in DELAY_WAYS:
        alone, *beside = [_left(gram, own, places[way]) for own in columns]
        best = min(beside, key=np.min)
        chosen = best if _takes_half(shares, float(best.min()), float(alone.min())) else alone
        found[way] = float(_CANDIDATES[np.argmin(chosen)])
    return found


def _takes_half(shares: Shares, beside: float, alone: float) -> bool:
    """Whether a force takes so much of what a delay leaves alone that it is missing with it."""
    with_force, without = (HeldOutSquares(np.array([x]), (), ()) for x in (beside, alone))
    return shares.is_clear_gain(with_force, without, 0.0)


def _rows(
    body: RigidBody, own: BushingMotion, groups: Sequence[ForceGroup], channels: FloatArray
) -> tuple[FloatArray, Mapping[str, IntArray]]:
    """Gap, linear bushings, forces alike in both bushings and delays along a run; their places."""
    forces = {"base": np.array([own.u, own.v])}
    forces |= {group.id: group.columns(own) for group in groups}
    rows = {name: signals_of(body, own, body.on_coordinates(u)) for name, u in forces.items()}
    for way in DELAY_WAYS:
        rows[way] = delay_columns(body, own, way, _CANDIDATES)
    first = 1
    places = {}
    for name, values in rows.items():
        places[name] = np.arange(first, first + len(values))
        first += len(values)
    signals = [np.nan_to_num(own.gap)[None], *rows.values()]
    weighted = np.concatenate([channels @ values for values in signals])
    return weighted.reshape(len(weighted), -1), places


def _left(gram: FloatArray, beside: IntArray, delays: IntArray) -> FloatArray:
    """Square that each delay leaves of the gap beside some columns, shape (n_delays,)."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram)[beside], np.finfo(float).tiny))
    products = gram[np.ix_(beside, beside)] * np.outer(scale, scale)
    inverse = np.linalg.pinv(products, rcond=_ROUNDING, hermitian=True) * np.outer(scale, scale)
    taken = gram[delays][:, beside] @ inverse
    square = np.diag(gram)[delays] - np.sum(taken * gram[delays][:, beside], axis=1)
    product = gram[delays, 0] - taken @ gram[beside, 0]
    left = gram[0, 0] - gram[0, beside] @ inverse @ gram[beside, 0]
    is_new = square > _ROUNDING * np.diag(gram)[delays]
    return np.asarray(left - np.where(is_new, product**2 / np.where(is_new, square, 1.0), 0.0))

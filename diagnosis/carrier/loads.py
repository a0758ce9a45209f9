"""Small figures of a carrier plant.

Typical speed, largest load, bounds, sums of squares by piece.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.identification.campaign.campaign import Campaign

FloatArray = NDArray[np.float64]


def segment_squares(left: FloatArray, gram: FloatArray) -> FloatArray:
    """Sum of squares by piece and channel; a perfect fit leaves rounding of either sign."""
    return np.maximum(np.einsum("pck,pckl,pcl->pc", left, gram, left, optimize=True), 0.0)


def typical_speed(campaign: Campaign) -> float:
    """Typical speed of the carrier [rad/s]."""
    turned = [
        abs(float(run.inputs["carrier_angle"][-1] - run.inputs["carrier_angle"][0]))
        for run in campaign.runs
    ]
    lasted = [float(run.time[-1] - run.time[0]) for run in campaign.runs]
    return max(sum(turned) / max(sum(lasted), np.finfo(float).tiny), np.finfo(float).tiny)


def largest_load(campaign: Campaign) -> float:
    """Largest radial load [N]; 1 where there is none."""
    largest = max(
        float(np.hypot(run.inputs["ntl_y"], run.inputs["ntl_z"]).max()) for run in campaign.runs
    )
    return largest or 1.0


def bounds_of(parameters: Sequence[Parameter]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of parameters."""
    return np.array([own.lower for own in parameters]), np.array([own.upper for own in parameters])


def used_columns(W: FloatArray, D: FloatArray) -> NDArray[np.int64]:
    """Places of the target and of every column with a weight or a derivative anywhere."""
    used = (W != 0.0).any(axis=(0, 1)) | (D != 0.0).any(axis=(0, 1, 2))
    used[0] = True
    return np.flatnonzero(used)

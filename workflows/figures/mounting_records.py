"""The load history of the 2011 paper: a record, and three bushing models identified from it.

The record stands for the measurement. Its bushings are the nonlinear ones of table 3; beside them
it holds what none of the three models knows, so that no fit can be perfect: bushings of unequal
stiffness, a radial load off the vertical, a main bearing that gives way, gains of the sensors.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.estimation.complex_method import ComplexSearch
from carrierflex.identification.mounting.bushing_identification import (
    BushingEstimate,
)
from carrierflex.identification.mounting.bushing_models import (
    HYDRODYNAMIC,
    LINEAR,
    NONLINEAR,
)
from carrierflex.simulation.mounting.inputs import MountingInputs

#: Names in the paper's figures.
LABELS = {NONLINEAR.name: "NLin", LINEAR.name: "Lin", HYDRODYNAMIC.name: "HD-b"}


@dataclass(frozen=True, eq=False)
class MountingRecords:
    """What the figures of the mounting are drawn from.

    Parameters
    ----------
    campaign : Campaign
        The record.
    inputs : MountingInputs
        Its loads.
    measured : ndarray, shape (n, 6)
        Motion of the housing from the sensors, equation 10 [m, rad].
    adapted : mapping of str to ndarray, shape (n, 6)
        Motion of the identified models, by model.
    estimates : mapping of str to BushingEstimate
        By model.
    searches : mapping of str to ComplexSearch
        Complex method on the same objective, by model.
    """

    campaign: Campaign
    inputs: MountingInputs
    measured: NDArray[np.float64]
    adapted: Mapping[str, NDArray[np.float64]]
    estimates: Mapping[str, BushingEstimate]
    searches: Mapping[str, ComplexSearch]

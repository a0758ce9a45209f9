"""Records of the truth as a measurement campaign; its words tell nothing of the truth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import CasePlan
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

#: Relative standard deviation of the gains of drive and channel.
GAIN_STD = 0.01
_QUANTITY = {"force": "displacement", "displacement": "force", "free_decay": "displacement"}
_UNIT = {"displacement": "m", "force": "N"}


@dataclass(frozen=True, eq=False)
class Records:
    """What was measured.

    `drive` as the contract names it, `time` of every run, `inputs` and `signals` by run,
    `noise_std` of the channel, `settle` samples left out at the beginning.
    """

    drive: str
    time: FloatArray
    inputs: Sequence[FloatArray]
    signals: Sequence[FloatArray]
    noise_std: float
    settle: int


def campaign_of(plan: CasePlan, records: Records) -> Campaign:
    """Campaign of a case."""
    quantity = _QUANTITY[records.drive]
    channel = f"measured_{quantity}"
    runs = tuple(
        Run(
            f"run{k + 1}",
            f"run{k + 1}.parquet",
            f"drive {k + 1}",
            records.time,
            {} if records.drive == "free_decay" else {records.drive: values},
            {channel: signal},
        )
        for k, (values, signal) in enumerate(zip(records.inputs, records.signals, strict=True))
    )
    rig = {"drive": records.drive}
    settle = {"settle_samples": records.settle} if records.settle else {}
    declared = () if records.drive == "free_decay" else (records.drive,)
    inputs = tuple(InputSignal(name, _UNIT[name], gain_std=GAIN_STD) for name in declared)
    return Campaign(
        kind="element",
        name=plan.name,
        baseline=Baseline("model"),
        rig={**rig, **settle},
        channels=(
            Channel(
                channel,
                quantity,
                _UNIT[quantity],
                noise_std=records.noise_std,
                gain_std=GAIN_STD,
            ),
        ),
        runs=runs,
        inputs=inputs,
    )

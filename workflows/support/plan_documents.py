"""What plan.json holds, by key."""

from collections.abc import Sequence
from typing import Annotated, Literal, TypedDict

from carrierflex.diagnosis.inference.planning.results import (
    CausePair,
    Costs,
    RankedAddition,
    VisibleSize,
)


class PlanDocument(TypedDict):
    """plan.json, written by plan."""

    format: Annotated[Literal["carrierflex-plan"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    campaign: Annotated[str, "Name of the case or campaign"]
    kind: Annotated[Literal["carrier", "mounting"], "Kind of the campaign"]
    software: Annotated[str, "Name and version of this software"]
    unit: Annotated[str, "Unit of the channels"]
    gap: Annotated[float, "Gap over the noise at which causes are to be told apart"]
    noise_std: Annotated[float, "Root of the mean variance of the noise [unit]"]
    is_measured: Annotated[bool, "Whether records say which amplitudes a cause has"]
    left_wanted: Annotated[float, "RMS that a rival must leave, over the noise"]
    costs: Annotated[Costs, "What additions cost [min]"]
    sizes: Annotated[Sequence[VisibleSize], "Size from which each cause is seen; null is never"]
    pairs: Annotated[Sequence[CausePair], "Every cause with every rival"]
    proposal: Annotated[RankedAddition | None, "First proposal; null where nothing is to be parted"]
    additions: Annotated[Sequence[RankedAddition], "Additions, cheapest sufficient first"]

"""The measurement campaign: what it declares, and its records.

The objects check what the contract says about their content; the files they come from are read and
written in :mod:`carrierflex.identification.campaign.campaign_files`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date
from typing import Any

from carrierflex.files.problems import refuse, repeated_names
from carrierflex.identification.campaign.campaign_kinds import CampaignKind, campaign_kind
from carrierflex.identification.campaign.declarations import (
    Baseline,
    Channel,
    InputSignal,
    baseline_conflicts,
    channel_conflicts,
    column_conflicts,
    expected_columns,
    input_conflicts,
)
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.carrier.effect import Effect


@dataclass(frozen=True, eq=False)
class Campaign:
    """What was measured and what the simulation already contains.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.
    name : str
        Title.
    baseline : Baseline
        The simulation whose gap is to be explained.
    rig : mapping
        Nominal facts of the rig, by the keys of the kind.
    channels : tuple of Channel
        Measured signals.
    runs : tuple of Run
        Records.
    inputs : tuple of InputSignal
        What is declared of input columns: units of a voltage analogue, errors.
    notes : tuple of str
        What the reader left out of the files, for the user.
    turbine : str
        Machine of a fleet that was measured; empty where the campaign does not say.
    recorded : date, optional
        Day of the records.
    causes : tuple of Effect
        Further effects, whose signals the simulator behind the predictions computes.

    Raises
    ------
    ValueError
        Where names repeat, a quantity, unit or effect is unknown, or a run's columns do not match.
    """

    kind: str
    name: str
    baseline: Baseline
    rig: Mapping[str, Any]
    channels: tuple[Channel, ...]
    runs: tuple[Run, ...]
    inputs: tuple[InputSignal, ...] = ()
    notes: tuple[str, ...] = ()
    turbine: str = ""
    recorded: date | None = None
    causes: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        kind = self.contract
        if not self.channels or not self.runs:
            raise ValueError(
                f"{len(self.channels)} channels and {len(self.runs)} runs; expected at least one "
                "of each"
            )
        refuse(f"[baseline]: {conflict}" for conflict in baseline_conflicts(self.baseline, kind))
        refuse(input_conflicts(self.inputs, kind))
        refuse(channel_conflicts(self.channels, kind))
        for what in ("name", "file"):
            refuse(repeated_names([getattr(run, what) for run in self.runs], f"[[runs]] {what}"))
        expected = expected_columns(kind, self.channels, self.baseline)
        for run in self.runs:
            refuse(column_conflicts(["time", *run.columns()], expected, f"run {run.name}"))

    @property
    def contract(self) -> CampaignKind:
        """What this kind of campaign holds."""
        measured = self.runs[0].inputs if self.runs else ()
        names = [*(declared.name for declared in self.inputs), *measured]
        return campaign_kind(self.kind, self.rig, names)

    @property
    def input_units(self) -> dict[str, str]:
        """Units of all inputs, as declared or by the contract."""
        return {**self.contract.inputs, **{signal.name: signal.unit for signal in self.inputs}}

    def input_of(self, name: str) -> InputSignal:
        """What is declared of one input; its unit alone where nothing is."""
        declared = {signal.name: signal for signal in self.inputs}
        return declared.get(name) or InputSignal(name, self.contract.inputs[name])

    def thinned(self, every: int) -> "Campaign":
        """Copy with one sample of every `every` of each run."""
        return replace(self, runs=tuple(run.thinned(every) for run in self.runs))

    def within_use(self) -> "Campaign":
        """Copy whose samples outside the windows that count are missing."""
        return replace(self, runs=tuple(run.within_use() for run in self.runs))

    def channels_of(self, quantity: str) -> tuple[Channel, ...]:
        """Channels that measure one quantity, in the order of the campaign."""
        return tuple(channel for channel in self.channels if channel.quantity == quantity)

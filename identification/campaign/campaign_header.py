"""A campaign without its records: campaign.toml as checked objects."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import date
from typing import Any

from carrierflex.files.problems import refuse
from carrierflex.files.shown_values import shown
from carrierflex.files.toml_files import TomlKind, check_header, checked_document
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_kinds import (
    KIND_NAMES,
    CampaignKind,
    campaign_kind,
)
from carrierflex.identification.campaign.declarations import (
    Baseline,
    Channel,
    InputSignal,
    SimulatedMark,
    input_conflicts,
)
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME
from carrierflex.identification.campaign.records import Run

CAMPAIGN_FILE = TomlKind(
    "a campaign",
    holds="the keys of the campaign format",
    most_bytes=1_000_000,
    format="carrierflex-campaign",
    version=2,
)


@dataclass(frozen=True, eq=False)
class RunEntry:
    """Where a run stands: its name, file, condition, and the windows of time that count [s]."""

    name: str
    file: str
    condition: str
    use: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class CampaignHeader:
    """A campaign without its records.

    Fields as in :class:`carrierflex.identification.campaign.campaign.Campaign`, the version of the
    contract that the file states, and `simulated` where a simulation wrote it.
    """

    contract: CampaignKind
    name: str
    baseline: Baseline
    rig: Mapping[str, Any]
    channels: tuple[Channel, ...]
    runs: tuple[RunEntry, ...]
    inputs: tuple[InputSignal, ...]
    version: int = 1
    simulated: SimulatedMark | None = None
    turbine: str = ""
    recorded: date | None = None

    def with_records(self, runs: Iterable[Run], notes: Iterable[str] = ()) -> Campaign:
        """The campaign of these records."""
        return Campaign(
            kind=self.contract.name,
            name=self.name,
            baseline=self.baseline,
            rig=self.rig,
            channels=self.channels,
            runs=tuple(runs),
            inputs=self.inputs,
            notes=tuple(notes),
            turbine=self.turbine,
            recorded=self.recorded,
        )


def campaign_header(
    document: Mapping[str, Any],
    where: str = DOCUMENT_NAME,
    measured: Iterable[str] = (),
) -> CampaignHeader:
    """Check a parsed campaign.toml.

    Parameters
    ----------
    document : mapping
        The TOML document.
    where : str
        File name, for the message.
    measured : iterable of str
        Columns of the first run file: they tell which motion of a base was measured.

    Returns
    -------
    CampaignHeader
        Its content, angles in radians.

    Raises
    ------
    ValueError
        Where format, version, a key or a value is not as the contract says; one line that names the
        key.
    """
    check_header(document, CAMPAIGN_FILE, where)
    kind_name = _kind_name(document, where)
    # What checks the tables is loaded for a document that may be one.
    from carrierflex.identification.campaign.campaign_tables import (
        DOCUMENT_OF_KIND,
        baseline_of,
        channels_of,
        inputs_of,
    )

    table = DOCUMENT_OF_KIND[kind_name]
    checked = checked_document(document, table, where, version=document["version"])
    names = [signal.name for signal in checked.inputs]
    kind = campaign_kind(checked.kind, document["rig"], [*names, *measured])
    channels, among_channels = channels_of(checked.channels, kind)
    inputs = (*inputs_of(checked.inputs, kind), *among_channels)
    refuse([f"{where}: {conflict}" for conflict in input_conflicts(inputs, kind)])
    mark = checked.simulated
    return CampaignHeader(
        contract=kind,
        name=checked.name,
        baseline=baseline_of(checked.baseline),
        # As it stands in the file: a whole number stays one.
        rig=dict(document["rig"]),
        channels=channels,
        runs=tuple(
            RunEntry(run.name, run.file, run.condition, tuple(run.use or ()))
            for run in checked.runs
        ),
        inputs=inputs,
        version=checked.version,
        simulated=SimulatedMark(mark.software, mark.sha256) if mark else None,
        turbine=checked.turbine or "",
        recorded=checked.recorded,
    )


def _kind_name(document: Mapping[str, Any], where: str) -> str:
    """Kind of the campaign: it decides which keys the document has."""
    if "kind" not in document:
        raise ValueError(f"{where}: missing key 'kind'; expected one of {', '.join(KIND_NAMES)}")
    kind = document["kind"]
    if not isinstance(kind, str) or kind not in KIND_NAMES:
        raise ValueError(
            f"{where}: key 'kind' is {shown(kind)}; expected one of {', '.join(KIND_NAMES)}"
        )
    return kind

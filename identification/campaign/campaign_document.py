"""The table of contents of a campaign (campaign.toml) as checked objects, and back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from carrierflex.files.shown_values import shown
from carrierflex.files.toml_files import TomlKind, check_header, checked_document
from carrierflex.identification.campaign.campaign import Baseline, Campaign, Channel
from carrierflex.identification.campaign.campaign_kinds import (
    KIND_NAMES,
    CampaignKind,
    campaign_kind,
)
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME
from carrierflex.identification.campaign.simulated_mark import SimulatedMark

CAMPAIGN_FILE = TomlKind(
    "a campaign",
    holds="the keys of the campaign format",
    most_bytes=10_000_000,
    format="carrierflex-campaign",
    version=2,
)


@dataclass(frozen=True, eq=False)
class RunEntry:
    """Where a run stands: its name, file and condition."""

    name: str
    file: str
    condition: str


@dataclass(frozen=True, eq=False)
class CampaignHeader:
    """A campaign without its records.

    Fields as in :class:`carrierflex.identification.campaign.campaign.Campaign`; `simulated` where a
    simulation wrote it.
    """

    contract: CampaignKind
    name: str
    baseline: Baseline
    rig: Mapping[str, Any]
    channels: tuple[Channel, ...]
    runs: tuple[RunEntry, ...]
    input_units: Mapping[str, str]
    simulated: SimulatedMark | None = None


def campaign_header(document: Mapping[str, Any], where: str = DOCUMENT_NAME) -> CampaignHeader:
    """Check a parsed campaign.toml.

    Parameters
    ----------
    document : mapping
        The TOML document.
    where : str
        File name, for the message.

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
    from carrierflex.identification.campaign.campaign_tables import DOCUMENT_OF_KIND, channels_of

    check_header(document, CAMPAIGN_FILE, where)
    checked = checked_document(document, DOCUMENT_OF_KIND[_kind_name(document, where)], where)
    kind = campaign_kind(checked.kind, document["rig"].get("drive"))
    channels, input_units = channels_of(checked.channels, kind)
    return CampaignHeader(
        contract=kind,
        name=checked.name,
        baseline=Baseline(checked.baseline.source, tuple(checked.baseline.effects)),
        # As it stands in the file: a whole number stays one.
        rig=dict(document["rig"]),
        channels=channels,
        runs=tuple(RunEntry(run.name, run.file, run.condition) for run in checked.runs),
        input_units=input_units,
        simulated=checked.simulated
        and SimulatedMark(checked.simulated.software, checked.simulated.sha256),
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


def campaign_document(campaign: Campaign) -> dict[str, Any]:
    """Content of the campaign.toml of a campaign, ready for a TOML writer."""
    channels = [_channel_table(channel) for channel in campaign.channels]
    for name, unit in campaign.input_units.items():
        channels.append({"name": name, "quantity": name, "unit": unit})
    return {
        "format": CAMPAIGN_FILE.format,
        "version": 1,
        "kind": campaign.kind,
        "name": campaign.name,
        "baseline": {
            "source": campaign.baseline.source,
            "effects": list(campaign.baseline.effects),
        },
        "rig": dict(campaign.rig),
        "channels": channels,
        "runs": [
            {"name": run.name, "file": run.file, "condition": run.condition}
            for run in campaign.runs
        ],
    }


def _channel_table(channel: Channel) -> dict[str, Any]:
    optional = {
        # Twelve decimals of a degree hide the rounding of the way there and back.
        "angle_deg": None if channel.angle is None else round(float(np.rad2deg(channel.angle)), 12),
        "radius_m": channel.radius,
        "sensor": channel.sensor,
        "noise_std": channel.noise_std,
    }
    table: dict[str, Any] = {
        "name": channel.name,
        "quantity": channel.quantity,
        "unit": channel.unit,
    }
    return {**table, **{key: value for key, value in optional.items() if value is not None}}

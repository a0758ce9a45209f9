"""The table of contents of a campaign (campaign.toml) as checked objects, and back."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from carrierflex.files.problems import refuse
from carrierflex.files.shown_values import shown
from carrierflex.files.toml_files import TomlKind, check_header, checked_document
from carrierflex.identification.campaign.campaign import (
    Baseline,
    Campaign,
    Channel,
    InputSignal,
    input_conflicts,
)
from carrierflex.identification.campaign.campaign_kinds import (
    KIND_NAMES,
    CampaignKind,
    campaign_kind,
)
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.simulated_mark import SimulatedMark

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
    from carrierflex.identification.campaign.campaign_tables import (
        DOCUMENT_OF_KIND,
        baseline_of,
        channels_of,
        inputs_of,
    )

    check_header(document, CAMPAIGN_FILE, where)
    table = DOCUMENT_OF_KIND[_kind_name(document, where)]
    checked = checked_document(document, table, where, version=document["version"])
    names = [own.name for own in checked.inputs]
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
    """Content of the campaign.toml of a campaign, ready for a TOML writer.

    The version is the first that knows all its keys.
    """
    document: dict[str, Any] = {
        "format": CAMPAIGN_FILE.format,
        "version": 1,
        "kind": campaign.kind,
        "name": campaign.name,
        "baseline": _baseline_table(campaign.baseline),
        "rig": dict(campaign.rig),
        "channels": [_channel_table(channel) for channel in campaign.channels],
        "runs": [_run_table(run) for run in campaign.runs],
    }
    if campaign.inputs:
        document["inputs"] = [_signal_table(own) for own in campaign.inputs]
    return {**document, "version": _version(document)}


def _version(document: Mapping[str, Any]) -> int:
    """First version of the contract that knows all keys of a document."""
    from carrierflex.files.toml_refusals import newer_keys_in
    from carrierflex.identification.campaign.campaign_tables import DOCUMENT_OF_KIND

    table = DOCUMENT_OF_KIND[document["kind"]]
    return CAMPAIGN_FILE.version if newer_keys_in(document, table, 1) else 1


def _baseline_table(baseline: Baseline) -> dict[str, Any]:
    table: dict[str, Any] = {"source": baseline.source, "effects": list(baseline.effects)}
    for key, values in (("fixed", baseline.fixed), ("clock_shift", baseline.clock_shift)):
        if values:
            table[key] = {
                name: {"value": known.value, "std": known.std} for name, known in values.items()
            }
    if baseline.impossible:
        table["impossible"] = list(baseline.impossible)
    return table


def _run_table(run: Run) -> dict[str, Any]:
    table: dict[str, Any] = {"name": run.name, "file": run.file, "condition": run.condition}
    if run.use:
        table["use"] = [list(window) for window in run.use]
    return table


def _channel_table(channel: Channel) -> dict[str, Any]:
    facts = {
        "angle_deg": _degrees(channel.angle),
        "radius_m": channel.radius,
        "sensor": channel.sensor,
        "motion": channel.motion,
    }
    table = {"quantity": channel.quantity, **_signal_table(channel)}
    return {**table, **{key: value for key, value in facts.items() if value is not None}}


def _signal_table(signal: Channel | InputSignal) -> dict[str, Any]:
    """Name, unit and declared errors."""
    errors = {
        "noise_std": signal.noise_std,
        "gain_std": signal.gain_std,
        "zero_std": signal.zero_std,
        "delay_std": signal.delay_std,
        "angle_std_deg": _degrees(signal.angle_std),
    }
    table: dict[str, Any] = {"name": signal.name, "unit": signal.unit}
    return {**table, **{key: value for key, value in errors.items() if value is not None}}


def _degrees(angle: float | None) -> float | None:
    # Twelve decimals of a degree hide the rounding of the way there and back.
    return None if angle is None else round(float(np.rad2deg(angle)), 12)

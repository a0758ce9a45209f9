"""The table of contents of a campaign (campaign.toml), made of its objects."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_header import CAMPAIGN_FILE
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run


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

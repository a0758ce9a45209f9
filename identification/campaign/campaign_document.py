"""The table of contents of a campaign (campaign.toml) as checked objects, and back."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np

from carrierflex.identification.campaign.campaign import (
    Baseline,
    Campaign,
    Channel,
    check_channels,
    check_different,
    check_effects,
)
from carrierflex.identification.campaign.campaign_kinds import (
    KIND_NAMES,
    CampaignKind,
    campaign_kind,
)
from carrierflex.simulation.toml_tables import (
    POSITIVE,
    TABLE,
    TABLES,
    TEXT,
    TEXTS,
    checked_table,
    one_of,
)

FORMAT = "carrierflex-campaign"
VERSION = 1
DOCUMENT_NAME = "campaign.toml"
RUN_SUFFIXES = (".csv", ".parquet")

_DOCUMENT_KEYS = {
    "kind": one_of(*KIND_NAMES),
    "name": TEXT,
    "baseline": TABLE,
    "rig": TABLE,
    "channels": TABLES,
    "runs": TABLES,
}
_CHANNEL_KEYS = {"name": TEXT, "quantity": TEXT, "unit": TEXT}
_RUN_KEYS = {"name": TEXT, "file": TEXT, "condition": TEXT}


@dataclass(frozen=True, eq=False)
class RunEntry:
    """Where a run stands: its name, file and condition."""

    name: str
    file: str
    condition: str


@dataclass(frozen=True, eq=False)
class CampaignHeader:
    """A campaign without its records.

    Fields as in :class:`carrierflex.identification.campaign.campaign.Campaign`.
    """

    contract: CampaignKind
    name: str
    baseline: Baseline
    rig: Mapping[str, Any]
    channels: tuple[Channel, ...]
    runs: tuple[RunEntry, ...]
    input_units: Mapping[str, str]


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
    rest = _checked_format(document, where)
    table = checked_table(rest, where, required=_DOCUMENT_KEYS)
    try:
        kind = campaign_kind(table["kind"], table["rig"].get("drive"))
        rig = checked_table(
            table["rig"], "[rig]", required=kind.rig_required, optional=kind.rig_optional
        )
        _check_rig(rig)
        baseline = _baseline(table["baseline"], kind)
        channels, input_units = _channels(table["channels"], kind)
        runs = tuple(_run_entry(run, number) for number, run in enumerate(table["runs"], start=1))
        check_different([run.name for run in runs], "[[runs]] name")
        check_different([run.file for run in runs], "[[runs]] file")
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
    return CampaignHeader(kind, table["name"], baseline, rig, channels, runs, input_units)


def campaign_document(campaign: Campaign) -> dict[str, Any]:
    """Content of the campaign.toml of a campaign, ready for a TOML writer."""
    channels = [_channel_table(channel) for channel in campaign.channels]
    for name, unit in campaign.input_units.items():
        channels.append({"name": name, "quantity": name, "unit": unit})
    return {
        "format": FORMAT,
        "version": VERSION,
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


def checked_file_name(name: str, key: str) -> str:
    """File name of the campaign folder; one that leads elsewhere is refused.

    Raises
    ------
    ValueError
        Where the name holds a folder, is absolute or is hidden.
    """
    plain = PurePosixPath(name).name == name and PureWindowsPath(name).name == name
    if not plain or name.startswith(".") or name == DOCUMENT_NAME or "\0" in name:
        raise ValueError(
            f"{key} '{name}' leads out of the campaign folder; expected a plain file name in it"
        )
    return name


def _checked_format(document: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Check format and version before anything else.

    A newer file may hold keys that are unknown here.
    """
    found = document.get("format")
    if found != FORMAT:
        raise ValueError(f"{where}: key 'format' is {found!r}; expected '{FORMAT}'")
    version = document.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise ValueError(f"{where}: key 'version' is {version!r}; expected {VERSION}")
    if version > VERSION:
        raise ValueError(
            f"{where}: key 'version' is {version}, written by a newer version; expected {VERSION}"
        )
    return {key: value for key, value in document.items() if key not in ("format", "version")}


def _baseline(table: Mapping[str, Any], kind: CampaignKind) -> Baseline:
    source = {"source": one_of("model", "columns")}
    effects = {"effects": TEXTS}
    if table.get("source") == "columns":
        checked = checked_table(table, "[baseline]", required=source, optional=effects)
    else:
        checked = checked_table(table, "[baseline]", required={**source, **effects})
    check_effects(checked.get("effects", ()), kind)
    return Baseline(checked["source"], tuple(checked.get("effects", ())))


def _check_rig(rig: Mapping[str, Any]) -> None:
    if "deflection_curves" in rig:
        checked_file_name(rig["deflection_curves"], "[rig]: key 'deflection_curves'")
    if rig.get("periodic") and "period_samples" not in rig:
        raise ValueError(
            "[rig]: missing key 'period_samples'; expected a whole number >= 1 where periodic = true"
        )


def _channels(
    tables: list[dict[str, Any]], kind: CampaignKind
) -> tuple[tuple[Channel, ...], dict[str, str]]:
    """Channels, and the units of inputs that a voltage analogue declares among them."""
    channels, input_units = [], {}
    for number, table in enumerate(tables, start=1):
        where = f"[[channels]] {number}"
        keys = checked_table(
            table,
            where,
            required={**_CHANNEL_KEYS, **kind.channel_keys},
            optional={"noise_std": POSITIVE},
        )
        if kind.any_unit and keys["name"] in kind.inputs and keys["quantity"] == keys["name"]:
            input_units[keys["name"]] = keys["unit"]
            continue
        angle = keys.get("angle_deg")
        channels.append(
            Channel(
                name=keys["name"],
                quantity=keys["quantity"],
                unit=keys["unit"],
                angle=None if angle is None else float(np.deg2rad(angle)),
                radius=keys.get("radius_m"),
                sensor=keys.get("sensor"),
                noise_std=keys.get("noise_std"),
            )
        )
    check_channels(channels, kind)
    if not channels:
        raise ValueError(
            "[[channels]]: every channel is an input; expected at least one measured channel"
        )
    return tuple(channels), input_units


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


def _run_entry(table: Mapping[str, Any], number: int) -> RunEntry:
    keys = checked_table(table, f"[[runs]] {number}", required=_RUN_KEYS)
    file = checked_file_name(keys["file"], f"[[runs]] {number}: key 'file'")
    if PurePosixPath(file).suffix.lower() not in RUN_SUFFIXES:
        raise ValueError(
            f"[[runs]] {number}: key 'file' is '{file}'; expected a name ending in .csv or .parquet"
        )
    return RunEntry(keys["name"], file, keys["condition"])

"""A finding about a campaign: what stands out, where, and what to do about it."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated


@dataclass(frozen=True)
class CampaignWarning:
    """Something in a campaign that does not look right."""

    check: Annotated[str, "Name of the check: ``unit``, ``clipping`` ..."]
    about: Annotated[str, "Channel, input, run, effect or key that it is about"]
    text: Annotated[str, "Finding, with its numbers"]
    remedy: Annotated[str, "What to do about it"]
    figure: Annotated[float, "What was measured"]
    line: Annotated[str, "File and line, or key of campaign.toml"]
    id: Annotated[str, "Kind of fault, ``wiring/polarity`` ...; empty where the check says it"] = ""


def merged(warnings: Iterable[CampaignWarning]) -> tuple[CampaignWarning, ...]:
    """One warning for each check and what it is about, the first; how many more are like it."""
    groups: dict[tuple[str, str], list[CampaignWarning]] = {}
    for warning in warnings:
        groups.setdefault((warning.check, warning.about), []).append(warning)
    result = []
    for first, *others in groups.values():
        more = f" (and at {len(others)} more places)" if others else ""
        result.append(replace(first, text=first.text + more))
    return tuple(result)


def key_of(table: str, key: str) -> str:
    """Place of a key of campaign.toml."""
    return f"campaign.toml, {table} {key}"


def sample_of(file: str, sample: int) -> str:
    """Place of a sample in a run file; a CSV file has its header in line 1."""
    if file.lower().endswith(".csv"):
        return f"{file}, line {sample + 2}"
    return f"{file}, sample {sample} (counted from 0)"

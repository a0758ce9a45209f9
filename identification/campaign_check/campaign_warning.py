"""A finding about a campaign: what stands out, where, and what to do about it."""

from collections.abc import Iterable
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class CampaignWarning:
    """Something in a campaign that does not look right.

    Parameters
    ----------
    check : str
        Check that found it: ``unit``, ``clipping`` ...
    about : str
        Channel, input, run or key that it is about.
    text : str
        What stands out, with its numbers.
    remedy : str
        What to look at or to change.
    figure : float
        The number that gave rise to it.
    line : str
        File with line, or key of campaign.toml.
    """

    check: str
    about: str
    text: str
    remedy: str
    figure: float
    line: str

    def entry(self) -> dict[str, object]:
        """Entry of the key ``warnings`` in diagnosis.json and identification.json."""
        return {
            "about": self.about,
            "text": self.text,
            "remedy": self.remedy,
            "check": self.check,
            "figure": self.figure,
            "line": self.line,
        }


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

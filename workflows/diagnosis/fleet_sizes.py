"""What one diagnosis of a fleet says: causes, their sizes with intervals, the gap by its noise."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.inference.results import FLOOR_UNKNOWN, NO_INTERVAL, Interval
from carrierflex.diagnosis.inference.thresholds import INTERVAL
from carrierflex.diagnosis.report.words import parameter_words, shown_unit
from carrierflex.files.quantities import UNKNOWN, scaled_unit
from carrierflex.identification.estimation.resampling import NORMAL_95, two_level_counts

#: Cause of a size that every diagnosis has: all that the baseline leaves above the noise.
GAP = "gap"
#: Parameter that is the RMS of what a cause leaves.
RMS = "rms"
#: Verdict of a campaign that could not be diagnosed.
FAILED = "error"
#: Parameters that are directions have no size; those of one run say nothing of a turbine.
_DIRECTION, _OF_RUN = "theta", " of "
_DRAWS, _SEED = 400, 17


@dataclass(frozen=True, eq=False)
class CauseSize:
    """Size of a cause in one campaign."""

    cause: Annotated[
        str, "Effect; class, where no effect of it is named; gap: all that the baseline leaves"
    ]
    parameter: Annotated[str, "Parameter of the effect; rms: RMS of what the cause leaves"]
    value: Annotated[float, "Value [unit]"]
    std: Annotated[float, "Its standard deviation [unit]"]
    ci95: Annotated[Interval, "Its 95 % interval [unit]"]
    unit: Annotated[str, "Unit"]
    is_named: Annotated[bool, "Whether the diagnosis names the cause; else the baseline holds it"]
    repeat_std: Annotated[
        float,
        "Standard deviation between records under the same conditions: without what loads, gains "
        "and curves do alike to all of them [unit]",
    ] = math.nan


@dataclass(frozen=True, eq=False)
class CampaignRow:
    """One campaign of a fleet."""

    campaign: Annotated[str, "Folder of the campaign, below that of the fleet"]
    turbine: Annotated[str, "Turbine: key of campaign.toml, or folder below that of the fleet"]
    recorded: Annotated[str, "Day of the records as 2026-01-31; empty where it is not stated"]
    kind: Annotated[str, "Kind of the campaign; empty where it could not be read"]
    verdict: Annotated[str, "Verdict of the diagnosis; error where there is none"]
    text: Annotated[str, "What the diagnosis says first, or why there is none"]
    causes: Annotated[tuple[str, ...], "Effects named, or classes where no effect is"] = ()
    unit: Annotated[str, "Unit of the gap"] = ""
    noise_floor: Annotated[float, "RMS of the noise [unit]"] = math.nan
    gap_floors: Annotated[float, "RMS of the gap above the noise, over that of the noise"] = (
        math.nan
    )
    rho: Annotated[float, "Held-out RMS with the causes over that without"] = math.nan
    rho_ci95: Annotated[Interval, "Its 95 % interval"] = NO_INTERVAL
    sizes: Annotated[tuple[CauseSize, ...], "Size of every cause"] = ()
    conditions: Annotated[tuple[str, ...], "Conditions of the records"] = ()
    faults: Annotated[tuple[str, ...], "Findings of the check"] = ()
    first_fault: Annotated[
        str, "Fault of the measurement that explains as much as the causes; empty where none"
    ] = ""

    @property
    def is_diagnosed(self) -> bool:
        """Whether there is a diagnosis."""
        return self.verdict != FAILED


def campaign_row(
    document: Mapping[str, Any], campaign: str, turbine: str, recorded: str
) -> CampaignRow:
    """Row of a diagnosed campaign, of its diagnosis.json: sizes of causes, the gap's first."""
    far = document["how_far"]
    gaps = list(_gap_size(document))
    sizes = [*gaps, *_parameter_sizes(document)]
    for gap in gaps if not document["effects"] else ():
        of_classes = (size_left(one["id"], one, gap) for one in document["classes"])
        sizes += [size for size in of_classes if size is not None]
    floor = _number(far["noise_floor"])
    classes = [finding["id"] for finding in document["classes"]]
    return CampaignRow(
        campaign=campaign,
        turbine=turbine,
        recorded=recorded,
        kind=document["kind"],
        verdict=document["verdict"],
        text=document["headline"],
        causes=tuple(document["effects"] or classes),
        unit=document["unit"],
        noise_floor=floor,
        gap_floors=gaps[0].value / floor if gaps else math.nan,
        rho=_number(far["rho"]),
        rho_ci95=_interval(far["rho_ci95"]),
        sizes=tuple(sizes),
        conditions=tuple(sorted({block["condition"] for block in document["held_out"]})),
        faults=tuple(
            f"{one['about']}: {one['text']}"
            for one in document["warnings"]
            # Findings about the model: a carrier not as drawn, a prior that is contradicted.
            if one["check"] not in ("drawing", "prior")
        ),
        first_fault="" if document["reason_id"] == FLOOR_UNKNOWN else document["reason_id"],
    )


def _gap_size(document: Mapping[str, Any]) -> Iterator[CauseSize]:
    """RMS of the gap above the noise, ``sqrt(rms^2 - floor^2)``, over draws of held-out blocks."""
    blocks = document["held_out"]
    floor = _number(document["how_far"]["noise_floor"])
    if not blocks or not math.isfinite(floor):
        return
    samples = np.array([block["samples"] for block in blocks], dtype=np.float64)
    squares = samples * np.array([block["mean_square"] for block in blocks], dtype=np.float64)
    conditions = [block["condition"] for block in blocks]
    rng = np.random.default_rng(_SEED)
    counts = two_level_counts(conditions, n_samples=_DRAWS, rng=rng)
    drawn = (counts @ squares) / (counts @ samples) - floor**2
    square = max(float(squares.sum() / samples.sum()) - floor**2, 0.0)
    # Every condition once: what its loads do to the gap is alike in all records under it. In their
    # order: a set of words has another one in every process, and so would the draws.
    alike = np.zeros_like(counts)
    for name in dict.fromkeys(conditions):
        members = np.flatnonzero(np.array(conditions) == name)
        alike[:, members] = two_level_counts([name] * members.size, n_samples=_DRAWS, rng=rng)
    low, high = np.sqrt(np.maximum(np.quantile(drawn, INTERVAL), 0.0))

    def std_of_root(draws: FloatArray) -> float:
        """By the root's derivative; where the square is within its error of zero, at that error."""
        std = float(draws.std(ddof=1))
        return std / (2.0 * math.sqrt(max(square, std))) if std > 0.0 else math.nan

    yield CauseSize(
        cause=GAP,
        parameter=RMS,
        value=math.sqrt(square),
        std=std_of_root(drawn),
        ci95=(float(low), float(high)),
        unit=document["unit"],
        is_named=False,
        repeat_std=std_of_root((alike @ squares) / (alike @ samples)),
    )


def _parameter_sizes(document: Mapping[str, Any]) -> Iterator[CauseSize]:
    """Parameters of named effects and of the baseline that are sizes, with finite errors."""
    for cause, values in document["parameters"].items():
        for parameter, one in values.items():
            value, std = _number(one["value"]), _number(one["std"])
            is_size = not parameter.startswith(_DIRECTION) and _OF_RUN not in parameter
            if is_size and math.isfinite(value) and math.isfinite(std) and std > 0.0:
                interval, is_named = _interval(one["ci95"]), cause in document["effects"]
                noise = _number(one.get("sources", {}).get("noise"))
                sizes = (value, std, interval, one["unit"])
                yield CauseSize(cause, parameter, *sizes, is_named, noise)


def size_left(cause: str, finding: Mapping[str, Any], gap: CauseSize) -> CauseSize | None:
    """RMS of what a named cause leaves, ``sqrt(share) gap``; None where its share is not known."""
    share, (low, high) = _number(finding["share"]), _interval(finding["share_ci95"])
    if not (share > 0.0 and gap.value > 0.0 and math.isfinite(low) and math.isfinite(high)):
        return None
    value = math.sqrt(share) * gap.value
    of_share = (high - low) / (4.0 * NORMAL_95 * share)
    std = value * math.hypot(of_share, gap.std / gap.value)
    interval = (max(value - NORMAL_95 * std, 0.0), value + NORMAL_95 * std)
    return CauseSize(cause, RMS, value, std, interval, gap.unit, True)


def _number(value: Any) -> float:
    """Number of the file; null is not a number."""
    return math.nan if value is None else float(value)


def _interval(ends: Any) -> Interval:
    return (_number(ends[0]), _number(ends[1]))


def size_name(cause: str, parameter: str) -> str:
    """A size in words: ``carrier tilt: tilt of the carrier``."""
    if cause == GAP:
        return "gap above the noise"
    words = "" if parameter == RMS else parameter_words(cause, parameter) or parameter
    return f"{plain_name(cause)}: {words}" if words else f"{plain_name(cause)} (RMS)"


def factor_of(value: float, parameter: str, unit: str) -> tuple[float, str]:
    """Factor to an engineer's unit of a size, and that unit."""
    factor, shown = shown_unit(parameter, unit)
    if unit == "1":
        return 1.0, ""
    return (factor, shown) if shown != unit else scaled_unit(abs(value), unit)


def shown_size(value: float, parameter: str, unit: str, std: float = math.nan) -> str:
    """Size with its unit, and the half width of its interval: ``0.0524 ± 0.001 mrad``."""
    if not math.isfinite(value):
        return UNKNOWN
    factor, shown = factor_of(value, parameter, unit)
    error = f" ± {NORMAL_95 * factor * std:.2g}" if math.isfinite(std) else ""
    return f"{factor * value:.3g}{error} {shown}".strip()


def shown_span(ends: Interval, parameter: str, unit: str) -> str:
    """Interval with its unit: ``0.051 to 0.054 mrad``."""
    factor, shown = factor_of(max(map(abs, ends)), parameter, unit)
    return f"{factor * ends[0]:.3g} to {factor * ends[1]:.3g} {shown}".strip()

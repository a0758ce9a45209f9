"""What the JSON files of diagnosis hold, by key."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, NotRequired, TypedDict

from carrierflex.diagnosis.gap.findings import (
    CellValidation,
    Drift,
    GapMoment,
    NonSynchronousCell,
    PartGrowth,
    ScalarGap,
)
from carrierflex.diagnosis.inference.results import (
    BlockScore,
    NamedValue,
    RunValidation,
    SelectionStep,
)
from carrierflex.files.versions import Software
from carrierflex.identification.campaign.record_digests import RecordDigests
from carrierflex.workflows.identification.documents import Warned

Verdict = Annotated[
    Literal[
        "named",
        "named_with_remainder",
        "class_named",
        "aliased",
        "none_of_these",
        "at_noise_floor",
        "not_diagnosable",
    ],
    "What the diagnosis says",
]


class Cell(TypedDict):
    """One cell of the gap map."""

    channel_pattern: Annotated[str, "Channel or sensor pattern"]
    order: Annotated[float, "Shaft order, line, or frequency over the lowest of the map"]
    run: Annotated[str, "Run"]
    mean_square: Annotated[float, "Mean square of the gap [unit squared]"]
    coherent: Annotated[float, "The same less the noise floor; may be negative"]
    share: Annotated[float, "Share of the whole coherent gap"]
    share_ci95: Annotated[Sequence[float], "95 % interval of the share"]
    p_value: Annotated[float, "Probability without a gap, adjusted for the number of cells"]
    frequency_hz: NotRequired[Annotated[Sequence[float], "Band of the cell [Hz]"]]


class HowFar(TypedDict):
    """How far the gap shrinks on held-out records; null where no diagnosis was made."""

    rms_before: Annotated[float, "Held-out RMS of the baseline [unit]"]
    rms_after: Annotated[float, "Held-out RMS with the effects [unit]"]
    noise_floor: Annotated[float, "RMS that the noise alone leaves [unit]"]
    rho: Annotated[float, "RMS after over before"]
    phi: Annotated[float, "Share of the mean square above the floor that is explained"]
    floor_multiple: Annotated[float, "RMS after over the floor"]
    extrapolation_rho: Annotated[float, "rho in the largest condition, predicted from the others"]
    rho_ci95: Annotated[Sequence[float], "95 % interval of rho"]
    phi_ci95: Annotated[Sequence[float], "95 % interval of phi"]
    held_out: Annotated[Literal[True], "Always on records that were not fitted to"]


class BesideShape(TypedDict):
    """Curve of another part beside it."""

    name: Annotated[str, "Part in words"]
    x: Annotated[Sequence[float], "Abscissa"]
    y: Annotated[Sequence[float], "Central curve"]
    band: Annotated[Sequence[Sequence[float]], "Lower and upper end of its 95 % band"]


class Shape(TypedDict):
    """Measured shape of a class."""

    x: Annotated[Sequence[float], "Abscissa"]
    y: Annotated[Sequence[float], "Central curve"]
    band: Annotated[Sequence[Sequence[float]], "Lower and upper end of the 95 % band"]
    law: Annotated[Sequence[float], "Nearest law along x; empty where none is drawn"]
    labels: Annotated[Sequence[str], "Names of both axes"]
    units: Annotated[Sequence[str], "Units of both axes"]
    words: Annotated[str, "The shape in words"]
    name: Annotated[str, "What the curve is beside others"]
    beside: Annotated[
        Sequence[BesideShape],
        "The other bushing, where it has a law of its own; a surface at another deflection",
    ]


class FoundClass(TypedDict):
    """A class of effects that the gap is of."""

    id: Annotated[str, "Class, docs/campaign_format.md"]
    share: Annotated[float, "Share of the gap that it explains"]
    share_ci95: Annotated[Sequence[float], "95 % interval of the share"]
    law: Annotated[str | None, "Nearest law of the library; null where the class holds none"]
    law_share: Annotated[float, "Share that this law explains"]
    law_named: Annotated[bool, "Whether the law is named"]
    shape: Annotated[Shape | None, "Its measured shape; null where it has none"]


class Tried(TypedDict):
    """A set of effects that was tried."""

    effects: Annotated[Sequence[str], "Added to the baseline"]
    held_out_rms: Annotated[float, "Held-out RMS [unit]"]
    refused: Annotated[str, "Why it is not supported; empty where it passes every rule"]


class GapBeyondMap(TypedDict):
    """The baseline's gap beyond its map."""

    text: Annotated[str, "What does not repeat, in words"]
    parity: Annotated[str, "Parity of the missing law in words"]
    in_time: Annotated[Sequence[GapMoment], "RMS in windows"]
    drift: Annotated[Sequence[Drift], "Trends over a run"]
    incoherent: Annotated[Sequence[NonSynchronousCell], "What does not repeat"]
    growth: Annotated[Sequence[PartGrowth], "How parts grow with the conditions"]
    cells: Annotated[Sequence[CellValidation], "Comparison error by cell (ASME V&V 20)"]
    scalars: Annotated[Sequence[ScalarGap], "Quantities of interest"]


class RimSignalEntry(TypedDict):
    """Mean turn of one sensor in one run."""

    run: Annotated[str, "Run"]
    channel: Annotated[str, "Sensor"]
    direction: Annotated[Literal["axial", "radial"], "Displacement of the rim that it reads"]
    sensor_angle_deg: Annotated[float, "Housing angle of the sensor [deg]"]
    measured: Annotated[Sequence[float], "Measured at every carrier angle [unit]"]
    simulated: Annotated[Sequence[float], "Simulated by the baseline [unit]"]
    with_effects: Annotated[
        Sequence[float] | None, "Simulated with the effects [unit]; null without any"
    ]


class RimMotionDocument(TypedDict):
    """rim_motion.json, written by diagnose (kind carrier) and read by view."""

    format: Annotated[Literal["carrierflex-rim-motion"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    campaign: Annotated[str, "Name of the campaign"]
    unit: Annotated[str, "Unit of the signals"]
    n_planets: Annotated[int, "Number of pins"]
    radius: Annotated[float, "Radius of the sensors' circle [m]"]
    effects: Annotated[Sequence[str], "Effects that the diagnosis added"]
    carrier_angle_deg: Annotated[Sequence[float], "Angles of one turn [deg]"]
    signals: Annotated[Sequence[RimSignalEntry], "Every sensor in every run"]


class DiagnosisDocument(TypedDict):
    """diagnosis.json, written by diagnose and run."""

    format: Annotated[Literal["carrierflex-diagnosis"], "Kind of the file"]
    version: Annotated[Literal[2], "Version of the format"]
    campaign: Annotated[str, "Name of the campaign"]
    kind: Annotated[Literal["carrier", "mounting", "element"], "Kind of the campaign"]
    software: Software
    verdict: Verdict
    incomplete: Annotated[bool, "Whether a class leads without explaining what a cause would"]
    reason: Annotated[str, "Why this verdict, in a sentence with its numbers"]
    effects: Annotated[Sequence[str], "Named effects, the one that explains most first"]
    aliases: Annotated[
        Sequence[Sequence[str]], "Effects, and errors of wiring, not to be told apart"
    ]
    parameters: Annotated[Mapping[str, Mapping[str, NamedValue]], "Values by effect and name"]
    gains: Annotated[str | None, "What the intervals hold of the signals' gains"]
    undetermined: Annotated[Sequence[str], "What the records do not determine, in words"]
    ranking: Annotated[Sequence[Tried], "Sets that were tried, best first"]
    where: Annotated[Sequence[Cell], "Largest cells of the gap"]
    where_text: Annotated[str, "Where the gap lies, in words"]
    how_far: Annotated[HowFar, "How far the gap shrinks"]
    how_far_law: Annotated[HowFar, "The same of the nearest laws"]
    classes: Annotated[Sequence[FoundClass], "Classes of the gap; empty where none is named"]
    class_ties: Annotated[Sequence[Sequence[str]], "Classes that the records cannot tell apart"]
    class_rivals: Annotated[Mapping[str, float], "Share that another class alone explains"]
    beyond_share: Annotated[float, "Share of the gap beyond the classes"]
    beyond_learnable: Annotated[float, "Share that a flexible model learns beyond the classes"]
    class_note: Annotated[str, "What the records cannot say of classes"]
    unit: Annotated[str, "Unit of every RMS"]
    remaining: Annotated[Sequence[Cell], "Largest cells of the remaining gap"]
    ladder: Annotated[Sequence[SelectionStep], "Held-out RMS as the effects are added"]
    validation: Annotated[Sequence[RunValidation], "Comparison error by run (ASME V&V 20)"]
    held_out: Annotated[Sequence[BlockScore], "Held-out gap of the baseline by block"]
    records: Annotated[RecordDigests | None, "Digests of records and files"]
    gap: Annotated[GapBeyondMap | None, "The gap beyond its map"]
    separating_test: Annotated[str, "Measurement that would tell rivals apart"]
    warnings: Annotated[Sequence[Warned], "What does not look right in the campaign"]

"""What the JSON files of studies and of the blind check hold, by key."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, NotRequired, TypedDict

from carrierflex.blind_check.scoring.class_score import ChangeRow
from carrierflex.blind_check.scoring.scoring import ClassRow, Figure
from carrierflex.blind_check.scoring.several_judging import JudgedCause
from carrierflex.identification.carrier.printed_tables import DerivedFacts
from carrierflex.simulation.mounting.torsional_train import TorsionalTrain
from carrierflex.workflows.simulation.estimate_gear_life import GearLife as GearLifeResult
from carrierflex.workflows.simulation.study_order_one import OrderOneRow
from carrierflex.workflows.support.result_documents import (
    Dimensions,
    Pair,
    Software,
    Versions,
)

ByName = Mapping[str, float]


class GivenFile(TypedDict):
    """A file that a result was made from."""

    file: Annotated[str, "Its path"]
    sha256: Annotated[str, "Its digest"]


class CurveInputsDocument(TypedDict):
    """inputs.json, written by curves."""

    size: Annotated[float, "Element edge length [m]"]
    stage: Dimensions
    files: Annotated[Mapping[str, GivenFile], "Files by role; empty without any"]
    assembly: Annotated[str, "What assembled and solved"]
    sensor_radius: Annotated[float, "Radius of the sensors' circle [m]"]
    versions: Versions


class CouplingsDocument(TypedDict):
    """couplings.json, written by couplings."""

    size: Annotated[float, "Element edge length [m]"]
    curve_change: Annotated[
        Mapping[str, ByName], "RMS change of the curve by what is rigid, by curve"
    ]
    brackets: Annotated[
        Mapping[str, Mapping[str, Any]], "Stiffness of pilots and curves by variant"
    ]
    files: Annotated[Mapping[str, GivenFile], "Files by role; empty without any"]
    versions: Versions


class PinFitInputs(TypedDict):
    """Inputs of the pin fit's study."""

    size: Annotated[float, "Element edge length [m]"]
    stage: Dimensions


class Residual(TypedDict):
    """Largest residual of a mix over the sweep."""

    residual: Annotated[float, "RMS left over RMS"]
    stiffness: Annotated[float, "Interface stiffness where it stands [N m/rad]"]


class PinFitDocument(TypedDict):
    """pin_fit.json, written by pin-fit."""

    inputs: Annotated[PinFitInputs, "Inputs"]
    stiffness_of_changes: Annotated[ByName, "Where the curve's character changes [N m/rad]"]
    worst: Annotated[
        Mapping[str, Mapping[str, Residual]], "Largest residual by axial fit and kind of mix"
    ]
    versions: Versions


class Sweep(TypedDict):
    """Order 1 over one axis of the supports."""

    unit: Annotated[str, "Unit of the axis"]
    values: Annotated[Pair, "Values"]
    order_1: Annotated[Mapping[str, Pair], "Amplitude by support [um]"]


class SizeInput(TypedDict):
    """Size of the elements."""

    size: Annotated[float, "Element edge length [m]"]


class OrderOneDocument(TypedDict):
    """order_one.json, written by order-one."""

    inputs: Annotated[SizeInput, "Inputs"]
    rows: Annotated[Sequence[OrderOneRow], "One a support, at full torque"]
    sweeps_um: Annotated[Mapping[str, Sweep], "By axis"]
    load_cases_m: Annotated[Mapping[str, Any], "Order 1 by load case [m]"]
    paper_m: Annotated[Any, "What the paper's figures hold [m]"]
    versions: Versions


class TableFiveRow(TypedDict):
    """A case of table 5."""

    load_case: Annotated[str, "Load case"]
    simulation: Annotated[str, "Aligned or misaligned"]
    rms_mm: Annotated[float, "RMS of the deviation [mm]"]
    paper_rms_mm: Annotated[float, "The same in the paper [mm]"]


class TableFiveDocument(TypedDict):
    """table_5.json, written by table-5."""

    rows: Annotated[Sequence[TableFiveRow], "Cases"]
    identified_tilt_rad: Annotated[ByName, "Identified kink by load case [rad]"]
    inputs: Annotated[Mapping[str, Any], "Options"]
    versions: Versions


class TorsionPaper(TypedDict):
    """What the paper prints of the torsional train."""

    stiffness_nm_per_rad: Annotated[Mapping[str, Any], "Stiffness by member [N m/rad]"]
    first_frequency_hz: Annotated[Any, "First frequency [Hz]"]
    fitted_to_it: Annotated[Any, "What was fitted to it"]


class TorsionDocument(TypedDict):
    """torsion.json, written by torsion."""

    train: Annotated[TorsionalTrain, "Inertias, stiffnesses, ratios"]
    stiffness_nm_per_rad: Annotated[ByName, "By member, from the sweeps [N m/rad]"]
    paper: Annotated[TorsionPaper, "What the paper prints"]
    frequencies_hz: Annotated[Mapping[str, Pair], "By topology and mounting [Hz]"]
    versions: Versions


class GearLifeInputs(TypedDict):
    """Inputs of the gear life."""

    torque: Annotated[float, "Torque of the main shaft [N m]"]
    gear: Annotated[Mapping[str, float], "Table [gear] of carrier-parameters"]


class GearLifeDocument(TypedDict):
    """gear_life.json, written by gear-life."""

    inputs: Annotated[GearLifeInputs, "Inputs"]
    result: Annotated[GearLifeResult, "Pressure and life by mesh"]
    versions: Versions


class MountingLinearisedDocument(TypedDict):
    """linearised.json of a mounting, written by simulate --linearised."""

    case: Annotated[str, "Name of the case"]
    operating_points: Annotated[Mapping[str, ByName], "Loads [N m, N, N] and speed [rad/s] by run"]
    versions: Versions


class StageLinearisedDocument(TypedDict):
    """linearised.json of a stage, written by simulate --linearised."""

    case: Annotated[str, "Name of the case"]
    speed: Annotated[float, "Speed [rad/s]"]
    crossings_rad_per_s: Annotated[Mapping[str, Any], "Speeds at which orders meet modes, by order"]
    versions: Versions


class FiguresDocument(TypedDict):
    """figures.json, written by figures."""

    figures: Annotated[Mapping[str, str], "File by figure"]
    numbers: Annotated[Mapping[str, Any], "Tables that go with the figures"]
    seconds: Annotated[ByName, "Time by stage [s]"]
    inputs: Annotated[Mapping[str, Any], "Options"]
    versions: Versions


class PrintedTablesDocument(TypedDict):
    """printed_tables.json, written by printed-tables."""

    facts: Annotated[DerivedFacts, "What the printed tables determine"]
    versions: Versions


class BlindCase(TypedDict):
    """A case of the blind check: its label, its answer."""

    case: Annotated[str, "Name"]
    family: Annotated[str, "Family"]
    effects: Annotated[Sequence[str], "Withheld effects"]
    gap_over_floor: Annotated[float, "RMS of the gap over that of the noise"]
    verdict: Annotated[str, "Verdict; error where the diagnosis failed"]
    reason: Annotated[str | None, "Why this verdict"]
    seconds: Annotated[float, "Time of the diagnosis [s]"]
    named: Annotated[Sequence[str], "Laws that are named"]
    declares_noise: Annotated[bool, "Whether the campaign declares its noise"]
    rho: NotRequired[Annotated[float, "RMS with the true effect over that without"]]
    right: NotRequired[Annotated[bool, "Whether the answer is right"]]
    classes: NotRequired[Annotated[Sequence[str], "True classes"]]
    drive: NotRequired[Annotated[str, "Drive of the element"]]
    changes: NotRequired[Annotated[Pair, "How far laws are from those of the library"]]
    answer: NotRequired[Annotated[Sequence[str], "Classes that are named"]]
    class_ties: NotRequired[Annotated[Sequence[Sequence[str]], "Classes not told apart"]]
    rivals: NotRequired[Annotated[ByName, "Share by rival class"]]
    outcome: NotRequired[Annotated[str, "Right, wrong, tied, abstained or silent"]]
    false_laws: NotRequired[Annotated[Sequence[str], "Laws that are wrong"]]
    causes: NotRequired[Annotated[Sequence[JudgedCause], "Of several causes, each by itself"]]
    false_classes: NotRequired[Annotated[Sequence[str], "Classes that are no cause's"]]


class BlindCheckDocument(TypedDict):
    """blind_check.json, written by blind-check."""

    format: Annotated[Literal["carrierflex-blind-check"], "Kind of the file"]
    version: Annotated[Literal[2], "Version of the format"]
    software: Software
    date: Annotated[str, "Day"]
    command: Annotated[str, "Command that repeats it"]
    digest: Annotated[str, "Digest of the seals"]
    met: Annotated[bool, "Whether every figure is met"]
    figures: Annotated[Sequence[Figure], "Wanted beside reached"]
    confusion: Annotated[Sequence[ClassRow], "Answers by true class"]
    beside: NotRequired[
        Annotated[Mapping[str, Sequence[Figure]], "Figures of other tools' answers, by tool"]
    ]
    by_change_of_form: NotRequired[Annotated[Sequence[ChangeRow], "Answers by change of form"]]
    cases: Annotated[Sequence[BlindCase], "Every case"]


class SealsDocument(TypedDict):
    """seals.json, written by blind-check before the first diagnosis."""

    format: Annotated[str, "Kind of the file"]
    version: Annotated[int, "Version of the format"]
    check: Annotated[Mapping[str, Any], "Seed and number of cases"]
    digest: Annotated[str, "SHA-256 of all seals"]
    seals: Annotated[Mapping[str, str], "SHA-256 of label and salt by case"]


class OpenedLabel(TypedDict):
    """A label that was opened."""

    label: Annotated[Mapping[str, Any], "The truth of the case"]
    salt: Annotated[str, "Random bytes of its seal"]


LabelsDocument = Annotated[Mapping[str, OpenedLabel], "labels.json of blind-check: label by case"]
SaltsDocument = Annotated[Mapping[str, str], "salts.json of blind-check: random bytes by case"]


class Answer(TypedDict):
    """Answer of a tool to a case."""

    verdict: NotRequired[Annotated[str, "Verdict; error where there is no answer"]]
    seconds: NotRequired[Annotated[float, "Time it took [s]"]]
    effects: NotRequired[Annotated[Sequence[str], "Named effects"]]
    aliases: NotRequired[Annotated[Sequence[Sequence[str]], "Effects not told apart"]]
    classes: NotRequired[Annotated[Sequence[str], "Named classes"]]
    class_ties: NotRequired[Annotated[Sequence[Sequence[str]], "Classes not told apart"]]
    rho: NotRequired[Annotated[float, "RMS with the effects over that without"]]
    rho_ci95: NotRequired[Annotated[Pair, "95 % interval of rho"]]
    parameters: NotRequired[
        Annotated[Mapping[str, Mapping[str, Any]], "Values by effect and name, as in diagnosis"]
    ]


class AnswersDocument(TypedDict):
    """Answers of any tool to a blind check, which it scores."""

    format: Annotated[Literal["carrierflex-answers"], "Kind of the file"]
    version: Annotated[Literal[1], "Version of the format"]
    tool: Annotated[str, "Name and version"]
    cases: Annotated[Mapping[str, Answer], "Answer by case"]


class Reference(TypedDict):
    """What a plain method answers to a case."""

    effects: Annotated[Sequence[str], "Named effects"]
    error: Annotated[str | None, "Why it failed; null where it did not"]
    seconds: Annotated[float, "Time it took [s]"]


ReferencesDocument = Annotated[
    Mapping[str, Reference], "references.json of blind-check: answer by plain method"
]


class TimesDocument(TypedDict):
    """times.json, written by blind-check beside every diagnosis."""

    seconds: Annotated[float, "Time of the diagnosis [s]"]
    error: Annotated[str | None, "Why it failed; null where it did not"]

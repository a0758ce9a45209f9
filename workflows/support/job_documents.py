"""What summary.json of the main job holds, by key."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, TypedDict

from carrierflex.fe.load_cases import GearForces
from carrierflex.geometry.quality import MeshQuality
from carrierflex.workflows.support.result_documents import (
    Dimensions,
    Effects,
    Pair,
    Verdict,
    Versions,
)


class JobInputs(TypedDict):
    """Inputs of the main job."""

    size: Annotated[float, "Element edge length [m]"]
    stage: Dimensions
    case: Annotated[str, "Case that was simulated"]


class Moment(TypedDict):
    """Tilting moment of 1 kN m of torque."""

    computed: Annotated[float, "Computed [N m]"]
    paper: Annotated[float, "Printed in the paper [N m]"]


#: Peaks, their angles [deg], amplitudes of the orders N, 2 N and 3 N of N planets, and the largest
#: other order over all of a deflection curve.
CurveFigures = Mapping[str, Any]


class MeshStudyFigures(TypedDict):
    """Orders of the curves over the size of the elements."""

    sizes: Annotated[Pair, "Edge lengths [m]"]
    n_dofs: Annotated[Sequence[int], "Unknowns"]
    orders: Annotated[Sequence[int], "Orders"]
    flexible_um_per_knm: Annotated[Sequence[Pair], "By size and order"]
    stiff_um_per_knm: Annotated[Sequence[Pair], "By size and order"]


class PinFitFigures(TypedDict):
    """Carrier and pins joined by an interface stiffness."""

    interface_stiffness: Annotated[Pair, "Stiffness [N m/rad]"]
    curves_um_per_knm: Annotated[Sequence[CurveFigures], "Curve by stiffness"]
    sliding_free_pin_against_full_model: Annotated[float, "RMS difference over RMS"]
    free_pin_against_full_model: Annotated[float, "RMS difference over RMS"]
    rigid_fit_against_bonded: Annotated[float, "RMS difference over RMS"]
    why_not_exact: Annotated[str, "Why the last two are not zero"]


class AgainstTruth(TypedDict):
    """An identified parameter beside the truth."""

    truth: Annotated[float, "True value, SI units"]
    value: Annotated[float, "Identified value, SI units"]
    std: Annotated[float, "Standard deviation"]
    inside_95_percent: Annotated[bool, "Whether the truth lies in the 95 % interval"]


class PaperEffects(TypedDict):
    """How far the effects of the paper's models M1 and M2 go alone, in turn."""

    effects: Annotated[Effects, "In the order of the paper"]
    rho: Annotated[Pair, "RMS over the baseline's, after each"]
    phi: Annotated[Pair, "Share explained, after each"]
    rms_um: Annotated[Pair, "Held-out RMS, baseline first [um]"]
    rms_alone_um: Annotated[Pair, "Held-out RMS of each by itself [um]"]


class JobGap(TypedDict):
    """The gap of a rigid, aligned carrier."""

    where: Annotated[str, "Where it lies, in words"]
    verdict: Verdict
    reason: Annotated[str, "Why this verdict"]
    effects: Annotated[Effects, "Named effects in turn"]
    rms_um: Annotated[Pair, "Held-out RMS as they are added, baseline first [um]"]
    rho: Annotated[Pair, "The same over the baseline's"]
    phi: Annotated[float, "Share of the mean square above the floor that they explain"]
    noise_floor_um: Annotated[float, "RMS of the noise [um]"]
    of_the_papers_models: Annotated[PaperEffects, "What models M1 and M2 hold"]


class JobCheck(TypedDict):
    """A check of the main job."""

    check: Annotated[str, "Figure"]
    wanted: Annotated[str, "Wanted"]
    reached: Annotated[float, "Reached"]
    met: Annotated[bool, "Whether it is met"]


class SummaryDocument(TypedDict):
    """summary.json, written by run."""

    inputs: Annotated[JobInputs, "Inputs"]
    gear_forces_per_knm: Annotated[GearForces, "Tooth forces of 1 kN m"]
    tilting_moment_nm: Annotated[Moment, "Tilting moment of 1 kN m [N m]"]
    mesh: Annotated[Mapping[str, MeshQuality], "Quality by mesh"]
    deflection_um_per_knm: Annotated[Mapping[str, CurveFigures], "Peaks and order_N by curve"]
    mesh_study: Annotated[MeshStudyFigures, "Convergence"]
    pin_fit: Annotated[PinFitFigures, "Pin fit"]
    frequencies_hz: Annotated[Mapping[str, Pair], "Fixed-interface modes by body [Hz]"]
    rms_um: Annotated[Mapping[str, Mapping[str, float]], "Residual by model and run [um]"]
    in_time: Annotated[Mapping[str, Any], "Figures of stage and mounting in time, and their files"]
    truth: Annotated[
        Mapping[str, Mapping[str, AgainstTruth]], "Parameters of M2 beside the truth, by run"
    ]
    gap: Annotated[JobGap, "The gap"]
    checks: Annotated[Sequence[JobCheck], "Checks, wanted beside reached"]
    seconds: Annotated[Mapping[str, float], "Time by stage [s]"]
    peak_memory_gb: Annotated[float, "Peak memory [GB]"]
    versions: Versions

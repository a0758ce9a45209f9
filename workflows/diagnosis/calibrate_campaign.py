"""Add the causes that a diagnosis names to the simulation, diagnose again, compare.

A named dimension or material constant changes the carrier's drawing, whose deflection curves are
computed by finite elements at the new value; a cause inside the stage changes the stage case of a
copy of the campaign; any other named law goes into the copy's baseline, with its value and standard
deviation. Writes before/ and after/ (as diagnose),
change/ (as compare), campaign/ (the copy), parameters.toml and calibration.json. A good answer: the
gap afterwards is as small as predicted, and what was put in is no longer missing.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    NO_INTERVAL,
    Interval,
    NamedValue,
)
from carrierflex.fe.curve_files import MATERIAL_CAUSES, PIN_FIT, write_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.json_files import read_document, save_json
from carrierflex.files.result_schemas import json_content, json_table
from carrierflex.files.toml_files import toml_document
from carrierflex.files.versions import software_name, versions
from carrierflex.files.whole_files import whole_file
from carrierflex.files.whole_folders import whole_folder
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.identification.campaign.campaign_header import CAMPAIGN_FILE, CampaignHeader
from carrierflex.identification.campaign.campaign_kinds import CampaignKind
from carrierflex.identification.campaign.declarations import TOLERANCES, KnownValue
from carrierflex.identification.campaign.document_files import read_campaign_header
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME
from carrierflex.reduction.changed_drawing import (
    ChangedDrawing,
    LinearPrediction,
    causes_in,
    changed_drawing,
    linear_prediction,
)
from carrierflex.simulation.carrier.effects.drawing import body_of_effect
from carrierflex.simulation.carrier.effects.inside_stage import group_of_effect
from carrierflex.simulation.case_kinds import STAGE_CASE
from carrierflex.workflows.diagnosis import compare_diagnoses, diagnose_campaign
from carrierflex.workflows.geometry.write_parameters import parameter_lines
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.diagnosis.results import Diagnosis

CALIBRATION_FILE = "calibration.json"
PARAMETERS_FILE = "parameters.toml"
BEFORE, AFTER, CAMPAIGN, CHANGE = "before", "after", "campaign", "change"
_FORMAT, _VERSION = "carrierflex-calibration", 1
#: Text of a file that a killed process leaves.
_UNFINISHED = (
    "The calibration was not finished: run it again. Files of an earlier one may still be here, "
    "but for before/."
)


@dataclass(frozen=True, eq=False)
class PutIn:
    """One effect that was put into the simulation."""

    effect: Annotated[str, "Effect"]
    file: Annotated[str, "File of the output folder that holds it"]
    values: Annotated[Mapping[str, NamedValue], "Its values, as diagnosed"]
    drawn: Annotated[
        float | None,
        "Dimension [m], modulus [Pa] or Poisson's ratio as drawn, or quantity of the stage case; "
        "null of a law",
    ] = None
    calibrated: Annotated[float | None, "The same with its change; null of a law"] = None


@dataclass(frozen=True, eq=False)
class CalibrationSide:
    """What one of the two diagnoses says."""

    verdict: Annotated[str, "Verdict"]
    headline: Annotated[str, "What the diagnosis says first, in one sentence"]
    rms: Annotated[float, "Held-out RMS of the baseline's gap [unit]"]
    noise_floor: Annotated[float, "RMS of the noise alone [unit]"]


@dataclass(frozen=True, eq=False)
class Calibration:
    """What was put into the simulation, and what became of the gap."""

    campaign: Annotated[str, "Name of the campaign"]
    unit: Annotated[str, "Unit of every RMS"]
    text: Annotated[str, "Change of the gap, or why nothing was added; next step"]
    before: Annotated[CalibrationSide, "Diagnosis of the campaign"]
    put_in: Annotated[tuple[PutIn, ...], "What was put into the simulation"] = ()
    omitted: Annotated[tuple[str, ...], "Named effects that no file of a campaign can hold"] = ()
    rms_predicted: Annotated[float, "Held-out RMS with what was put in, by the first diagnosis"] = (
        math.nan
    )
    after: Annotated[
        CalibrationSide | None, "Diagnosis of campaign/; null where nothing was put in"
    ] = None
    ratio: Annotated[float, "RMS of the gap after over before, on the same held-out blocks"] = (
        math.nan
    )
    ratio_ci95: Annotated[Interval, "95 % interval of the ratio"] = NO_INTERVAL
    linear: Annotated[
        LinearPrediction | None,
        "How far the derivatives predict the change of the drawing; null where it is unchanged",
    ] = None


#: calibration.json.
CALIBRATION = json_table(
    "CalibrationDocument",
    "calibration.json, written by calibrate.",
    {
        Calibration: "campaign unit text before put_in omitted rms_predicted after ratio "
        "ratio_ci95 linear"
    },
    format=(Literal["carrierflex-calibration"], "Kind of the file"),
    version=(Literal[1], "Version of the format"),
    software=(str, "Name and version of this software"),
    parameters=(str | None, "File of --parameters; null: the default carrier"),
    take=(str | None, "Effect of --take"),
    size=(float, "Element edge length of the deflection curves [m]"),
    versions=(Mapping[str, str], "Versions of the software"),
)


def main(
    campaign: Path,
    *,
    out: Path,
    parameters: Path | None = None,
    take: str | None = None,
    size: float = DEFAULT_SIZE,
    seed: int = 0,
    workers: int = 1,
    quiet: bool = False,
) -> Calibration:
    """Add the causes that a diagnosis names to the simulation, diagnose again, compare.

    Parameters
    ----------
    campaign : Path
        Campaign folder with a baseline of this program's simulator or stage. It is not changed.
    out : Path
        Folder to write: new, or that of an earlier calibration.
    parameters : Path, optional
        TOML file with the dimensions [m, rad] of the carrier's drawing; default: the default
        carrier. parameters.toml is a copy with the named changes.
    take : str, optional
        Effect to add if the verdict is "aliased": one of the alternatives.
    size : float
        Element edge length [m] of the deflection curves before and after a change of the drawing.
    seed : int
        Seed of the bootstrap samples of both diagnoses, 0 or more.
    workers : int
        Processes in which sets of effects are fitted; every number stays the same.
    quiet : bool
        Show no progress.

    Returns
    -------
    Calibration
        What was put in with its values; RMS of the gap before, predicted and after; how far the
        derivatives predict the change of the drawing. Nothing is put in where nothing is named: the
        text says why and what to do next.

    Raises
    ------
    ValueError
        Where a file is refused, `out` holds anything else, `take` is no alternative, or no carrier
        has the changed dimensions.
    OSError
        Where `out` cannot be written.
    """
    stage = read_parameters(parameters)
    header = read_campaign_header(campaign)
    _refuse(header, stage, campaign, out)
    prepared_folder(out)
    inputs = {"parameters": parameters, "take": take, "size": size}

    def diagnosed(folder: Path, name: str) -> Diagnosis:
        return diagnose_campaign.main(
            folder, out=out / name, seed=seed, workers=workers, quiet=quiet
        )

    before = diagnosed(campaign, BEFORE)
    values = _values_to_put_in(before, take)
    known = {name: of for name, of in values.items() if _is_held(name, header)}
    calibration = Calibration(
        campaign=before.campaign,
        unit=before.unit,
        text=_UNFINISHED if known else _why_nothing(before, tuple(values)),
        before=_side(before),
        omitted=tuple(name for name in values if name not in known),
    )
    _write(calibration, inputs, out)
    if not known:
        _remove(out, AFTER, CAMPAIGN, CHANGE, PARAMETERS_FILE)
        return calibration
    changes = {
        name.partition("/")[2]: of["change"].value
        for name, of in known.items()
        if body_of_effect(name)
    }
    _refuse_surfaces(changes, stage)
    curves, drawing = None, None
    if changes:
        curves = diagnose_campaign.curves_of_rig(header.rig, campaign)
        drawing = _drawing(stage, changes, size, quiet=quiet)
        with whole_file(out / PARAMETERS_FILE) as file:
            file.write_text("\n".join(parameter_lines(drawing.stage)) + "\n", encoding="utf-8")
        w = before.attribution.parameters.get(PIN_FIT, {}).get("w")
        w_of_fit = w.value if w else 0.0
        calibration = replace(
            calibration, linear=linear_prediction(curves, changes, w_of_fit, drawing)
        )
        curves = drawing.moved(curves)
    laws = {name: of for name, of in known.items() if not body_of_effect(name)}
    if header.baseline.source == "stage":
        put_in = _write_copy_with_case(campaign, out / CAMPAIGN, header, laws)
    else:
        _write_copy(campaign, out / CAMPAIGN, header.contract, laws, curves)
        put_in = tuple(_put_in(name, of, stage, drawing) for name, of in known.items())
    after = diagnosed(out / CAMPAIGN, AFTER)
    calibration = replace(
        calibration,
        put_in=put_in,
        rms_predicted=_predicted(before, tuple(known), take),
        after=_side(after),
        text=after.reason,
    )
    if not changes:
        _remove(out, PARAMETERS_FILE)
    if after.reduction is None:
        _remove(out, CHANGE)
    else:
        calibration = _compared(calibration, after, out)
    linear = calibration.linear
    if linear is not None and math.isfinite(linear.off):
        text = (
            f"{calibration.text} By finite elements at the new value, the derivative was "
            f"{linear.off:.0%} off: the records support {linear.factor:.3g} times the named change."
        )
        calibration = replace(calibration, text=text)
    _write(calibration, inputs, out)
    return calibration


def _remove(out: Path, *names: str) -> None:
    """Remove what an earlier calibration wrote and this one does not replace."""
    for path in (out / name for name in names):
        if path.is_file():
            path.unlink()
        else:
            shutil.rmtree(path, ignore_errors=True)


def _refuse(header: CampaignHeader, stage: StageParameters, campaign: Path, out: Path) -> None:
    """Refuse what cannot be calibrated, and a folder that holds something else."""
    if header.baseline.source not in ("model", "stage"):
        raise ValueError(
            f"{campaign / DOCUMENT_NAME}: [baseline]: key 'source' is '{header.baseline.source}', "
            "another simulator's prediction; expected 'model' or 'stage': put the effect into that "
            "simulator, then diagnose and compare"
        )
    n_planets = header.rig.get("n_planets")
    if TOLERANCES in header.rig and stage.carrier.n_planets != n_planets:
        raise ValueError(
            f"--parameters: [carrier] n_planets is {stage.carrier.n_planets}, and [rig] n_planets "
            f"of the campaign is {n_planets}; expected the dimensions of the campaign's carrier"
        )
    if out.resolve() in (campaign.resolve(), *campaign.resolve().parents):
        raise ValueError(
            f"{out}: the campaign {campaign} is in this folder, and its files would be replaced; "
            "expected another folder for --out"
        )
    _refuse_foreign_folder(out)


def _refuse_surfaces(changes: Mapping[str, float], stage: StageParameters) -> None:
    """Refuse offsets of surfaces of a CAD model, which no parameter file holds."""
    for name, change in changes.items():
        if name not in causes_in(stage):
            raise ValueError(
                f"geometry/{name} is a surface of a CAD model or mesh, and no dimension of the "
                f"parametric carrier: move it by {1e3 * change:+.3g} mm along its normal in the "
                "CAD model, compute its curves (carrierflex curves --step --derivatives) and "
                "diagnose again"
            )


def _refuse_foreign_folder(out: Path) -> None:
    """Refuse a folder that neither is empty nor comes from an earlier calibration."""
    names = {BEFORE, AFTER, CAMPAIGN, CHANGE, PARAMETERS_FILE, CALIBRATION_FILE}
    present = {path.name for path in out.iterdir()} if out.is_dir() else set()
    foreign = sorted(name for name in present - names if not name.startswith("."))
    if foreign:
        raise ValueError(
            f"{out}: holds '{foreign[0]}', which is no file of a calibration; expected a new "
            "folder, or that of an earlier calibration"
        )
    if CALIBRATION_FILE in present:
        read_document(out / CALIBRATION_FILE, "a calibration.json", _FORMAT, _VERSION)
    elif present & names - {BEFORE}:
        raise ValueError(
            f"{out}: holds '{min(present & names - {BEFORE})}' and no {CALIBRATION_FILE}; expected "
            "a new folder, or that of an earlier calibration"
        )


def _values_to_put_in(
    diagnosis: Diagnosis, take: str | None
) -> dict[str, Mapping[str, NamedValue]]:
    """Values of the named effects, or of the alternative that is taken, by effect."""
    which = diagnosis.attribution
    if take is None:
        named = () if diagnosis.verdict == ALIASED else which.effects
        return {name: which.parameters.get(name, {}) for name in named}
    alternatives = _alternatives(diagnosis)
    if diagnosis.verdict != ALIASED:
        raise ValueError(
            f"--take {take}: the verdict is '{diagnosis.verdict}', without alternatives; expected "
            "no --take"
        )
    if take not in alternatives:
        listed = ", ".join(alternatives) or "no --take: the alternatives have no values"
        raise ValueError(f"--take {take}: is no alternative of this diagnosis; expected {listed}")
    return {take: alternatives[take]}


def _alternatives(diagnosis: Diagnosis) -> dict[str, Mapping[str, NamedValue]]:
    """Values of effects that explain the gap equally well, by effect."""
    which = diagnosis.attribution
    tried = {name for ranked in which.ranking for name in ranked.effects}
    values = {**which.parameters, **which.alternatives}
    return {name: of for name, of in values.items() if name in tried}


def _is_held(effect: str, header: CampaignHeader) -> bool:
    """Whether a drawing, a stage case or a campaign can hold an effect; none holds a user's law."""
    if header.baseline.source == "stage":
        return bool(group_of_effect(effect))
    return bool(body_of_effect(effect)) or effect in header.contract.effects


def _why_nothing(diagnosis: Diagnosis, effects: Sequence[str]) -> str:
    """Why nothing is put in and what to do next, in one line."""
    from carrierflex.diagnosis.report.verdict_words import next_step, verdict_heading

    if effects:
        return (
            f"Nothing was put in: {', '.join(effects)} is in no campaign.toml or stage case; add "
            "it to the simulation as an effect of its package."
        )
    text = f"Nothing was put in. {verdict_heading(diagnosis)}. {next_step(diagnosis)}"
    alternatives = _alternatives(diagnosis) if diagnosis.verdict == ALIASED else {}
    if alternatives:
        listed = " or ".join(f"--take {name}" for name in alternatives)
        text += f" To put one of them in before that: {listed}."
    return text


def _side(diagnosis: Diagnosis) -> CalibrationSide:
    from carrierflex.diagnosis.report.verdict_words import verdict_heading

    far = diagnosis.reduction
    sizes = (math.nan, math.nan) if far is None else (far.rms_before, far.noise_floor)
    return CalibrationSide(diagnosis.verdict, verdict_heading(diagnosis), *sizes)


def _drawing(
    stage: StageParameters, changes: Mapping[str, float], size: float, *, quiet: bool
) -> ChangedDrawing:
    stages = Stages(1, quiet)
    try:
        with stages.stage(f"deflection curves, elements of {size:.4g} m"):
            return changed_drawing(stage, changes, size, note=stages.note)
    except ValueError as error:
        listed = ", ".join(f"{name} {change:+.4g}" for name, change in changes.items())
        raise ValueError(
            f"no carrier has the named changes ({listed}): {error}; expected dimensions near those "
            "of the campaign's carrier in --parameters"
        ) from error


def _put_in(
    effect: str,
    values: Mapping[str, NamedValue],
    stage: StageParameters,
    drawing: ChangedDrawing | None,
) -> PutIn:
    if not body_of_effect(effect) or drawing is None:
        return PutIn(effect, f"{CAMPAIGN}/{DOCUMENT_NAME}", values)
    cause = effect.partition("/")[2]
    file = CALIBRATION_FILE if cause in MATERIAL_CAUSES else PARAMETERS_FILE
    new = causes_in(drawing.stage, drawing.materials)
    return PutIn(effect, file, values, causes_in(stage)[cause], new[cause])


def _write_copy(
    campaign: Path,
    folder: Path,
    kind: CampaignKind,
    laws: Mapping[str, Mapping[str, NamedValue]],
    curves: Mapping[str, DeflectionCurve] | None,
) -> None:
    """Copy a campaign, its baseline with some laws, its rig with some curves."""
    # Late: help does not wait for a simulator's libraries.
    import tomli_w

    from carrierflex.identification.campaign.simulated_campaign import CURVES_FILE

    document = toml_document(campaign / DOCUMENT_NAME, CAMPAIGN_FILE)
    # Keys of known physics came with the second version.
    document["version"] = CAMPAIGN_FILE.version
    baseline = document["baseline"]
    baseline["effects"] = [*baseline.get("effects", ()), *laws]
    fixed = {
        f"{law}.{name}": {"value": known.value, "std": known.std}
        for law, values in laws.items()
        for name, known in _known_values(law, values, kind).items()
    }
    if fixed:
        baseline["fixed"] = {**baseline.get("fixed", {}), **fixed}
    with _copy_of_files(campaign, folder) as partial:
        if curves is not None:
            name = document["rig"].setdefault("deflection_curves", CURVES_FILE)
            write_curves(partial / name, curves)
        (partial / DOCUMENT_NAME).write_bytes(tomli_w.dumps(document).encode())


@contextmanager
def _copy_of_files(campaign: Path, folder: Path) -> Iterator[Path]:
    """Folder with the files of a campaign, whole or not at all."""
    with whole_folder(folder) as partial:
        for file in campaign.iterdir():
            if file.is_file() and not file.name.startswith("."):
                shutil.copyfile(file, partial / file.name)
        yield partial


def _write_copy_with_case(
    campaign: Path,
    folder: Path,
    header: CampaignHeader,
    causes: Mapping[str, Mapping[str, NamedValue]],
) -> tuple[PutIn, ...]:
    """Copy a campaign, its stage case with the values of some causes."""
    import tomli_w

    from carrierflex.simulation.stage.causes import case_values
    from carrierflex.simulation.stage.stage_cases import read_stage_case

    name = header.baseline.case
    case = read_stage_case(campaign / name)
    document = toml_document(campaign / name, STAGE_CASE)
    put_in = []
    for effect, values in causes.items():
        numbers = {key: value.value for key, value in values.items()}
        table, keys = case_values(
            effect, numbers, case.data, case.effects, int(case.rig["n_planets"])
        )
        document[table] = {**document.get(table, {}), **keys}
        one = PutIn(effect, f"{CAMPAIGN}/{name}", values)
        key, value = next(iter(keys.items()), ("", None))
        if len(keys) == 1 and not isinstance(value, list):
            of = case.effects if table == "effects" else getattr(case.data, table)
            one = replace(one, drawn=getattr(of, key), calibrated=value)
        put_in.append(one)
    # Bodies in other folders are not copied.
    for body, path in case.bodies.items():
        if path.parent != campaign:
            document["bodies"][body] = str(path.resolve())
    with _copy_of_files(campaign, folder) as partial:
        (partial / name).write_bytes(tomli_w.dumps(document).encode())
    return tuple(put_in)


def _known_values(
    law: str, values: Mapping[str, NamedValue], kind: CampaignKind
) -> dict[str, KnownValue]:
    """What ``[baseline.fixed]`` may hold of a law: names that the kind knows, pairs as a whole.

    An error of one sensor is published with the sensor's name, ``g_s137``, and known without.
    """
    known = {}
    for name in kind.parameters[law]:
        of_sensor = (values[one] for one in values if one.startswith(f"{name}_"))
        value = values.get(name) or (next(of_sensor, None) if law.startswith("sensor_") else None)
        if value is not None and math.isfinite(value.value) and math.isfinite(value.std):
            known[name] = KnownValue(value.value, value.std)
    return {
        name: value
        for name, value in known.items()
        if kind.partners.get((law, name), name) in known
    }


def _predicted(diagnosis: Diagnosis, effects: Sequence[str], take: str | None) -> float:
    """Held-out RMS that a diagnosis gives its laws; not a number where it did not fit the set."""
    far = diagnosis.reduction_law or diagnosis.reduction
    if take is None and far is not None:
        return far.rms_after
    ranking = diagnosis.attribution.ranking
    sizes = [one.held_out_rms for one in ranking if set(one.effects) == set(effects)]
    return sizes[0] if sizes else math.nan


def _compared(calibration: Calibration, after: Diagnosis, out: Path) -> Calibration:
    """Calibration with what became of the gap."""
    from carrierflex.diagnosis.report.verdict_words import next_step, verdict_heading
    from carrierflex.workflows.diagnosis.gap_change import first_sentence

    change = compare_diagnoses.compared_gaps(out / BEFORE, out / AFTER, out / CHANGE)
    text = f"{first_sentence(change)} {verdict_heading(after)}."
    if after.verdict != AT_NOISE_FLOOR:
        text += f" {next_step(after)}"
    return replace(calibration, text=text, ratio=change.ratio, ratio_ci95=change.ratio_ci95)


def _write(calibration: Calibration, inputs: Mapping[str, object], out: Path) -> None:
    written = {"software": software_name(), "versions": versions(), **inputs}
    save_json(out / CALIBRATION_FILE, json_content(CALIBRATION, calibration, **written))

"""How another program gets a body, or a linearised mounting or stage; bodies of others as well.

Writes a file in that program's own format, with what was measured on the way, and what can be
checked of the body alone before and after.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.reduction.exports.openfast_files import Form
    from carrierflex.reduction.imports.conversion_checks import ConversionCheck
    from carrierflex.reduction.reduced_model import ReducedModel


#: Frame of a mounting's and a stage's loads and sensors.
_CASE_FRAME = (
    "x downwind along the rotation axis, z up, right-handed; a stage in the frame of its carrier "
    "at carrier angle 0"
)


@dataclass(frozen=True, eq=False)
class ExportedBody:
    """What was written: the files, and figures measured on the way.

    Their names in words with units.
    """

    files: tuple[Path, ...]
    figures: Mapping[str, float]
    checks: tuple[ConversionCheck, ...] = ()
    """Figures of the body before, and of the written file read back."""
    losses: tuple[str, ...] = ()
    """What the written file does not hold of the body that was read, one line each."""


def main(
    body: Path,
    *,
    format: Literal[
        "body",
        "op4",
        "dmig",
        "mbdyn",
        "sid",
        "exudyn",
        "simscape",
        "openfast",
        "openfast-flex5",
        "statespace",
    ],
    out: Path,
    pilot: str | None = None,
    run: str | None = None,
    units: Literal["m-N", "mm-N", "in-lbf"] = "m-N",
    quiet: bool = False,
) -> ExportedBody:
    """Write a reduced body for another program, or the state space of a body or a case.

    SI units, body frame, pilots first, as every header states.

    Parameters
    ----------
    body
        Body file (.h5), or a body of another program.

        Of carrierflex reduce or join; of another program: .op4
        with .asm and .pch beside it, DMIG (.pch, .bdf, .dat), .SID_FEM, .hdf5 of Exudyn, .mat of
        Simscape. With statespace also a case of kind mounting or a stage case (TOML, or the name
        of a bundled one), which is linearised.
    format
        Format of the file.

        body: body file (.h5); op4: Nastran external superelement (.op4, with .asm, .pch and .txt
        beside it); dmig: Nastran bulk data, ten digits; mbdyn: modal data with inertia invariants
        (.fem); sid: standard input data (SID_FEM); simscape: .mat; exudyn: FEMinterface (.hdf5),
        which needs the finite elements: they are computed again from the inputs recorded in the
        body file, and the result is compared with the file; openfast: superelement of ExtPtfm
        (.dat, with _SE.dat and _Conn.dat beside it); openfast-flex5: its form before OpenFAST's
        pull request 3210; statespace: A, B, C, D with names and units (.mat or .npz).
    out
        File to write; its suffix is that of the format. Files of another export are not replaced.
    pilot
        Pilot that the floating frame follows (mbdyn, sid, exudyn), or the superelement's interface
        (openfast); the first of the body by default.
    run
        Run at whose largest torque a case of kind mounting is linearised (statespace); default: the
        first run.
    units
        Units of length and force in a BODY of another program.

        Time in seconds; what is written is in m and N.
    quiet
        Show no progress.

    Returns
    -------
    ExportedBody
        Files and figures measured, the body's checks before and after, and what was lost.
    """
    if format == "statespace":
        return _state_space(body, out, pilot, run, units, Stages(1, quiet))
    if run is not None:
        raise ValueError(f"--run is given, but {format} writes a body; expected it with statespace")
    if body.suffix == ".toml":
        raise ValueError(
            f"{body}: a case, and {format} writes a body; expected a body file (.h5) of "
            "carrierflex reduce, or --format statespace"
        )

    from carrierflex.reduction.imports.foreign_bodies import read_any_body

    imported = read_any_body(body, units)
    model = imported.model
    if pilot is not None and format in ("body", "op4", "dmig", "simscape"):
        raise ValueError(
            f"--pilot is given, but {format} holds no pilot; expected it with mbdyn, sid, exudyn "
            "or openfast only"
        )
    if pilot is not None and pilot not in model.pilots:
        raise ValueError(
            f"{body}: {model.name} has no pilot {pilot!r}; expected one of "
            f"{', '.join(model.pilots)}"
        )
    prepared_folder(out.parent)
    _refuse_to_replace(format, out)
    stages = Stages(2, quiet)
    with stages.stage(
        f"writing {out}" if format != "exudyn" else f"finite elements again, writing {out}"
    ):
        if format == "exudyn":
            written = _exudyn(model, out, pilot, body_folder=body.parent)
        else:
            written = _WRITERS[format](model, out, pilot)
    with stages.stage("checks before and after"):
        return _checked(written, format, model, imported.losses, body)


def _checked(
    written: ExportedBody,
    format: str,
    model: ReducedModel,
    losses: tuple[str, ...],
    source: Path,
) -> ExportedBody:
    """What was written with the checks of the body before and after, and what was lost."""
    from carrierflex.reduction.imports.conversion_checks import conversion_checks
    from carrierflex.reduction.imports.foreign_bodies import FORMAT_OF_SUFFIX, read_any_body

    out = written.files[0]
    again = None
    if FORMAT_OF_SUFFIX.get(out.suffix.lower()) == format:
        again = read_any_body(out).model
    lost = [f"{source.name}: {line}" for line in losses]
    if model.sensor_names and format not in ("body", "statespace"):
        lost.append(f"{format} has no sensors: {len(model.sensor_names)} rows are left out")
    if format == "exudyn" and model.D.any():
        lost.append("exudyn has no damping: that of the body is left out")
    if model.ffrf is not None and again is not None and again.ffrf is None:
        lost.append(
            f"{format} has no inertia invariants: mbdyn and sid cannot be written of {out.name}"
        )
    if format == "dmig":
        lost.append("dmig keeps ten digits")
    if again is None:
        lost.append(f"{format} is not read back by carrierflex: no figures after")
    return replace(written, checks=conversion_checks(model, again), losses=tuple(lost))


def _state_space(
    source: Path, out: Path, pilot: str | None, run: str | None, units: str, stages: Stages
) -> ExportedBody:
    from carrierflex.files.whole_files import refuse_foreign
    from carrierflex.reduction.exports.ordered_body import FRAME, UNITS
    from carrierflex.reduction.exports.state_space_files import refuse_suffix, write_state_space
    from carrierflex.reduction.imports.foreign_bodies import FORMAT_OF_SUFFIX, read_any_body
    from carrierflex.reduction.state_space import body_state_space
    from carrierflex.workflows.simulation.linearised_case import case_state_space

    refuse_suffix(out)
    if pilot is not None:
        raise ValueError("--pilot is given, but statespace holds no pilot; leave it out")
    is_body = source.suffix.lower() in FORMAT_OF_SUFFIX
    if is_body and run is not None:
        raise ValueError(
            f"--run is {run!r} and {source} is a body, which is linear; expected --run with a case "
            "of kind mounting"
        )
    prepared_folder(out.parent)
    refuse_foreign(out, UNITS)
    with stages.stage(f"state space of {source}, writing {out}"):
        system = (
            body_state_space(read_any_body(source, units).model)
            if is_body
            else case_state_space(source, run)
        )
        write_state_space(system, out, frame=FRAME if is_body else _CASE_FRAME)
    sizes = {"states": system.states, "inputs": system.inputs, "outputs": system.outputs}
    figures = {name: float(len(signals.names)) for name, signals in sizes.items()}
    return ExportedBody((out,), figures | dict(system.operating_point))


def _refuse_to_replace(format: str, out: Path) -> None:
    """Refuse where an export would replace files of others, or of another export."""
    from carrierflex.files.whole_files import refuse_foreign
    from carrierflex.reduction.exports.ordered_body import UNITS

    if format == "body":
        from carrierflex.reduction.body_files import FORMAT

        refuse_foreign(out, FORMAT)
        return
    if format in _OPENFAST_FORMS:
        from carrierflex.reduction.exports.openfast_files import openfast_files

        refuse_foreign(out, UNITS, "EXTPTFM")
        for partner in openfast_files(out, _OPENFAST_FORMS[format])[1:]:
            refuse_foreign(partner, UNITS)
        return
    if format != "op4":
        refuse_foreign(out, UNITS, *(["K2GG = KAAX"] if format == "dmig" else []))
        return
    partners = [out.with_suffix(suffix) for suffix in (".asm", ".pch", ".txt")]
    for partner in partners:
        refuse_foreign(partner, UNITS, "kaa, maa, baa")
    # Matrices alone do not say who wrote them; the text beside them does.
    if not partners[-1].exists():
        refuse_foreign(out, UNITS)


def _body(model: ReducedModel, out: Path, pilot: str | None) -> ExportedBody:
    """Body file; its certificate is what its matrices alone show."""
    from carrierflex.reduction.body_files import write_body
    from carrierflex.reduction.certificate import Certificate, inner_checks

    if out.suffix != ".h5":
        raise ValueError(f"{out}: suffix {out.suffix!r}; expected .h5")
    write_body(model, out, Certificate(0.0, inner_checks(model, 0.0)))
    return ExportedBody((out,), {"coordinates": float(model.n_coordinates)})


def _op4(model: ReducedModel, out: Path, pilot: str | None) -> ExportedBody:
    from carrierflex.reduction.exports.op4_files import write_op4
    from carrierflex.reduction.rigid_body_checks import grounding

    return ExportedBody(
        write_op4(model, out), {"grounding of the stiffness [m or rad]": grounding(model)}
    )


def _dmig(model: ReducedModel, out: Path, pilot: str | None) -> ExportedBody:
    from carrierflex.reduction.exports.dmig_files import write_dmig

    return ExportedBody(
        (out,), {"grounding as written, max |K R| / max |K|": write_dmig(model, out)}
    )


def _mbdyn(model: ReducedModel, out: Path, pilot: str | None) -> ExportedBody:
    from carrierflex.reduction.exports.mbdyn_files import write_mbdyn
    from carrierflex.reduction.exports.ordered_body import held_body

    write_mbdyn(model, out, pilot=pilot)
    return ExportedBody((out,), {"modes": float(len(held_body(model, pilot).K))})


def _sid(model: ReducedModel, out: Path, pilot: str | None) -> ExportedBody:
    from carrierflex.reduction.exports.sid_files import write_sid

    frequencies_hz = write_sid(model, out, pilot=pilot)
    return ExportedBody(
        (out,),
        {"modes": float(len(frequencies_hz)), "lowest frequency [Hz]": float(frequencies_hz[0])},
    )


def _simscape(model: ReducedModel, out: Path, pilot: str | None) -> ExportedBody:
    from carrierflex.reduction.exports.simscape_files import write_simscape
    from carrierflex.reduction.rigid_body_checks import grounding

    write_simscape(model, out)
    return ExportedBody((out,), {"grounding of the stiffness [m or rad]": grounding(model)})


def _superelement(model: ReducedModel, out: Path, pilot: str | None, form: Form) -> ExportedBody:
    from carrierflex.reduction.exports.openfast_files import checks, superelement, write_openfast

    body = superelement(model, pilot)
    return ExportedBody(write_openfast(body, out, form), checks(body))


def _exudyn(
    model: ReducedModel, out: Path, pilot: str | None, *, body_folder: Path
) -> ExportedBody:
    from carrierflex.reduction.craig_bampton import craig_bampton
    from carrierflex.reduction.exports.exudyn_files import write_exudyn
    from carrierflex.workflows.reduction.recorded_structure import (
        differences_from,
        recorded_structure,
    )

    if "converted_from" in model.provenance:
        raise ValueError(
            f"{model.name}: exudyn needs the finite elements, which "
            f"{model.provenance['converted_from']} does not hold; expected a body of carrierflex "
            "reduce, or another --format"
        )
    mesh, structure, n_modes = recorded_structure(model, body_folder)
    reduction = craig_bampton(structure, n_modes)
    differences = differences_from(model, reduction.model)
    write_exudyn(structure, reduction, out, mesh=mesh, pilot=pilot)
    return ExportedBody(
        (out,), {f"difference of {name} from the body file": v for name, v in differences.items()}
    )


_WRITERS: dict[str, Callable[[ReducedModel, Path, str | None], ExportedBody]] = {
    "body": _body,
    "op4": _op4,
    "dmig": _dmig,
    "mbdyn": _mbdyn,
    "sid": _sid,
    "simscape": _simscape,
    "openfast": partial(_superelement, form="current"),
    "openfast-flex5": partial(_superelement, form="flex5"),
}
_OPENFAST_FORMS: dict[str, Form] = {"openfast": "current", "openfast-flex5": "flex5"}

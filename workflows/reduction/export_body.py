"""How another multibody code gets a body.

Writes a body file in that code's own format, with what it measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.reduction.reduced_model import ReducedModel


@dataclass(frozen=True, eq=False)
class ExportedBody:
    """What was written: the files, and figures measured on the way.

    Their names in words with units.
    """

    files: tuple[Path, ...]
    figures: Mapping[str, float]


def main(
    body: Path,
    *,
    format: Literal["op4", "dmig", "mbdyn", "sid", "exudyn", "simscape"],
    out: Path,
    pilot: str | None = None,
    quiet: bool = False,
) -> ExportedBody:
    """Write a reduced body for another multibody code.

    SI units, body frame, pilots first, as every header states.

    Parameters
    ----------
    body
        Body file (.h5) that carrierflex reduce wrote.
    format
        op4: Nastran external superelement (.op4, with .asm, .pch and .txt beside it); dmig: Nastran
        bulk data, ten digits; mbdyn: modal data with inertia invariants (.fem); sid: standard input
        data (SID_FEM); simscape: .mat; exudyn: FEMinterface (.hdf5), which needs the finite
        elements: they are made again from the inputs that the body file records, and the result is
        compared with the file.
    out
        File to write; its suffix is that of the format. Files of another export are not replaced.
    pilot
        Pilot that the floating frame follows (mbdyn, sid, exudyn); the first of the body by
        default.
    quiet
        Show no progress.

    Returns
    -------
    ExportedBody
        Files and figures measured.
    """
    from carrierflex.reduction.body_files import read_body

    model = read_body(body)
    if pilot is not None and format not in ("mbdyn", "sid", "exudyn"):
        raise ValueError(
            f"--pilot is given, but {format} holds no pilot; expected it with mbdyn, sid or exudyn "
            "only"
        )
    if pilot is not None and pilot not in model.pilots:
        raise ValueError(
            f"{body}: {model.name} has no pilot {pilot!r}; expected one of "
            f"{', '.join(model.pilots)}"
        )
    prepared_folder(out.parent)
    _refuse_to_replace(format, out)
    stages = Stages(1, quiet)
    with stages.stage(
        f"writing {out}" if format != "exudyn" else f"finite elements again, writing {out}"
    ):
        if format == "exudyn":
            return _exudyn(model, out, pilot, beside=body.parent)
        return _WRITERS[format](model, out, pilot)


def _refuse_to_replace(format: str, out: Path) -> None:
    """Refuse where an export would replace files of others, or of another export."""
    from carrierflex.files.whole_files import refuse_foreign
    from carrierflex.reduction.exports.ordered_body import UNITS

    if format != "op4":
        refuse_foreign(out, UNITS, *(["K2GG = KAAX"] if format == "dmig" else []))
        return
    partners = [out.with_suffix(suffix) for suffix in (".asm", ".pch", ".txt")]
    for partner in partners:
        refuse_foreign(partner, UNITS, "kaa, maa, baa")
    # Matrices alone do not say who wrote them; the text beside them does.
    if not partners[-1].exists():
        refuse_foreign(out, UNITS)


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


def _exudyn(model: ReducedModel, out: Path, pilot: str | None, *, beside: Path) -> ExportedBody:
    from carrierflex.reduction.craig_bampton import craig_bampton
    from carrierflex.reduction.exports.exudyn_files import write_exudyn
    from carrierflex.workflows.reduction.recorded_structure import (
        differences_from,
        recorded_structure,
    )

    mesh, structure, n_modes = recorded_structure(model, beside)
    reduction = craig_bampton(structure, n_modes)
    differences = differences_from(model, reduction.model)
    write_exudyn(structure, reduction, out, mesh=mesh, pilot=pilot)
    return ExportedBody(
        (out,), {f"difference of {name} from the body file": v for name, v in differences.items()}
    )


_WRITERS: dict[str, Callable[[ReducedModel, Path, str | None], ExportedBody]] = {
    "op4": _op4,
    "dmig": _dmig,
    "mbdyn": _mbdyn,
    "sid": _sid,
    "simscape": _simscape,
}

"""Main shaft, carrier and pins as one body.

The rotating group of the 2012 paper (section 3.1 and figure 12).

Joins body files that ``carrierflex reduce`` wrote, the carrier sitting on the shaft with a small
tilt. A good answer: the first elastic mode is a bending of the shaft, in which the carrier follows
as a whole; and the tilt shows in full at the rim only while no second bearing holds the carrier
straight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.workflows.outputs import prepared_folder, save_table

if TYPE_CHECKING:
    from carrierflex.reduction.assembly_modes import AssemblyMode
    from carrierflex.reduction.reduced_model import ReducedModel
    from carrierflex.reduction.shaft_joint import RotatingGroup

#: Elastic modes on the screen.
_N_MODES = 12


@dataclass(frozen=True, eq=False)
class JoinedGroup:
    """The group, its elastic free modes, order-1 swing of the rim [m] by support, and the files."""

    group: RotatingGroup
    modes: tuple[AssemblyMode, ...]
    swing: Mapping[str, float]
    files: tuple[Path, ...]


def main(
    *,
    carrier: Path,
    shaft: Path,
    out: Path,
    pin: Path | None = None,
    pin_fit: float = PAPER_STIFFNESS,
    phi_plc: float = 0.0,
    theta_plc: float = 0.0,
) -> JoinedGroup:
    """Join main shaft, carrier and pins to one body, the carrier tilted on the shaft.

    Parameters
    ----------
    carrier
        Body file (.h5) of the carrier; of variant flexible with --pin, of variant stiff without.
    shaft
        Body file of the main shaft (carrierflex reduce --body main_shaft).
    out
        File to write (.h5), in the carrier's frame; with a tilt also OUT_misalignment.csv: its
        constant load on every coordinate [N, N m], and what it adds to every sensor [m].
    pin
        Body file of the pin (carrierflex reduce --body pin), joined three times.
    pin_fit
        Bending and torsional stiffness of each of the six pin interfaces [N m/rad].
    phi_plc
        Tilt of the carrier against the shaft [rad], positive as in equation 1 of the 2012 paper;
        0.6e-3 was measured.
    theta_plc
        Angle of the tilt's axis in the carrier's frame [rad].

    Returns
    -------
    JoinedGroup
        The group with its elastic free modes and what the tilt does at the rim.
    """
    if out.suffix != ".h5":
        raise ValueError(f"{out}: suffix {out.suffix!r}; expected .h5")

    from carrierflex.reduction.assembly_modes import assembly_modes
    from carrierflex.reduction.body_files import read_body, write_body
    from carrierflex.reduction.shaft_joint import (
        SUPPORTS,
        Misalignment,
        carrier_on_shaft,
        rim_swing,
        rotating_group,
    )

    misalignment = Misalignment(phi_plc, theta_plc)
    body, main_shaft = read_body(carrier), read_body(shaft)
    if pin is None:
        group = carrier_on_shaft(body, main_shaft, misalignment)
    else:
        group = rotating_group(
            body, read_body(pin), main_shaft, pin_fit=pin_fit, misalignment=misalignment
        )
    modes = assembly_modes(group.model, _N_MODES)
    swing = (
        {name: rim_swing(group, supports) for name, supports in SUPPORTS.items()} if phi_plc else {}
    )
    prepared_folder(out.parent)
    write_body(group.model, out)
    files = (out, *_misalignment_files(group, out)) if phi_plc else (out,)
    return JoinedGroup(group, modes, swing, files)


def _misalignment_files(group: RotatingGroup, out: Path) -> tuple[Path, ...]:
    model: ReducedModel = group.model
    path = out.with_name(f"{out.stem}_misalignment.csv")
    loads = [
        ["load", label, value]
        for label, value in zip(model.labels, group.imposed.load, strict=True)
    ]
    offsets = zip(model.sensor_names, group.imposed.sensor_offset, strict=True)
    save_table(
        path,
        ["kind", "name", "value [N, N m or m]"],
        [*loads, *(["offset", *pair] for pair in offsets)],
    )
    return (path,)

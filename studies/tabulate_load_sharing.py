"""How the planets share the load, over torque, rotor moment and support, beside what was measured.

Static equilibria over a turn of the shipped case ``stage_load_sharing.toml``, of the same stage
without clearances (the later gearbox of the family has preloaded bearings), and of what is changed
one at a time:

    python -m studies.tabulate_load_sharing --out load_sharing

writes load_sharing.csv, load_sharing.md and load_sharing.png. A good answer: the measured factors
lie within what the ranges of the unpublished supports give, and one case meets all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from carrierflex.identification.carrier.printed_tables import FULL_TORQUE
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.load_channels import load_columns
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.papers.gap_posterior import EXTREME_MOMENT, MEASURED
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from studies.case_files import write_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Shipped case with the clearances, and carrier angles of a turn.
CASE, _ANGLES = "stage_load_sharing", 12
#: Bearings of the later gearbox: preloaded, no clearance.
_PRELOADED = dict.fromkeys(("upwind_clearance", "downwind_clearance", "planet_clearance"), 0.0)
_TORQUES = (90e3, 180e3, 270e3, 360e3)
_MOMENTS = (-300e3, -200e3, -100e3, 0.0, 100e3, 200e3, 300e3)


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage of the study."""

    name: str
    data: StageData
    effects: StageEffects = field(default_factory=StageEffects)


@dataclass(frozen=True)
class SharingRow:
    """What the planets of a stage carry over a turn."""

    stage: Annotated[str, "stage"]
    torque: Annotated[float, "torque [N m]"]
    moment: Annotated[float, "rotor moment about y, positive upwards at the hub [N m]"]
    share: Annotated[float, "largest tangential share times three"]
    pin: Annotated[float, "largest pin load over their mean"]
    upwind: Annotated[float, "most loaded upwind row over half of T / (3 a)"]
    downwind: Annotated[float, "most loaded downwind row over half of T / (3 a)"]
    sun: Annotated[float, "largest lateral force on the sun [N]"]


def sharing(body: StageBody, stage: Stage, torque: float, moment: float) -> SharingRow:
    """Factors of a stage under a torque and a rotor moment [N m].

    The moment is ``ntl_z ntl_arm``: a vertical load at the hub.
    """
    data = stage.data
    load = SteadyLoad(torque, ntl_z=moment / data.mounting.ntl_arm)
    model = stage_model(body, data, effects=stage.effects, speed=0.0)
    record = quasi_static_turn(model, load, _ANGLES)
    columns = load_columns(model, record, part_loads(model, record.c))
    expected = torque / (2.0 * body.n_planets * data.gear.centre_distance)
    pins = range(1, body.n_planets + 1)
    upwind, downwind = (
        max(columns[f"pin_{pin}_{side}_row"].max() for pin in pins) / expected
        for side in ("upwind", "downwind")
    )
    lateral = np.hypot(columns["sun_support_y"], columns["sun_support_z"])
    return SharingRow(
        stage.name,
        torque,
        moment,
        float(columns["load_sharing_factor"].max()),
        float(columns["pin_load_factor"].max()),
        float(upwind),
        float(downwind),
        float(lateral.max()),
    )


def with_bearings(stage: Stage, name: str, values: Mapping[str, float]) -> Stage:
    """Copy under a name, with some bearings changed."""
    data = stage.data
    return Stage(
        name, replace(data, bearings=replace(data.bearings, **dict(values))), stage.effects
    )


def loose_and_preloaded() -> tuple[Stage, Stage]:
    """The shipped case, and the same without clearances."""
    case = read_stage_case(shipped_case(CASE))
    loose = Stage("with clearances", case.data, case.effects)
    return loose, with_bearings(loose, "preloaded", _PRELOADED)


def changed_stages(loose: Stage) -> tuple[Stage, ...]:
    """The case with one choice changed at a time, to the ends of its range and in between."""
    of_sun: tuple[tuple[str, dict[str, float]], ...] = (
        ("quill 5e6 N/m, the default: the sun floats", {"sun_radial": 5e6}),
        ("quill 1.3e8 N/m, 150 mm x 0.5 m", {"sun_radial": 1.3e8}),
        ("quill 3e8 N/m", {"sun_radial": 3e8}),
        ("quill 1.4e9 N/m, 186 mm x 0.3 m", {"sun_radial": 1.4e9}),
        ("no friction: 0.3 mm of play", {"sun_friction": 0.0}),
        ("friction 0.1", {"sun_friction": 0.1}),
        ("friction 0.15", {"sun_friction": 0.15}),
        ("friction 0.05, spline of 90 mm radius", {"spline_radius": 0.09}),
        ("spline without clearance", {"sun_clearance": 0.0}),
        ("no clearance of the planets", {"planet_clearance": 0.0}),
    )
    data = loose.data
    thrice = tuple(3.0 * offset for offset in loose.effects.pin_offset)
    return (
        *(with_bearings(loose, name, values) for name, values in of_sun),
        replace(loose, name="pins in place", effects=StageEffects()),
        replace(loose, name="pins 30 um out", effects=StageEffects(pin_offset=thrice)),
        replace(
            loose,
            name="teeth do not resist tilt",
            data=replace(data, mesh=replace(data.mesh, n_slices=1)),
        ),
        replace(
            loose,
            name="planet bearings 1.7e10 N/m as springs",
            data=replace(data, planet_rollers=None),
        ),
    )


def sharing_rows(body: StageBody) -> list[SharingRow]:
    """Both gearboxes over torque and moment, then the changed ones at full torque."""
    both = loose_and_preloaded()
    rows = [
        sharing(body, stage, torque, moment)
        for stage in both
        for torque in _TORQUES
        for moment in _MOMENTS
    ]
    return rows + [
        sharing(body, stage, FULL_TORQUE, moment)
        for stage in changed_stages(both[0])
        for moment in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)
    ]


def sharing_table(rows: Iterable[SharingRow]) -> list[str]:
    """Full torque as Markdown: a row a stage, without and with moment downwards and upwards."""
    by_stage: dict[str, dict[float, SharingRow]] = {}
    for row in rows:
        if row.torque == FULL_TORQUE:
            by_stage.setdefault(row.stage, {})[row.moment] = row
    lines = [
        "| stage, 360 kN m | factor | -300 kN m | +300 kN m | pin load over mean | upwind row, "
        "no moment | downwind | sun, -300 kN m [kN] |",
        "|---|---|---|---|---|---|---|---|",
        f"| measured, with clearances | {MEASURED.no_moment:.2f} | {MEASURED.extreme_moment:.2f}, "
        f"sign not stated | as before | | {MEASURED.upwind_row:.2f} | | |",
        f"| measured, preloaded | {' | '.join(3 * [f'below {MEASURED.preloaded:.2f}'])} | | | | |",
    ]
    for name, at in by_stage.items():
        none, down, up = (at[moment] for moment in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT))
        pins = ", ".join(f"{row.pin:.3f}" for row in (none, down, up))
        lines.append(
            f"| {name} | {none.share:.3f} | {down.share:.3f} | {up.share:.3f} | {pins} | "
            f"{none.upwind:.2f} | {none.downwind:.2f} | {down.sun / 1e3:.1f} |"
        )
    return lines


def sharing_figure(rows: Iterable[SharingRow]) -> Figure:
    """Factor over rotor moment for both gearboxes by torque, then over the supports."""
    from matplotlib.figure import Figure

    rows = list(rows)
    figure = Figure(figsize=(13.0, 5.0), layout="constrained")
    *panels, supports = figure.subplots(1, 3)
    for panel, stage in zip(panels, loose_and_preloaded(), strict=True):
        for i, torque in enumerate(_TORQUES):
            chosen = [row for row in rows if row.stage == stage.name and row.torque == torque]
            moments = [row.moment / 1e3 for row in chosen]
            label = f"{torque / 1e3:g} kN m"
            panel.plot(moments, [row.share for row in chosen], f"C{i}o-", label=label, ms=3)
            panel.plot(moments, [row.pin for row in chosen], f"C{i}:", lw=1.0)
        panel.set(title=f"stage {stage.name}", xlabel="rotor moment [kN m]")
        panel.set_ylim(0.99, 1.3)
    for level, text in (
        (MEASURED.no_moment, "measured, no moment"),
        (MEASURED.extreme_moment, "measured, extreme moment"),
    ):
        panels[0].axhline(level, color="black", ls="--", lw=1.0)
        panels[0].text(-300.0, level + 0.003, f"{text}: {level:.2f}", fontsize="small")
    panels[1].axhline(MEASURED.preloaded, color="black", ls="--", lw=1.0)
    panels[1].text(-300.0, MEASURED.preloaded + 0.003, "measured: below 1.10", fontsize="small")
    panels[0].set_ylabel("load sharing factor, largest share times three")
    panels[0].legend(title="torque; dotted: pin load over mean", fontsize="small")
    loose = loose_and_preloaded()[0].name
    full = [r for r in rows if r.torque == FULL_TORQUE and abs(r.moment) in (0.0, EXTREME_MOMENT)]
    names = list(
        dict.fromkeys(
            r.stage
            for r in full
            if r.stage == loose or r.stage not in {stage.name for stage in loose_and_preloaded()}
        )
    )
    for moment, marker, label in (
        (0.0, "ko", "no moment"), (-EXTREME_MOMENT, "C3v", "-300 kN m"),
        (EXTREME_MOMENT, "C0^", "+300 kN m"),
    ):  # fmt: skip
        of_moment = {row.stage: row.share for row in full if row.moment == moment}
        values = [of_moment[name] for name in names]
        supports.plot(values, range(len(names)), marker, label=label, ms=5)
    supports.axvline(MEASURED.no_moment, color="black", ls="--", lw=1.0)
    supports.axvline(MEASURED.extreme_moment, color="C3", ls="--", lw=1.0)
    supports.set_yticks(range(len(names)), names, fontsize="x-small")
    supports.invert_yaxis()
    supports.set(title="one choice changed, 360 kN m", xlabel="factor; dashed: measured")
    supports.legend(fontsize="small", loc="upper right")
    supports.set_xlim(0.99, 1.32)
    for panel in (*panels, supports):
        panel.grid(alpha=0.3)
    return figure


def main(*, out: Path, size: float = 0.045) -> None:
    """Compute the factors; write load_sharing.csv, load_sharing.md and load_sharing.png.

    Parameters
    ----------
    out
        Folder.
    size
        Element edge length of carrier and pins [m].
    """
    folder = prepared_folder(out)
    case = read_stage_case(shipped_case(CASE))
    rows = sharing_rows(default_stage_body(case.pin_fit_stiffness, size))
    names = [entry.name for entry in fields(SharingRow)]
    values: list[list[Any]] = [[getattr(row, name) for name in names] for row in rows]
    lines = [",".join(names)]
    lines += [
        ",".join(f'"{v}"' if isinstance(v, str) else f"{v:.6g}" for v in row) for row in values
    ]
    write_table(folder / "load_sharing.csv", lines)
    write_table(folder / "load_sharing.md", sharing_table(rows))
    save_figure(folder / "load_sharing.png", sharing_figure(rows))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

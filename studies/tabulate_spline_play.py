"""What the play of the sun's spline moves: load sharing, and the rim at the proximity sensors.

    python -m studies.tabulate_spline_play --out spline_play

writes spline_play.md: static turns of the case ``stage_load_sharing.toml`` with the spline's
sideways clearance and friction over their ranges, beside a spline without clearance; then the turn
that its backlash leaves free. A good answer says whether a carrier's sensors see the spline.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.carrier.printed_tables import FULL_TORQUE
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.papers.gap_posterior import EXTREME_MOMENT, LOADS
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.case_files import write_table
from studies.tabulate_load_sharing import (
    CASE,
    Stage,
    loose_and_preloaded,
    sharing,
    with_bearings,
)

#: Friction and sideways clearance [m] over the ranges of ``[bearings]``; backlashes [m].
FRICTIONS, CLEARANCES, BACKLASHES = (0.0, 0.05, 0.15), (0.1e-3, 0.3e-3), (0.1e-3, 0.3e-3)
#: Carrier angles of a turn.
_ANGLES = 12


@dataclass(frozen=True)
class SplineRow:
    """What a spline gives: factors without moment, downwards and upwards; motion at the sensors."""

    spline: str
    factors: tuple[float, float, float]
    static: float
    """RMS over sensors and load cases of what the mean moves [m]."""
    order_1: float
    """Largest change of an amplitude [m]."""
    order_3: float


def orders(body: StageBody, stage: Stage) -> NDArray[np.complex128]:
    """Orders of the axial sensors, zeroed at rest, under the paper's four loads [m].

    Shape (4, n_sensors, n_orders).
    """
    model = stage_model(body, stage.data, effects=stage.effects, speed=0.0)
    at = np.array(
        [
            sensor_orders(model, quasi_static_turn(model, load, _ANGLES), SENSORS).amplitudes
            for load in (SteadyLoad(0.0), *LOADS)
        ]
    )
    at[1:, :, 0] -= at[0, :, 0]
    return at[1:]


def spline_rows(body: StageBody) -> list[SplineRow]:
    """Splines of the ranges beside one without clearance."""
    loose, _ = loose_and_preloaded()
    tight = with_bearings(loose, "no clearance", {"sun_clearance": 0.0, "sun_friction": 0.0})
    stages = [
        with_bearings(
            loose,
            f"clearance {1e3 * clearance:g} mm, friction {friction:g}",
            {"sun_clearance": clearance, "sun_friction": friction},
        )
        for friction in FRICTIONS
        for clearance in CLEARANCES
    ]
    start = orders(body, tight)
    rows = []
    for stage in (tight, *stages):
        moved = np.abs(orders(body, stage) - start)
        none, down, up = (
            sharing(body, stage, FULL_TORQUE, moment).share
            for moment in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)
        )
        static = float(np.sqrt((moved[:, :, 0] ** 2).mean()))
        largest = moved.max(axis=(0, 1))
        rows.append(
            SplineRow(stage.name, (none, down, up), static, float(largest[1]), float(largest[3]))
        )
    return rows


def spline_table(rows: Iterable[SplineRow]) -> list[str]:
    """Table of docs/stage_model.md."""
    lines = [
        "| spline | factor | -300 kN m | +300 kN m | static, RMS [um] | order 1 [um] | "
        "order 3 [um] |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        factors = " | ".join(f"{factor:.3f}" for factor in row.factors)
        moved = (f"{1e6 * value:.1f}" for value in (row.static, row.order_1, row.order_3))
        lines.append(f"| {row.spline} | {factors} | {' | '.join(moved)} |")
    return lines


def backlash_table(data: StageData) -> list[str]:
    """Turn of the sun in its spline and of the carrier with it, where the torque turns round."""
    lines = [
        "| backlash around the spline [mm] | sun [mrad] | carrier [mrad] | generator [mrad] |",
        "|---|---|---|---|",
    ]
    for backlash in BACKLASHES:
        sun = backlash / data.bearings.spline_radius
        turned = (sun, sun / data.gear.ratio, sun * data.chain.parallel_ratio)
        cells = " | ".join(f"{1e3 * angle:.3g}" for angle in turned)
        lines.append(f"| {1e3 * backlash:g} | {cells} |")
    return lines


def main(*, out: Path, size: float = 0.045) -> None:
    """Compute both tables; write spline_play.md.

    Parameters
    ----------
    out
        Folder.
    size
        Element edge length of carrier and pins [m].
    """
    folder = prepared_folder(out)
    case = read_stage_case(shipped_case(CASE))
    rows = spline_rows(default_stage_body(case.pin_fit_stiffness, size))
    write_table(folder / "spline_play.md", [*spline_table(rows), "", *backlash_table(case.data)])


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)

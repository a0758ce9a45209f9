"""Results of the simulation's workflows as tables on the screen."""

from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.markup import escape

from carrierflex.workflows.screen.titled_table import titled_table

if TYPE_CHECKING:
    from carrierflex.workflows.simulation.export_fmu import ExportedUnit
    from carrierflex.workflows.simulation.simulate_table_5 import Table5


def table_5_table(found: "Table5") -> RenderableType:
    """RMS of the eight simulations beside the paper's."""
    from carrierflex.workflows.simulation.simulate_table_5 import PAPER

    table = titled_table(
        "table 5 of the 2012 paper", "simulation", "RMS, mm", "paper, mm", "identified tilt, mrad"
    )
    for (name, kind), rms in found.rms.items():
        cells = (
            f"{rms * 1e3:.3f}",
            f"{PAPER[name, kind] * 1e3:.3f}",
            f"{found.tilt[name] * 1e3:.3f}",
        )
        table.add_row(f"{name}, {kind}", *cells)
    return table


def fmu_table(found: "ExportedUnit") -> RenderableType:
    """File of the unit and what it holds."""
    table = titled_table("co-simulation unit", "figure", "value")
    table.add_row("file", escape(str(found.file)))
    table.add_row("own step, s", f"{found.step:g}")
    compiled = (
        "sources and a library for this platform"
        if found.compiled
        else "sources only: no C compiler was used"
    )
    table.add_row("holds", compiled)
    return table

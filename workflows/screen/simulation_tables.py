"""Results of the simulation's workflows as tables on the screen."""

from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from carrierflex.simulation.mounting.rig import SENSORS
from carrierflex.workflows.screen.titled_table import titled_table

if TYPE_CHECKING:
    from carrierflex.workflows.figures.draw_figures import DrawnFigures
    from carrierflex.workflows.papers.gap_rows import PapersGap
    from carrierflex.workflows.simulation.compute_torsion import Torsion
    from carrierflex.workflows.simulation.estimate_gear_life import GearLife
    from carrierflex.workflows.simulation.export_fmu import ExportedUnit
    from carrierflex.workflows.simulation.identified_life import Bounded, IdentifiedLife
    from carrierflex.workflows.simulation.simulate_carrier import SimulatedLoadCases
    from carrierflex.workflows.simulation.simulate_mounting import SimulatedMounting
    from carrierflex.workflows.simulation.simulate_stage import SimulatedStage
    from carrierflex.workflows.simulation.simulate_table_5 import Table5
    from carrierflex.workflows.simulation.study_order_one import OrderOneStudy
    from carrierflex.workflows.simulation.vary_mounting import Variants


#: Rows of the table of variants on the screen; the file holds all of them.
_MOST_ROWS = 20


def campaign_table(
    simulated: "SimulatedLoadCases | SimulatedMounting | SimulatedStage | Variants",
) -> RenderableType:
    """Runs of a simulated campaign, and the energy balances that were made.

    Or the RMS of the variants.
    """
    from carrierflex.workflows.simulation.vary_mounting import Variants

    if isinstance(simulated, Variants):
        return _variants_table(simulated)
    table = titled_table("simulated campaign", "run", "condition", "samples", "file")
    lengths = getattr(simulated, "n_samples", {})  # of runs that went to their files piece by piece
    for run in simulated.campaign.runs:
        n_samples = lengths.get(run.name, len(run.time))
        table.add_row(run.name, run.condition, str(n_samples), str(simulated.folder / run.file))
    balances = getattr(simulated, "balances", {})
    if not balances:
        return table
    energies = titled_table(
        "energy balance, J", "run", "work", "dissipated", "stored", "left over / work"
    )
    for name, balance in balances.items():
        values = (balance.work[-1], balance.dissipated[-1], balance.stored[-1])
        energies.add_row(name, *(f"{value:.4g}" for value in values), f"{balance.error:.1e}")
    return Group(table, "", energies)


def _variants_table(variants: "Variants") -> RenderableType:
    shown: list[RenderableType] = []
    for run, rms in variants.rms.items():
        table = titled_table(f"RMS of {run}, um", *variants.names, *SENSORS)
        for parameters, values in list(zip(variants.sets, rms, strict=True))[:_MOST_ROWS]:
            numbers = ("diverged" if np.isnan(value) else f"{value * 1e6:.4g}" for value in values)
            table.add_row(*(f"{value:.4g}" for value in parameters), *numbers)
        shown.append(table)
    return Group(*shown, f"{len(variants.sets)} parameter sets in {variants.file}")


def table_5_table(table_5: "Table5") -> RenderableType:
    """RMS of the eight simulations beside the paper's."""
    from carrierflex.workflows.simulation.simulate_table_5 import PAPER

    table = titled_table(
        "table 5 of the 2012 paper", "simulation", "RMS, mm", "paper, mm", "identified tilt, mrad"
    )
    for (name, kind), rms in table_5.rms.items():
        cells = (
            f"{rms * 1e3:.3f}",
            f"{PAPER[name, kind] * 1e3:.3f}",
            f"{table_5.tilt[name] * 1e3:.3f}",
        )
        table.add_row(f"{name}, {kind}", *cells)
    return table


def order_one_table(study: "OrderOneStudy") -> RenderableType:
    """Order 1 by support, and by load case beside the paper's."""
    table = titled_table(
        "support of carrier and housing", "order 1, um", "over the misalignment", "order 2, um"
    )
    for row in study.rows:
        numbers = (f"{row.order_1 * 1e6:.2f}", f"{row.share:.3f}", f"{row.order_2 * 1e6:.1f}")
        table.add_row(row.name, *numbers)
    names = list(study.load_cases)
    cases = titled_table("order 1 by load case, um", *study.load_cases[names[0]])
    for name in names:
        cases.add_row(name, *(f"{value * 1e6:.0f}" for value in study.load_cases[name].values()))
    paper = (study.paper.get(case) for case in study.load_cases[names[0]])
    cases.add_row("paper, table 5", *("-" if v is None else f"{v * 1e6:.0f}" for v in paper))
    return Group(table, "", cases)


def papers_gap_table(gap: "PapersGap") -> RenderableType:
    """Order of the hypotheses, then the answer, the next measurement and the checks."""
    from carrierflex.workflows.papers.gap_page import check_sentences, gap_sentences

    table = titled_table("the papers' gap", "first", "second", "log evidence, difference", "better")
    for row in gap.order:
        difference = f"{row.least:+.1f} to {row.most:+.1f}"
        table.add_row(row.first, row.second, difference, row.better or "not decided")
    sentences = [Text(line) for line in (*gap_sentences(gap), "", *check_sentences(gap))]
    return Group(table, "", *sentences)


def fmu_table(unit: "ExportedUnit") -> RenderableType:
    """File of the unit and what it holds."""
    table = titled_table("co-simulation unit", "figure", "value")
    table.add_row("file", str(unit.file))
    table.add_row("FMI version", unit.fmi)
    table.add_row("model", unit.model)
    table.add_row("largest step inside, s", f"{unit.step:g}")
    compiled = (
        "sources and a library for this platform"
        if unit.compiled
        else "sources only: no C compiler was used"
    )
    table.add_row("holds", compiled)
    return table


def torsion_table(torsion: "Torsion") -> RenderableType:
    """Torsional stiffness of the members and frequencies of the train beside the paper's."""
    from carrierflex.workflows.simulation.compute_torsion import (
        PAPER_FREQUENCIES_HZ,
        PAPER_STIFFNESSES,
    )

    stiffness = titled_table(
        "torsional stiffness, MN m/rad", "member", "torque sweep", "2011 paper"
    )
    for name, sweep in torsion.sweeps.items():
        stiffness.add_row(
            name, f"{sweep.stiffness / 1e6:.3g}", f"{PAPER_STIFFNESSES[name] / 1e6:.3g}"
        )
    frequency = titled_table(
        "frequencies of the torsional train, Hz", "topology", "mounting", "1st", "2nd", "paper, 1st"
    )
    for (topology, mounting), values in torsion.frequencies_hz.items():
        numbers = (f"{values[0]:.3f}", f"{values[1]:.1f}", f"{PAPER_FREQUENCIES_HZ[mounting]:.2f}")
        frequency.add_row(topology, mounting, *numbers)
    remark = (
        "mounting: two bushings; the paper's 11.4 is K1 R_x^2 of one. The stage's main shaft and "
        "sun shaft were derived from the paper's 50 and 27."
    )
    return Group(stiffness, remark, "", frequency)


def figures_table(drawn: "DrawnFigures") -> RenderableType:
    """Figures that were drawn, and their files."""
    table = titled_table("figures of the papers", "figure", "shows", "file")
    for figure in drawn.figures:
        table.add_row(figure.name, figure.title, figure.file)
    return Group(table, f"index: {drawn.folder / 'index.html'}")


def gear_life_table(life: "GearLife") -> RenderableType:
    """Pressure and life of both meshes, aligned and at chosen misalignments."""
    table = titled_table(
        "gear mesh",
        "misalignment, urad",
        "pressure, sun, MPa",
        "life",
        "pressure, ring, MPa",
        "life",
    )
    for k in np.linspace(0, len(life.misalignment) - 1, 6).round().astype(int):
        cells = [
            (
                f"{mesh.aligned_pressure * mesh.pressure_ratio[k] / 1e6:.0f}",
                f"{mesh.life_ratio[k]:.3f}",
            )
            for mesh in life.meshes.values()
        ]
        table.add_row(
            f"{life.misalignment[k] * 1e6:.0f}", *(cell for pair in cells for cell in pair)
        )
    papers = titled_table(
        "1.5 % more pressure (2012 paper, life 0.77)", "mesh", "misalignment, urad"
    )
    for name, mesh in life.meshes.items():
        papers.add_row(f"planet and {name}", f"{mesh.papers_misalignment * 1e6:.0f}")
    stage = titled_table(
        "misalignment in the whole stage",
        "support",
        "carrier",
        "mesh",
        "slope, urad",
        "pressure",
        "life",
    )
    for kink in life.kinks:
        numbers = (
            f"{abs(kink.worst) * 1e6:.3g}",
            f"{(kink.pressure_ratio - 1.0) * 100.0:+.2f} %",
            f"{kink.life_ratio:.3f}",
        )
        stage.add_row(kink.support, kink.carrier, kink.mesh, *numbers)
    if life.identified is None:
        return Group(table, papers, "", stage)
    return Group(table, "", _identified_life(life.identified))


def _identified_life(life: "IdentifiedLife") -> RenderableType:
    """Load and life under the identified tilt, by assumed support."""
    table = titled_table(
        "worst planet over the aligned stage, 95 % intervals",
        "support (assumed)",
        "teeth (assumed)",
        "component",
        "kink, urad",
        "K_Hbeta",
        "life",
    )
    for one in life.components:
        face = "" if one.face_load_factor is None else f"{one.face_load_factor.value:.3g}"
        numbers = (f"{one.kink.value * 1e6:.3g}", face, _bounded(one.life_ratio))
        table.add_row(one.support, one.teeth, one.component, *numbers)
    lines = [
        *(f"identified: {text}" for text in life.identified),
        *(f"assumed: {text}" for text in life.assumed),
        *(
            f"excluded: {support}: no kink up to 20 mrad shows more than {rim * 1e6:.3g} urad at "
            "the rim"
            for support, rim in life.excluded.items()
        ),
    ]
    return Group(table, *lines)


def _bounded(one: "Bounded") -> str:
    return f"{one.value:.3g} ({one.low:.3g} to {one.high:.3g})"

"""Result of a diagnosis as a table on the screen."""

import numpy as np
from rich.console import RenderableType
from rich.markup import escape

from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.diagnosis.report.gap_words import where_text
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.workflows.screen.titled_table import titled_table


def _value_text(named: NamedValue) -> str:
    if not np.isfinite(named.std):
        return "not determined by these records"
    return f"{named.value:.5g} ± {named.std:.1g} {named.unit}"


def diagnosis_table(found: Diagnosis) -> RenderableType:
    """Verdict, where, which and how far."""
    far = found.reduction
    which = found.attribution
    table = titled_table("diagnosis", "quantity", "value")
    table.columns[1].justify = "left"
    rows = [("verdict", found.verdict), ("reason", found.reason), ("where", where_text(found))]
    rows += [("effects", ", ".join(which.effects) or "none")]
    rows += [("aliases", " = ".join(members)) for members in which.aliases]
    for effect, values in which.parameters.items():
        rows += [(f"{effect} {n}", _value_text(named)) for n, named in values.items()]
    rows.append(
        (
            "RMS before, after, floor",
            f"{far.rms_before:.4g}, {far.rms_after:.4g}, {far.noise_floor:.3g} {found.unit}",
        )
    )
    rows.append(("rho, 95 %", f"{far.rho:.4f} [{far.rho_ci95[0]:.4f}, {far.rho_ci95[1]:.4f}]"))
    rows.append(("phi, 95 %", f"{far.phi:.4f} [{far.phi_ci95[0]:.4f}, {far.phi_ci95[1]:.4f}]"))
    others = (far.negative_control_rho, far.black_box_rho, far.extrapolation_rho)
    rows.append(
        (
            "rho of negative control, black box, extrapolation",
            ", ".join(f"{value:.3f}" for value in others),
        )
    )
    if which.discriminating_experiment:
        rows.append(("discriminating experiment", which.discriminating_experiment))
    for name, value in rows:
        table.add_row(name, escape(value))
    return table

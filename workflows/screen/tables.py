"""Results of the workflows as tables on the screen."""

import dataclasses
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Group, RenderableType
from rich.text import Text

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.cad_faces import CadFace
from carrierflex.geometry.cad_recognition.proposal_files import candidate_text
from carrierflex.geometry.cad_recognition.surface_proposal import SurfaceProposal
from carrierflex.geometry.quality import MeshQuality
from carrierflex.identification.carrier.printed_tables import DerivedFacts
from carrierflex.identification.mounting.bushing_models import AXIAL
from carrierflex.reduction.certificate import Certificate
from carrierflex.reduction.interface_mass import (
    DIRECTIONS,
    effective_interface_mass,
    has_fixed_interface_modes,
)
from carrierflex.reduction.mode_names import mode_names
from carrierflex.reduction.pin_joints import PIN_FITS
from carrierflex.reduction.reduced_model import PILOT_COORDINATES, ReducedModel
from carrierflex.simulation.mounting.rig import HOUSING_MOTION
from carrierflex.workflows.screen.titled_table import titled_table as _table

_NO = Text("no", style="red")

if TYPE_CHECKING:
    from carrierflex.workflows.fe.cost_preview import CostPreview
    from carrierflex.workflows.fe.pin_fit_pictures import PinFitStudy
    from carrierflex.workflows.fe.study_sensitivities import SensitivityStudy
    from carrierflex.workflows.identification.identify_bushings import BushingIdentification
    from carrierflex.workflows.identification.identify_parameters import Identification
    from carrierflex.workflows.identification.infer_loads import InferredLoads, LoadValue
    from carrierflex.workflows.reduction.export_body import ExportedBody

#: Smallest share of the effective interface mass that the mode table tells.
_WORTH_TELLING = 0.01
_QUALITY_WORDS = {
    "n_nodes": "nodes",
    "n_tets": "quadratic tetrahedra",
    "volume": "volume, m^3",
    # Other programs call another figure so (gmsh's minSJ).
    "worst_scaled_jacobian": "smallest over largest Jacobian within an element, worst element",
    "worst_shape": "shape of the worst element, 1 is regular",
}


def quality_table(quality: MeshQuality) -> RenderableType:
    """Figures of one mesh."""
    table = _table("mesh", "figure", "value")
    for field in dataclasses.fields(quality):
        table.add_row(_QUALITY_WORDS[field.name], f"{getattr(quality, field.name):.6g}")
    return table


def cad_table(faces: tuple[CadFace, ...]) -> RenderableType:
    """Faces of a CAD model, one a line."""
    return Group(Text("faces of the CAD model", style="bold"), *(str(face) for face in faces))


def proposal_table(proposal: SurfaceProposal) -> RenderableType:
    """Frame, numbered surfaces, candidates by name, and what was assumed."""
    extent = " x ".join(f"{length:.4g}" for length in proposal.solid.extent)
    stated = proposal.frame.length_unit
    unit = f"unit {stated}, as given" if stated else f"unit {proposal.solid.declared}, as declared"
    return Group(
        Text(proposal.step.name, style="bold"),
        f"{unit}: {extent} m, {proposal.solid.volume:.4g} m^3",
        *proposal.reasons,
        *(f"assumed: {text}" for text in proposal.assumed),
        Text("surfaces, numbered as in the picture", style="bold"),
        *(f"[{group.number}] {group.described()}" for group in proposal.groups),
        Text("names", style="bold"),
        *_named_surfaces(proposal),
    )


def _named_surfaces(proposal: SurfaceProposal) -> Iterator[str]:
    for surface in proposal.surfaces:
        if not surface.candidates:
            yield f"{surface.name}: left out, nothing of the solid fits"
        elif surface.chosen is not None:
            yield f"{surface.name}: {candidate_text(surface.chosen)}"
        else:
            alike = "; ".join(candidate_text(each) for each in surface.candidates[: surface.equals])
            yield f"{surface.name}: left out, {surface.equals} candidates fit equally well: {alike}"


def curve_table(curves: "dict[str, DeflectionCurve] | CostPreview") -> RenderableType:
    """Orders and peaks of the deflection curves, or what they would cost."""
    if not isinstance(curves, dict):
        return str(curves)
    orders = curves["delta_f"].first_order * np.array([1, 2, 3])
    columns = (f"order {order}, um" for order in orders)
    table = _table("axial rim deflection", "curve", "per", *columns, "peaks")
    for name, curve in curves.items():
        content = curve.axial_order_content() * 1e6
        unit, peaks = (
            ("kN m", str(len(curve.peak_angles()))) if curve.is_of_torque else ("N on pin 1", "-")
        )
        table.add_row(name, unit, *(f"{content[order]:.4g}" for order in orders), peaks)
    return table


def reduced_table(model: "ReducedModel | CostPreview") -> RenderableType:
    """Size, mass and modes of a reduced body, or what it would cost."""
    if not isinstance(model, ReducedModel):
        return str(model)
    table = _table(f"reduced body {model.name}", "figure", "value")
    mass = model.mass_properties
    table.add_row("coordinates", str(model.n_coordinates))
    asked_for, n_modes = (model.provenance.get(key) for key in ("modes_asked_for", "modes"))
    if asked_for is not None:
        why = "modes of equal frequency are kept together"
        table.add_row("modes", f"{n_modes}, {asked_for} requested: {why}")
    table.add_row("pilots", ", ".join(model.pilots))
    table.add_row("mass, kg", f"{mass.mass:.4g}")
    table.add_row("inertia about x, kg m^2", f"{mass.inertia[0, 0]:.4g}")
    modes = [label for label in model.labels if label.startswith("mode")]
    fixed = model.ffrf is not None and has_fixed_interface_modes(model)
    shares = effective_interface_mass(model) if fixed else np.zeros((len(modes), 6))
    for label, name, share in zip(modes, mode_names(model), shares, strict=False):
        most = int(share.argmax())
        carried = (
            f"; carries {share[most]:.0%} of the {'mass' if most < 3 else 'inertia'} "
            f"{DIRECTIONS[most]}"
        )
        table.add_row(label, name + (carried if share[most] >= _WORTH_TELLING else ""))
    return table


def sensitivity_table(study: "SensitivityStudy") -> RenderableType:
    """Change of each order and frequency in per cent by each cause, one table a body."""
    tables = []
    for body in study.bodies:
        rows = [row for row in study.rows if row.body == body.name]
        quantities = dict.fromkeys(row.quantity for row in rows)
        shown = [name for name in quantities if name.startswith(("delta", "frequency 1"))]
        # Units of the change beside its name: 1 % of a value, 1 mm of an offset.
        table = _table(f"{body.name.replace('_', ' ')}: change, %", "cause", "change", *shown)
        for cause in body.causes:
            changes = {row.quantity: row.change_percent for row in rows if row.cause == cause.name}
            change = "+1 %" if cause.value else f"{1e3 * cause.change:+g} mm"
            table.add_row(cause.name, change, *(f"{changes[name]:+.2f}" for name in shown))
        tables.append(table)
    note = (
        "orders in % of their curve's RMS; whole curves, derivatives and matrices: "
        "sensitivities.h5, what moves what: sensitivities.png"
    )
    return Group(*tables, Text(note, style="dim"))


def pin_fit_table(study: "PinFitStudy") -> RenderableType:
    """Curve and best mix at each decade of the interface stiffness.

    Beside them where the curve changes, and the worst residuals.
    """
    from carrierflex.workflows.fe.pin_fit_pictures import RESIDUALS

    first_two = list(study.tied[0].orders)[:2]
    columns = (
        *(f"order {order}, um" for order in first_two),
        "RMS, um",
        "peaks",
        "rho_s",
        "rho_f",
        "residual, %",
        "sum one: residual, %",
    )
    table = _table("pin interface, N m/rad", "stiffness", *columns)
    for row in study.tied:
        decade = np.log10(row.stiffness) % 1.0 if 0.0 < row.stiffness < np.inf else 0.0
        if min(decade, 1.0 - decade) < 1e-9 or row.stiffness in PIN_FITS.values():
            amplitudes = (*(row.orders[order] for order in first_two), row.rms)
            sizes = (f"{value * 1e6:.4f}" for value in amplitudes)
            shares = (f"{row.rho_s:.3f}", f"{row.rho_f:.3f}")
            residuals = (f"{100.0 * value:.2f}" for value in (row.residual, row.residual_convex))
            table.add_row(f"{row.stiffness:.3g}", *sizes, str(row.peaks), *shares, *residuals)
    changes = [f"{name}: from {stiffness:.3g} N m/rad" for name, stiffness in study.changes.items()]
    worst = _table(
        "worst over the sweep", "mix", "residual, %", "at, N m/rad", "sliding pins: left, %"
    )
    for name, text in RESIDUALS.items():
        tied, sliding = (study.worst[axial][name] for axial in ("tied", "sliding"))
        values = (
            f"{100.0 * tied['residual']:.2f}",
            f"{tied['stiffness']:.3g}",
            f"{100.0 * sliding['residual']:.2f}",
        )
        worst.add_row(text, *values)
    return Group(table, "", *changes, "", worst)


def export_table(exported: "ExportedBody") -> RenderableType:
    """Files written, figures measured on the way, the body before and after, what was lost."""
    table = _table("exported body", "figure", "value")
    for file in exported.files:
        table.add_row("file", str(file))
    for name, value in exported.figures.items():
        table.add_row(name, f"{value:.4g}")
    checks = _table("the body alone", "check", "before", "after", "difference")
    for check in exported.checks:
        cells = (check.before, check.after)
        difference = "" if check.difference is None else f"{check.difference:.1e}"
        checks.add_row(check.name, *("" if v is None else f"{v:.6g}" for v in cells), difference)
    return Group(table, *([checks] if exported.checks else []), *exported.losses)


def certificate_table(certificate: Certificate) -> RenderableType:
    """Every check of a reduction certificate."""
    table = _table(
        "reduction certificate", "check", "required", "actual", "share of the limit", "pass"
    )
    for check in certificate.checks:
        share = check.share_of_limit
        table.add_row(
            check.name,
            check.wanted,
            f"{check.reached:.2g}",
            "" if share is None else f"{share:.2g}" if share < 0.01 else f"{share:.0%}",
            "yes" if check.met else _NO,
        )
    names = " ".join(check.name for check in certificate.checks)
    checked = [
        what
        for what, word in (
            ("free frequencies", "free frequencies"),
            ("responses", "frequency response"),
            ("equal pilots", "unlike response"),
        )
        if word in names
    ]
    lines = [f"{', '.join(checked) or 'nothing'} checked up to {certificate.cut_off_hz:.0f} Hz"]
    closest = certificate.closest
    if closest is not None and closest.share_of_limit is not None:
        used = f"{100.0 * closest.share_of_limit:.2g} %"
        lines.append(f"closest to its limit: {closest.name}, {used} of what is allowed")
    return Group(table, *lines)


def rms_table(identified: "Identification") -> RenderableType:
    """RMS by model and run, the paper's Table 4."""
    factor, unit = identified.rms_unit
    table = _table(f"RMS of the residual, {unit}", "run", *identified.estimates)
    by_model = identified.estimates.values()
    for run in next(iter(by_model)):
        table.add_row(run, *(f"{by_run[run].rms_by_run[run] * factor:.4f}" for by_run in by_model))
    return table


def estimate_table(identified: "Identification | BushingIdentification") -> RenderableType:
    """RMS, and the parameters of the model asked for with their 95 % intervals."""
    from carrierflex.workflows.identification.identify_bushings import BushingIdentification

    if isinstance(identified, BushingIdentification):
        return _bushing_table(identified)
    table = _table(
        f"parameters of {identified.model}",
        "parameter",
        "run",
        "value",
        "std",
        "95 %",
        "interval",
        "unit",
    )
    # A joint estimate stands under every run.
    estimates = dict.fromkeys(identified.estimates[identified.model].values())
    for estimate in estimates:
        for k, name in enumerate(estimate.names):
            low, high = estimate.ci95[k]
            numbers = (f"{estimate.values[k]:.6g}", f"{estimate.std[k]:.1g}")
            ends = (f"{low:.6g}", f"{high:.6g}")
            run = estimate.scopes[k] or "all"
            table.add_row(name, run, *numbers, *ends, estimate.units[k])
    flagged = [
        f"{outlier.run} {outlier.channel}: {outlier.count} samples beyond 6 standard deviations, "
        f"the largest {outlier.largest:.3g} at {outlier.time:.6g} s"
        for outlier in identified.outliers
    ]
    texts = dict.fromkeys(text for estimate in estimates for text in estimate.undetermined)
    return Group(rms_table(identified), "", table, *texts, *flagged, *_warning_lines(identified))


def loads_table(inferred: "InferredLoads") -> RenderableType:
    """Torque, rotor moment and pin loads of every run with their 95 % intervals."""
    of_runs = _table(
        "loads, 95 % intervals; in brackets: recorded",
        "run", "torque, kN m", "M_y, kN m", "M_z, kN m", "load sharing", "misfit",
    )  # fmt: skip
    pins = [f"pin {pin.pin}" for pin in inferred.runs[0].pins]
    of_pins = _table("mean force of a planet on its pin, against the rotation, kN", "run", *pins)

    def shown(value: "LoadValue", known: bool = False, digits: int = 1) -> str:
        recorded = "" if value.recorded is None else f" ({value.recorded / 1e3 + 0.0:.{digits}f})"
        if known:
            return f"{value.value / 1e3:.{digits}f}, known"
        half = (value.high - value.low) / 2e3
        return f"{value.value / 1e3:.{digits}f} +- {half:.{digits}f}{recorded}"

    for run in inferred.runs:
        sharing = run.load_sharing_factor
        half = (sharing.high - sharing.low) / 2.0
        of_runs.add_row(
            run.run,
            *(shown(value, run.known) for value in (run.torque, run.moment_y, run.moment_z)),
            f"{sharing.value:.3f} +- {half:.3f}",
            f"{run.misfit:.2f}",
        )
        of_pins.add_row(run.run, *(shown(pin.tangential) for pin in run.pins))
    return Group(of_runs, "", of_pins, *(f"warning: {text}" for text in inferred.warnings))


def _warning_lines(identified: "Identification | BushingIdentification") -> list[str]:
    """Findings about the campaign, one line each."""
    return [
        f"check {warning.about}: {warning.text}; {warning.remedy}"
        for warning in identified.warnings
    ]


def _half(value: float, ci95: NDArray[np.float64]) -> float:
    """Half width of an interval about a value, one end of which a bound may cut."""
    return float(np.abs(ci95 - value).max())


def _bushing_table(identified: "BushingIdentification") -> RenderableType:
    """Tables 2 and 3 of the 2011 paper, with what each fit cost in model runs."""
    from carrierflex.workflows.identification.identify_bushings import benchmark_rows

    shown: list[RenderableType] = []
    for group, estimates in identified.estimates.items():
        rows = benchmark_rows(estimates, identified)
        title = f"bushing models {group}".strip() + ", values ± 95 %"
        table = _table(title, "", *(row["model"] for row in rows))
        table.add_row("parameters", *(str(row["n_parameters"]) for row in rows))
        table.add_row("one simulation, s", *(f"{row['simulation_seconds']:.3g}" for row in rows))
        table.add_row(
            "accuracy (objective over linear)", *(f"{row['accuracy']:.6g}" for row in rows)
        )
        table.add_row("RMS of the gap, um", *(f"{row['rms'] * 1e6:.4g}" for row in rows))
        # C1 is a linear damper of the linear bushing, and one of the deflection's square of others.
        shown_of_row = [
            {
                f"{name}, {p['unit']}": f"{p['value']:.4g} ± {_half(p['value'], p['ci95']):.2g}"
                for name, p in row["parameters"].items()
            }
            for row in rows
        ]
        for label in dict.fromkeys(label for values in shown_of_row for label in values):
            table.add_row(label, *(values.get(label, "-") for values in shown_of_row))
        table.add_row("model runs", *(str(row["model_runs"]) for row in rows))
        table.add_row("time to identify, s", *(f"{row['seconds']:.3g}" for row in rows))
        if identified.searches:
            table.add_row(
                "complex method: model runs", *(str(row["complex_model_runs"]) for row in rows)
            )
            table.add_row(
                "complex method: time, s", *(f"{row['complex_seconds']:.3g}" for row in rows)
            )
            table.add_row(
                "complex method: accuracy", *(f"{row['complex_accuracy']:.6g}" for row in rows)
            )
        shown += [table, *estimates[-1].undetermined]
        known = [name for name in AXIAL if name not in estimates[-1].model.axial]
        if known:
            shown.append(f"{' and '.join(known)} of the bushings: not fitted, value of [rig]")
    for run, rms in identified.motion_rms.items():
        table = _table(f"housing motion {run}, RMS", "", "measured", "residual", "unit")
        for name, measured, residual in zip(HOUSING_MOTION, *(rms * 1e6), strict=True):
            unit = "um" if name.startswith("d") else "urad"
            table.add_row(name, f"{measured:.4g}", f"{residual:.4g}", unit)
        shown += ["", table]
    return Group(*shown, *_warning_lines(identified))


def printed_tables_table(facts: DerivedFacts) -> RenderableType:
    """What the printed tables determine, each with the interval of its digits."""
    table = _table("2012 paper, tables 4 and 5", "quantity", "unit", "value", "low", "high")
    rows = [
        (f"rim deflection {case}, RMS", "um", q, 1e6) for case, q in facts.deflection_rms.items()
    ]
    rows += [
        (f"rim deflection {case}, RMS", "um/kN m", q, 1e9)
        for case, q in facts.deflection_per_torque.items()
    ]
    if facts.common_deflection_per_torque is not None and facts.order_3_amplitude is not None:
        rows.append(
            ("in common to all load cases, RMS", "um/kN m", facts.common_deflection_per_torque, 1e9)
        )
        rows.append(("in common, amplitude of order 3", "um/kN m", facts.order_3_amplitude, 1e9))
    rows += [(f"phi_PLC {case}", "mrad", q, 1e3) for case, q in facts.phi_PLC.items()]
    rows.append(("static saddle without radial load", "mm", facts.saddle_line[0], 1e3))
    rows.append(("static saddle over radial load", "um/kN", facts.saddle_line[1], 1e9))
    rows.append(("radial load without a saddle", "kN", facts.saddle_zero, 1e-3))
    for name, unit, quantity, factor in rows:
        table.add_row(
            name,
            unit,
            *(f"{q * factor:.4g}" for q in (quantity.value, quantity.low, quantity.high)),
        )
    return table


if TYPE_CHECKING:
    from carrierflex.reduction.coupling_bracket import CouplingBracket
    from carrierflex.workflows.reduction.join_rotating_group import JoinedGroup
    from carrierflex.workflows.view3d.view_file import WrittenView


def joined_table(joined: "JoinedGroup") -> RenderableType:
    """Elastic free modes of the rotating group, and what the tilt does at the rim."""
    modes = _table("free modes", "Hz", "moves most", "rim")
    for mode in joined.modes:
        modes.add_row(f"{mode.frequency_hz:.1f}", mode.leading_pilot, mode.rim_motion)
    shown: list[RenderableType] = [modes]
    if joined.swing:
        swing = _table("axial swing of the rim by the tilt, um", "supports", "order 1")
        for name, value in joined.swing.items():
            swing.add_row(name, f"{value * 1e6:.1f}")
        shown += ["", swing]
    return Group(*shown, "", *map(str, joined.files))


def coupling_table(brackets: "dict[str, CouplingBracket]") -> RenderableType:
    """Own stiffness of every pilot coordinate from distributing to rigid.

    The rim's orders with either and with a mix.
    """
    shown: list[RenderableType] = []
    for variant, bracket in brackets.items():
        for unit, motions in (("GN/m", slice(0, 3)), ("GN m/rad", slice(3, 6))):
            coordinates = [f"{name.split(' ')[0]}, {unit}" for name in PILOT_COORDINATES[motions]]
            table = _table(f"{variant} carrier", "pilot", *coordinates)
            for pilot, soft, rigid in zip(
                bracket.pilots, *bracket.stiffness[:, :, motions] / 1e9, strict=True
            ):
                table.add_row(
                    pilot,
                    *(f"{low:.3g} to {high:.3g}" for low, high in zip(soft, rigid, strict=True)),
                )
            shown += [table, ""]
        title = f"{bracket.curve_name}, um/kN m"
        first = next(iter(bracket.all_curves.values())).first_order
        columns = ("rigid", f"order {first}", f"order {2 * first}", "peaks", "change, %")
        orders = _table(title, *columns)
        for rigid_pilots, curve in bracket.all_curves.items():
            content = curve.axial_order_content() * 1e6
            change = 100.0 * bracket.curve_change(rigid_pilots)
            orders.add_row(
                rigid_pilots,
                f"{content[first]:.4f}",
                f"{content[2 * first]:.4f}",
                str(len(curve.peak_angles())),
                f"{change:.1f}",
            )
        shown += [orders, ""]
    return Group(*shown)


def view_table(view: "WrittenView") -> RenderableType:
    """The page, its size and what can be shown in it."""
    table = _table(f"{view.path}, {view.size / 1e6:.1f} MB", "shown")
    for name in view.entries:
        table.add_row(name)
    if view.n_left_out:
        table.add_row(f"{view.n_left_out} more found no room in a page below 15 MB")
    return table

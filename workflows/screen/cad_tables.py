"""What was recognised in a CAD model, on the screen."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.text import Text

from carrierflex.geometry.cad_recognition.proposal_files import told
from carrierflex.geometry.cad_recognition.surface_proposal import SurfaceProposal


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
        *_named(proposal),
    )


def _named(proposal: SurfaceProposal) -> Iterator[str]:
    for surface in proposal.surfaces:
        if not surface.candidates:
            yield f"{surface.name}: left out, nothing of the solid fits"
        elif surface.chosen is not None:
            yield f"{surface.name}: {told(surface.chosen)}"
        else:
            alike = "; ".join(told(each) for each in surface.candidates[: surface.equals])
            yield f"{surface.name}: left out, {surface.equals} candidates are alike: {alike}"

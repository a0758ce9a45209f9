"""A surfaces file to start from, as recognised: each name with its reason, or its candidates."""

from collections.abc import Iterator
from pathlib import Path

from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.cad_recognition.named_candidates import Candidate, ProposedSurface
from carrierflex.geometry.cad_recognition.surface_proposal import SurfaceProposal
from carrierflex.geometry.cad_surface_files import HEADING, TOLERANCE, frame_lines, statement_text
from carrierflex.geometry.cad_surface_tables import FINER_AT_INNER_EDGES

#: Candidates beside the best that a file tells of.
_SHOWN = 4
_UNKNOWN = "nothing of the solid fits; state it by hand, faces are listed by cad-faces"
#: What one may want of the mesh; the values are those of docs/cad.md.
_MESH_HINTS = (
    "# How many times smaller elements at re-entrant edges are; 1 for elements of one size:",
    f"# finer_at_inner_edges = {FINER_AT_INNER_EDGES}",
    "# Small holes that statics need not:",
    "# leave_out_holes_below = 0.035",
)
_WHOLE_SEAT = "The whole cylinder: set axial_range to the bearing's width."


def write_proposal(path: Path, proposal: SurfaceProposal) -> None:
    """Write the proposed statements as a surfaces file, with the reasons as comments.

    A name with several candidates as good as the best is left out: they stand as comments.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(_lines(proposal)) + "\n", encoding="utf-8")


def _lines(proposal: SurfaceProposal) -> Iterator[str]:
    yield f"# Recognised in {proposal.step.name}; numbers in [] are those of the picture."
    yield from (f"# Assumed: {text}." for text in proposal.assumed)
    yield from HEADING
    yield f"tolerance = {TOLERANCE}"
    yield ""
    yield from (f"# {reason}" for reason in proposal.reasons)
    yield from frame_lines(proposal.frame)
    yield ""
    yield "[pin]"
    yield f"bearing_width = {proposal.bearing_width!r}"
    yield ""
    yield "[mesh]"
    yield from _MESH_HINTS
    for surface in proposal.surfaces:
        yield ""
        yield from _surface_lines(surface)


def _surface_lines(surface: ProposedSurface) -> Iterator[str]:
    if not surface.candidates:
        yield f"# {surface.name}: {_UNKNOWN}."
        return
    if surface.chosen is not None:
        yield f"# {candidate_text(surface.chosen)}."
        yield from (
            f"# Not {candidate_text(other)}." for other in surface.candidates[1 : 1 + _SHOWN]
        )
        if surface.name.endswith("_seat"):
            yield f"# {_WHOLE_SEAT}"
        yield statement_text(surface.chosen.statement)
        return
    yield (
        f"# {surface.name}: {surface.equals} candidates fit equally well; remove the # of one of "
        "them."
    )
    for candidate in surface.candidates[: max(surface.equals, _SHOWN)]:
        yield f"# {candidate_text(candidate)}:"
        yield from (f"# {line}" for line in statement_text(candidate.statement).splitlines())


def candidate_text(candidate: Candidate) -> str:
    """Numbers of a candidate in the picture, and the reason of its rank."""
    numbers = ", ".join(map(str, candidate.numbers))
    return f"[{numbers}] {candidate.reason}"

"""What a deck holds beside solids: shells, beams, springs, masses, links.

Matrices are made of solids alone. A body without its shells or masses would be another body, so
that they are refused; links are what pilots of an interfaces file stand for, and are listed.
"""

import re
from collections import Counter
from pathlib import Path

from carrierflex.files.plain_files import plain_content
from carrierflex.files.shown_values import shown
from carrierflex.geometry.given_meshes.abaqus_decks import deck_blocks
from carrierflex.geometry.given_meshes.nastran_decks import bulk_entries

#: Nastran's entries by what they add to a body; shells only where the deck gives them a property.
_NASTRAN_SHELLS = r"C(TRIA|QUAD)\w*"
_NASTRAN_SECTIONS = r"(PSHELL|PCOMPG?)"
_NASTRAN_CARRYING = (
    r"C(BAR|BEAM|BEND|BUSH|DAMP|ELAS|FAST|GAP|MASS|ONM|ONROD|ROD|SEAM|SHEAR|TRAX|TUBE|VISC|WELD)\w*"
    r"|CIHEX\d|GENEL|DMIG"
)
_NASTRAN_LINKS = r"RBE\d|RBAR1?|RROD|RTRPLT1?|RJOINT|RSPLINE|RSSCON|MPC"
#: Abaqus element types, and keywords.
_ABAQUS_SHELLS = r"(S[3-9]|STRI|M3D|DS[3-8])\w*"
_ABAQUS_SECTIONS = r"\*(SHELL|MEMBRANE) (GENERAL )?SECTION"
_ABAQUS_CARRYING = (
    r"(MASS|ROTARYI|HEATCAP|SPRING|DASHPOT|CONN|GAP|JOINT|ITS|GK|T[23]D|B[23]\d|PIPE|ELBOW|FRAME"
    r"|SC[68]|CSS8|COH|U\d|VU\d)\w*|\*NONSTRUCTURAL MASS|\*MATRIX ASSEMBLE"
)
#: Keywords that fetch or make elements or nodes: only those that a deck lists are read.
_ABAQUS_UNREAD = r"\*(INCLUDE|ELGEN|ELCOPY|SYMMETRIC MODEL GENERATION|(NSET|ELEMENT|ELSET), INPUT)"
_ABAQUS_MADE_NODES = r"\*(NGEN|NFILL|NCOPY|NMAP)"
_ABAQUS_LINKS = r"\*(RIGID BODY|((KINEMATIC|DISTRIBUTING) )?COUPLING|MPC|EQUATION|TIE)|R3D\d"
#: What is said of links where pilots of an interfaces file stand for them.
LINKS_REPLACED = "pilots of the interfaces file replace links"
_SUFFIXES = (".inp", ".bdf", ".nas")
_MOST_BYTES = 4_000_000_000


def left_out(path: Path) -> tuple[str, ...]:
    """What is to be told of a mesh file whose solids are read: its links, and facets of no section.

    Raises
    ------
    ValueError
        Where a deck holds other elements with stiffness or mass; kinds and counts are named. Where
        lines of a deck would be dropped.
    """
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        return ()
    content = plain_content(path, "a mesh", _MOST_BYTES)
    try:
        if suffix == ".inp":
            refuse_made_nodes(content)
            counts, has_sections = _abaqus_entries(content)
            shells, carrying, links = _ABAQUS_SHELLS, _ABAQUS_CARRYING, _ABAQUS_LINKS
        else:
            counts = Counter(entry.name for entry in bulk_entries(content))
            has_sections = bool(_of(counts, _NASTRAN_SECTIONS))
            shells, carrying, links = _NASTRAN_SHELLS, _NASTRAN_CARRYING, _NASTRAN_LINKS
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if unread := _of(counts, _ABAQUS_UNREAD):
        raise ValueError(
            f"{path}: {_listed(unread)}; expected all nodes and elements in *NODE and *ELEMENT of "
            "this file: other files are not read and nothing is generated; delete *INCLUDE of a "
            "file without a mesh"
        )
    refused = _of(counts, f"{carrying}|{shells}" if has_sections else carrying)
    if refused:
        raise ValueError(
            f"{path}: {_listed(refused)}; expected solids alone, since nothing else is assembled "
            "here: give the matrices of the whole by --stiffness and --mass, or delete from the "
            "file what is not to count"
        )
    lines = []
    if facets := {} if has_sections else _of(counts, shells):
        lines.append(f"left out: {_listed(facets)}, to which the file gives no thickness")
    if linked := _of(counts, links):
        lines.append(f"left out: {_listed(linked)}; {LINKS_REPLACED}")
    return tuple(lines)


def _of(counts: Counter[str], pattern: str) -> dict[str, int]:
    return {name: count for name, count in counts.items() if re.fullmatch(pattern, name)}


def _listed(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def refuse_made_nodes(content: bytes) -> None:
    """Refuse an Abaqus deck in which keywords make, move or fetch nodes; only ``*NODE`` is read.

    One instance of one part is read where it stays where the part is.

    Parameters
    ----------
    content : bytes
        The deck.

    Raises
    ------
    ValueError
        With the line, and what to write in its place.
    """
    counts: Counter[str] = Counter()
    for block in deck_blocks(content):
        name, line = block.name, block.line
        counts[name] += 1
        moves = re.search(rb"[1-9]", block.data) is not None
        elsewhere = name == "*NODE" and {"SYSTEM", "INPUT"} & set(block.settings)
        if elsewhere or re.fullmatch(_ABAQUS_MADE_NODES, name) or (name == "*SYSTEM" and moves):
            raise ValueError(
                f"{shown(line)}; expected every node in *NODE of this file, in rectangular "
                "coordinates of the model: let the preprocessor write the mesh so"
            )
        if name in ("*PART", "*INSTANCE") and (counts[name] > 1 or (name == "*INSTANCE" and moves)):
            what = "is the second one" if counts[name] > 1 else "moves its part"
            raise ValueError(
                f"{shown(line)} {what}; expected one part and one instance of it, without lines "
                "that move it: write the deck without parts and assemblies"
            )


def _abaqus_entries(content: bytes) -> tuple[Counter[str], bool]:
    """Types of elements and keywords with their counts; whether shells have a section."""
    counts: Counter[str] = Counter()
    has_sections = False
    for block in deck_blocks(content):
        name = block.name
        has_sections |= re.fullmatch(_ABAQUS_SECTIONS, name) is not None
        if name == "*ELEMENT":
            # A line that ends with a comma goes on in the next one.
            lines = re.sub(rb",\s*\n", b",", block.data).split(b"\n")
            kind = block.settings.get("TYPE", "").upper()
            counts[kind] += sum(bool(row.strip()) for row in lines)
        if "INPUT" in block.settings and name != "*INCLUDE":
            name += ", INPUT"
        counts[name] += 1
    return counts, has_sections

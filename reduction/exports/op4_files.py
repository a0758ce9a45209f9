"""Nastran external superelement.

Matrices in OP4, assembly and punch files, and a text that says what they hold.
"""

import io
import re
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from pyyeti.nastran import bulk, n2p

from carrierflex.files.whole_files import whole_file
from carrierflex.files.whole_folders import scratch_folder
from carrierflex.reduction.exports.ordered_body import OrderedBody, comments, header, ordered_body
from carrierflex.reduction.reduced_model import ReducedModel

#: Superelement number, also its Fortran unit; and the number of the first scalar point.
SUPERELEMENT = 100
FIRST_SPOINT = 1001


def grid_numbers(n_pilots: int) -> list[int]:
    """Grid points of the pilots, in their order: 1, 2, ..."""
    return list(range(1, n_pilots + 1))


def write_op4(model: ReducedModel, path: Path) -> tuple[Path, ...]:
    """Write ``.op4``, ``.asm``, ``.pch`` and ``.txt`` of the same stem.

    ``.op4`` holds kaa, maa and baa in double precision.

    Parameters
    ----------
    model : ReducedModel
        A single body.
    path : Path
        File of suffix .op4; the others stand beside it.

    Returns
    -------
    tuple of Path
        The four files.

    Raises
    ------
    ValueError
        Where the body is an assembly or the suffix is another.
    OSError
        Where a file cannot be written.
    """
    if path.suffix != ".op4":
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected .op4")
    body = ordered_body(model)
    grids = grid_numbers(len(body.pilots))
    uset = n2p.addgrid(None, grids, "b", 0, body.points, 0)
    numbering = f"scalar points from {FIRST_SPOINT}, one a modal coordinate"
    lines = [
        *header(model),
        *(f"Grid {grid}: pilot {name}" for grid, name in zip(grids, body.pilots, strict=True)),
        f"Matrices kaa, maa, baa; superelement {SUPERELEMENT}; {numbering}:",
        *(
            f"Spoint {FIRST_SPOINT + i}: {label}"
            for i, label in enumerate(body.labels[body.n_pilot_coordinates :])
        ),
    ]
    files = tuple(path.with_suffix(suffix) for suffix in (".op4", ".asm", ".pch", ".txt"))
    for file in files:
        # Four renames are not one step: what would stop one of them is looked for before the first.
        if file.is_dir():
            raise IsADirectoryError(f"{file}: is a folder; expected the name of a file")
    with ExitStack() as stack:
        folder = stack.enter_context(scratch_folder(files[0]))
        bulk.wtextseout(
            str(folder / "body"),
            se=SUPERELEMENT,
            bset=np.arange(body.n_pilot_coordinates),
            uset=uset,
            spoint1=FIRST_SPOINT,
            kaa=body.K,
            maa=body.M,
            baa=body.D,
        )
        if model.pilot_components:
            _name_components(folder / "body.pch", body, grids)
        targets = [stack.enter_context(whole_file(file)) for file in files]
        targets[0].write_bytes((folder / "body.op4").read_bytes())
        for target in targets[1:3]:
            # The first line names a temporary file; ours says what the body is.
            text = (folder / f"body{target.suffix}").read_text().split("\n", 1)[1]
            target.write_text("\n".join(comments("$", lines)) + "\n" + text, encoding="utf-8")
        targets[3].write_text("\n".join(lines) + "\n", encoding="utf-8")
    return files


def _name_components(punch: Path, body: OrderedBody, grids: list[int]) -> None:
    """State the components of every grid in the punch file, which gives all of them six."""
    digits = ["".join(str(i + 1) for i in own) for own in body.components]
    points = [*grids, *range(FIRST_SPOINT, FIRST_SPOINT + body.n_modal)]
    external = io.StringIO()
    bulk.wtextrn(external, points, [*(int(own) for own in digits), *[0] * body.n_modal])
    held = "".join(f"ASET1   {own:>8s}{grid:8d}\n" for grid, own in zip(grids, digits, strict=True))
    text = punch.read_text()
    for card, lines in (("EXTRN", external.getvalue()), ("ASET1", held)):
        text = re.sub(rf"^{card}.*?(?=^\$)", lines, text, count=1, flags=re.DOTALL | re.MULTILINE)
    punch.write_text(text, encoding="utf-8")

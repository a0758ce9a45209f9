"""Nastran external superelement.

Matrices in OP4, assembly and punch files, and a text that says what they hold.
"""

import io
import re
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.pyyeti_modules import bulk, n2p
from carrierflex.files.whole_files import whole_file
from carrierflex.files.whole_folders import scratch_folder
from carrierflex.reduction.exports.ordered_body import OrderedBody, comments, header, ordered_body
from carrierflex.reduction.reduced_model import ReducedModel

#: Superelement number, also its Fortran unit; and the number of the first scalar point.
SUPERELEMENT = 100
FIRST_SPOINT = 1001
#: Characters of a large field.
_FIELD = 16


def grid_numbers(n_pilots: int) -> list[int]:
    """Grid points of the pilots, in their order: 1, 2, ..."""
    return list(range(1, n_pilots + 1))


def grid_cards(points: NDArray[np.float64]) -> str:
    """GRID entries of the pilots in large fields: as many digits as sixteen characters hold.

    A place that is rounded makes a free body's stiffness resist its rigid motions.

    Examples
    --------
    >>> print(grid_cards(np.array([[0.1, -1.0 / 3.0, 2e-9]])), end="")
    GRID*                  1               0 0.1000000000000-0.3333333333333
    *        2.000000000E-09               0
    """
    lines = []
    for grid, point in zip(grid_numbers(len(points)), points, strict=True):
        x, y, z = (_sixteen(float(value)) for value in point)
        lines.append(f"GRID*   {grid:16d}{0:16d}{x}{y}\n*       {z}{0:16d}\n")
    return "".join(lines)


def _sixteen(value: float) -> str:
    """A number in a field of sixteen characters, the first one blank or a sign."""
    for digits in range(13, 0, -1):
        fixed = 1e-4 <= abs(value) < 1e9 or value == 0.0
        text = f"{value:.{digits}f}" if fixed else f"{value:.{min(digits, 9)}E}"
        if len(text) <= _FIELD - (value >= 0.0):
            return text.rjust(_FIELD)
    return f"{value:16.8E}"


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
        for suffix in ("asm", "pch"):
            _set_grids(folder / f"body.{suffix}", body.points)
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


def _set_grids(file: Path, points: NDArray[np.float64]) -> None:
    """Put in the place of a file's GRID entries, of eight decimals, those of all digits."""
    text = file.read_text()
    cards = grid_cards(points)
    text = re.sub(r"(^GRID\*.*\n\*.*\n)+", lambda _: cards, text, count=1, flags=re.MULTILINE)
    file.write_text(text, encoding="utf-8")


def _name_components(punch: Path, body: OrderedBody, grids: list[int]) -> None:
    """State the components of every grid in the punch file, which gives all of them six."""
    digits = ["".join(str(i + 1) for i in components) for components in body.components]
    points = [*grids, *range(FIRST_SPOINT, FIRST_SPOINT + body.n_modal)]
    external = io.StringIO()
    bulk.wtextrn(
        external, points, [*(int(components) for components in digits), *[0] * body.n_modal]
    )
    cards = "".join(
        f"ASET1   {components:>8s}{grid:8d}\n"
        for grid, components in zip(grids, digits, strict=True)
    )
    text = punch.read_text()
    for card, lines in (("EXTRN", external.getvalue()), ("ASET1", cards)):
        text = re.sub(rf"^{card}.*?(?=^\$)", lines, text, count=1, flags=re.DOTALL | re.MULTILINE)
    punch.write_text(text, encoding="utf-8")

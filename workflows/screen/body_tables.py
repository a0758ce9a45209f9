"""Results of the workflows on reduced bodies as tables on the screen."""

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType

from carrierflex.reduction.reduced_model import PILOT_COORDINATES
from carrierflex.workflows.screen.titled_table import titled_table as _table

if TYPE_CHECKING:
    from carrierflex.reduction.coupling_bracket import CouplingBracket
    from carrierflex.workflows.reduction.join_rotating_group import JoinedGroup
    from carrierflex.workflows.view3d.view_file import WrittenView


def joined_table(joined: "JoinedGroup") -> RenderableType:
    """Elastic free modes of the rotating group, and what the tilt does at the rim."""
    modes = _table("free modes", "Hz", "moves most", "rim")
    for mode in joined.modes:
        modes.add_row(f"{mode.frequency_hz:.1f}", mode.leading_pilot, mode.rim_motion)
    parts: list[RenderableType] = [modes]
    if joined.swing:
        swing = _table("axial swing of the rim by the tilt, um", "supports", "order 1")
        for name, value in joined.swing.items():
            swing.add_row(name, f"{value * 1e6:.1f}")
        parts += ["", swing]
    return Group(*parts, "", *map(str, joined.files))


def coupling_table(brackets: "dict[str, CouplingBracket]") -> RenderableType:
    """Own stiffness of every pilot coordinate from distributing to rigid.

    The rim's orders with either and with a mix.
    """
    parts: list[RenderableType] = []
    for variant, bracket in brackets.items():
        for unit, part in (("GN/m", slice(0, 3)), ("GN m/rad", slice(3, 6))):
            coordinates = [f"{name.split(' ')[0]}, {unit}" for name in PILOT_COORDINATES[part]]
            table = _table(f"{variant} carrier", "pilot", *coordinates)
            for pilot, soft, rigid in zip(
                bracket.pilots, *bracket.stiffness[:, :, part] / 1e9, strict=True
            ):
                table.add_row(
                    pilot,
                    *(f"{low:.3g} to {high:.3g}" for low, high in zip(soft, rigid, strict=True)),
                )
            parts += [table, ""]
        title = f"{bracket.curve_name}, um/kN m"
        first = next(iter(bracket.all_curves.values())).first_order
        columns = ("rigid", f"order {first}", f"order {2 * first}", "peaks", "change, %")
        orders = _table(title, *columns)
        for rigid_part, curve in bracket.all_curves.items():
            content = curve.axial_order_content() * 1e6
            change = 100.0 * bracket.curve_change(rigid_part)
            orders.add_row(
                rigid_part,
                f"{content[first]:.4f}",
                f"{content[2 * first]:.4f}",
                str(len(curve.peak_angles())),
                f"{change:.1f}",
            )
        parts += [orders, ""]
    return Group(*parts)


def view_table(view: "WrittenView") -> RenderableType:
    """The page, its size and what can be shown in it."""
    table = _table(f"{view.path}, {view.size / 1e6:.1f} MB", "shown")
    for name in view.entries:
        table.add_row(name)
    if view.n_left_out:
        table.add_row(f"{view.n_left_out} more found no room in a page below 15 MB")
    return table

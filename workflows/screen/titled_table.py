"""The one layout of tables on the screen."""

from collections.abc import Collection, Iterable

from rich.console import RenderableType
from rich.table import Table


def titled_table(
    title: str,
    *columns: str,
    rows: Iterable[Iterable[RenderableType]] = (),
    folded: Collection[int] = (),
) -> Table:
    """Table with a bold title, first column and those of folded text left, the others right."""
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    for number, column in enumerate(columns):
        table.add_column(
            column,
            justify="left" if number in (0, *folded) else "right",
            overflow="fold" if number in folded else "ellipsis",
            min_width=len(title) if number == 0 else None,
        )
    for row in rows:
        table.add_row(*row)
    return table

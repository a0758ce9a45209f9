"""What is known of a figure of the papers before it is drawn."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from matplotlib.figure import Figure

from carrierflex.workflows.figures.shared_runs import SharedRuns


@dataclass(frozen=True, eq=False)
class PaperFigure:
    """One figure of a paper and how this project draws it."""

    paper: Annotated[str, "``2011`` or ``2012``"]
    number: Annotated[int, "Number in that paper"]
    title: Annotated[str, "What it shows, in short"]
    in_the_paper: Annotated[str, "What the paper's figure shows"]
    made_by: Annotated[str, "Command, case or function of this project behind the drawing"]
    derived: Annotated[
        str, "What in it comes from the papers themselves, and so proves nothing about them"
    ]
    draw: Annotated[Callable[[SharedRuns], Figure], "Makes the figure"]
    needs: Annotated[
        tuple[str, ...], "Attributes of :class:`SharedRuns` that it is drawn from"
    ] = ()

    @property
    def name(self) -> str:
        """Name on the command line and of the picture, as in ``2012-5``."""
        return f"{self.paper}-{self.number}"

    @property
    def file(self) -> str:
        """File name of the picture."""
        return f"{self.paper}_figure_{self.number:02d}.png"


def drawing(draw: Callable[[], Figure]) -> Callable[[SharedRuns], Figure]:
    """Drawing that needs no run, with the arguments of one that does."""
    return lambda _: draw()

"""What is known of a figure of the papers before it is drawn."""

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from carrierflex.workflows.figures.shared_runs import SharedRuns


@dataclass(frozen=True, eq=False)
class PaperFigure:
    """One figure of a paper and how this project draws it.

    Parameters
    ----------
    paper : str
        ``2011`` or ``2012``.
    number : int
        Number in that paper.
    title : str
        What it shows, in short.
    in_the_paper : str
        What the paper's figure shows.
    made_by : str
        Command, case or function of this project behind the drawing.
    derived : str
        What in it comes from the papers themselves, and so proves nothing about them.
    draw : callable
        Makes the figure.
    needs : tuple of str
        Attributes of :class:`SharedRuns` that it is drawn from.
    """

    paper: str
    number: int
    title: str
    in_the_paper: str
    made_by: str
    derived: str
    draw: Callable[[SharedRuns], Figure]
    needs: tuple[str, ...] = ()

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

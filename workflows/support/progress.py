"""Progress of long work: a bar with the remaining time on a terminal, a line a stage in a pipe."""

import logging
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from carrierflex.files.shown_values import printable
from carrierflex.workflows.shell.logs import SHOWN

log = logging.getLogger(__name__)


@dataclass
class Stages:
    """Announces stages of known number and keeps their times.

    Parameters
    ----------
    total : int
        Number of stages.
    quiet : bool
        Show none of it.
    weights : sequence of float
        How long each stage takes, in any unit; all the same without.
    """

    total: int
    quiet: bool = False
    weights: Sequence[float] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    _begun: float = field(default_factory=lambda: time.perf_counter(), init=False, repr=False)
    _share: float = field(default=0.0, init=False, repr=False)
    _bar: Progress | None = field(default=None, init=False, repr=False)
    _name: str = field(default="", init=False, repr=False)

    def note(self, text: str, share: float | None = None) -> None:
        """Show beside the bar what the running stage is at, and what share of it is done."""
        if share is not None:
            self._share = share
        if self._bar is not None:
            words = _plain(f"{self._name}: {printable(text)}")
            self._bar.update(self._bar.task_ids[0], description=words, completed=self.done)
        log.debug("%s: %s", self._name, printable(text))

    def tell(self, text: str) -> None:
        """Print a note that must not be missed, also where no terminal shows the stages."""
        console = Console(stderr=True, quiet=self.quiet, highlight=False, soft_wrap=True)
        console.print(f"note: {text}", markup=False)
        log.warning("note: %s", text, extra=SHOWN)

    @property
    def done(self) -> float:
        """Share of all stages that is done."""
        weights = self.weights or (1.0,) * self.total
        number = len(self.seconds)
        running = weights[number] * self._share if number < len(weights) else 0.0
        return min((sum(weights[:number]) + running) / sum(weights), 1.0)

    @property
    def remaining(self) -> float | None:
        """Seconds that are left at the speed so far; None where nothing is done yet."""
        if self.done <= 0.0:
            return None
        return (time.perf_counter() - self._begun) * (1.0 - self.done) / self.done

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Show `name` with a bar while the block runs, then a line with its time."""
        number = len(self.seconds) + 1
        start = time.perf_counter()
        # Names of files and runs may hold what rich takes for markup or a terminal for commands.
        self._name = f"[{number}/{self.total}] {printable(name)}"
        self._share = 0.0
        console = Console(stderr=True, quiet=self.quiet, highlight=False, soft_wrap=True)
        log.info("%s begins", self._name, extra=SHOWN)
        with self._shown_bar(console):
            yield
        self.seconds[name] = time.perf_counter() - start
        console.print(
            Text.assemble(
                (f"[{number}/{self.total}] ", "dim"),
                printable(name),
                (f" {self.seconds[name]:.1f} s", "dim"),
            )
        )
        log.info("%s %.1f s", self._name, self.seconds[name], extra=SHOWN)

    @contextmanager
    def _shown_bar(self, console: Console) -> Iterator[None]:
        if self.quiet or not sys.stderr.isatty():
            yield
            return
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            TimeElapsedColumn(),
            _Remaining(self),
        )
        with Progress(*columns, console=console, transient=True) as self._bar:
            task = self._bar.add_task(_plain(self._name), total=1.0)
            self._bar.update(task, completed=self.done)
            yield
        self._bar = None


class _Remaining(ProgressColumn):
    """Time that is left."""

    def __init__(self, stages: Stages) -> None:
        super().__init__()
        self._stages = stages

    def render(self, task: Task) -> Text:
        """Minutes and seconds, once something is done."""
        left = self._stages.remaining
        if left is None:
            return Text("")
        return Text(f"about {int(left) // 60}:{int(left) % 60:02d} left", style="cyan")


def _plain(text: str) -> str:
    """Text in which rich sees no markup."""
    return text.replace("[", "\\[")

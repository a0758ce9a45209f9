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
        How long each stage takes, in any unit; without, no time is shown as left before the last
        stage, and there only if it is told what share of it is done.
    timed_from : int
        Number of stages before those by whose weights time can be told: before them none is shown.

    Raises
    ------
    ValueError
        Where there is not one weight a stage.
    """

    total: int
    quiet: bool = False
    weights: Sequence[float] = ()
    timed_from: int = 0
    seconds: dict[str, float] = field(default_factory=dict)
    #: When the first timed stage began, and the running one.
    _begun: float = field(default_factory=lambda: time.perf_counter(), init=False, repr=False)
    _stage_begun: float = field(default_factory=lambda: time.perf_counter(), init=False, repr=False)
    _share: float = field(default=0.0, init=False, repr=False)
    _noted: float = field(default=0.0, init=False, repr=False)
    #: Stages that have ended; two may have one name.
    _ended: int = field(default=0, init=False, repr=False)
    _bar: Progress | None = field(default=None, init=False, repr=False)
    _name: str = field(default="", init=False, repr=False)

    def __post_init__(self) -> None:
        if self.weights and len(self.weights) != self.total:
            raise ValueError(f"{len(self.weights)} weights; expected {self.total}, one a stage")

    def note(self, text: str, share: float | None = None) -> None:
        """Show beside the bar what the running stage is at, and what share of it is done."""
        if share is not None:
            self._share = share
            self._noted = time.perf_counter()
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
        number = self._ended
        running = weights[number] * self._share if number < len(weights) else 0.0
        return min((sum(weights[:number]) + running) / sum(weights), 1.0)

    @property
    def remaining(self) -> float | None:
        """Seconds that are left; None where nobody can know.

        The running stage at its own speed as far as it was told, and at that of the stages before
        it; the later ones by their weights. None before anything is done, where later stages have
        no weights, and where the last stage takes longer than was thought.
        """
        number = self._ended
        later = self.weights[number + 1 :]
        if number < self.timed_from or len(later) < self.total - number - 1:
            return None
        duration = self._stage_seconds(number)
        if duration is None:
            return None
        in_stage = time.perf_counter() - self._stage_begun
        duration = max(duration, in_stage)
        after = 0.0
        if later:
            before = self._stage_begun - self._begun
            known = sum(self.weights[self.timed_from : number + 1])
            after = (before + duration) * sum(later) / known
        remaining = duration - in_stage + after
        return remaining if remaining > 0.0 else None

    def _stage_seconds(self, number: int) -> float | None:
        """Seconds that the running stage takes; None where nobody can know."""
        by_share = (self._noted - self._stage_begun) / self._share if self._share > 0.0 else None
        earlier = sum(self.weights[self.timed_from : number])
        if earlier <= 0.0 or number >= self.total:
            return by_share
        by_weight = (self._stage_begun - self._begun) * self.weights[number] / earlier
        if by_share is None:
            return by_weight
        return self._share * by_share + (1.0 - self._share) * by_weight

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Show `name` with a bar while the block runs, then a line with its time."""
        number = self._ended + 1
        self._stage_begun = time.perf_counter()
        if self._ended == self.timed_from:
            self._begun = self._stage_begun
        # Names of files and runs may hold what rich takes for markup or a terminal for commands.
        self._name = f"[{number}/{self.total}] {printable(name)}"
        self._share = 0.0
        console = Console(stderr=True, quiet=self.quiet, highlight=False, soft_wrap=True)
        log.info("%s begins", self._name, extra=SHOWN)
        with self._shown_bar(console):
            yield
        self.seconds[name] = time.perf_counter() - self._stage_begun
        self._share = 0.0
        self._ended = number
        self._stage_begun = time.perf_counter()
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
        remaining = self._stages.remaining
        if remaining is None:
            return Text("")
        return Text(f"about {int(remaining) // 60}:{int(remaining) % 60:02d} left", style="cyan")


def _plain(text: str) -> str:
    """Text in which rich sees no markup."""
    return text.replace("[", "\\[")

"""Progress of long work on the terminal: one line a stage, with its time."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console
from rich.status import Status
from rich.text import Text

from carrierflex.files.shown_values import printable


@dataclass
class Stages:
    """Announces stages of known number and keeps their times.

    Silent where `quiet` or not on a terminal.
    """

    total: int
    quiet: bool = False
    seconds: dict[str, float] = field(default_factory=dict)
    _status: Status | None = field(default=None, init=False, repr=False)
    _name: str = field(default="", init=False, repr=False)

    def note(self, text: str) -> None:
        """Show beside the spinner of the running stage what it is at."""
        if self._status is not None:
            self._status.update(Text(f"{self._name}: {printable(text)}"))

    def tell(self, text: str) -> None:
        """Print a note that must not be missed, also where no terminal shows the stages."""
        console = Console(stderr=True, quiet=self.quiet, highlight=False, soft_wrap=True)
        console.print(f"note: {text}", markup=False)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Show `name` with a spinner while the block runs, then a line with its time."""
        number = len(self.seconds) + 1
        start = time.perf_counter()
        console = Console(stderr=True, quiet=self.quiet or not sys.stderr.isatty(), highlight=False)
        # Names of files and runs may hold what rich takes for markup or a terminal for commands.
        self._name = f"[{number}/{self.total}] {printable(name)}"
        with console.status(Text(self._name)) as self._status:
            yield
        self._status = None
        self.seconds[name] = time.perf_counter() - start
        console.print(
            Text.assemble(
                (f"[{number}/{self.total}] ", "dim"),
                printable(name),
                (f" {self.seconds[name]:.1f} s", "dim"),
            )
        )

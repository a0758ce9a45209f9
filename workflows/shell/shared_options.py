"""Options that every command has: what is said, what is logged, how many threads work."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from carrierflex.workflows.shell.help_screen import show_in_one_paragraph
from carrierflex.workflows.shell.logs import log_into, say_more
from carrierflex.workflows.shell.threads import limit_threads

_GROUP = Group("Options of every command", sort_key=1, help_formatter=show_in_one_paragraph)


def _option(text: str) -> Parameter:
    return Parameter(help=text, show_default=False, group=_GROUP)


@Parameter(name="*")
@dataclass(frozen=True)
class SharedOptions:
    """Options that every command has."""

    quiet: Annotated[bool, _option("errors only")] = False
    verbose: Annotated[bool, _option("more messages; with --help the complete help")] = False
    log_file: Annotated[Path | None, _option("append messages to this file")] = None
    threads: Annotated[int | None, _option("of each process; default: by the libraries")] = None
    json: Annotated[bool, _option("print only the result, as JSON")] = False

    def apply(self) -> None:
        """Set threads and logging of this process.

        Raises
        ------
        ValueError
            Where options contradict one another or name no number of threads.
        OSError
            Where the log file cannot be written.
        """
        if self.quiet and self.verbose:
            raise ValueError("--quiet and --verbose are both given; expected one of them")
        if self.threads is not None:
            limit_threads(self.threads)
        if self.verbose:
            say_more()
        if self.log_file is not None:
            log_into(self.log_file)

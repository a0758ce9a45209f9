"""What every step of the page has: a command line, a button, progress, and what came of it."""

import functools
import inspect
import time
from collections.abc import Awaitable, Callable, Sequence
from html import escape
from typing import Any

from nicegui import ui

from carrierflex.workflows.app.called_line import CalledLine, shell_line


class Step:
    """A box of the page: a title, a `body` for the fields, and below it what came of it."""

    def __init__(self, title: str, called: CalledLine) -> None:
        self._called = called
        with ui.element("section").classes("step"):
            ui.html(f"<h2>{escape(title)}</h2>", sanitize=False)
            self.body = ui.element("div")
            self.output = ui.element("div")

    def command(
        self,
        name: str,
        words: Sequence[str],
        then: Callable[[], Any],
        *,
        before: Callable[[], None] = lambda: None,
        shows_tables: bool = True,
    ) -> None:
        """Show a command line and the button that runs it.

        Parameters
        ----------
        name : str
            Of the button.
        words : sequence of str
            Words of the line.
        then : function
            What follows where the command was not refused.
        before : function
            Writes what the command reads.
        shows_tables : bool
            Whether what the command shows is shown.
        """

        async def run() -> None:
            if self._called.is_busy:
                ui.notify("Another command is running: wait for its end, or stop it.")
                return
            before()
            if not await self._run(words, shows_tables=shows_tables):
                return
            result = then()
            if inspect.isawaitable(result):
                await result

        ui.label(shell_line(words)).classes("line")
        button = ui.button(name, on_click=self.guarded(run)).props("no-caps")
        button.classes(f"run-{words[0]}")

    async def _run(self, words: Sequence[str], *, shows_tables: bool) -> bool:
        """Run a line with its progress; whether it was not refused."""
        self.output.clear()
        begun = time.monotonic()
        with self.output:
            bar = ui.linear_progress(0.0, show_value=False)
            stage = ui.label("starting").classes("faint-words")
            stop = ui.button("Stop", on_click=self._called.end).props("flat no-caps dense")
            stop.classes("stop")

        def note(text: str, share: float | None) -> None:
            bar.value = bar.value if share is None else share
            done = "" if share is None else "done: "
            stage.text = f"{done}{text}; {time.monotonic() - begun:.0f} s since the start"

        ended = await self._called.call(words, note)
        self.output.clear()
        with self.output:
            ui.label(f"Ended: {shell_line(words)}").classes("faint-words")
            for text in ended.notes:
                ui.label(text).classes("note")
            if ended.refusal:
                ui.label(ended.refusal).classes("refused")
            for title, rows in ended.tables if shows_tables else ():
                show_table(title, rows)
        return not ended.refusal

    def guarded(self, action: Callable[..., Any]) -> Callable[..., Awaitable[None]]:
        """The action; what it refuses is shown in one line."""

        @functools.wraps(action)  # with its signature: one without parameters gets no event
        async def run(*arguments: Any) -> None:
            try:
                result = action(*arguments)
                if inspect.isawaitable(result):
                    await result
            except (ValueError, OSError, ArithmeticError) as error:
                self.output.clear()
                with self.output:
                    ui.label(" ".join(str(error).split())).classes("refused")

        return run


def show_table(title: str, rows: Sequence[Sequence[str]]) -> None:
    """Show rows, the first of them as names of the columns."""
    lines = [f"<caption>{escape(title)}</caption>"]
    for tag, row in zip(["th", *["td"] * len(rows)], rows, strict=False):
        lines.append("<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in row) + "</tr>")
    ui.html(f'<table class="rows">{"".join(lines)}</table>', sanitize=False)

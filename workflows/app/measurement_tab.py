"""Steps from the files of a logger to the report of their diagnosis."""

import asyncio
import tomllib
from collections.abc import Callable, Iterator, Sequence
from html import escape
from typing import Any

import numpy as np
from nicegui import events, ui

from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.identification.logs.log_files import read_log
from carrierflex.identification.logs.log_table import LogTable
from carrierflex.workflows.app.called_line import CalledLine
from carrierflex.workflows.app.map_lines import MapLine, map_lines, with_key, with_value
from carrierflex.workflows.app.steps import Step, show_table
from carrierflex.workflows.app.view import DrawnSensor, face, housing
from carrierflex.workflows.app.work_folder import WorkFolder

#: What `new-campaign` is told of the measurement, and its words.
_KINDS = {
    "carrier": "carrier: proximity sensors at the rim",
    "mounting": "mounting: motion sensors on the housing",
    "element": "element (mount, damper, spring): drive guessed",
    "element --drive force": "element driven by a force",
    "element --drive displacement": "element driven by a displacement",
    "element --drive free_decay": "element in free decay",
    "element --drive base": "element on a moving base",
}
_SIGNALS = {"inputs": "input", "channels": "sensor"}


class MeasurementTab:
    """The steps; what is in the folder already is taken up."""

    def __init__(self, folder: WorkFolder, called: CalledLine, prefix: str) -> None:
        self._folder, self._prefix = folder, prefix
        self._chosen = folder.log_files()
        self._kind = "carrier"
        self._campaign = folder.last("campaign", document="campaign.toml")
        self._diagnosis = folder.last("diagnosis", document="report.html")
        self._map, self._text = "", ""
        self._open_map(folder.last("map", ".toml") or "")
        self._tables: list[LogTable] = []
        self._live = ui.refreshable(self._columns), ui.refreshable(self._drawing)
        self._steps: list[Any] = []
        steps: dict[str, Callable[[Step], None]] = {
            "1  Files of the logger": self._files,
            "2  Columns, guesses and wiring": self._fields,
            "3  Import": self._import,
            "4  Check": self._check,
            "5  Diagnose": self._diagnose,
        }
        for title, build in steps.items():
            step = Step(title, called)
            with step.body:
                self._steps.append(ui.refreshable(build))
                self._steps[-1](step)
        ui.on("sensor_moved", self._move)
        ui.timer(0.0, self._read_tables, once=True)

    def _refresh(self, *numbers: int) -> None:
        for number in numbers:
            self._steps[number - 1].refresh()

    def _files(self, step: Step) -> None:
        # All files at once: drawn anew after the first, the box would be gone with the others.
        async def upload(event: events.MultiUploadEventArguments) -> None:
            for file in event.files:
                await self._folder.save(file.name, file.save)
                self._chosen.append(file.name)
            self._refresh(1)

        def choose(name: str, chosen: bool) -> None:
            self._chosen = [other for other in self._chosen if other != name] + [name] * chosen
            self._refresh(1)

        def set_kind(event: events.ValueChangeEventArguments) -> None:
            self._kind = event.value
            self._refresh(1)

        label = "Drop files here, or choose them: +"
        upload_box = ui.upload(
            multiple=True, auto_upload=True, label=label, on_multi_upload=step.guarded(upload)
        )
        upload_box.props("flat bordered")
        names = self._folder.log_files()
        chosen = [name for name in names if name in self._chosen]
        with ui.element("div").classes("fields"):
            for name in names:
                box = ui.checkbox(name, value=name in chosen)
                box.on_value_change(lambda event, name=name: choose(name, event.value))
        ui.select(_KINDS, value=self._kind, label="What was measured", on_change=set_kind)
        if not chosen:
            ui.label("No file is chosen yet.").classes("faint-words")
            return
        out = self._folder.free("map", ".toml")

        async def then() -> None:
            self._open_map(out)
            self._refresh(1, 2, 3)
            await self._read_tables()

        words = ["new-campaign", "--kind", *self._kind.split(), "--from", *chosen, "--out", out]
        step.command("Guess the columns", words, then, shows_tables=False)

    def _open_map(self, name: str) -> None:
        self._map = name
        if name:
            self._text = self._folder.path_of(name).read_text(encoding="utf-8")

    def _runs(self) -> list[list[str]]:
        """Files of every run of the map."""
        runs = tomllib.loads(self._text).get("runs", [])
        return [[*map(str, run.get("files", []))] for run in runs]

    async def _read_tables(self) -> None:
        """Read the columns of the first run's files."""
        tables: list[LogTable] = []
        for name in (self._runs() or [[]])[0]:
            try:
                tables += await asyncio.to_thread(read_log, self._folder.path_of(name))
            except (ValueError, OSError):
                continue  # `import` refuses it in words
        self._tables = tables
        self._refresh(2)

    def _write_map(self, text: str) -> None:
        """Write the map that the page shows; one that was changed elsewhere is not replaced."""
        path = self._folder.path_of(self._map)
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"{path.name}: {error}; the file is unchanged") from error
        if path.read_text(encoding="utf-8") != self._text:
            raise ValueError(
                f"{path.name}: was changed elsewhere since this page read it and is not replaced; "
                "reload the page"
            )
        with whole_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        self._text = text
        for shown in self._live:
            shown.refresh()
        self._refresh(3)

    def _fields(self, step: Step) -> None:
        if not self._map:
            ui.label("Guess the columns first.").classes("faint-words")
            return
        lines = list(map_lines(self._text))
        self._live[0]()
        ui.html("<h2>Rig and clock</h2>", sanitize=False)
        with ui.element("div").classes("fields"):
            for line in lines:
                if line.table in ("time", "rig"):
                    self._field(step, line)
        ui.html("<h2>Wiring</h2>", sanitize=False)
        with ui.element("div").classes("two"):
            with ui.element("div"):
                for at in dict.fromkeys((line.table, line.nth) for line in lines):
                    if at[0] in _SIGNALS:
                        self._signal(step, [one for one in lines if (one.table, one.nth) == at])
            with ui.element("div").classes("stays"):
                self._live[1]()

        def save() -> None:
            self._write_map(area.value)
            self._refresh(2)

        with ui.expansion("All of the map as text"):
            area = ui.textarea(value=self._text).props("autogrow outlined").classes("text")
            ui.button("Save the text", on_click=step.guarded(save)).props("no-caps flat")

    def _columns(self) -> None:
        """What is open, and the columns: unit, range, what each is taken for."""
        lines = list(map_lines(self._text))
        n_open = sum(line.is_open for line in lines)
        words = f"{n_open} to fill in (red)" if n_open else "nothing is left to fill in"
        ui.label(f"{self._map}: {words}. Every value is a guess: look at it.").classes("state")
        names = {(line.table, line.nth): line.value for line in lines if line.key == "name"}
        taken = {
            line.value: f"{_SIGNALS[line.table]} {names[line.table, line.nth]}"
            if line.table in _SIGNALS
            else line.table
            for line in lines
            if line.key == "column"
        }
        rows = [["column", "unit stated", "from", "to", "taken as"]]
        for table in self._tables:
            for column, values in table.columns.items():
                finite = values[np.isfinite(values)]
                ends = (
                    [f"{end:.3g}" for end in (finite.min(), finite.max() + 0.0)]
                    if finite.size
                    else []
                )
                unit = table.units.get(column, "")
                rows.append([column, unit, *(ends or ["", ""]), taken.get(column, "left out")])
        if self._tables:
            show_table(f"Columns of {', '.join(table.file for table in self._tables)}", rows)

    def _drawing(self) -> None:
        """The rig with its sensors."""
        kind = tomllib.loads(self._text).get("kind")
        sensors = list(_sensors(list(map_lines(self._text))))
        if kind == "carrier":
            ui.html(face(CarrierParameters(), sensors), sanitize=False)
            words = "Drag a sensor to its angle. Blue: axial plane. Orange: radial plane. "
            ui.label(words + "Red: not known yet.").classes("faint-words")
        if kind == "mounting":
            ui.html(housing(sensors), sanitize=False)
            ui.label("Drag a channel to the place of its sensor.").classes("faint-words")

    def _field(self, step: Step, line: MapLine) -> None:
        """One value; it is written where the user leaves the field."""

        def change() -> None:
            now = next(other for other in map_lines(self._text) if other.number == line.number)
            given = str(entry.value or "").strip()
            if given != now.text:
                self._write_map(with_value(self._text, now, given))
                entry.props(remove="error") if given else None

        entry: Any
        if line.key == "column" and self._tables:
            columns = [name for table in self._tables for name in table.names]
            options = dict.fromkeys([*columns, *filter(None, [line.text])])
            entry = ui.select([*options], value=line.text or None, label=line.key)
            entry.on_value_change(step.guarded(change))
        else:
            entry = ui.input(label=line.key, value=line.text)
            for event in ("blur", "keydown.enter"):
                entry.on(event, step.guarded(change))
        entry.props("dense stack-label options-dense" + " error" * line.is_open)
        entry.props["hint"] = line.words
        entry.props["error-message"] = line.words
        if not line.is_given:
            entry.props["placeholder"] = f"{line.value}"
        entry.classes(f"{line.table}-{line.nth}-{line.key}")

    def _signal(self, step: Step, lines: Sequence[MapLine]) -> None:
        """Fields of one input or channel."""
        by_key = {line.key: line for line in lines}
        role = _SIGNALS[lines[0].table]

        def turn() -> None:
            self._write_map(with_key(self._text, by_key["column"], "factor", "-1.0"))
            self._refresh(2)

        with ui.element("div").classes("signal"):
            ui.html(f"<b>{role} {escape(str(by_key['name'].value))}</b>", sanitize=False)
            with ui.element("div").classes("fields"):
                for key, line in by_key.items():
                    if key != "name" or role == "sensor":
                        self._field(step, line)
            if "factor" not in by_key:
                ui.button("Turn its sign", on_click=step.guarded(turn)).props("flat dense no-caps")

    def _move(self, event: events.GenericEventArguments) -> None:
        """Take over where a sensor of the drawing was let go."""
        position = event.args["place"]
        key, value = (
            ("sensor", position) if isinstance(position, str) else ("angle_deg", f"{position:.1f}")
        )
        for line in map_lines(self._text):
            if (line.table, line.nth, line.key) == ("channels", event.args["number"], key):
                self._write_map(with_value(self._text, line, value))
                self._refresh(2)
                return

    def _import(self, step: Step) -> None:
        if not self._map:
            ui.label("Guess the columns first.").classes("faint-words")
            return
        out = self._folder.free("campaign")
        names = dict.fromkeys(name for files in self._runs() for name in files)

        def then() -> None:
            self._campaign = out
            self._refresh(3, 4, 5)

        step.command("Import", ["import", *names, "--map", self._map, "--out", out], then)

    def _check(self, step: Step) -> None:
        if self._campaign is None:
            ui.label("Import the files first.").classes("faint-words")
            return
        step.command("Check", ["check", self._campaign], lambda: None)

    def _diagnose(self, step: Step) -> None:
        if self._campaign is None:
            ui.label("Import the files first.").classes("faint-words")
            return
        out = self._folder.free("diagnosis")

        def then() -> None:
            self._diagnosis = out
            self._refresh(5)

        words = ["diagnose", self._campaign, "--out", out]
        # The report says what the command shows.
        step.command("Diagnose", words, then, shows_tables=False)
        if self._diagnosis is not None:
            address = f"{self._prefix}/report/{self._diagnosis}"
            ui.link(f"{self._diagnosis}/report.html", address, new_tab=True).classes("report-link")
            ui.element("iframe").classes("report").props(
                f'src="{address}" sandbox="allow-scripts allow-popups" title="Report"'
            )


def _sensors(lines: Sequence[MapLine]) -> Iterator[DrawnSensor]:
    """Channels that have a place on a drawing."""
    tables: dict[int, dict[str, Any]] = {}
    for line in lines:
        if line.table == "channels" and line.is_given:
            tables.setdefault(line.nth, {})[line.key] = None if line.is_open else line.value
    for number, table in tables.items():
        if {"angle_deg", "sensor"} & set(table):
            angle = table.get("angle_deg", table.get("sensor"))
            known = float(angle) if isinstance(angle, int) else angle
            yield DrawnSensor(number, str(table["name"]), known, str(table.get("quantity")))

"""Dimensions of the carrier with its picture and its deflection curve while they change."""

from typing import Any

import numpy as np
from nicegui import events, ui
from numpy.typing import NDArray

from carrierflex.fe.curve_files import read_curves
from carrierflex.files.whole_files import refuse_existing, whole_file
from carrierflex.workflows.app.called_line import CalledLine
from carrierflex.workflows.app.live_curves import (
    changed_stage,
    deflection,
    dimensions,
    parameter_text,
)
from carrierflex.workflows.app.steps import Step
from carrierflex.workflows.app.view import face, section
from carrierflex.workflows.app.work_folder import WorkFolder

_MM, _UM = 1e3, 1e6
_WORDS = (
    "Of the default carrier, in millimetres. The curve follows by its derivatives: first order, "
    "for changes of some per cent."
)
_CHART = {
    "animation": False,
    "grid": {"left": 52, "right": 16, "top": 104, "bottom": 48},
    "legend": {"top": 0, "left": 0, "orient": "vertical"},
    "tooltip": {"trigger": "axis"},
    "xAxis": {
        "type": "value", "min": 0, "max": 360, "interval": 60,
        "name": "angle from pin 1 [deg]", "nameLocation": "middle", "nameGap": 28,
    },
    "yAxis": {"type": "value", "name": "um per kN m"},
    "series": [],
}  # fmt: skip


class CarrierTab:
    """Fields, command line, picture and curves."""

    def __init__(self, folder: WorkFolder, called: CalledLine) -> None:
        self._folder = folder
        self._changes: dict[str, float] = {}
        self._step = step = Step("Dimensions", called)
        with step.body:
            ui.label(_WORDS).classes("faint-words")
            with ui.element("div").classes("fields"):
                for name, (value, low, high) in dimensions().items():
                    field = ui.number(name, value=round(_MM * value, 6), step=1.0)
                    field.props("dense stack-label").classes(name)
                    field.props["hint"] = f"{_MM * low:.4g} to {_MM * high:.4g}"
                    field.on_value_change(
                        step.guarded(lambda event, name=name: self._change(name, event))
                    )
            self._line = ui.refreshable(self._command)
            self._line()
        with Step("Picture and deflection of the rim", called).body:
            with ui.element("div").classes("two"):
                self._face, self._section = (ui.html("", sanitize=False) for _ in range(2))
            self._chart = ui.echart(_CHART).classes("curves")
        self._show()

    def _change(self, name: str, event: events.ValueChangeEventArguments) -> None:
        """Take over a dimension [mm]."""
        if event.value is None:
            raise ValueError(f"{name}: is empty; expected a length in mm")
        changes = {**self._changes, name: round(event.value / _MM, 9)}
        if abs(changes[name] - dimensions()[name][0]) < 1e-9:
            del changes[name]
        changed_stage(changes)
        self._changes = changes
        self._step.output.clear()
        self._line.refresh()
        self._show()

    def _command(self) -> None:
        """Command line that solves for the changed carrier."""
        out, file = self._folder.free("curves"), self._folder.free("carrier", ".toml")
        changes = dict(self._changes)
        if changes:
            ui.label(f"{file} will hold:").classes("faint-words")
            ui.label(parameter_text(changes)).classes("file-text")

        def write() -> None:
            path = self._folder.path_of(file)
            if changes:
                refuse_existing(path)
                with whole_file(path) as temporary:
                    temporary.write_text(parameter_text(changes), encoding="utf-8")

        def then() -> None:
            self._line.refresh()
            self._show(out)

        words = ["curves", *(["--parameters", file] if changes else []), "--out", out]
        self._step.command("Compute by finite elements", words, then, before=write)

    def _show(self, solved: str = "") -> None:
        """Show the changed carrier and its curves; those of a folder too, which are solved for."""
        carrier = changed_stage(self._changes).carrier
        self._face.content, self._section.content = face(carrier), section(carrier)
        series = [_series("delta_f, default", "#8fa3b5", *deflection({}))]
        if self._changes:
            name = "delta_f by derivatives"
            series.append(_series(name, "#1f5fa8", *deflection(self._changes)))
        if solved:
            curves = read_curves(self._folder.root / solved / "deflection_curves.csv")
            for name, colour in (("delta_f", "#c8501e"), ("delta_s", "#3a8f4d")):
                title = f"{name} by finite elements, {solved}"
                series.append(_series(title, colour, curves[name].angle, curves[name].axial))
        self._chart.options["series"] = series
        self._chart.update()


def _series(
    name: str, colour: str, angle: NDArray[np.float64], axial: NDArray[np.float64]
) -> dict[str, Any]:
    """One curve over a full turn: degrees, um per kN m."""
    x, y = np.append(np.rad2deg(angle), 360.0), _UM * np.append(axial, axial[0])
    points = np.column_stack([x.round(3), y.round(6)]).tolist()
    return {"type": "line", "name": name, "showSymbol": False, "color": colour, "data": points}

"""The page: two tabs of steps, each with its command line, its button and what came of it."""

from collections.abc import Callable
from importlib.resources import files

from nicegui import ui

from carrierflex.workflows.app.called_line import CalledLine
from carrierflex.workflows.app.carrier_tab import CarrierTab
from carrierflex.workflows.app.measurement_tab import MeasurementTab
from carrierflex.workflows.app.work_folder import WorkFolder

_PAGE = files("carrierflex.workflows") / "app" / "page"
_TABS = ("Measurement", "Carrier dimensions")


def build_page(
    folder: WorkFolder, called: CalledLine, prefix: str, close: Callable[[], None]
) -> None:
    """Build the page for a browser that has opened it.

    Parameters
    ----------
    folder : WorkFolder
        Where everything is.
    called : CalledLine
        Runs the command lines.
    prefix : str
        What the addresses of the page begin with.
    close : function
        Closes the page and ends the program.
    """

    def leave() -> None:
        ui.run_javascript("document.body.textContent = 'The page is closed.'")
        ui.timer(0.3, close, once=True)

    for tag, name in (("style", "page.css"), ("script", "drag.js")):
        ui.add_head_html(f"<{tag}>{(_PAGE / name).read_text(encoding='utf-8')}</{tag}>")
    with ui.element("div").classes("page"):
        with ui.element("div").classes("top"):
            ui.html("<h1>carrierflex</h1>", sanitize=False)
            ui.button("Close", on_click=leave).props("flat no-caps").classes("close")
        ui.label(f"Folder: {folder.root}").classes("faint-words")
        with ui.tabs().props("align=left no-caps dense") as tabs:
            for name in _TABS:
                ui.tab(name)
        with ui.tab_panels(tabs, value=_TABS[0], animated=False):
            with ui.tab_panel(_TABS[0]):
                MeasurementTab(folder, called, prefix)
            with ui.tab_panel(_TABS[1]):
                CarrierTab(folder, called)

"""The commands as a page in a browser on this machine: files in, report out, without a shell.

A good answer: a report whose files have the same bytes as those of the command lines that the page
shows.
"""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ClosedPage:
    """A page that was closed, and the folder with its files."""

    folder: Path


def main(
    *, out: Path = Path("carrierflex-app"), port: int = 0, browser: bool = True, quiet: bool = False
) -> ClosedPage:
    """Open a page in the browser of this machine: from logger files to the report.

    Only this machine can reach it, and only by the address that it prints; it fetches nothing from
    a network. Every step shows the command line that does the same.

    Parameters
    ----------
    out
        Folder to write: files that the page is given, maps, campaigns, diagnoses, curves; nothing
        in it is replaced.
    port
        Port of 127.0.0.1; 0 takes a free one.
    browser
        Open the page in the browser.
    quiet
        Print the address only.

    Returns
    -------
    ClosedPage
        Once the page is closed by its button; Ctrl-C ends it too.

    Raises
    ------
    ValueError
        Where NiceGUI is not installed, or the port is not free.
    OSError
        Where the folder cannot be written.
    """
    if not 0 <= port <= 65535:
        raise ValueError(f"--port is {port}; expected 0 to 65535")
    try:
        import nicegui  # noqa: F401
    except ImportError as error:
        raise ValueError(
            "the page needs NiceGUI, which is not installed; expected: pip install "
            '"carrierflex[app]" (.venv/bin/pip install "nicegui>=3" in a clone)'
        ) from error
    from carrierflex.workflows.app.server import serve
    from carrierflex.workflows.outputs import prepared_folder

    folder = prepared_folder(out)
    serve(folder.resolve(), port, opens_browser=browser, quiet=quiet)
    return ClosedPage(folder)

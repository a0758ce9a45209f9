"""The commands as a page in a browser on this machine: files in, report out, without a shell.

A good answer: a report whose files have the same bytes as those of the command lines that the page
shows.
"""

import os
import re
import secrets
import socket
import tempfile
import webbrowser
from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_HOST = "127.0.0.1"
#: Folders whose report the page shows.
_DIAGNOSIS = re.compile(r"diagnosis(_\d+)?")
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]


class OnlyThisPage:
    """Refuses what is not addressed to the page or comes from another one, and keeps it offline.

    The token in the address is what lets in; the header Host keeps out names that other sites let
    point to this machine. The policy lets the page load from its own server only.
    """

    def __init__(self, app: Application, address: str) -> None:
        self.app = app
        self._address = address
        policy = (
            "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
            f"connect-src 'self' ws://{address}; frame-ancestors 'self'; form-action 'self'"
        )
        self._headers = [
            (b"content-security-policy", policy.encode()),
            (b"referrer-policy", b"same-origin"),
            (b"x-content-type-options", b"nosniff"),
        ]

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        origin = headers.get(b"origin", b"").decode("latin-1")
        sound = headers.get(b"host", b"").decode("latin-1") == self._address
        if not sound or origin not in ("", f"http://{self._address}"):
            await _refuse(scope, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *self._headers]
            await send(message)

        await self.app(scope, receive, send_guarded)


async def _refuse(scope: Message, send: Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    body = b"refused: not the address of this page\n"
    headers = [(b"content-type", b"text/plain"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": body})


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
    from carrierflex.workflows.outputs import prepared_folder

    folder = prepared_folder(out)
    _serve(folder.resolve(), port, opens_browser=browser, quiet=quiet)
    return ClosedPage(folder)


def _serve(folder: Path, port: int, *, opens_browser: bool, quiet: bool) -> None:
    """Serve the page until it is closed."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((_HOST, port))
    except OSError as error:
        listening.close()
        raise ValueError(
            f"--port is {port}: {error.strerror}; expected a free one, or 0 for any"
        ) from error
    with listening, tempfile.TemporaryDirectory() as storage:
        # What NiceGUI would store stands in no folder of the user's; it reads this when imported.
        os.environ["NICEGUI_STORAGE_PATH"] = storage
        address = f"{_HOST}:{listening.getsockname()[1]}"
        prefix = f"/{secrets.token_urlsafe(24)}"
        server, app = _server(folder, address, prefix)
        url = f"http://{address}{prefix}/"
        print(url if quiet else f"The page: {url}\nCtrl-C, or its button, closes it.", flush=True)
        if opens_browser:
            app.on_startup(lambda: webbrowser.open(url))
        server.run(sockets=[listening])


def _server(folder: Path, address: str, prefix: str) -> tuple[Any, Any]:
    """Server and application of NiceGUI."""
    import uvicorn
    from fastapi import FastAPI, HTTPException
    from fastapi.responses import FileResponse
    from nicegui import app, ui

    from carrierflex.workflows.app.called_line import CalledLine
    from carrierflex.workflows.app.page import build_page
    from carrierflex.workflows.app.work_folder import WorkFolder

    called = CalledLine(folder)
    outer = FastAPI(openapi_url=None)

    def close() -> None:
        called.end()
        server.should_exit = True

    @ui.page("/", title="carrierflex")
    def page() -> None:
        build_page(WorkFolder(folder), called, prefix, close)

    @app.get("/report/{name}")
    def report(name: str) -> FileResponse:
        path = folder / name / "report.html"
        if not _DIAGNOSIS.fullmatch(name) or not path.is_file():
            raise HTTPException(404)
        return FileResponse(path, media_type="text/html")

    app.on_shutdown(called.end)
    ui.run_with(
        outer,
        mount_path=prefix,
        tailwind=False,
        show_welcome_message=False,
        reconnect_timeout=60.0,
    )
    guarded = OnlyThisPage(outer, address)
    config = uvicorn.Config(guarded, log_level="warning", access_log=False, lifespan="on")
    server = uvicorn.Server(config)
    return server, app

"""A headless Chromium over its debugging pipe.

What a page logs, what it fetches, how large its figures are.
"""

import base64
import io
import json
import os
import shutil
import subprocess
from contextlib import contextmanager

import numpy as np
import pytest
from matplotlib.image import imread

FLAGS = (
    "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking "
    "--disable-component-update "
    "--disable-sync --remote-debugging-pipe"
).split()
#: A page in space needs WebGL, which Chromium computes where there is no graphics card; no name is
#: resolved, so that nothing can come from a network.
WITH_WEBGL = [
    *(flag for flag in FLAGS if flag != "--disable-gpu"),
    *"--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader".split(),
    "--host-resolver-rules=MAP * ~NOTFOUND",
]
SECONDS = 60
#: Debian's and Google's names of the program.
PROGRAMS = ("chromium", "google-chrome")


class Browser:
    """Commands and events of the DevTools protocol; messages end with a zero byte."""

    def __init__(self, read, write):
        self.read, self.write = read, write
        self.buffer = b""
        self.number = 0
        self.session = None
        self.events = []

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def _next(self):
        while b"\0" not in self.buffer:
            chunk = os.read(self.read, 1 << 16)
            assert chunk, "the browser closed its pipe"
            self.buffer += chunk
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def open(self, address, *, width):
        """Load a page as a phone or a screen of that width would; returns when it is loaded."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=900,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self.call("Page.navigate", url=address)
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self._next())

    def value(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def picture(self):
        """What the window shows, shape (height, width, 3), values from 0 to 255."""
        png = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        return np.round(255.0 * imread(io.BytesIO(png), format="png")[..., :3])

    def complaints(self):
        """Console messages, uncaught exceptions and log entries."""
        wanted = ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
        return [event for event in self.events if event.get("method") in wanted]

    def addresses(self):
        """Everything the page asked for."""
        requests = (
            event for event in self.events if event.get("method") == "Network.requestWillBeSent"
        )
        return [event["params"]["request"]["url"] for event in requests]


@contextmanager
def browser(folder, flags=FLAGS):
    """Browser with an empty profile in a folder.

    Where there is none the test skips (fails with CI=true).
    """
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    shell = shutil.which("bash")
    if program is None or shell is None:
        pytest.skip(
            "chromium (or bash, which starts it) is not installed; the page's look is checked with "
            "it"
        )
    to_browser, from_browser = os.pipe(), os.pipe()
    command = f'exec "$0" "$@" 3<&{to_browser[0]} 4>&{from_browser[1]}'
    with open(os.devnull, "wb") as nothing:
        process = subprocess.Popen(
            [shell, "-c", command, program, *flags, f"--user-data-dir={folder}", "about:blank"],
            pass_fds=(to_browser[0], from_browser[1]),
            stdout=nothing,
            stderr=nothing,
        )
    os.close(to_browser[0])
    os.close(from_browser[1])
    opened = Browser(from_browser[0], to_browser[1])
    try:
        target = opened.call("Target.createTarget", url="about:blank")["targetId"]
        opened.session = opened.call("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log", "Network"):
            opened.call(f"{domain}.enable")
        yield opened
        opened.session = None
        opened.call("Browser.close")
        process.wait(SECONDS)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        os.close(from_browser[0])
        os.close(to_browser[1])

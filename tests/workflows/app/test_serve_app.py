"""The server of the page: for its own address only, and one line where it cannot start."""

import asyncio
import socket
import sys
from importlib.util import find_spec

import pytest

from carrierflex.workflows.app.serve_app import OnlyThisPage

HERE = "127.0.0.1:8000"


def answered(kind="http", **headers):
    """What a request with these headers gets: messages, and whether the page was asked."""
    asked, sent = [], []

    async def page(scope, receive, send):
        asked.append(scope["type"])
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message):
        sent.append(message)

    raw = [(name.encode(), value.encode()) for name, value in headers.items()]
    asyncio.run(OnlyThisPage(page, HERE)({"type": kind, "headers": raw}, None, send))
    return sent, bool(asked)


def test_the_page_answers_its_own_address_and_lets_nothing_be_loaded_from_elsewhere():
    (start,), asked = answered(host=HERE)
    assert asked
    policy = dict(start["headers"])[b"content-security-policy"].decode()
    assert policy.startswith("default-src 'self' ")
    assert [word for word in policy.split() if "//" in word] == [f"ws://{HERE};"]
    assert answered(host=HERE, origin=f"http://{HERE}")[1]


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"host": "evil.example:8000"},
        {"host": "127.0.0.1:8001"},
        {"host": HERE, "origin": "http://evil.example"},
        {"host": HERE, "origin": "null"},
        {"host": HERE, "origin": "http://127.0.0.1:8001"},
    ],
)
def test_another_host_or_origin_is_refused(headers):
    sent, asked = answered(**headers)
    assert not asked
    assert sent[0]["status"] == 403
    sent, asked = answered("websocket", **headers)
    assert (sent, asked) == ([{"type": "websocket.close", "code": 1008}], False)


def test_without_the_library_one_line_says_which_extra_to_install(command, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "nicegui", None)
    done = command("app", "--no-browser")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert 'pip install "carrierflex[app]"' in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_port_that_is_none_or_taken_is_refused(command):
    assert "--port is 70000; expected 0 to 65535" in command("app", "--port", "70000").stderr
    if find_spec("nicegui") is None:
        pytest.skip("NiceGUI is not installed")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = command("app", "--port", port, "--no-browser")
    assert done.returncode == 2
    assert f"--port is {port}: Address already in use; expected a free one" in done.stderr

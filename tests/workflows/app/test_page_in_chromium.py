"""The page in Chromium: a newcomer's files to the report, with the bytes of the commands."""

import re
import shutil
import socket
import subprocess
import sys
import time
import tomllib
from contextlib import closing, contextmanager
from http.client import HTTPConnection
from importlib.util import find_spec
from urllib.parse import urlsplit

import numpy as np
import pytest

from tests.diagnosis.report.browser import FLAGS, browser
from tests.identification.synthetic_campaigns import carrier_campaign

pytestmark = pytest.mark.long

PROGRAM = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]
#: No name is resolved, so that nothing can come from a network.
OFFLINE = [*FLAGS, "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"]
SECONDS = 120
#: Runs, as the newcomer's logger has them; no name tells the angle of the third sensor.
COLUMNS = ("Zeit [s]", "Winkel [rad]", "Drehmoment [kN m]", "ntl_y [kN]", "ntl_z [kN]")
SENSORS = {"s047": "probe 47 [um]", "s137": "probe 137 [um]", "s227": "left below [um]"}
SENSORS |= {"s317": "probe 317 [um]"}
#: What stands over the edge of the window, or of the box that it is in.
WIDER = """[...document.querySelectorAll('.page *')].filter(e => {
    const box = e.getBoundingClientRect();
    return box.width > 0 && !e.closest('svg, .q-tabs, .nicegui-echart')
        && (box.right > window.innerWidth + 1 || box.left < -1);
}).map(e => e.className || e.tagName)"""
#: Words of fields, lines and tables that cover one another.
COVERED = """(() => {
    const words = [...document.querySelectorAll('.line, .q-btn, caption, td, th, h2, .faint-words,'
        + ' .state, .signal b, .q-field, .q-field__messages, .q-checkbox, .refused, .note, figure')]
        .map(e => [e, e.getBoundingClientRect()]).filter(([e, box]) => box.width && box.height);
    const pairs = [];
    for (const [a, p] of words) for (const [b, q] of words)
        if (a !== b && !a.contains(b) && !b.contains(a)
            && Math.min(p.right, q.right) - Math.max(p.left, q.left) > 1
            && Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top) > 1)
            pairs.push(a.textContent.slice(0, 30) + ' | ' + b.textContent.slice(0, 30));
    return pairs;
})()"""


@contextmanager
def served(folder):
    """Address and process of a page whose work folder is `work` in a folder."""
    if find_spec("nicegui") is None:
        pytest.skip("NiceGUI is not installed; the page is made with it")
    line = [*PROGRAM, "app", "--no-browser", "--quiet", "--out", "work"]
    with subprocess.Popen(line, cwd=folder, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().strip(), process
        finally:
            process.terminate()


class Page:
    """What a person does on the page."""

    def __init__(self, opened, address, width):
        self.browser = opened
        opened.open(address, width=width)
        self.until("!!document.querySelector('input[type=file]')")

    def until(self, condition):
        """Wait for something on the page."""
        end = time.monotonic() + SECONDS
        while not self.browser.value(condition):
            assert time.monotonic() < end, (
                condition,
                self.browser.value("document.body.innerText"),
            )
            time.sleep(0.1)

    def drop(self, *paths):
        call = self.browser.call
        root = call("DOM.getDocument")["root"]["nodeId"]
        node = call("DOM.querySelector", nodeId=root, selector="input[type=file]")["nodeId"]
        call("DOM.setFileInputFiles", nodeId=node, files=[str(path) for path in paths])

    def fill(self, field, text):
        self.browser.value(f"document.querySelector('input.{field}, .{field} input').focus()")
        self.browser.value("document.activeElement.select()")
        self.browser.call("Input.insertText", text=text)
        self.browser.value("document.activeElement.blur()")

    def run(self, command):
        """Press the button of a command and wait for its end; the line that it ran."""
        self.until(f"!!document.querySelector('.run-{command}')")
        box = f"document.querySelector('.run-{command}').closest('.step')"
        line = self.browser.value(f"{box}.querySelector('.line').textContent")
        self.browser.value(f"document.querySelector('.run-{command}').click()")
        self.until(
            f"[...document.querySelectorAll('.refused, .faint-words')].some(e =>"
            f" e.className.includes('refused') || e.textContent === 'Ended: ' + {line!r})"
        )
        return line.split()

    def drag(self, name, degrees):
        """Drag a sensor around the rim."""
        self.browser.value("document.querySelector('svg.drawing').scrollIntoView()")
        sensor = f"document.querySelector('[data-name=\"{name}\"]')"
        at = f"(e => [(e.left + e.right) / 2, (e.top + e.bottom) / 2])({sensor}" + (
            ".querySelector('circle').getBoundingClientRect())"
        )
        middle = "(e => [(e.left + e.right) / 2, (e.top + e.bottom) / 2])" + (
            "(document.querySelector('svg.drawing').getBoundingClientRect())"
        )
        begin, centre = self.browser.value(at), self.browser.value(middle)
        radius, turn = 120.0, np.deg2rad(degrees)
        end = [centre[0] + radius * np.sin(turn), centre[1] - radius * np.cos(turn)]
        for kind, (x, y) in (("Pressed", begin), ("Moved", end), ("Released", end)):
            self.browser.call(
                "Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button="left",
                buttons=1, clickCount=1,
            )  # fmt: skip

    def overflow(self, width):
        """What is too wide or covered at a width of the window."""
        self.browser.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=900, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        time.sleep(0.5)
        scrolls = self.browser.value("document.documentElement.scrollWidth > window.innerWidth")
        return scrolls, self.browser.value(WIDER), self.browser.value(COVERED)


def write_logs(folder):
    """Two files of a logger."""
    for run in carrier_campaign().runs:
        inputs = [run.inputs["carrier_angle"]]
        inputs += [1e-3 * run.inputs[name] for name in ("torque", "ntl_y", "ntl_z")]
        columns = [run.time, *inputs, *(1e6 * run.signals[name] for name in SENSORS)]
        header = ";".join([*COLUMNS, *SENSORS.values()])
        table = np.column_stack(columns)
        np.savetxt(folder / f"{run.name}.csv", table, "%.9g", ";", header=header, comments="")
    return [folder / "LC1.csv", folder / "LC2.csv"]


def without_time(content):
    """Bytes without the minute at which a report was written."""
    return re.sub(rb"\d{4}-\d\d-\d\d \d\d:\d\d", b"", content)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A newcomer's session from files to the report, and what it left."""
    folder = tmp_path_factory.mktemp("session")
    logs = folder / "logger"
    logs.mkdir()
    paths = write_logs(logs)
    with served(folder) as (address, _), browser(folder / "profile", OFFLINE) as opened:
        page = Page(opened, address, 1280)
        page.drop(*paths)
        page.until("document.querySelectorAll('.q-checkbox').length === 2")
        lines = [page.run("new-campaign")]
        page.until("!!document.querySelector('.rig-0-nominal_torque')")
        page.until("document.querySelectorAll('table.rows td').length > 40")
        guessed = (folder / "work" / "map.toml").read_bytes()
        refused = page.run("import")
        refusal = opened.value("document.querySelector('.refused').textContent")
        page.fill("rig-0-nominal_torque", "360e3")
        page.fill("rig-0-sensor_radius", "0.412")
        page.until("document.querySelector('.state').textContent.includes('1 to fill in')")
        page.drag("left_below", 227)
        page.until("document.querySelector('.state').textContent.includes('nothing is left')")
        for command in ("import", "check", "diagnose"):
            lines.append(page.run(command))
        page.until("!!document.querySelector('iframe.report')")
        shown = opened.value("document.querySelector('iframe.report').src")
        looks = {width: page.overflow(width) for width in (390, 1280)}
        yield {
            "folder": folder, "lines": lines, "address": address, "guessed": guessed,
            "refused": (refused, refusal), "page": page, "report": shown, "looks": looks,
        }  # fmt: skip


def test_the_files_have_the_bytes_of_the_command_lines_that_the_page_shows(session, tmp_path):
    work = session["folder"] / "work"
    by_shell = tmp_path / "work"
    by_shell.mkdir()
    for name in ("LC1.csv", "LC2.csv"):
        shutil.copy(session["folder"] / "logger" / name, by_shell)
    assert [line[:2] for line in session["lines"]] == [
        ["carrierflex", name] for name in ("new-campaign", "import", "check", "diagnose")
    ]
    for line in session["lines"]:
        if line[1] == "import":
            # What the user's editor does in a shell.
            assert (by_shell / "map.toml").read_bytes() == session["guessed"]
            shutil.copy(work / "map.toml", by_shell)
        subprocess.run([*PROGRAM, *line[1:]], cwd=by_shell, check=False, capture_output=True)
    files = {path.relative_to(work) for path in work.rglob("*") if path.is_file()}
    assert {path.relative_to(by_shell) for path in by_shell.rglob("*") if path.is_file()} == files
    assert {"campaign", "diagnosis"} <= {path.parts[0] for path in files}
    for name in files:
        of_both = [without_time((folder / name).read_bytes()) for folder in (work, by_shell)]
        assert of_both[0] == of_both[1], name


def test_the_dragged_sensor_has_its_angle_and_the_carrier_tilts_as_simulated(session):
    folder = session["folder"] / "work"
    channels = tomllib.loads((folder / "map.toml").read_text(encoding="utf-8"))["channels"]
    assert [channel["angle_deg"] for channel in channels] == [47.0, 137.0, 227.0, 317.0]
    assert b'angle_deg = "?"' in session["guessed"]
    assert "carrier_tilt" in (folder / "diagnosis" / "diagnosis.json").read_text(encoding="utf-8")


def test_an_import_that_is_refused_says_the_one_line_of_the_command(session, command):
    line, refusal = session["refused"]
    assert line[1] == "import"
    for name in ("nominal_torque", "sensor_radius", "angle_deg"):
        assert f"'{name}' is '?'" in refusal
    folder = session["folder"] / "again"
    folder.mkdir()
    for name in ("LC1.csv", "LC2.csv"):
        shutil.copy(session["folder"] / "logger" / name, folder)
    (folder / "map.toml").write_bytes(session["guessed"])
    done = subprocess.run(
        [*PROGRAM, *line[1:]], cwd=folder, check=False, capture_output=True, text=True
    )
    assert done.stderr == f"carrierflex: {refusal}\n"


@pytest.mark.parametrize("width", [390, 1280])
def test_nothing_overlaps_or_scrolls_sideways(session, width):
    assert session["looks"][width] == (False, [], [])


def test_everything_comes_from_this_page_and_the_browser_complains_of_nothing(session):
    page = session["page"].browser
    page.value("1")  # events that wait
    asked = [url for url in page.addresses() if not url.startswith(("data:", "blob:"))]
    assert session["report"] in asked
    assert [url for url in asked if not url.startswith(session["address"])] == []
    assert page.complaints() == []


def test_only_this_machine_with_the_token_and_the_right_host_is_answered(session):
    address = urlsplit(session["address"])
    assert (address.hostname, len(address.path.strip("/"))) == ("127.0.0.1", 32)

    def status(path, **headers):
        with closing(HTTPConnection("127.0.0.1", address.port)) as connection:
            connection.request("GET", path, headers=headers)
            return connection.getresponse().status

    assert status(address.path) == 200
    report = f"{address.path}report/diagnosis"
    assert status(report) == 200
    assert status(address.path, Host=f"evil.example:{address.port}") == 403
    first_letter = "x" if address.path[1] != "x" else "y"
    wrong_token = f"/{first_letter}{address.path[2:]}"
    for path in ("/", "/report/diagnosis", "/wrong/", wrong_token, "/_nicegui/x"):
        assert status(path) == 404, path
    for name in ("..", "%2e%2e", "..%2flogger", "campaign", "map.toml", "diagnosis%2f..%2f.."):
        assert status(f"{address.path}report/{name}") == 404, name
    # A server of all addresses of this machine would answer here too.
    with socket.socket() as other:
        assert other.connect_ex(("127.0.0.2", address.port)) != 0


def test_a_name_from_the_browser_stays_in_the_folder(session):
    page = session["page"].browser
    page.value(
        "(async () => { const box = document.querySelector('.q-uploader');"
        "const form = new FormData();"
        "form.append('a', new Blob(['out']), '../../escaped.csv');"
        "form.append('b', new Blob(['other']), 'LC1.csv');"
        "const id = document.documentElement.innerHTML.match(/client_id\\W+([\\w-]{36})/)[1];"
        "const path = `_nicegui/client/${id}/upload/${box.id.slice(1)}`;"
        "window.answer = (await fetch(path, {method: 'POST', body: form})).status; })()"
    )
    session["page"].until("window.answer === 200")
    session["page"].until("!!document.querySelector('.refused')")
    assert "LC1.csv: is in the folder already" in page.value(
        "document.querySelector('.refused').textContent"
    )
    folder = session["folder"]
    assert [path.relative_to(folder) for path in folder.rglob("escaped.csv")] in (
        [],
        [(folder / "work" / "escaped.csv").relative_to(folder)],
    )
    assert not (folder.parent / "escaped.csv").exists()
    of_both = [(folder / name / "LC1.csv").read_bytes() for name in ("logger", "work")]
    assert of_both[0] == of_both[1]


def test_a_map_that_was_changed_elsewhere_is_not_replaced(session):
    path = session["folder"] / "work" / "map.toml"
    edited = path.read_bytes() + b"# by an editor\n"
    path.write_bytes(edited)
    session["page"].fill("rig-0-n_planets", "4")
    session["page"].until("document.body.innerText.includes('was changed elsewhere')")
    assert path.read_bytes() == edited


def test_a_file_that_is_none_of_a_logger_is_refused_in_one_line(tmp_path, command):
    bad = tmp_path / "bad.csv"
    bad.write_bytes(bytes(range(256)) * 40)
    with served(tmp_path) as (address, _), browser(tmp_path / "profile", OFFLINE) as opened:
        page = Page(opened, address, 390)
        page.drop(bad)
        page.until("document.querySelectorAll('.q-checkbox').length === 1")
        page.run("new-campaign")
        refusal = opened.value("document.querySelector('.refused').textContent")
    done = command("new-campaign", "--kind", "carrier", "--from", "bad.csv", "--out", "map.toml")
    assert done.stderr == f"carrierflex: {refusal}\n"
    assert {path.name for path in (tmp_path / "work").iterdir()} == {"bad.csv"}


def test_dimensions_change_the_picture_at_once_and_the_button_solves_until_it_is_stopped(tmp_path):
    with served(tmp_path) as (address, process), browser(tmp_path / "profile", OFFLINE) as opened:
        page = Page(opened, address, 1280)
        opened.value("document.querySelectorAll('.q-tab')[1].click()")
        page.until("!!document.querySelector('.run-curves')")
        before = opened.value("document.querySelectorAll('svg.drawing')[1].outerHTML")
        page.fill("plate_gap", "250")
        page.until("document.body.innerText.includes('plate_gap = 0.25')")
        page.until(f"document.querySelectorAll('svg.drawing')[1].outerHTML !== {before!r}")
        line = opened.value(
            "document.querySelector('.run-curves').closest('.step')"
            ".querySelector('.line').textContent"
        )
        assert line == "carrierflex curves --parameters carrier.toml --out curves"
        page.fill("hub_inner_diameter", "470")
        page.until("!!document.querySelector('.refused')")
        assert "hub_inner_diameter" in opened.value(
            "document.querySelector('.refused').textContent"
        )
        for width in (390, 1280):
            assert page.overflow(width) == (False, [], [])
        work = tmp_path / "work"
        assert not list(work.iterdir())
        opened.value("document.querySelector('.run-curves').click()")
        page.until("!!document.querySelector('.stop')")
        assert (work / "carrier.toml").read_text(
            encoding="utf-8"
        ) == "[carrier]\nplate_gap = 0.25\n"
        opened.value("document.querySelector('.stop').click()")
        page.until("!!document.querySelector('.refused')")
        said = opened.value("document.querySelector('.refused').textContent")
        assert "terminated" in said or "exit code -15" in said
        assert [path.name for path in work.rglob("*") if path.is_file()] == ["carrier.toml"]
        opened.value("document.querySelector('.close').click()")
        assert process.wait(SECONDS) == 0

"""The pages in a browser: something is drawn, the slider moves it, nothing asks a network."""

import time
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.files.versions import provenance
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.reduction.shapes.body_shapes import body_shapes
from carrierflex.workflows.view3d.body_scene import body_scene
from carrierflex.workflows.view3d.rim_motion_files import RimMotion, RimSignal
from carrierflex.workflows.view3d.rim_scene import rim_scene
from carrierflex.workflows.view3d.view_file import write_view
from tests.diagnosis.report.browser import SECONDS, WITH_WEBGL, browser

pytestmark = pytest.mark.long

#: Columns of the panel; the picture is beside it.
PANEL = 320
CHANGED = 20.0


@pytest.fixture(scope="module")
def body_page(tmp_path_factory, flexible_mesh, flexible_structure, flexible_reduction):
    pytest.importorskip("k3d")
    record = provenance(parameters=read_parameters(None), size=0.06, modes=11)
    model = replace(flexible_reduction.model, provenance=record)
    shapes = body_shapes(flexible_mesh, flexible_reduction.basis)
    path = tmp_path_factory.mktemp("body") / "body.html"
    return write_view(body_scene(model, shapes), path)


@pytest.fixture(scope="module")
def rim_page(tmp_path_factory):
    pytest.importorskip("k3d")
    theta = 2.0 * np.pi * np.arange(90) / 90
    signals = [
        RimSignal("LC1", name, "axial", angle, 3e-4 * np.cos(theta - angle), 0.0 * theta)
        for name, angle in (("s047", 0.8), ("s137", 2.4))
    ]
    path = tmp_path_factory.mktemp("rim") / "rim.html"
    return write_view(rim_scene(RimMotion("twin", "m", 3, 0.4, (), tuple(signals))), path)


def wait_for(opened, expression):
    """Wait until an expression holds in the page."""
    end = time.monotonic() + SECONDS
    while not opened.value(expression):
        assert time.monotonic() < end, f"{expression} does not become true"
        time.sleep(0.05)


def shown(opened):
    """The picture beside the panel once it was drawn for the time that the panel asks for."""
    # Two frames: the one asked for, and the one after it.
    opened.call(
        "Runtime.evaluate",
        expression="new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))",
        awaitPromise=True,
    )
    return opened.picture()[:, PANEL:]


def opened_page(opened, page):
    opened.open(page.path.as_uri(), width=1200)
    wait_for(opened, "document.body.dataset.time !== undefined")
    return shown(opened)


def moved(opened, control, value):
    """The picture after a control of the panel was moved by hand."""
    before = opened.value("document.body.dataset.time")
    kind = "change" if control == "entry" else "input"
    opened.value(
        f"(() => {{ const e = document.getElementById('{control}'); e.value = {value};"
        f" e.dispatchEvent(new Event('{kind}')); return 1; }})()"
    )
    wait_for(opened, f"document.body.dataset.time !== '{before}'")
    return shown(opened)


def changed_share(before, after):
    return float(np.mean(np.abs(before - after).max(axis=2) > CHANGED))


def drawn_share(picture):
    return float(np.mean(picture.min(axis=2) < 250.0))


def test_a_body_is_drawn_moves_with_the_slider_and_asks_no_network(tmp_path, body_page):
    with browser(tmp_path, WITH_WEBGL) as opened:
        first = opened_page(opened, body_page)
        assert drawn_share(first) > 0.1
        # At rest the colours vanish and the shape is another.
        assert changed_share(first, moved(opened, "slider", 0.0)) > 0.05
        assert changed_share(first, moved(opened, "slider", 1.0)) < 1e-3
        mode = moved(opened, "entry", 3)
        assert changed_share(first, mode) > 0.05
        assert changed_share(mode, moved(opened, "slider", -1.0)) > 0.05
        # Surfaces by name: the rim's face is drawn in its colour, and a switch takes it away.
        names = moved(opened, "entry", 0)
        opened.value("document.querySelectorAll('#switches input')[1].click()")
        time.sleep(0.5)
        assert 0.005 < changed_share(names, shown(opened)) < 0.2
        assert opened.value("document.querySelector('#words').textContent") != ""
        addresses = opened.addresses()
        complaints = [event for event in opened.complaints() if "K3D: " not in str(event)]
    assert complaints == []
    assert {address.split(":")[0] for address in addresses} <= {"file", "data", "blob"}
    assert body_page.size < 15e6


def test_labels_of_pins_stand_in_the_picture(tmp_path, body_page):
    with browser(tmp_path, WITH_WEBGL) as opened:
        opened_page(opened, body_page)
        positions = opened.value(
            "[...document.querySelectorAll('#canvasTarget div')]"
            ".filter(e => /^pin \\d upwind$/.test(e.textContent))"
            ".map(e => { const b = e.getBoundingClientRect(); return [b.x, b.y]; })"
        )
    assert len(positions) == 3
    assert all(PANEL < x < 1200 and 0 < y < 900 for x, y in positions)


def test_the_carrier_turns_and_its_gap_is_in_colour(tmp_path, rim_page):
    with browser(tmp_path, WITH_WEBGL) as opened:
        first = opened_page(opened, rim_page)
        assert drawn_share(first) > 0.02
        # Between measured and simulated there is blue and red.
        red, blue = first[..., 0] - first[..., 2] > 60.0, first[..., 2] - first[..., 0] > 60.0
        assert min(np.count_nonzero(red), np.count_nonzero(blue)) > 200
        quarter = moved(opened, "slider", 90.0)
        assert changed_share(first, quarter) > 0.01
        # A whole turn is the same picture again.
        assert changed_share(first, moved(opened, "slider", 360.0)) < 1e-3
        opened.value("document.getElementById('play').click()")
        wait_for(opened, "Number(document.getElementById('slider').value) > 5")
        addresses = opened.addresses()
    assert {address.split(":")[0] for address in addresses} <= {"file", "data", "blob"}
    assert rim_page.size < 2e6

"""How the pages of every kind and verdict look: no text on another, nothing to scroll sideways."""

import json

import pytest

from carrierflex.diagnosis.inference.results import VERDICTS
from tests.diagnosis.report.verdict_pages import pages

pytestmark = pytest.mark.long

KINDS = ("carrier", "element", "mounting")
#: Widths of a phone, of a screen, and of A4 within its margins at 96 dots an inch.
PHONE = 390
SCREEN = 1280
PAPER = 688
PAPER_HEIGHT = 1017
#: What is seen without scrolling: an iPhone 14, a laptop.
FOLD = {PHONE: 844.0, SCREEN: 800.0}

#: Pairs of texts whose boxes overlap, whatever they belong to: every line of every text is a box.
_OVERLAPS = """JSON.stringify((() => {
    const boxes = [];
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walk.nextNode(), owner = 0; node; node = walk.nextNode(), owner++) {
        if (!node.textContent.trim() || !node.parentElement.checkVisibility()) continue;
        if (node.parentElement.closest("style, script, title, desc")) continue;
        const range = document.createRange();
        range.selectNodeContents(node);
        const inSvg = node.parentElement.closest("svg text");
        const rects = inSvg ? [inSvg.getBoundingClientRect()] : range.getClientRects();
        const shared = inSvg || node;
        for (const box of rects)
            if (box.width > 1 && box.height > 1) boxes.push([box, shared, node.textContent]);
    }
    boxes.sort((a, b) => a[0].top - b[0].top);
    const found = [];
    boxes.forEach(([a, of_a, text_a], i) => {
        for (let k = i + 1; k < boxes.length && boxes[k][0].top < a.bottom; k++) {
            const [b, of_b, text_b] = boxes[k];
            if (of_a === of_b) continue;
            const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
            const down = Math.min(a.bottom, b.bottom) - b.top;
            if (across > 1 && down > 0.35 * Math.min(a.height, b.height))
                found.push([text_a.trim().slice(0, 60), text_b.trim().slice(0, 60)]);
        }
    });
    return found; })())"""

#: Texts that stand outside the page, or are cut by a frame that cannot be scrolled.
_CUT = """JSON.stringify([...document.querySelectorAll("td, th, p, dd, dt, h1, h2, h3, li, text")]
    .filter(own => own.checkVisibility() && own.textContent.trim())
    .filter(own => !own.closest(".scroll") || getComputedStyle(own.closest(".scroll")).overflowX
        === "visible")
    .filter(own => own.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
    .map(own => own.textContent.trim().slice(0, 60)))"""

_OPEN_DETAILS = "document.querySelectorAll('details').forEach(own => {own.open = true}); 1"
_BOTTOM = "document.querySelector('{}')?.getBoundingClientRect().bottom ?? 0"


@pytest.fixture(scope="module", params=KINDS)
def addresses(request, tmp_path_factory):
    """Page of every verdict of a kind, by the verdict."""
    folder = tmp_path_factory.mktemp(request.param)
    written = {}
    for verdict, text in pages(request.param):
        path = folder / f"{verdict}.html"
        path.write_text(text, encoding="utf-8")
        written[verdict] = path.as_uri()
    assert set(written) == set(VERDICTS)
    return written


def opened(window, address, width):
    window.events.clear()
    window.open(address, width=width)


def faults(window):
    """What is wrong with the page as it stands."""
    wide = window.value(
        "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    )
    return {
        "texts that overlap": json.loads(window.value(_OVERLAPS)),
        "texts that are cut": json.loads(window.value(_CUT)),
        "pixels to scroll sideways": wide,
    }


NONE = {"texts that overlap": [], "texts that are cut": [], "pixels to scroll sideways": 0}


@pytest.mark.parametrize("width", [PHONE, SCREEN])
def test_no_text_stands_on_another_and_nothing_scrolls_sideways(addresses, width, window):
    result = {}
    for verdict, address in addresses.items():
        opened(window, address, width)
        result[verdict] = faults(window)
        window.value(_OPEN_DETAILS)
        result[f"{verdict}, unfolded"] = faults(window)
        assert window.complaints() == []
    assert result == dict.fromkeys(result, NONE)


def test_a_printed_page_is_whole(addresses, window):
    result = {}
    for verdict, address in addresses.items():
        opened(window, address, PAPER)
        window.call("Emulation.setEmulatedMedia", media="print")
        assert window.value("document.querySelector('#inputs').checkVisibility()") is True
        result[verdict] = faults(window)
        window.call("Emulation.setEmulatedMedia", media="")
    assert result == dict.fromkeys(result, NONE)


@pytest.mark.parametrize("width", [PHONE, SCREEN])
def test_answer_and_next_step_stand_above_the_fold(addresses, width, window):
    below = {}
    for verdict, address in addresses.items():
        opened(window, address, width)
        for selector in ("#headline", "#next"):
            bottom = window.value(_BOTTOM.format(selector))
            assert bottom > 0.0
            if bottom > FOLD[width]:
                below[verdict, selector] = bottom
    assert below == {}


def test_the_summary_is_one_printed_page_and_the_annex_begins_another(addresses, window):
    heights = {}
    for verdict, address in addresses.items():
        opened(window, address, PAPER)
        window.call("Emulation.setEmulatedMedia", media="print")
        heights[verdict] = window.value(_BOTTOM.format("#verdict"))
        breaks = "getComputedStyle(document.querySelector('#annex')).breakBefore"
        assert window.value(breaks) == "page"
        window.call("Emulation.setEmulatedMedia", media="")
    assert max(heights.values()) < PAPER_HEIGHT, heights

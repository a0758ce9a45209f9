"""The site: few pages and words, no picture that nothing shows, nothing asked of the network."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.docs

DOCS = Path(__file__).parents[2] / "docs"
SETTINGS, _, NAVIGATION = (
    (DOCS.parent / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")
)
#: Of the navigation without reference and decisions; of what is written by hand but decisions.
MOST_PAGES, MOST_WORDS = 22, 50_000


def pages(navigation):
    return re.findall(r": ([\w/]+\.md)$", navigation, re.MULTILINE)


def written_pages():
    return sorted(path for path in DOCS.rglob("*.md") if path.parent.name != "decisions")


def test_the_navigation_is_short_and_holds_every_page():
    guide, _, reference = NAVIGATION.partition("  - Reference:\n")
    assert 15 < len(pages(guide)) <= MOST_PAGES
    # Pages whose sections or pictures follow from the source, and the list of decisions.
    assert len(pages(reference)) == 7
    missing = {path.relative_to(DOCS).as_posix() for path in written_pages()} - {*pages(NAVIGATION)}
    assert missing == {"reliability.md"}  # linked from validation.md


def test_the_pages_are_short():
    words = {}
    for path in written_pages():
        text = path.read_text(encoding="utf-8")
        # Written by make performance, and by make gallery.
        text = re.sub(r"<!-- Written by.*<!-- End of", "", text, flags=re.DOTALL)
        words[path.name] = len(text.split()) * (path.name != "gallery.md")
    assert sum(words.values()) > 20_000
    assert sum(words.values()) <= MOST_WORDS, words


def test_every_picture_is_shown():
    shown = {DOCS.parent / "README.md", *DOCS.rglob("*.md")}
    text = "".join(path.read_text(encoding="utf-8") for path in shown)
    pictures = [path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.png")]
    assert len(pictures) > 20
    assert not [picture for picture in pictures if picture not in text]


def test_search_from_disk_asks_nothing_of_the_network():
    # Without a polyfill of this name the plugin offline has one fetched from unpkg.com.
    assert "\n  - offline" in SETTINGS
    (script,) = re.findall(r"polyfills: \[(.*iframe-worker.*)\]", SETTINGS)
    assert "http" not in script
    assert (DOCS / script).is_file()

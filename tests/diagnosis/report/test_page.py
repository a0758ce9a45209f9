import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import jinja2
import numpy as np
import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.results import VERDICTS
from carrierflex.diagnosis.report import page as report
from carrierflex.diagnosis.report.gap_words import where_text
from carrierflex.files.json_files import save_text
from tests.diagnosis.carrier.carrier_twin import twin_campaign, twin_problem
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.report.verdict_pages import page_of

LOADS = ((1.0, 0, 0), (0.5, 0, 0), (1.0, 0, -2e5), (1.0, 1e5, 1e5))
SECTIONS = (
    "verdict headline next causes where look parameters regime gap-maps growth scalars shapes "
    "which figures-of-merit sets validation inputs runs channels rig versions words"
).split()


@pytest.fixture(scope="module")
def element():
    campaign = displacement_campaign(lambda q, v: 5e8 * q**3, n=1500)
    diagnosis = diagnose(element_problem(campaign), campaign="twin mount", kind="element")
    return diagnosis, campaign


@pytest.fixture(scope="module")
def carrier():
    options = {"loads": LOADS, "turns": 8}
    diagnosis = diagnose(
        twin_problem("carrier_tilt", **options), campaign="twin carrier", kind="carrier"
    )
    return diagnosis, twin_campaign("carrier_tilt", **options)


@pytest.fixture(scope="module")
def page(element):
    return page_of(*element)


@pytest.fixture(scope="module")
def carrier_page(carrier):
    return page_of(*carrier)


class Text(HTMLParser):
    """What a reader sees of a page."""

    def __init__(self, text):
        super().__init__()
        self.text = ""
        self.feed(text)

    def handle_data(self, data):
        self.text += data


class Tags(HTMLParser):
    """Tags of a page with their attributes; end tags must match."""

    VOID = ("meta", "link", "br", "img", "path", "use")

    def __init__(self, text):
        super().__init__()
        self.elements, self.opened = [], []
        self.feed(text)
        assert self.opened == []

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.opened.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.opened.pop() == tag

    def of(self, *names):
        return [attributes for tag, attributes in self.elements if tag in names]

    def identifiers(self):
        return [attributes["id"] for _, attributes in self.elements if "id" in attributes]


@pytest.mark.parametrize("section", SECTIONS)
def test_page_has_every_section(section, page):
    assert Tags(page).identifiers().count(section) == 1


def test_page_says_what_was_found(element, page):
    diagnosis, _ = element
    reduction = diagnosis.reduction
    assert "<h1>The gap is explained by cubic stiffness.</h1>" in page
    assert where_text(diagnosis).split("^")[0] in page
    assert diagnosis.reason in page
    for value in (
        reduction.rho,
        reduction.phi,
        *reduction.rho_ci95,
    ):
        assert f"{value:.3f}" in page
    K3 = diagnosis.attribution.parameters["cubic_stiffness"]["K3"]
    mantissa = f"{K3.value:.1e}".split("e")[0]
    value = rf"\({mantissa}\d* ± 0.\d+\)·10<sup>8</sup> N/m<sup>3</sup>"
    assert re.search(rf"<b>{value}</b> cubic stiffness", page)
    assert re.search(rf"<code>K3</code></td><td class=\"n\">{value}</td>", page)
    for text in (
        "twin mount",
        "folder/twin",
        "2026-01-02 03:04",
        "numpy 2.0.1",
        "carrierflex",
        "R2.csv",
    ):
        assert text in page


def test_page_needs_nothing_from_outside(page):
    tags = Tags(page)
    assert not tags.of("script", "iframe", "object", "embed", "base")
    addresses = [
        value
        for _, attributes in tags.elements
        for name, value in attributes.items()
        if name in ("src", "href", "xlink:href")
    ]
    assert addresses
    assert all(address.startswith(("#", "data:")) for address in addresses)
    assert not re.search(r"@import|@font-face", page)
    assert all(match.startswith("url(#") for match in re.findall(r"url\([^)]*", page))
    assert "default-src 'none'" in page
    assert len(page.encode()) < 1_000_000


def test_identifiers_are_unique_and_references_lead_somewhere(page):
    tags = Tags(page)
    identifiers = tags.identifiers()
    assert len(identifiers) == len(set(identifiers))
    wanted = re.findall(r"url\(#([^)]+)\)", page)
    wanted += [attributes["href"][1:] for attributes in tags.of("a")]
    wanted += [attributes["xlink:href"][1:] for attributes in tags.of("use")]
    assert set(wanted) <= set(identifiers)


def test_every_figure_has_a_text_and_fits_any_width(element, carrier, page, carrier_page):
    for (diagnosis, _), text in ((element, page), (carrier, carrier_page)):
        figures = Tags(text).of("svg")
        n_panels = sum(len(picture.panels) for picture in diagnosis.pictures)
        # Two gap maps, the machine and its signals; the curve of a class.
        assert len(figures) - n_panels in (4, 5)
        for figure in figures:
            assert figure["role"] == "img"
            assert "viewbox" in figure
            assert not {"width", "height"} & set(figure)


def test_axes_name_their_units(page, carrier_page):
    for text, wanted in zip(
        (page, carrier_page),
        (
            ["frequency [Hz]", "RMS of the gap [N]", "deflection [mm]", "unexplained force [N]"],
            [
                "order of carrier rotation [per turn]",
                "RMS of the gap [µm]",
                "displacement [µm] over carrier angle [deg]",
            ],
        ),
        strict=True,
    ):
        for label in wanted:
            assert label in text


def test_names_from_the_campaign_are_text_and_no_markup(element):
    diagnosis, campaign = element
    findings = diagnosis.gap.findings
    band = replace(findings.where[0], runs=("a < b & c",), is_in_every_run=False)
    gap = replace(diagnosis.gap, findings=replace(findings, where=(band,)))
    named = replace(without_figures(diagnosis), campaign="<script>alert(1)</script>", gap=gap)
    page = page_of(named, campaign)
    assert "&lt;script&gt;" in page
    assert "<script" not in page
    assert "in a &lt; b &amp; c" in page


def test_effects_are_called_by_their_names_in_every_sentence(element, page):
    diagnosis, _ = element
    sentences = [diagnosis.reason, diagnosis.attribution.discriminating_experiment]
    sentences += [ranked.refused for ranked in diagnosis.attribution.ranking]
    assert not any("_" in sentence for sentence in sentences)
    assert "cubic stiffness" in Text(page).text
    assert not re.search(r"[a-z]+_(stiffness|friction|damping)", Text(page).text)


def test_a_template_without_its_content_is_refused():
    with pytest.raises(jinja2.UndefinedError):
        report.rendered_page("report.html.j2", {})


def without_figures(diagnosis):
    reduction = replace(diagnosis.reduction, cells_before=(), cells_after=(), steps=())
    return replace(
        diagnosis,
        pictures=(),
        gap=None,
        classes=None,
        signals=None,
        reduction=reduction,
    )


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_has_words(verdict, element):
    diagnosis, campaign = element
    page = page_of(without_figures(replace(diagnosis, verdict=verdict)), campaign)
    assert not Tags(page).of("svg")
    assert f"<code>{verdict}</code>" in page
    explained = "The gap is explained by cubic stiffness" in page
    assert explained == (verdict in ("named", "aliased", "named_with_remainder"))


def test_records_that_allow_no_diagnosis_give_a_page_that_says_why(element):
    _, measured = element
    campaign = replace(measured, runs=measured.runs[:1])
    problem = element_problem(campaign)
    [record] = problem.records
    diagnosis = diagnose(
        replace(problem, records=(replace(record, block=np.minimum(record.block, 1)),)),
        campaign="short",
        kind="element",
    )
    assert diagnosis.verdict == "not_diagnosable"
    page = page_of(diagnosis, measured)
    assert "These records do not allow a diagnosis" in page
    assert diagnosis.reason in page
    assert not Tags(page).of("svg")


@pytest.mark.long
def test_without_a_supported_set_the_gap_is_drawn_once(element):
    diagnosis, campaign = element
    reduction = replace(
        diagnosis.reduction,
        steps=diagnosis.reduction.steps[:1],
        cells_after=diagnosis.reduction.cells_before,
    )
    nothing = replace(diagnosis.attribution, effects=())
    page = page_of(
        replace(
            diagnosis,
            verdict="none_of_these",
            pictures=(),
            reduction=reduction,
            attribution=nothing,
        ),
        campaign,
    )
    assert "No known effect explains the gap" in page
    assert [
        identifier
        for identifier in Tags(page).identifiers()
        if identifier.startswith("map-") and identifier.endswith("-title")
    ] == ["map-before-title"]
    refused = replace(diagnosis, verdict="none_of_these", attribution=nothing, pictures=())
    assert "cubic stiffness added, which is not named" in page_of(refused, campaign)


def test_a_problem_without_pictures_gives_a_page_without_them(element):
    diagnosis, campaign = element
    page = page_of(replace(diagnosis, pictures=()), campaign)
    assert "Unexplained force" not in page
    assert len(Tags(page).of("svg")) == 5


@pytest.mark.long
def test_page_is_the_same_each_time_and_written_whole(element, tmp_path, page):
    save_text(tmp_path / "report.html", page_of(*element))
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_a_browser_shows_every_figure_without_complaint(
    element, carrier, page, carrier_page, tmp_path, window
):
    for result, text, width in product_of_pages((element, page), (carrier, carrier_page)):
        path = tmp_path / "report.html"
        path.write_text(text, encoding="utf-8")
        window.events.clear()
        window.open(path.as_uri(), width=width)
        window.value("document.querySelectorAll('details').forEach(own => {own.open = true}); 1")
        boxes = json.loads(window.value(_BOXES))
        n_panels = sum(len(picture.panels) for picture in result[0].pictures)
        assert len(boxes) >= 4 + n_panels
        assert np.min(boxes) > 80.0
        assert np.max(np.array(boxes)[:, 0]) <= width
        # A phone never has to scroll sideways; wide tables do so in their own frame.
        assert window.value("document.documentElement.scrollWidth") <= width
        assert window.complaints() == []
        assert all(address.startswith(("file:", "data:")) for address in window.addresses())


def product_of_pages(*pages):
    """Every page at the width of a phone and of a screen."""
    return [(*entry, width) for entry in pages for width in (390, 1200)]


_BOXES = """JSON.stringify([...document.querySelectorAll("svg")].map(own => {
    const box = own.getBoundingClientRect(); return [box.width, box.height]; }))"""


def test_page_says_what_the_errors_of_parameters_hold(page, carrier_page):
    assert "The squares add up to the square of ±. Gain errors are not included." in Text(page).text
    assert "Gain errors are not included" not in Text(carrier_page).text


#: Pairs of texts of one figure, or of the page's first screen, whose boxes overlap.
_OVERLAPS = """JSON.stringify((() => {
    const found = [];
    for (const svg of document.querySelectorAll("svg")) {
        const texts = [...svg.querySelectorAll("text")].filter(own => own.textContent.trim());
        const boxes = texts.map(own => own.getBoundingClientRect());
        for (let i = 0; i < boxes.length; i++) for (let k = 0; k < i; k++) {
            const a = boxes[i], b = boxes[k];
            const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
            const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
            if (across > 1 && down > 0.35 * Math.min(a.height, b.height))
                found.push([svg.getAttribute("aria-labelledby"), texts[i].textContent,
                            texts[k].textContent]);
        }
    }
    return found; })())"""


def test_the_answer_and_the_next_step_stand_on_the_first_screen(
    page, carrier_page, tmp_path, window
):
    for text in (page, carrier_page):
        path = tmp_path / "report.html"
        path.write_text(text, encoding="utf-8")
        window.events.clear()
        window.open(path.as_uri(), width=1280)
        bottom = "document.querySelector('{}').getBoundingClientRect().bottom"
        for selector in ("#headline", "#next", "#machine-title", "#causes"):
            assert window.value(bottom.format(selector)) <= 800.0
        # Details are folded until they are asked for, and printed all the same.
        assert window.value("document.querySelector('#gap-maps').checkVisibility()") is False
        window.call("Emulation.setEmulatedMedia", media="print")
        assert (
            window.value("document.querySelector('#gap-maps svg').getBoundingClientRect().width")
            > 80
        )
        window.call("Emulation.setEmulatedMedia", media="")


@pytest.mark.parametrize("width", [390, 1280])
def test_no_text_of_a_figure_stands_on_another(carrier_page, page, tmp_path, width, window):
    for text in (page, carrier_page):
        path = tmp_path / "report.html"
        path.write_text(text, encoding="utf-8")
        window.events.clear()
        window.open(path.as_uri(), width=width)
        window.value("document.querySelectorAll('details').forEach(own => {own.open = true}); 1")
        assert json.loads(window.value(_OVERLAPS)) == []

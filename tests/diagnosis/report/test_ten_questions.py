"""Ten questions of a first reader, answered by the first screen with the numbers of diagnosis.json.

Three campaigns of every kind, each with every verdict; and a page that belongs to another answer.
"""

import html
import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from markupsafe import Markup
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.results import VERDICTS
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.report import page as report
from carrierflex.diagnosis.report.diagnosis_files import diagnosis_document
from tests.diagnosis.carrier.carrier_twin import twin_campaign, twin_problem
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, mounting_campaign
from tests.diagnosis.report.verdict_pages import LOADS, page_of, with_verdict

pytestmark = pytest.mark.long

LAWS = (
    lambda q, v: 5e8 * q**3,
    lambda q, v: 30.0 * v * abs(v),
    lambda q, v: 0.8 * (v > 0) - 0.8 * (v < 0),
)
#: Rounding of three digits, and of a share of a whole per cent.
DIGITS, PERCENT = 6e-3, 0.6
PREFIXES = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "k": 1e3, "": 1.0}


def carriers():
    for effect in ("carrier_tilt", "flange_warp", "flexible_pins"):
        options = {"loads": LOADS, "turns": 8}
        yield twin_problem(effect, **options), twin_campaign(effect, **options)


def mountings():
    for law in ({"K3": 4e12}, {"K3": 8e12}, {"K5": 2e18}):
        campaign = mounting_campaign(law, conditions=CONDITIONS[:2])
        yield problem_of(campaign), campaign


def elements():
    for law in LAWS:
        campaign = displacement_campaign(law, n=1500)
        yield problem_of(campaign), campaign


KINDS = {"carrier": carriers, "element": elements, "mounting": mountings}


def first_screen(page):
    """Plain text of the first screen by the id of its element, and the rows of the causes."""
    screen = page[page.index('<section id="verdict"') : page.index('<div id="annex">')]
    screen = re.sub(r"<svg.*?</svg>", "", screen, flags=re.DOTALL)
    rows = re.findall(r'<tr class="([a-z-]+)">(.*?)</tr>', screen)
    causes = [
        (state, [plain(cell) for cell in re.findall(r"<td>(.*?)</td>", row, re.DOTALL)])
        for state, row in rows
    ]
    return plain(screen), causes, [plain(line) for line in re.findall(r"<li>(.*?)</li>", screen)]


def plain(text):
    text = re.sub(r"<sup>(.*?)</sup>", r"^\1", re.sub(r"</?code>", "", text))
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", text)).split())


def si(number, unit):
    """Size in the unit of the channels."""
    prefix = unit[:-1] if unit[-1:] in ("m", "N") else ""
    return float(number) * PREFIXES[prefix]


def is_close(shown, stated):
    return abs(shown - stated) <= DIGITS * abs(stated) + 1e-15


def answers(page, document):
    """Which of ten questions the page answers as diagnosis.json does."""
    text, causes, steps = first_screen(page)
    far = document["how_far"]
    named = [row for row in causes if row[0] in ("named", "one-of-several")]
    warned = [cells for state, cells in causes if state == "check-first"]
    rest = [cells for state, cells in causes if state == "unexplained"]
    is_answered = far["rms_before"] is not None
    is_tied = bool(document["aliases"] or document["class_ties"])
    warnings = zip(document["warnings"], warned, strict=False)
    first = document["headline"].split(". ")[0]
    where = document["where_text"].split(";")[0].split("^")[0]
    sizes = re.search(
        r"gap (?:is )?([\d.e+-]+) (\S+?)(?: to ([\d.e+-]+) (\S+))? RMS", " ".join(steps)
    )
    return {
        "where": not is_answered or where.lower() in text.lower(),
        "which": text.startswith(first),
        "how much": all(_values(cells, document) for _, cells in named),
        "how sure": all(_share(cells, document) for _, cells in named),
        "what next": bool(steps) and all(step.endswith(".") for step in steps),
        "what is wrong with the rig": ("has no findings" in text) == (not document["warnings"])
        and all(one["text"] in cells[2] for one, cells in warnings),
        "what cannot be told apart": all(
            (plain_name(name) in text) or name.startswith("wiring/")
            for group in document["aliases"]
            for name in group
        )
        and ("Cannot be distinguished" in text) == is_tied,
        "in which regime": all(_regime(cells, document) for _, cells in named),
        "how far it shrinks": not is_answered
        or (
            (sizes is not None and _sizes(sizes, far)) and all(_rest(cells, far) for cells in rest)
        ),
        "where the numbers come from": "Records: folder/twin." in text
        and (not is_answered or "held-out records" in text),
    }


def _sizes(groups, far):
    before, after = far["rms_before"], far["rms_after"]
    return is_close(si(groups[1], groups[2]), before) and (
        groups[3] is None or is_close(si(groups[3], groups[4]), after)
    )


def _rest(cells, far):
    share = re.match(r"([\d.]+|below 0.5) %", cells[1])
    stated = 100.0 * (1.0 - far["phi"])
    return not share or share[1] in ("below 0.5", "100") or abs(float(share[1]) - stated) < PERCENT


def _step(cells, document):
    names = {plain_name(s["added"].removeprefix("measured ")): s for s in document["ladder"]}
    return next((step for name, step in names.items() if cells[0].startswith(name)), None)


def _share(cells, document):
    """Share of a row is that of its step or its class, with the interval."""
    step = _step(cells, document)
    known = [c["share"] for c in document["classes"]] + ([step["share"]] if step else [])
    result = re.match(r"([\d.]+|below 0.5) %", cells[1])
    share = 0.0 if result[1] == "below 0.5" else float(result[1])
    return any(abs(share - 100.0 * min(max(one, 0.0), 1.0)) < PERCENT for one in known)


def _regime(cells, document):
    """Where a step acts: its largest run with the RMS there."""
    step = _step(cells, document)
    if step is None or not step["by_run"]:
        return True
    run = max(step["by_run"], key=lambda name: step["by_run"][name])
    result = re.match(r"([\d.e+-]+) (\S+) in (\S+)", cells[3])
    return result[3].rstrip(",;") == run and is_close(si(result[1], result[2]), step["by_run"][run])


def _values(cells, document):
    """Values over their intervals are those of the parameters, whatever the unit."""
    known = [
        abs(one["value"]) / (1.96 * one["std"])
        for values in (*document["parameters"].values(), *document["alternatives"].values())
        for one in values.values()
        if one["std"]
    ]
    shown = re.findall(r"\(?(-?[\d.]+) ± ([\d.]+)", cells[2])
    # Two digits of the interval.
    return all(
        any(abs(abs(float(value)) / float(half) - ratio) < 0.06 * ratio for ratio in known)
        for value, half in shown
    )


@pytest.fixture(autouse=True)
def without_figures(monkeypatch):
    """Figures say nothing of this, and take most of the time."""
    monkeypatch.setattr(report, "inline_svg", lambda *args: Markup("<svg></svg>"))


@pytest.fixture(scope="module", params=KINDS)
def diagnosed(request):
    kind = request.param
    return [
        (diagnose(problem, campaign=f"{kind} {k}", kind=kind), campaign)
        for k, (problem, campaign) in enumerate(KINDS[kind]())
    ]


def test_ten_questions_are_answered_by_the_first_screen_as_by_the_file(diagnosed):
    wrong = {}
    for diagnosis, campaign in diagnosed:
        for verdict in VERDICTS:
            shown = with_verdict(diagnosis, verdict)
            answered = answers(page_of(shown, campaign), diagnosis_document(shown))
            failed = [question for question, is_right in answered.items() if not is_right]
            if failed:
                wrong[diagnosis.campaign, verdict] = failed
    assert wrong == {}


def test_a_page_of_another_answer_fails_the_questions(diagnosed):
    """The page of the second campaign as an aliased answer beside the file of the first."""
    (one, _), (other, campaign), *_ = diagnosed
    two = with_verdict(other, "aliased")
    answered = answers(
        page_of(two, campaign), diagnosis_document(with_verdict(one, "at_noise_floor"))
    )
    failed = {question for question, is_right in answered.items() if not is_right}
    assert failed >= {
        "which", "what is wrong with the rig", "what cannot be told apart", "how far it shrinks"
    }  # fmt: skip
    far = replace(one.reduction, rms_after=1.1 * one.reduction.rms_after)
    answered = answers(page_of(replace(one, reduction=far), campaign), diagnosis_document(one))
    assert not answered["how far it shrinks"]


def test_shares_add_up_to_phi_runs_to_the_gap_and_sources_to_the_interval(diagnosed):
    for diagnosis, _ in diagnosed:
        far = diagnosis.reduction
        assert_allclose(sum(step.share for step in far.steps[1:]), far.phi, rtol=1e-9)
        samples = {}
        for block in far.blocks:
            samples[block.run] = samples.get(block.run, 0) + block.samples
        for before, step in itertools.pairwise(far.steps):
            square = sum(n * step.by_run[run] * abs(step.by_run[run]) for run, n in samples.items())
            taken = before.rms**2 - step.rms**2
            assert_allclose(square / sum(samples.values()), taken, rtol=1e-6)
        values = diagnosis.attribution.parameters.values()
        known = [
            one for of in values for one in of.values() if np.isfinite(one.std) and one.sources
        ]
        assert known
        for one in known:
            assert_allclose(
                sum(deviation**2 for deviation in one.sources.values()), one.std**2, rtol=1e-9
            )

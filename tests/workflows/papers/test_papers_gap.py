"""The command ``papers gap``: its file, its page and how it goes on, with numbers made up."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from carrierflex.workflows.outputs import schema_file
from carrierflex.workflows.papers import explain_gap, gap_laplace, gap_posterior, gap_results
from carrierflex.workflows.papers.gap_page import check_sentences, gap_sentences
from carrierflex.workflows.papers.gap_posterior import FACE, GROUND, KINK, NAMES, PUBLISHED
from carrierflex.workflows.simulation import stage_bodies


class MadeUp:
    """The tilt makes the amplitudes; a kink misses them by 60 um, the saddle makes table 4."""

    n_angles = 9

    @staticmethod
    def numbers(hypothesis, values):
        numbers = np.append(PUBLISHED, PUBLISHED[0]).copy()
        tilt = values.get("phi_face", values.get("phi_PLC", 0.0))
        numbers[:3] += 0.412 * (tilt - 5.8e-4) + 60e-6 * hypothesis.name.startswith("kink")
        numbers[3:7] += (values.get("by_load", 0.0) - 90e-6) * np.array([0.0, 0.0, 1.0, 0.1])
        return numbers


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder and result of the command."""
    folder = tmp_path_factory.mktemp("gap") / "gap"
    with pytest.MonkeyPatch.context() as patch:
        patched(patch)
        result = explain_gap.main(out=folder, starts=2, quiet=True)
        again = explain_gap.main(out=folder, starts=2, quiet=True)
    return folder, result, again


def patched(patch):
    """Replace the stage, and do with little work."""
    patch.setattr(stage_bodies, "default_stage_body", lambda *_: None)
    patch.setattr(gap_posterior, "comparison", lambda _: MadeUp())
    patch.setattr(gap_results, "largest_deviation", lambda *_: 1e-7)
    patch.setattr(gap_results, "predictions", made_up_predictions)
    patch.setattr(explain_gap, "find_spec", lambda _: None)
    for name, size in {"_LOOKED_AT": 10, "_RESTARTS": 1, "_WALK": 2}.items():
        patch.setattr(gap_laplace, name, size)


def made_up_predictions(_compare, hypothesis, points):
    """Only the third measurement differs between face and ground."""
    values = np.zeros((len(points), len(gap_results.MEASUREMENTS)))
    values[:, 2] = {FACE: 240e-6, GROUND: 10e-6, KINK: 246e-6}[hypothesis.name]
    return values


@pytest.mark.long
def test_the_file_fulfils_its_schema_and_the_page_says_the_same(made):
    folder, result, _ = made
    document = json.loads((folder / "papers_gap.json").read_text(encoding="utf-8"))
    schema = json.loads(schema_file("papers gap").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(document)
    page = (folder / "papers_gap.html").read_text(encoding="utf-8")
    for sentence in (*gap_sentences(result), *check_sentences(result)):
        assert sentence.replace("'", "&#39;") in page
    assert (folder / "papers_gap.png").stat().st_size > 10_000
    assert document["inputs"] == {
        "method": "laplace",
        "starts": 2,
        "size": 0.045,
        "seed": 2012,
    }
    assert len(list((folder / "runs").iterdir())) == 42


@pytest.mark.long
def test_the_answer_is_that_of_the_numbers(made):
    _, result, _ = made
    order = {(row.first, row.second): row.better for row in result.order}
    # The same tilt in both, as likely: nothing distinguishes them.
    assert order[FACE, GROUND] is None
    assert order[FACE, "tilted face, saddle of the housing"] == FACE
    first = result.predictions[0]
    assert first.measurement.startswith("order 1 of an axial sensor on the housing")
    # One of three is apart, two differ by one standard error.
    assert 0.9 < first.bits < np.log2(3.0)
    assert result.causes[0].table_5_rms == pytest.approx(0.412 * 5.8e-4, rel=1e-6)
    assert result.causes[-1].table_5_rms < 10e-6
    assert result.causes[-1].table_4_rms < 0.2 * result.causes[0].table_4_rms
    sentences = " ".join(gap_sentences(result))
    assert f"Not decided between {FACE} and: tilted face, sun floating; {GROUND}" in sentences
    assert "Next measurement: order 1 of an axial sensor on the housing" in sentences
    assert result.names[: len(NAMES)] == NAMES
    assert "is not checked by nested sampling" in " ".join(check_sentences(result))


@pytest.mark.long
def test_files_of_a_stopped_command_are_read_again(made):
    _, result, again = made
    assert [vars(row) for row in again.order] == [vars(row) for row in result.order]


@pytest.mark.long
def test_nested_sampling_checks_the_evidence(made):
    _, result, _ = made
    checked = replace(result, nested_evidence={FACE: 12.3})
    assert f"{FACE} {result.laplace_evidence[FACE]:.1f} and 12.3" in check_sentences(checked)[1]


def test_the_method_nested_needs_dynesty(monkeypatch, tmp_path):
    monkeypatch.setattr(explain_gap, "find_spec", lambda _: None)
    with pytest.raises(ImportError, match=r"--method nested needs dynesty .*carrierflex\[papers\]"):
        explain_gap.main(out=tmp_path / "gap", method="nested", quiet=True)
    assert not (tmp_path / "gap").exists()

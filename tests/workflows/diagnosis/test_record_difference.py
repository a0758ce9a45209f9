"""Two diagnoses of different records: what differs beyond its interval, and what would decide."""

import json
from statistics import NormalDist

import numpy as np
import pytest

from carrierflex.diagnosis.report.diagnosis_files import FORMAT, VERSION
from carrierflex.workflows.diagnosis import compare_diagnoses
from carrierflex.workflows.diagnosis.gap_change import digest_of_records
from tests.workflows.checked_documents import checked_document

FLOOR = 5e-6


def write_diagnosis(folder, measured, **keys):
    """Write what a comparison reads of a diagnosis."""
    far = {"noise_floor": FLOOR, "rho": 0.3, "rho_ci95": [0.28, 0.32]}
    document = {
        "format": FORMAT, "version": VERSION, "campaign": folder.name, "kind": "carrier",
        "unit": "m", "verdict": "named", "headline": "", "reason_id": "", "effects": [],
        "classes": [], "parameters": {}, "warnings": [], "separating_test": "", "gains": None,
        "how_far": far,
        "records": {"measured": measured * 64}, "held_out": blocks(4e-6),
    }  # fmt: skip
    folder.mkdir()
    text = json.dumps({**document, **keys})
    (folder / "diagnosis.json").write_text(text, encoding="utf-8")
    return folder


def blocks(gap):
    """Held-out blocks whose mean square is that of the noise and of a gap, 2 % of scatter."""
    rng = np.random.default_rng(1)
    return [
        {
            "run": "a", "condition": "one", "block": number, "samples": 400,
            "mean_square": (FLOOR**2 + gap**2) * (1.0 + 0.02 * rng.standard_normal()),
        }
        for number in range(40)
    ]  # fmt: skip


def tilted(size, std):
    """Keys of a diagnosis that names a tilt of the carrier."""
    value = {"value": size, "std": std, "unit": "rad", "ci95": [size - 2 * std, size + 2 * std]}
    direction = {"value": 1.0, "std": 0.01, "unit": "rad", "ci95": [0.98, 1.02]}
    finding = {"id": "carrier/tilt/none", "law": "carrier_tilt", "share": 0.9}
    return {
        "effects": ["carrier_tilt"],
        "parameters": {"carrier_tilt": {"phi_PLC": value, "theta_PLC": direction}},
        "classes": [{**finding, "share_ci95": [0.85, 0.95]}],
    }


def difference_of(result, parameter):
    return next(one for one in result.sizes if one.parameter == parameter)


def test_sizes_apart_beyond_their_intervals_differ_and_others_need_longer_records(tmp_path):
    first = write_diagnosis(tmp_path / "T1", "a", **tilted(5e-5, 3e-6))
    near = write_diagnosis(tmp_path / "T2", "b", **tilted(5.6e-5, 4e-6), gains="gains of 1 %")
    far = write_diagnosis(tmp_path / "T3", "c", **tilted(8e-5, 4e-6))
    apart = difference_of(compare_diagnoses.main(first, far), "phi_PLC")
    assert apart.differs
    # 3e-5 less 1.95996 times the root of 3^2 + 4^2.
    in_95, in_90 = (NormalDist().inv_cdf(share) for share in (0.975, 0.9))
    ends = (3e-5 - in_95 * 5e-6, 3e-5 + in_95 * 5e-6)
    np.testing.assert_allclose(apart.difference_ci95, ends, rtol=1e-9)
    result = compare_diagnoses.main(first, near, out=tmp_path / "out")
    equal = difference_of(result, "phi_PLC")
    assert not equal.differs
    # 6 of 5 standard deviations.
    np.testing.assert_allclose(equal.longer, ((in_95 + in_90) * 5.0 / 6.0) ** 2)
    assert any("7.3 times as long" in sentence for sentence in result.deciding)
    assert any("gains of 1 %" in sentence for sentence in result.deciding)
    # A direction is no size.
    assert {one.parameter for one in result.sizes} == {"phi_PLC", "rms"}
    document = checked_document(tmp_path / "out" / "comparison.json")
    assert document["text"] == "No cause differs beyond its interval."
    assert document["format"] == "carrierflex-difference"
    page = (tmp_path / "out" / "comparison.html").read_text(encoding="utf-8")
    assert "7.3 times as long" in page


@pytest.mark.parametrize(("gap", "differs"), [(1e-6, True), (4e-6, False)])
def test_a_cause_named_at_one_differs_where_it_leaves_more_than_all_of_the_other(
    tmp_path, gap, differs
):
    first = write_diagnosis(tmp_path / "T1", "a", **tilted(5e-5, 3e-6))
    second = write_diagnosis(
        tmp_path / "T2", "b", verdict="at_noise_floor", held_out=blocks(gap), separating_test="turn"
    )
    result = compare_diagnoses.main(first, second)
    cause = next(one for one in result.sizes if one.cause == "carrier_tilt")
    assert (cause.differs, cause.second) == (differs, None)
    # Nine tenths of the mean square of the gap.
    np.testing.assert_allclose(cause.first.value, np.sqrt(0.9) * 4e-6, rtol=0.02)
    assert result.deciding[0] == "At the second, whose cause is not certain: turn."


def test_what_is_of_another_kind_or_damaged_is_refused(tmp_path):
    first = write_diagnosis(tmp_path / "T1", "a")
    other = write_diagnosis(tmp_path / "T2", "b", kind="mounting")
    with pytest.raises(ValueError, match="their kind is carrier and mounting"):
        compare_diagnoses.main(first, other)
    damaged = write_diagnosis(tmp_path / "T3", "c", how_far=None)
    with pytest.raises(ValueError, match=r"T3.diagnosis\.json: a key is missing or of another"):
        compare_diagnoses.main(first, damaged)
    assert digest_of_records(first) == "a" * 64

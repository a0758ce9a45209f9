"""The table of what moved constants change, from cases that stand."""

import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.sensitivity.listed_constants import listed_constants
from carrierflex.blind_check.sensitivity.moved_constants import values_of
from carrierflex.files.json_files import save_json
from carrierflex.workflows.diagnosis.studies.vary_constants import main

NAMED_LEFT = "diagnosis.classes.constants.named_left"
ROLL_OFF = "identification.campaign.signals._ROLL_OFF"
USUAL = "named: memory"


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Table of 60 cases: one number changes two, and another one once to other classes."""
    folder = tmp_path_factory.mktemp("constants")
    plans = case_plans("element", 60, 5)
    values = values_of(listed_constants())
    changes = {
        0: {f"{NAMED_LEFT} x0.8": "leading: memory"},
        1: {f"{NAMED_LEFT} x0.8": "leading: memory", f"{ROLL_OFF} x1.2": "named: delay"},
    }
    for number, plan in enumerate(plans):
        content = {
            "answer": USUAL,
            "moved": values,
            "changed": changes.get(number, {}),
            "repeated": [USUAL, "named: delay" if number < 6 else USUAL],
        }
        save_json(folder / f"5-{plan.name}.json", content)
    main(out=folder, seed=5, cases=60, standing=True, quiet=True)
    return (folder / "constants.md").read_text(encoding="utf-8").splitlines()


def test_the_table_counts_answers_and_those_that_go_to_other_classes(table):
    rows = {line.split("|")[1].strip(): line.split("|")[3:5] for line in table if "| `" in line}
    assert [cell.strip() for cell in rows["`constants.named_left`"]] == ["2 (0)", "0 (0)"]
    assert [cell.strip() for cell in rows["`signals._ROLL_OFF`"]] == ["0 (0)", "1 (1)"]
    assert len(rows) == 2


def test_what_changes_too_much_is_told_beside_what_other_noise_changes(table):
    assert "1 change more than 2%: `constants.named_left` (2)." in table
    assert table[-1].endswith("changes 6 (6) of 120: 5.0%.")


def test_a_file_that_is_no_case_is_told(tmp_path):
    plan = case_plans("element", 60, 5)[0]
    save_json(tmp_path / f"5-{plan.name}.json", {"answer": USUAL})
    with pytest.raises(ValueError, match="not answers of a case; remove it to make it again"):
        main(out=tmp_path, seed=5, cases=60, standing=True, quiet=True)

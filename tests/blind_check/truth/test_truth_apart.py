"""The truth shares nothing with what fits, and says nothing but in its label."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans, full_size
from carrierflex.blind_check.labels import (
    FAMILIES,
    KINDS,
    NOTHING,
    OUTSIDE,
    SINGLE,
    CasePlan,
    Label,
)
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.identification.campaign.campaign_files import read_campaign

ROOT = Path(__file__).parents[3]
#: What a truth may know of identification: the types and files of a campaign.
CAMPAIGN_TYPES = {
    "carrierflex.identification.campaign.campaign",
    "carrierflex.identification.campaign.declarations",
    "carrierflex.identification.campaign.records",
    "carrierflex.identification.campaign.campaign_files",
}
ELEMENT = CasePlan("element", 1, 5, SINGLE, ("cubic_spring",), 10.0, "multisine")
CARRIER = CasePlan("carrier", 1, 5, SINGLE, ("carrier_tilt",), 10.0)


def imports_of(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def modules_of_the_truth():
    """Every module that `truth` imports, one after the other, within the blind check."""
    modules, waiting = {}, ["carrierflex.blind_check.truth.campaigns"]
    while waiting:
        name = waiting.pop()
        path = ROOT / (name.removeprefix("carrierflex.").replace(".", "/") + ".py")
        if name not in modules and path.is_file():
            modules[name] = set(imports_of(path))
            waiting.extend(
                module for module in modules[name] if module.startswith("carrierflex.blind_check.")
            )
    return modules


def test_truth_imports_nothing_that_fits():
    modules = modules_of_the_truth()
    assert {f"carrierflex.blind_check.truth.{kind}.truth" for kind in KINDS} < set(modules)
    for module, names in modules.items():
        for name in names:
            if name.startswith("carrierflex.") and not name.startswith("carrierflex.blind_check"):
                assert any(
                    name == allowed or name.startswith(allowed + ".") for allowed in CAMPAIGN_TYPES
                ), f"{module} imports {name}"
        assert not names & {"importlib.import_module", "runpy"}, module


@pytest.mark.long
def test_no_package_that_fits_imports_the_truth():
    for package in ("simulation", "identification", "diagnosis"):
        for path in (ROOT / package).rglob("*.py"):
            assert not any(
                name.startswith(("carrierflex.blind_check", "carrierflex.workflows"))
                for name in imports_of(path)
            ), path


@pytest.mark.long
@pytest.mark.parametrize("plan", [ELEMENT, CARRIER], ids=lambda plan: plan.kind)
def test_a_case_follows_from_its_plan_alone(plan, tmp_path):
    first = write_case(plan, tmp_path / "first")
    write_case(replace(plan, number=2), tmp_path / "between")
    assert write_case(plan, tmp_path / "second").text() == first.text()
    written, two, other = (
        read_campaign(tmp_path / name) for name in ("first", "second", "between")
    )
    for run, again, different in zip(written.runs, two.runs, other.runs, strict=True):
        for name, signal in run.signals.items():
            np.testing.assert_array_equal(signal, again.signals[name])
            assert not np.array_equal(signal, different.signals[name])


def test_repeats_of_a_case_differ_by_their_noise_alone(tmp_path):
    label, again = (write_case(CARRIER, tmp_path / str(k), repeat=k) for k in (0, 1))
    assert again.parameters == label.parameters
    assert again.gap_over_floor == label.gap_over_floor
    first, second = (read_campaign(tmp_path / str(k)) for k in (0, 1))
    for run, other in zip(first.runs, second.runs, strict=True):
        np.testing.assert_array_equal(run.inputs["torque"], other.inputs["torque"])
        change = np.array([run.signals[name] - other.signals[name] for name in run.signals])
        # Two noises of the declared size; 3840 correlated samples scatter by 3 %.
        np.testing.assert_allclose(change.std(), np.sqrt(2.0) * label.floor, rtol=0.1)


@pytest.mark.long
def test_folder_holds_records_and_no_word_of_the_truth(tmp_path):
    label = write_case(ELEMENT, tmp_path / "case")
    names = sorted(path.name for path in (tmp_path / "case").iterdir())
    assert names == ["campaign.toml", *(f"run{k}.parquet" for k in (1, 2, 3, 4))]
    text = (tmp_path / "case" / "campaign.toml").read_text(encoding="utf-8")
    assert "effects" not in text.replace("effects = []", "")
    assert not any(word in text for word in (*label.effects, *label.classes, *FAMILIES))


def test_label_text_is_read_back_and_of_one_form(tmp_path):
    label = write_case(CARRIER, tmp_path / "case")
    again = Label.from_text(label.text())
    assert again.text() == label.text()
    assert again.effects == ("carrier_tilt",)
    assert again.acceptable == (("carrier_tilt",),)
    assert (again.classes, again.class_aliases, again.changes) == ((), (), ())
    assert again.gap_over_floor == pytest.approx(10.0, rel=1e-3)
    assert label.text() != replace(label, rho=label.rho * 1.001).text()


def test_unknown_kind_is_refused(tmp_path):
    with pytest.raises(
        ValueError, match="kind is 'gearbox'; expected one of carrier, element, mounting"
    ):
        write_case(replace(ELEMENT, kind="gearbox"), tmp_path / "case")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "element"])
def test_plan_of_a_full_check_holds_every_family_and_every_size(kind):
    plans = case_plans(kind, full_size(kind), 3)
    assert len(plans) >= (60 if kind == "mounting" else 200)
    assert [plan.number for plan in plans] == list(range(1, len(plans) + 1))
    ratios = np.array([plan.ratio for plan in plans if plan.family not in (NOTHING,)])
    assert ratios.min() >= 0.5
    assert ratios.max() <= 30.0
    assert np.median(ratios) == pytest.approx(np.sqrt(15.0), rel=0.2)
    assert all(plan.effects == () for plan in plans if plan.family == NOTHING)
    assert sum(plan.family == OUTSIDE for plan in plans) >= 5
    assert plans == case_plans(kind, full_size(kind), 3) != case_plans(kind, full_size(kind), 4)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("gearbox", 5, 1), "kind is 'gearbox'; expected one of"),
        (("element", 0, 1), "--cases is 0; expected 1 or more"),
        (("element", 5, -1), "--seed is -1; expected 0 or more"),
    ],
)
def test_impossible_plans_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        case_plans(*arguments)

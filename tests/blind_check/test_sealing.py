"""A sealed label cannot be changed, and nothing that diagnoses can read one."""

import hashlib
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from carrierflex.blind_check.labels import SINGLE, CasePlan, Label
from carrierflex.blind_check.sealing.check import (
    SealedCheck,
    Seals,
    diagnosed,
    new_salt,
    read_seals,
    seal,
    verify,
    write_seals,
)
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.workflows.executors import SerialExecutor

ROOT = Path(__file__).parents[2]
LABEL = Label(
    "element-0001",
    "element",
    SINGLE,
    ("backlash",),
    (("backlash",),),
    (),
    8.0,
    1e-5,
    0.1,
    {"backlash": {"gap": 1e-4}},
    {},
)


@pytest.fixture
def sealed():
    labels = {LABEL.case: LABEL, "element-0002": replace(LABEL, case="element-0002")}
    salts = {case: new_salt() for case in labels}
    return (
        labels,
        salts,
        Seals({"seed": 1}, {case: seal(label, salts[case]) for case, label in labels.items()}),
    )


def test_labels_open_their_own_seals(sealed):
    labels, salts, published = sealed
    verify(labels, salts, published)
    # A third party needs the text of the label, its salt and SHA-256, and nothing of this project.
    for case, label in labels.items():
        text = (label.text() + salts[case]).encode()
        assert published.seals[case] == hashlib.sha256(text).hexdigest()
    # Labels that were dealt to each other's cases open nothing.
    first, second = labels
    with pytest.raises(ValueError, match="2 labels are not the sealed ones"):
        verify({first: labels[second], second: labels[first]}, salts, published)


@pytest.mark.parametrize(
    "change", [{"effects": ("sensor_delay",)}, {"rho": 0.11}, {"present": ("sensor_delay",)}]
)
def test_a_label_changed_after_sealing_is_refused(sealed, change):
    labels, salts, published = sealed
    with pytest.raises(
        ValueError, match=r"1 labels are not the sealed ones \(first: element-0001\)"
    ):
        verify({**labels, LABEL.case: replace(LABEL, **change)}, salts, published)


def test_another_salt_is_refused(sealed):
    labels, salts, published = sealed
    with pytest.raises(ValueError, match="not the sealed ones"):
        verify(labels, {**salts, LABEL.case: new_salt()}, published)


def test_a_label_without_a_seal_is_refused(sealed):
    labels, salts, published = sealed
    with pytest.raises(ValueError, match=r"other cases \(element-0003\)"):
        verify({**labels, "element-0003": LABEL}, {**salts, "element-0003": new_salt()}, published)


def test_equal_labels_have_unequal_seals():
    assert seal(LABEL, new_salt()) != seal(LABEL, new_salt())


def test_seals_are_read_back_and_a_changed_file_is_refused(sealed, tmp_path):
    path = tmp_path / "seals.json"
    write_seals(path, sealed[2])
    assert read_seals(path) == sealed[2]
    content = json.loads(path.read_text(encoding="utf-8"))
    content["seals"][LABEL.case] = "0" * 64
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ValueError, match="do not give its digest"):
        read_seals(path)
    path.write_text("[]", encoding="utf-8")
    with pytest.raises(ValueError, match="not a list of seals"):
        read_seals(path)


#: Runs a diagnosis as a worker does and prints every file it opens and every module of the project
#: it has loaded.
_AUDITED = """
import os, sys
from pathlib import Path
from carrierflex.workflows.diagnosis.diagnose_case import diagnose_case
opened = set()
def watch(event, arguments):
    if event == "open" and isinstance(arguments[0], (str, bytes)):
        opened.add(os.path.abspath(os.fsdecode(arguments[0])))
    if event in ("os.listdir", "os.scandir") and isinstance(arguments[0], (str, bytes)):
        opened.add(os.path.abspath(os.fsdecode(arguments[0])))
sys.addaudithook(watch)
diagnose_case(Path(sys.argv[1]), Path(sys.argv[2]))
print("\\n".join(sorted(opened)))
print("MODULES", *(name for name in sys.modules if name.startswith("carrierflex.blind_check")))
"""


@pytest.mark.long
def test_diagnosis_reads_its_campaign_and_nothing_else_of_the_check(tmp_path):
    plan = CasePlan("carrier", 1, 5, SINGLE, ("sensor_gain",), 10.0)
    campaign, out = (
        tmp_path / "check" / "campaigns" / plan.name,
        tmp_path / "check" / "diagnoses" / plan.name,
    )
    campaign.parent.mkdir(parents=True)
    write_case(plan, campaign)
    assert not list(tmp_path.rglob("*label*"))
    result = subprocess.run(
        [sys.executable, "-c", _AUDITED, str(campaign), str(out)],
        cwd=tmp_path.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    *paths, modules = result.stdout.splitlines()
    inside = [Path(path) for path in paths if path.startswith(str(tmp_path))]
    assert campaign / "campaign.toml" in inside
    assert all(path.is_relative_to(campaign) or path.is_relative_to(out) for path in inside)
    truth = ROOT / "blind_check" / "truth"
    assert truth.is_dir()
    assert not [path for path in paths if Path(path).resolve().is_relative_to(truth)]
    assert set(modules.split()[1:]) == {
        "carrierflex.blind_check",
        "carrierflex.blind_check.references",
        "carrierflex.blind_check.references.linear_laws",
        "carrierflex.blind_check.sealing",
        "carrierflex.blind_check.sealing.verdicts",
    }


def test_campaigns_of_the_check_go_and_other_folders_stay(tmp_path):
    plans = [
        CasePlan("element", number, 5, SINGLE, ("cubic_stiffness",), 10.0) for number in (1, 2)
    ]
    sealed = SealedCheck(tmp_path, {plan.name: LABEL for plan in plans}, {}, Seals({}, {}))
    mine = tmp_path / "campaigns" / "my_measurement" / "campaign.toml"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    for plan in plans:
        sealed.campaign(plan.name).mkdir()

    def diagnose(campaign, out):
        out.mkdir(parents=True)
        (out / "times.json").write_text('{"seconds": 1.0, "error": "none"}')

    with SerialExecutor() as executor:
        diagnosed(sealed, diagnose, executor, keep=False, note=lambda text, share: None)
    assert [path.name for path in (tmp_path / "campaigns").iterdir()] == ["my_measurement"]
    assert mine.read_text() == "mine"

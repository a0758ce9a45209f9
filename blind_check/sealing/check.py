"""The order of a blind check: write and seal every case, publish, diagnose case by case, open.

Labels live in the memory of the calling process until every verdict is written; what diagnoses is
handed two folders. The salts lie on disk meanwhile so that an interrupted check can go on: they are
random and tell nothing of a label.
"""

import hashlib
import json
import secrets
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from carrierflex.blind_check.labels import CasePlan, Label
from carrierflex.blind_check.sealing.verdicts import Verdict, is_finished, read_verdict
from carrierflex.files.json_files import read_json, save_json, save_text
from carrierflex.files.shown_values import shortened, shown
from carrierflex.files.whole_folders import whole_folder

SEALS_FILE = "seals.json"
SALTS_FILE = "salts.json"
LABELS_FILE = "labels.json"

Plan = TypeVar("Plan", bound=CasePlan)
DiagnoseCase = Callable[[Path, Path], None]
Note = Callable[[str, float], None]


_FORMAT = "carrierflex-seals"
_VERSION = 1
_SALT_BYTES = 32


@dataclass(frozen=True)
class Seals:
    """What is published of a check before its first diagnosis.

    Parameters
    ----------
    check : mapping of str to object
        What was asked for: seed and number of cases by kind.
    seals : mapping of str to str
        Seal by case.
    """

    check: Mapping[str, Any]
    seals: Mapping[str, str]

    @property
    def digest(self) -> str:
        """SHA-256 of the list: one line to note down that fixes every label."""
        lines = "".join(f"{case} {self.seals[case]}\n" for case in sorted(self.seals))
        return hashlib.sha256(lines.encode()).hexdigest()


@dataclass(frozen=True)
class SealedCheck:
    """Labels and salts in memory, and what is published of them."""

    out: Path
    labels: Mapping[str, Label]
    salts: Mapping[str, str]
    published: Seals

    def campaign(self, case: str) -> Path:
        """Folder of a case's campaign."""
        return self.out / "campaigns" / case

    def diagnosis(self, case: str) -> Path:
        """Folder of a case's diagnosis."""
        return self.out / "diagnoses" / case


def sealed_check(
    plans: Sequence[Plan],
    out: Path,
    write: Callable[[Plan, Path], Label],
    executor: Executor,
    *,
    check: Mapping[str, Any],
    note: Note,
) -> SealedCheck:
    """Write every campaign, seal every label and publish the seals.

    Or go on with a check that was interrupted.

    Parameters
    ----------
    plans : sequence of CasePlan
        Planned cases.
    out : Path
        Folder of the check; exists.
    write : callable
        Writes the campaign of a plan into a folder and returns its label.
    executor : concurrent.futures.Executor
        Where campaigns are written; not the one that diagnoses.
    check : mapping of str to object
        Seed and number of cases by kind: published with the seals.
    note : callable
        Is told the progress, in words and as a share.

    Returns
    -------
    SealedCheck
        Labels in memory; seals.json and salts.json are written.

    Raises
    ------
    ValueError
        Where the folder holds the seals of another check, or its labels come out otherwise now.
    """
    earlier = read_seals(out / SEALS_FILE) if (out / SEALS_FILE).exists() else None
    if earlier is not None and earlier.check != check:
        raise ValueError(
            f"{out}: holds a check of {dict(earlier.check)}, asked for {dict(check)}; expected "
            "another --out"
        )
    _refuse_opened(out, plans)
    futures = {
        executor.submit(write, plan, out / "campaigns" / plan.name): plan.name for plan in plans
    }
    written = {}
    for future in as_completed(futures):
        written[futures[future]] = future.result()
        note(f"{len(written)} of {len(plans)}", len(written) / len(plans))
    labels = {plan.name: written[plan.name] for plan in plans}
    if earlier is not None:
        salts = _read_salts(out / SALTS_FILE)
        verify(labels, salts, earlier)
        return SealedCheck(out, labels, salts, earlier)
    salts = {case: new_salt() for case in labels}
    published = Seals(
        dict(check), {case: seal(label, salts[case]) for case, label in labels.items()}
    )
    save_json(out / SALTS_FILE, salts)
    write_seals(out / SEALS_FILE, published)
    return SealedCheck(out, labels, salts, published)


def diagnosed(
    sealed: SealedCheck, diagnose: DiagnoseCase, executor: Executor, *, keep: bool, note: Note
) -> dict[str, Verdict]:
    """Diagnose every case that has no finished diagnosis yet.

    Parameters
    ----------
    sealed : SealedCheck
        Check whose seals are published.
    diagnose : callable
        Diagnosis of one case, given the campaign's folder and the folder to write to.
    executor : concurrent.futures.Executor
        Where cases are diagnosed.
    keep : bool
        Keep campaigns; otherwise they go once a case is diagnosed.
    note : callable
        Is told the progress, in words and as a share.

    Returns
    -------
    dict
        Verdict by case.
    """
    waiting = [case for case in sealed.labels if not is_finished(sealed.diagnosis(case))]
    futures = {
        executor.submit(diagnose, sealed.campaign(case), sealed.diagnosis(case)): case
        for case in waiting
    }  # fmt: skip
    for done, future in enumerate(as_completed(futures), 1):
        future.result()
        if not keep:
            shutil.rmtree(sealed.campaign(futures[future]))
        note(f"{done} of {len(waiting)}", done / len(waiting))
    if not keep:
        _remove_campaigns(sealed)
    return {case: read_verdict(sealed.diagnosis(case)) for case in sealed.labels}


def opened(sealed: SealedCheck) -> Mapping[str, Label]:
    """Open the labels: verify them against the seals as published, and write them down.

    Raises
    ------
    ValueError
        Where a verdict is missing, the published seals have changed, or a label is not the sealed
        one.
    """
    missing = [case for case in sealed.labels if not is_finished(sealed.diagnosis(case))]
    if missing:
        raise ValueError(
            f"{len(missing)} cases have no verdict (first: {missing[0]}); expected all before the "
            "opening"
        )
    published = read_seals(sealed.out / SEALS_FILE)
    if published.digest != sealed.published.digest:
        raise ValueError(
            f"{sealed.out / SEALS_FILE}: changed during the check; expected "
            f"{sealed.published.digest}"
        )
    verify(sealed.labels, sealed.salts, published)
    rows = {
        case: {"label": json.loads(label.text()), "salt": sealed.salts[case]}
        for case, label in sealed.labels.items()
    }
    save_json(sealed.out / LABELS_FILE, rows)
    return sealed.labels


def exported(sealed: SealedCheck, folder: Path, readme: str) -> None:
    """Move the campaigns of a check into a folder that tells nothing of the truth.

    It holds the campaigns, the seals without the request (who knows the seed can make every label)
    and a page; seals and salts stay in the folder of the check.

    Parameters
    ----------
    sealed : SealedCheck
        Check whose seals are published.
    folder : Path
        Folder to write, whole or not at all.
    readme : str
        Text of its README.md.
    """
    with whole_folder(folder) as new:
        for case in sealed.labels:
            shutil.copytree(sealed.campaign(case), new / "campaigns" / case)
        write_seals(new / SEALS_FILE, Seals({}, sealed.published.seals))
        save_text(new / "README.md", readme)
    _remove_campaigns(sealed)


def remade(
    out: Path,
    plans: Callable[[Mapping[str, Any]], Sequence[CasePlan]],
    label: Callable[[CasePlan], Label],
) -> tuple[dict[str, Label], Seals]:
    """Labels of an exported check, made again from its seed and verified against its seals.

    Parameters
    ----------
    out : Path
        Folder of the check.
    plans : callable
        Plans of what was asked for.
    label : callable
        Label of a plan.

    Returns
    -------
    tuple of (dict, Seals)
        Label by case, and what was published.

    Raises
    ------
    ValueError
        Where the folder holds no check, or the labels come out otherwise now.
    """
    if not (out / SEALS_FILE).exists():
        raise ValueError(f"{out}: holds no {SEALS_FILE}; expected the folder of an exported check")
    published = read_seals(out / SEALS_FILE)
    salts = _read_salts(out / SALTS_FILE)
    labels = {plan.name: label(plan) for plan in plans(published.check)}
    verify(labels, salts, published)
    return labels, published


def _remove_campaigns(sealed: SealedCheck) -> None:
    """Remove the campaigns of the check, and their folder where nothing else is in it."""
    for case in sealed.labels:
        shutil.rmtree(sealed.campaign(case), ignore_errors=True)
    with suppress(OSError):
        (sealed.out / "campaigns").rmdir()


def _refuse_opened(out: Path, plans: Sequence[CasePlan]) -> None:
    """One opening counts: a case must not be diagnosed once its label has been on disk."""
    if (out / LABELS_FILE).exists():
        missing = [plan.name for plan in plans if not is_finished(out / "diagnoses" / plan.name)]
        if missing:
            raise ValueError(
                f"{out}: its labels are opened and {missing[0]} has no verdict; expected a new "
                "--out and a new --seed"
            )


def _read_salts(path: Path) -> dict[str, str]:
    try:
        salts = read_json(path, "the salts of the published seals")
        return {str(case): str(salt) for case, salt in salts.items()}
    except (ValueError, AttributeError) as error:
        raise ValueError(
            f"{path}: no salts of the published seals: {error}; expected a new --out"
        ) from error


def new_salt() -> str:
    """Random salt; from the operating system, so that no seed gives it again."""
    return secrets.token_hex(_SALT_BYTES)


def seal(label: Label, salt: str) -> str:
    """Seal of a label: SHA-256 of its text and a salt.

    >>> from carrierflex.blind_check.labels import Label
    >>> label = Label("element-0001", "element", "nothing", (), (), (), 0.0, 1.0, 1.0, {}, {})
    >>> len(seal(label, "00")), seal(label, "00") == seal(label, "01")
    (64, False)
    """
    return hashlib.sha256((label.text() + salt).encode()).hexdigest()


def verify(labels: Mapping[str, Label], salts: Mapping[str, str], published: Seals) -> None:
    """Make sure that labels are those that were sealed.

    Raises
    ------
    ValueError
        Where a label has no seal, a seal no label, or a label is another than the sealed one.
    """
    if set(labels) != set(published.seals) or set(salts) != set(published.seals):
        odd = sorted((set(labels) | set(salts)) ^ set(published.seals)) or sorted(
            set(labels) ^ set(salts)
        )
        raise ValueError(
            f"labels and seals are of other cases ({', '.join(odd[:3])}); expected one seal for "
            "each label"
        )
    broken = [
        case for case, label in labels.items() if seal(label, salts[case]) != published.seals[case]
    ]
    if broken:
        raise ValueError(
            f"{len(broken)} labels are not the sealed ones (first: {broken[0]}); expected the "
            "labels of the published seals; "
            "a check of another version needs a new --out and a new --seed"
        )


def write_seals(path: Path, published: Seals) -> None:
    """Publish the seals."""
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        "check": published.check,
        "digest": published.digest,
    }
    save_json(path, content | {"seals": published.seals})


def read_seals(path: Path) -> Seals:
    """Read published seals.

    Raises
    ------
    ValueError
        Where the file is no list of seals, of another version, or changed since it was written.
    """
    expected = "a list of seals"
    content = read_json(path, expected)
    try:
        known = content["format"] == _FORMAT and content["version"] == _VERSION
        check, seals = content["check"], content["seals"]
    except (KeyError, TypeError) as error:
        raise ValueError(f"{path}: not a list of seals: {shortened(str(error))}") from error
    if not known:
        raise ValueError(
            f"{path}: found another format or version; expected '{_FORMAT}' {_VERSION}"
        )
    if not isinstance(check, dict) or not _is_seals(seals):
        raise ValueError(
            f"{path}: keys 'check' and 'seals' are {shown(check)} and {shown(seals)}; expected "
            "what was asked for, and a seal for each case"
        )
    published = Seals(check, seals)
    if published.digest != content.get("digest"):
        raise ValueError(
            f"{path}: its seals do not give its digest; expected a file that nobody has changed"
        )
    return published


def _is_seals(value: object) -> bool:
    return isinstance(value, dict) and all(isinstance(seal, str) for seal in value.values())

"""Seals of labels: published before the first diagnosis, verified when the labels are opened.

The seal of a label is ``SHA-256(text of the label + salt)`` with a random salt of 32 bytes in
hexadecimal digits: nobody can guess a label from its seal, and nobody can change the label
afterwards.
"""

import hashlib
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carrierflex.blind_check.labels import Label
from carrierflex.files.json_files import read_json, save_json
from carrierflex.files.shown_values import shortened, shown

FORMAT = "carrierflex-seals"
VERSION = 1
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
        "format": FORMAT,
        "version": VERSION,
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
        known = content["format"] == FORMAT and content["version"] == VERSION
        check, seals = content["check"], content["seals"]
    except (KeyError, TypeError) as error:
        raise ValueError(f"{path}: not a list of seals: {shortened(str(error))}") from error
    if not known:
        raise ValueError(f"{path}: found another format or version; expected '{FORMAT}' {VERSION}")
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

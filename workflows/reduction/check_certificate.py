"""Whether a body file can be trusted.

Shows the certificate it was written with and repeats what needs no finite elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

from carrierflex.files.json_files import plain, save_json
from carrierflex.files.whole_files import refuse_foreign
from carrierflex.workflows.outputs import prepared_folder

if TYPE_CHECKING:
    from carrierflex.reduction.certificate import Certificate, Check


def main(body: Path, *, out: Path | None = None) -> Certificate:
    """Show the reduction certificate of a body; the exit code is 1 where a check fails.

    Checks against the full body (static compliance, free frequencies, MAC, frequency response)
    stand as they were found when the body was reduced. Mass by three kinds of rigid-body modes,
    grounding, symmetry and equality of equal pilots are computed again from the matrices in the
    file.

    Parameters
    ----------
    body
        Body file (.h5) that carrierflex reduce wrote.
    out
        File to write (.json) with the checks; default: they are only shown.

    Returns
    -------
    Certificate
        All checks, wanted beside reached; limits are relative unless a name says otherwise.
    """
    from carrierflex.reduction.body_files import read_body, read_certificate
    from carrierflex.reduction.certificate import Certificate, inner_checks

    model = read_body(body)
    stored = read_certificate(body)
    if stored is None:
        raise ValueError(
            f"{body}: the body was written without a certificate; expected one made by carrierflex "
            "reduce"
        )
    again = {check.name: check for check in inner_checks(model, stored.cut_off_hz)}
    repeated = [again.pop(check.name, check) for check in stored.checks]
    # What an earlier version did not check yet comes last.
    certificate = Certificate(stored.cut_off_hz, (*repeated, *again.values()))
    if out is not None:
        prepared_folder(out.parent)
        refuse_foreign(out, '"cut_off_hz"')
        save_json(out, {"body": str(body), "met": certificate.met, **plain(certificate)})
    return certificate


class CertificateDocument(TypedDict):
    """Checks of a reduced body, written by certificate --json."""

    body: Annotated[str, "Body file"]
    met: Annotated[bool, "Whether every check is met"]
    checks: Annotated[Sequence[Check], "Required and actual"]
    cut_off_hz: Annotated[float, "Frequency up to which was checked [Hz]"]

"""Digests by which two diagnoses are known to be of the same measurement."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.json_files import plain
from carrierflex.files.whole_files import file_digest
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME
from carrierflex.identification.campaign.records import Run


@dataclass(frozen=True)
class RecordDigests:
    """SHA-256 of what a campaign measured, and of the files it was read from.

    Parameters
    ----------
    measured : str
        Digest of `runs`.
    runs : mapping of str to str
        Digest of each run by name: time, inputs, signals, windows that count, condition. Another
        simulator's prediction, the baseline and the rig are no part of it.
    files : mapping of str to str
        Digest of each file of the folder by name, byte by byte.
    """

    measured: str
    runs: Mapping[str, str]
    files: Mapping[str, str]


def record_digests(campaign: Campaign, folder: Path) -> RecordDigests:
    """Digests of a campaign and of its files.

    Parameters
    ----------
    campaign : Campaign
        As it was read.
    folder : Path
        Where it was read.
    """
    runs = {run.name: run_digest(run) for run in campaign.runs}
    lines = "\n".join(f"{name} {digest}" for name, digest in sorted(runs.items()))
    names = [DOCUMENT_NAME, *(run.file for run in campaign.runs)]
    curves = campaign.rig.get("deflection_curves")
    if curves is not None:
        names.append(str(curves))
    if campaign.baseline.case:
        names.append(campaign.baseline.case)
    return RecordDigests(
        measured=hashlib.sha256(lines.encode()).hexdigest(),
        runs=runs,
        files={name: file_digest(folder / name) for name in dict.fromkeys(names)},
    )


def run_digest(run: Run) -> str:
    """SHA-256 of what one run measured, the same whatever file format holds it."""
    digest = hashlib.sha256(repr((run.condition, plain(run.use))).encode())
    for name, values in [("time", run.time), *sorted({**run.inputs, **run.signals}.items())]:
        digest.update(f"\n{name} {values.size}\n".encode())
        digest.update(_bytes(values))
    return digest.hexdigest()


def _bytes(values: NDArray[np.float64]) -> bytes:
    """Samples as little-endian doubles; every missing sample is the same."""
    one_nan = np.where(np.isnan(values), np.nan, values)
    return one_nan.astype("<f8").tobytes()

"""Records that grow piece by piece on disk: a campaign of any length in bounded memory."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv

from carrierflex.files.whole_files import errors_naming
from carrierflex.files.whole_folders import unfinished_folder
from carrierflex.identification.campaign.campaign_files import prepare_campaign_folder
from carrierflex.identification.campaign.file_names import checked_file_name
from carrierflex.identification.campaign.records import Run


@dataclass
class GrowingRuns:
    """CSV files that runs are written to as they come.

    Parameters
    ----------
    folder : Path
        Where the files grow.
    n_samples : dict of str to int
        Samples written, by run name.
    """

    folder: Path
    n_samples: dict[str, int] = field(default_factory=dict)
    _last: dict[str, Run] = field(default_factory=dict, init=False, repr=False)

    @property
    def runs(self) -> tuple[Run, ...]:
        """Last piece of every run: name, file, condition and columns are the run's."""
        return tuple(self._last.values())

    @property
    def files(self) -> dict[str, Path]:
        """Where each run stands, by its file name."""
        return {run.file: self.folder / run.file for run in self.runs}

    def append(self, piece: Run) -> None:
        """Write the next piece of a run.

        Raises
        ------
        ValueError
            Where the file name is no plain name, the columns are not those of the piece before, or
            time does not go on.
        """
        path = self.folder / checked_file_name(piece.file, f"run {piece.name}: file")
        columns, last = {"time": piece.time, **piece.columns()}, self._last.get(piece.name)
        if last is not None and not (
            piece.time[0] > last.time[-1] and columns.keys() == {"time", *last.columns()}
        ):
            raise ValueError(
                f"run {piece.name}: a piece from {piece.time[0]:g} s follows one until "
                f"{last.time[-1]:g} s; expected a later one with the same columns"
            )
        with errors_naming(path, path), path.open("ab") as file:
            if last is None:
                # Arrow would quote the column names.
                file.write((",".join(columns) + "\n").encode())
            table = pa.table(
                {name: pa.array(values, from_pandas=True) for name, values in columns.items()}
            )
            pa_csv.write_csv(table, file, pa_csv.WriteOptions(include_header=False))
        self._last[piece.name] = piece
        self.n_samples[piece.name] = self.n_samples.get(piece.name, 0) + len(piece.time)

    def cut(self, name: str, why: str) -> None:
        """Note in a run's condition where and why it ends: it is no repeat of a whole one."""
        run = self._last[name]
        self._last[name] = replace(
            run, condition=f"{run.condition}, cut at {np.round(run.time[-1], 9):g} s: {why}"
        )


@contextmanager
def growing_runs(folder: Path) -> Iterator[GrowingRuns]:
    """Runs that grow beside a campaign folder to be.

    :func:`carrierflex.identification.campaign.campaign_files.write_campaign` takes them over.

    Parameters
    ----------
    folder : Path
        Campaign folder; what is not taken over when the block ends is removed.

    Raises
    ------
    ValueError
        At once where the folder holds a measurement or something that is not a campaign.
    OSError
        At once where the folder cannot be written.
    """
    prepare_campaign_folder(folder)
    partial = unfinished_folder(folder)
    try:
        yield GrowingRuns(partial)
    finally:
        shutil.rmtree(partial, ignore_errors=True)

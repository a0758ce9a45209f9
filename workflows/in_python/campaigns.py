"""``cf.simulated_campaign``, ``cf.measured_campaign``: records of a simulation or a measurement."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from carrierflex.fe.curve_files import write_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.workflows.diagnosis.diagnose_campaign import campaign_curves
from carrierflex.workflows.in_python.notebook import shown_in_notebook
from carrierflex.workflows.simulation import simulate_load_case

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class Records:
    """Runs of a campaign with what they are to be read with.

    Parameters
    ----------
    campaign : Campaign
        Channels, runs, rig and baseline.
    curves : dict of str to DeflectionCurve, optional
        Deflection curves of a carrier.
    """

    campaign: Campaign
    curves: dict[str, DeflectionCurve] | None = None

    def to_dataframe(self, run: str | None = None) -> "DataFrame":
        """Inputs and signals of one run, the first without a name, over time [s] as index.

        Raises
        ------
        ValueError
            Where there is no such run.
        """
        import pandas as pd

        record = self._run(run)
        columns = {**record.inputs, **record.signals}
        return pd.DataFrame(columns, index=pd.Index(record.time, name="time"))

    def plot(self, run: str | None = None) -> "Figure":
        """Signals of one run over time, a panel a unit."""
        from matplotlib.figure import Figure

        record = self._run(run)
        units = sorted({channel.unit for channel in self.campaign.channels})
        figure = Figure(figsize=(9.0, 2.8 * len(units) + 0.6), layout="constrained")
        panels = figure.subplots(len(units), 1, sharex=True, squeeze=False).ravel()
        for panel, unit in zip(panels, units, strict=True):
            for channel in self.campaign.channels:
                if channel.unit == unit:
                    panel.plot(record.time, record.signals[channel.name], label=channel.name)
            panel.set_ylabel(f"[{unit}]")
            # Beside the panel: signals reach its edges.
            panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
        panels[-1].set_xlabel("time [s]")
        figure.suptitle(f"{self.campaign.name}: {record.name}")
        return figure

    def write(self, folder: Path | str) -> Path:
        """Write the campaign folder that ``identify`` and ``diagnose`` read; its path."""
        curves = self.curves
        named = self.campaign.rig.get("deflection_curves")
        more = {}
        if curves is not None and named is not None:
            more[str(named)] = lambda path: write_curves(path, curves)
        write_campaign(self.campaign, Path(folder), simulated=True, more_files=more)
        return Path(folder)

    def _run(self, name: str | None) -> Run:
        names = [run.name for run in self.campaign.runs]
        if name is not None and name not in names:
            raise ValueError(f"run '{name}' is not in the campaign; expected one of {names}")
        return self.campaign.runs[0 if name is None else names.index(name)]

    def _rows(self) -> list[tuple[str, str]]:
        campaign = self.campaign
        samples = sum(run.time.size for run in campaign.runs)
        return [
            ("kind", campaign.kind),
            ("channels", ", ".join(channel.name for channel in campaign.channels)),
            ("runs", ", ".join(run.name for run in campaign.runs)),
            ("samples", f"{samples} in all"),
        ]

    def __repr__(self) -> str:
        """Kind, channels and runs in one line."""
        inside = "; ".join(f"{name}: {text}" for name, text in self._rows())
        return f"Records({self.campaign.name}; {inside})"

    def _repr_html_(self) -> str:
        return shown_in_notebook(self.campaign.name, self._rows(), self.plot())


def simulated_campaign(case: Path | str = "carrier_lc1_to_lc4") -> Records:
    """Simulate what the sensors of a case would read.

    Parameters
    ----------
    case : path or str
        Case file (TOML), or the name of a bundled case.

    Returns
    -------
    Records
        The runs, in memory; nothing stays on disk.

    Raises
    ------
    ValueError
        Where there is no such case, or it is refused.
    """
    with TemporaryDirectory() as folder:
        out = Path(folder) / "campaign"
        simulate_load_case.main(Path(case), out=out, quiet=True)
        return measured_campaign(out)


def measured_campaign(folder: Path | str) -> Records:
    """Read a campaign folder.

    Parameters
    ----------
    folder : path or str
        Folder with campaign.toml.

    Returns
    -------
    Records
        The runs.

    Raises
    ------
    ValueError
        Where a file is refused, with its name.
    """
    campaign = read_campaign(Path(folder))
    return Records(campaign, campaign_curves(campaign, Path(folder)))

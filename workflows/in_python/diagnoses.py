"""``cf.diagnosed``: where the gap lies, which effect is missing, how far it shrinks."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.diagnosis.report.gap_words import where_text
from carrierflex.diagnosis.report.page import report_page
from carrierflex.diagnosis.report.report_data import ReportSource, report_data
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.json_files import save_text
from carrierflex.files.versions import versions
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis.examination import examined
from carrierflex.workflows.in_python.campaigns import Records, measured_campaign
from carrierflex.workflows.in_python.notebook import shown_in_notebook

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosed:
    """A diagnosis and the records it belongs to.

    Parameters
    ----------
    result : Diagnosis
        Verdict, effects, parameters, gap.
    records : Records
        What was diagnosed.
    """

    result: Diagnosis
    records: Records

    @property
    def verdict(self) -> str:
        """One of the verdicts of docs/campaign_format.md."""
        return self.result.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that are named, the one that explains most first."""
        return self.result.attribution.effects

    def to_dataframe(self) -> "DataFrame":
        """Values of the parameters: effect, parameter, value, ends of its 95 % interval, unit."""
        import pandas as pd

        rows = [
            {
                "effect": effect,
                "parameter": name,
                "value": value.value,
                "ci95_low": value.ci95[0],
                "ci95_high": value.ci95[1],
                "unit": value.unit,
            }
            for effect, values in self.result.attribution.parameters.items()
            for name, value in values.items()
        ]
        columns = ["effect", "parameter", "value", "ci95_low", "ci95_high", "unit"]
        return pd.DataFrame(rows, columns=columns)

    def write_report(self, path: Path | str) -> Path:
        """Write report.html, which needs no network to be read; the file's path."""
        written = f"{datetime.now():%Y-%m-%d %H:%M}"
        campaign = self.records.campaign
        source = ReportSource(campaign.name, versions(), written)
        save_text(Path(path), report_page(report_data(self.result, campaign, source)))
        return Path(path)

    def _rows(self) -> list[tuple[str, str]]:
        rows = [
            ("verdict", self.verdict),
            ("effects", ", ".join(self.effects) or "none"),
            ("where", where_text(self.result)),
        ]
        reduction = self.result.reduction
        if reduction is not None:
            low, high = reduction.rho_ci95
            rows.append(
                (
                    "gap after over before, held out",
                    f"{reduction.rho:.3g} (95 %: {low:.3g} to {high:.3g})",
                )
            )
        return [*rows, ("why", self.result.reason)]

    def __repr__(self) -> str:
        """Verdict, effects and how far the gap shrinks in one line."""
        reduction = self.result.reduction
        far = "" if reduction is None else f"; gap shrinks to {reduction.rho:.1%}"
        return f"Diagnosed({self.verdict}: {', '.join(self.effects) or 'no effect'}{far})"

    def _repr_html_(self) -> str:
        return shown_in_notebook(f"Diagnosis of {self.result.campaign}", self._rows())


def diagnosed(records: Records | Path | str) -> Diagnosed:
    """Diagnose the gap between a campaign and its baseline simulation.

    Parameters
    ----------
    records : Records, path or str
        A campaign, or its folder.

    Returns
    -------
    Diagnosed
        What ``carrierflex diagnose`` would write.

    Raises
    ------
    ValueError
        Where the campaign is refused.
    """
    if not isinstance(records, Records):
        records = measured_campaign(records)
    with single_threaded():
        result = examined(records.campaign, records.curves).diagnosis()
    return Diagnosed(result, records)

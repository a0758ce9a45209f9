"""What a user starts from, on the screen: maps, imports, schemas, cases, dimensions."""

from collections import Counter
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.text import Text

from carrierflex.files.shown_values import shortened
from carrierflex.workflows.screen.titled_table import titled_table

if TYPE_CHECKING:
    from carrierflex.workflows.app.serve_app import ClosedPage
    from carrierflex.workflows.check_installation import Installation
    from carrierflex.workflows.complete_shell import Completion
    from carrierflex.workflows.describe_file import FileDescription
    from carrierflex.workflows.geometry.write_parameters import WrittenParameters
    from carrierflex.workflows.identification.import_records import ImportedRecords
    from carrierflex.workflows.identification.new_campaign import NewMap
    from carrierflex.workflows.schemas.show_schema import Schema
    from carrierflex.workflows.simulation.copy_cases import ShippedCases
    from carrierflex.workflows.simulation.rexs_case import RexsCase


def map_table(new: "NewMap") -> RenderableType:
    """Where the map is, what is to fill in, and which columns it leaves out."""
    table = titled_table(
        f"{new.path}: check every line, then run carrierflex import", "to fill in", folded=(0,)
    )
    for line in new.open_keys:
        table.add_row(line)
    if not new.open_keys:
        table.add_row("nothing: every key has a guess")
    if not new.left_out:
        return table
    names = shortened(", ".join(new.left_out), 400)
    return Group(table, Text(f"Columns that the map leaves out: {names}"))


def closed_page_line(closed: "ClosedPage") -> RenderableType:
    """Where the files of a closed page are."""
    return Text(f"The page is closed. Its files are in {closed.folder}.")


def imported_table(result: "ImportedRecords") -> RenderableType:
    """Runs, missing samples and clocks, one row each."""
    imported = result.imported
    table = titled_table(f"campaign {result.folder}", "run", "about", "what", "samples")
    for run in imported.campaign.runs:
        span = f"{run.time[0]:.6g} to {run.time[-1]:.6g} s"
        table.add_row(run.name, "", span, str(run.time.size))
    for count in imported.counts:
        table.add_row(count.run, count.column, count.what, str(count.rows))
    for name, shift in imported.shifts.items():
        words = f"moved by {shift.seconds:.6g} ± {shift.std:.1g} s, as sensor_delay would"
        if shift.others:
            words += f"; {len(shift.others)} other shifts fit as well"
        table.add_row(name, "simulated clock", words, "")
    for note in imported.notes:
        table.add_row("", "", note, "")
    return table


def schema_page(schema: "Schema") -> RenderableType:
    """The schema itself, or where it is."""
    return Text(schema.text.rstrip() if schema.path is None else f"schema {schema.path}")


def completion_script(completion: "Completion") -> RenderableType:
    """The script itself."""
    return Text(completion.text.rstrip())


def cases_table(cases: "ShippedCases | RexsCase") -> RenderableType:
    """Shipped cases with their titles, or what a REXS file gave and lacks."""
    from carrierflex.workflows.simulation.copy_cases import ShippedCases

    if not isinstance(cases, ShippedCases):
        return _rexs_table(cases)
    where = f": copied to {cases.folder}" if cases.folder is not None else ""
    table = titled_table(f"bundled cases{where}", "name", "what it is", folded=(1,))
    for name, title in cases.titles.items():
        table.add_row(name, title)
    return table


def _rexs_table(case: "RexsCase") -> RenderableType:
    """Defaults for what the file lacks, by table; notes; what to run next."""
    counts = Counter(value.how for value in case.values)
    title = (
        f"{case.folder}, {case.source}: {counts['file']} numbers of the file, "
        f"{counts['derived']} derived, {counts['default']} defaults"
    )
    table = titled_table(title, "not in the file", "used instead", folded=(1,))
    tables = dict.fromkeys(value.table for value in case.values)
    for name in tables:
        values = [value for value in case.values if value.table == name]
        lacking = [value for value in values if value.how == "default"]
        if len(lacking) == len(values) > 1:
            table.add_row(f"[{name}]", f"all {len(values)} numbers: the shipped gearbox, scaled")
            continue
        for value in lacking:
            key = f"[{name}] {value.key}" if name else value.key
            table.add_row(key, f"{value.number:.4g} {value.unit}".rstrip() + f": {value.source}")
    for words, lines in (
        ("note", case.notes),
        ("to correct", case.problems),
        ("next", case.commands),
    ):
        for number, line in enumerate(lines):
            table.add_row("" if number else words, line)
    return table


def description_table(described: "FileDescription") -> RenderableType:
    """Kind, figures, writer and commands of a file."""
    table = titled_table(described.kind, "what", "value", folded=(1,))
    table.add_row("file", str(described.path))
    for name, text in described.figures.items():
        table.add_row(name, text)
    table.add_row("written by", described.software or "not stated")
    for number, line in enumerate(described.commands):
        table.add_row("" if number else "taken by", line)
    return table


def installation_table(installation: "Installation") -> RenderableType:
    """What is required, what is optional, and what the machine offers."""
    table = titled_table("installation", "what", "state", "value", folded=(2,))
    for item in installation.items:
        table.add_row(item.name, item.state, item.value)
    return table


def parameters_table(written: "WrittenParameters") -> RenderableType:
    """Where the dimensions are, and their drawing."""
    return Text(f"{written.n_keys} dimensions in {written.path}, drawn in {written.drawing}")

"""The file map.toml, read and checked."""

from pathlib import Path

from carrierflex.files.shown_values import shown
from carrierflex.files.toml_files import TomlKind, check_header, checked_document, toml_document
from carrierflex.identification.campaign.campaign_kinds import KIND_NAMES
from carrierflex.identification.logs.map_tables import MAP_OF_KIND, MapDocument

MAP_FILE = TomlKind(
    "a map of a logger's columns",
    holds="the keys that carrierflex new-campaign writes",
    most_bytes=1_000_000,
    format="carrierflex-map",
)


def read_map(path: Path) -> MapDocument:
    """Read a map.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no map, or anything in it is wrong or still '?': all of it at once.
    """
    document = toml_document(path, MAP_FILE)
    check_header(document, MAP_FILE, str(path))
    kind = document.get("kind")
    if kind not in KIND_NAMES:
        raise ValueError(
            f"{path}: key 'kind' is {shown(kind)}; expected one of {', '.join(KIND_NAMES)}"
        )
    return checked_document(document, MAP_OF_KIND[kind], str(path))

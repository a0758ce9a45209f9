"""The interfaces file: units, nodes, pilots and sensors of another program's matrices."""

from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.files.toml_files import TomlKind, read_toml

if TYPE_CHECKING:
    from carrierflex.fe.matrices.interface_tables import InterfacesDocument

INTERFACES_FILE = TomlKind(
    "an interfaces file",
    holds="the tables [nodes] and [[pilots]]",
    most_bytes=50_000_000,
    format="carrierflex-interfaces",
)


def read_interfaces(path: Path) -> "InterfacesDocument":
    """Read an interfaces file.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where keys are unknown, missing or contradict each other; the message names all of them.
    """
    from carrierflex.fe.matrices.interface_tables import InterfacesDocument

    return read_toml(path, INTERFACES_FILE, InterfacesDocument)

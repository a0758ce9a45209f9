"""Names of the files of a campaign folder."""

from pathlib import Path, PurePosixPath, PureWindowsPath

#: The campaign's document.
DOCUMENT_NAME = "campaign.toml"
#: What the libraries of effects publish; it comes with the package, derived from them by
#: :mod:`carrierflex.identification.campaign.effect_names`.
EFFECT_NAMES = Path(__file__).with_name("effect_names.json")
#: Endings of run files.
RUN_SUFFIXES = (".csv", ".parquet")


def checked_file_name(name: str, key: str) -> str:
    """File name of the campaign folder; one that leads elsewhere is refused.

    Raises
    ------
    ValueError
        Where the name holds a folder, is absolute or is hidden.
    """
    plain = PurePosixPath(name).name == name and PureWindowsPath(name).name == name
    if not plain or name.startswith(".") or name == DOCUMENT_NAME or "\0" in name:
        raise ValueError(
            f"{key} '{name}' leads out of the campaign folder; expected a plain file name in it"
        )
    return name

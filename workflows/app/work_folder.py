"""The one folder that the page reads and writes: files of loggers beside the results of commands.

Every result gets a name that is free, so nothing in the folder is replaced but a map that the page
has shown.
"""

import filecmp
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath

from carrierflex.files.shown_values import shown
from carrierflex.files.temporary_names import unfinished_name

#: What the page writes by itself.
_TOML_OF_THE_PAGE = re.compile(r"(map|carrier)(_\d+)?\.toml")


@dataclass(frozen=True)
class WorkFolder:
    """A folder whose files are named by their names alone."""

    root: Path

    def path_of(self, name: str) -> Path:
        """Path of a file; a name that leads out, is hidden or looks like an option is refused."""
        is_plain = PurePosixPath(name).name == name and PureWindowsPath(name).name == name
        if not (name and is_plain) or name[0] in ".-" or not name.isprintable():
            raise ValueError(
                f"file {shown(name)}: expected a plain name without folders that begins with no "
                "dot and no dash; rename the file"
            )
        return self.root / name

    def log_files(self) -> list[str]:
        """Names of the files that may be those of loggers."""
        names = [path.name for path in self.root.iterdir() if path.is_file()]
        return sorted(
            name for name in names if name[0] not in ".-" and not _TOML_OF_THE_PAGE.fullmatch(name)
        )

    def free(self, stem: str, suffix: str = "") -> str:
        """First of ``stem``, ``stem_2``, ``stem_3`` ... that nothing in the folder is called."""
        number, name = 1, stem + suffix
        while (self.root / name).exists():
            number += 1
            name = f"{stem}_{number}{suffix}"
        return name

    def last(self, stem: str, suffix: str = "", document: str = "") -> str | None:
        """The `stem` of highest number that exists and holds a document; None without one."""
        numbers = {
            int(match[1] or 1): path.name
            for path in self.root.iterdir()
            if (match := re.fullmatch(rf"{stem}(?:_(\d+))?{re.escape(suffix)}", path.name))
            and (path / document).is_file()
        }
        return numbers[max(numbers)] if numbers else None

    async def save(self, name: str, write: Callable[[Path], Awaitable[None]]) -> None:
        """Write a new file by a function of its path; one with another content is not replaced."""
        path = self.path_of(name)
        temporary = path.with_name(unfinished_name(name))
        try:
            await write(temporary)
            is_same = path.is_file() and filecmp.cmp(temporary, path, shallow=False)
            if path.exists() and not is_same:
                raise ValueError(
                    f"{name}: is in the folder already with another content and is not replaced; "
                    "rename the file"
                )
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)

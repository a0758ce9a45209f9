"""Files that appear whole or not at all: written under another name, then renamed."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path`, of the same suffix.

    Rename it to `path` when the block ends well.

    Parameters
    ----------
    path : Path
        File to write; an older one is replaced in one step.

    Yields
    ------
    Path
        Name to write to; removed where the block raises or is interrupted.
    """
    temporary = path.with_name(f".part-{os.getpid()}-{path.name}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)

"""Compiled code kept by numba: files of pickle, which are removed where they are damaged.

Numba keeps what it compiles in ``__pycache__`` beside the source, or in ``NUMBA_CACHE_DIR``, and
reads it with pickle: whoever may write there can run code as the user (docs/reliability.md).
"""

import logging
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")

log = logging.getLogger(__name__)

_ROOT = Path(__file__).resolve().parents[1]
#: Part of numba that reads the files.
_READER = str(Path("numba", "core", "caching.py"))


def with_sound_cache(call: Callable[[], T]) -> T:
    """Result of a call that may load compiled code.

    Where the kept code is damaged it is removed, and the call begins again and compiles.

    Parameters
    ----------
    call : callable
        Work that can be begun again.
    """
    try:
        return call()
    except Exception as error:
        if not _is_damaged_cache(error):
            raise
        for path in _index_files(error):
            log.error("%s: compiled code is damaged; removed, to be compiled again", path)
            path.unlink(missing_ok=True)
    return call()


def _is_damaged_cache(error: BaseException) -> bool:
    """Whether reading of compiled code failed, here or in a process that works for this one."""
    frames = traceback.extract_tb(error.__traceback__)
    return any(frame.filename.endswith(_READER) for frame in frames) or _READER in str(
        error.__cause__
    )


def _index_files(error: BaseException) -> Iterator[Path]:
    """Index of the code that could not be read; all of this program's where only a worker knows."""
    known: set[Path] = set()
    for frame, _ in traceback.walk_tb(error.__traceback__):
        index = getattr(frame.f_locals.get("self"), "_index_path", None)
        if frame.f_code.co_filename.endswith(_READER) and index is not None:
            known.update(Path(index).parent.glob("*.nbi"))
    yield from sorted(known) or sorted(_ROOT.glob("*/**/__pycache__/*.nbi"))

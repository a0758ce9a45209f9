"""The one way in which workflows use the cache.

Copy a result that is there, or compute it and keep it.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from rich.console import Console

from carrierflex.files.whole_files import whole_file
from carrierflex.workflows.support.cache_store import CacheStore, cache_folder, cache_key


def cached_files(
    files: Mapping[str, Path],
    compute: Callable[[], object],
    *,
    use: bool,
    quiet: bool,
    inputs: Mapping[str, object],
) -> bool:
    """Write result files from the cache, or let `compute` write them and keep copies.

    Parameters
    ----------
    files : mapping of str to Path
        Name in the cache and path of every file of the result.
    compute : callable
        Writes all of `files`.
    use : bool
        False: neither look into the cache nor add to it.
    quiet : bool
        Do not say that a kept result is used.
    inputs : mapping
        All that the result depends on, besides materials and program.

    Returns
    -------
    bool
        Whether the result came from the cache.
    """
    if not use:
        compute()
        return False
    store, key = CacheStore(cache_folder()), cache_key(**inputs)
    entry = store.found(key, files)
    if entry is None:
        compute()
        store.keep(key, files, inputs)
        return False
    for name, path in files.items():
        with whole_file(path) as temporary:
            temporary.write_bytes((entry / name).read_bytes())
    console = Console(stderr=True, quiet=quiet, highlight=False, soft_wrap=True)
    shown = ", ".join(str(path) for path in files.values())
    console.print(
        f"unchanged inputs: {shown} taken from the cache ({entry}); --no-cache computes again",
        markup=False,
    )
    return True

"""Results kept between runs: an unchanged body is not computed again.

An entry is a folder of ordinary versioned files (a body file, a curve file) beside ``entry.json``,
which names their SHA-256. Its name is the SHA-256 of everything the result depends on: inputs,
material data, the source text of the numerics and the versions of the libraries below them. An
entry that is not what it says is removed and computed again. Where the cache outgrows its limit,
the entries that were not used for the longest time go.
"""

import hashlib
import json
import logging
import os
import shutil
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rich.console import Console

from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.files.json_files import plain, read_json, save_json
from carrierflex.files.shown_values import shortened, shown
from carrierflex.files.temporary_names import remove_abandoned
from carrierflex.files.versions import versions
from carrierflex.files.whole_files import file_digest, whole_file
from carrierflex.files.whole_folders import unfinished_folder

log = logging.getLogger(__name__)

FORMAT = "carrierflex-cache-entry"
VERSION = 1
#: Environment variable with another folder for the cache.
FOLDER_VARIABLE = "CARRIERFLEX_CACHE"
_ENTRY = "entry.json"
#: Size of the cache above which the oldest entries go [bytes]: several hundred bodies of the
#: default size.
_LIMIT = 2_000_000_000
_NUMERICS = ("geometry", "fe", "reduction")


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
    entry = store.lookup(key, files)
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


def cache_folder() -> Path:
    """Folder: `CARRIERFLEX_CACHE`, or ``carrierflex`` in `XDG_CACHE_HOME`, or in ``~/.cache``."""
    named = os.environ.get(FOLDER_VARIABLE)
    if named:
        return Path(named)
    user = os.environ.get("XDG_CACHE_HOME")
    # The XDG base directory specification: a relative path there is invalid and ignored.
    return (
        Path(user) if user and Path(user).is_absolute() else Path.home() / ".cache"
    ) / "carrierflex"


def cache_key(**inputs: object) -> str:
    """SHA-256 of the inputs (dataclasses spelled out) and of all they are computed with.

    That is the materials, the numerics' source text and the libraries' versions.
    """
    content = {
        "inputs": inputs,
        "materials": BODY_MATERIALS,
        "numerics": _numerics(),
        "versions": versions(),
    }
    return hashlib.sha256(json.dumps(plain(content), sort_keys=True).encode()).hexdigest()


@cache
def _numerics() -> str:
    """SHA-256 over the source files of the packages that compute what is cached."""
    root = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for package in _NUMERICS:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class CacheStore:
    """Entries in one folder, safe for several processes at once.

    An entry appears whole by a rename, or not at all.
    """

    folder: Path
    limit: int = _LIMIT

    def lookup(self, key: str, names: Collection[str]) -> Path | None:
        """Folder of the entry `key` with the files `names`, each as it was written.

        None where there is none to trust.
        """
        entry = self.folder / key
        if not entry.is_dir():
            return None
        reason = _damage(entry, key, names)
        if reason is None:
            _mark_used(entry)
            return entry
        log.error("%s: %s; removed, to be computed again", entry, reason)
        self._remove(entry)
        return None

    def keep(self, key: str, files: Mapping[str, Path], inputs: Mapping[str, object]) -> None:
        """Copy finished `files` (name in the entry to path) into the cache.

        A cache that cannot be written is only told.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            remove_abandoned(self.folder)
            unfinished = unfinished_folder(self.folder / key)
        except OSError as error:
            log.error(
                "%s: cannot write into the cache (%s); the result is not stored",
                self.folder,
                error.strerror,
            )
            return
        try:
            for name, path in files.items():
                shutil.copyfile(path, unfinished / name)
            digests = {name: file_digest(unfinished / name) for name in files}
            header = {
                "format": FORMAT,
                "version": VERSION,
                "key": key,
                "files": digests,
                "inputs": inputs,
            }
            save_json(unfinished / _ENTRY, header)
            # Another process may have been first: its entry is the same.
            if not (self.folder / key).exists():
                os.rename(unfinished, self.folder / key)
        except OSError as error:
            log.error(
                "%s: cannot write into the cache (%s); the result is not stored",
                self.folder,
                error.strerror,
            )
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
        self._trim(newest=key)

    def _trim(self, newest: str) -> None:
        """Remove entries, least recently used first, until the cache fits its limit."""
        ages, sizes = {}, {}
        for entry in self.folder.iterdir():
            try:
                if not entry.name.startswith("."):
                    ages[entry] = (entry.name == newest, entry.stat().st_mtime)
                    sizes[entry] = sum(path.stat().st_size for path in entry.iterdir())
            except OSError as error:  # another process removes it
                log.info("%s: %s", entry, error.strerror)
        total = sum(sizes.values())
        for entry in sorted(sizes, key=lambda name: ages[name])[:-1]:
            if total <= self.limit:
                return
            self._remove(entry)
            total -= sizes[entry]

    def _remove(self, entry: Path) -> None:
        """Take the entry away in one step, so that no reader meets half of it, then delete it."""
        grave = unfinished_folder(entry)
        try:
            os.rename(entry, grave / "entry")
        except FileNotFoundError:
            log.info("%s: another process removed it first", entry)
        finally:
            shutil.rmtree(grave, ignore_errors=True)


def _mark_used(entry: Path) -> None:
    """Set the entry's time to now; a cache that is read-only keeps the time it was written."""
    try:
        os.utime(entry)
    except OSError as error:
        log.info("%s: time of use not kept (%s)", entry, error.strerror)


def _damage(entry: Path, key: str, names: Collection[str]) -> str | None:
    """What is wrong with an entry, None where nothing is."""
    try:
        header = read_json(entry / _ENTRY, "an entry of the cache", most_bytes=10_000_000)
        stated = {name: header[name] for name in ("format", "version", "key")}
        files = {str(name): str(digest) for name, digest in header["files"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        return f"its {_ENTRY} cannot be read ({shortened(' '.join(str(error).split()))})"
    if stated != {"format": FORMAT, "version": VERSION, "key": key}:
        return (
            f"its {_ENTRY} says {shown(stated)}; expected format {FORMAT}, version {VERSION} and "
            "its own key"
        )
    for name in names:
        if name not in files or not (entry / name).is_file():
            return f"{name} is missing"
        if file_digest(entry / name) != files[name]:
            return f"{name} was changed after it was written"
    return None

"""Run the scripts of docs/gallery, keep their pictures, and write the page that shows them.

Run it by ``make gallery``; ``tools/make_gallery.py torsion`` runs one script.
"""

import ast
import runpy
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
SCRIPTS = ROOT / "docs" / "gallery"
PICTURES = ROOT / "docs" / "pictures" / "gallery"
PAGE = ROOT / "docs" / "gallery.md"
_HEAD = """# Gallery

A click on a picture opens its script; `python docs/gallery/NAME.py FOLDER` writes
`FOLDER/NAME.png`. `make gallery` makes them all and this page. Meshes are coarse (60 to 80 mm), so
that a script takes seconds.
"""


class Entry(NamedTuple):
    """A script of the gallery: its first sentence, and what its docstring says of the command."""

    path: Path
    title: str
    command: str
    kind: str


def entries() -> list[Entry]:
    """Scripts of the gallery by name."""
    gallery = []
    for path in sorted(SCRIPTS.glob("*.py")):
        docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        title, _, rest = docstring.partition("\n")
        command, _, kind = rest.strip().removeprefix("Command: ").partition(", ")
        gallery.append(Entry(path, title.rstrip("."), command, kind))
    return gallery


def page() -> str:
    """The page of the gallery."""
    sections = [_HEAD]
    for entry in entries():
        name = entry.path.stem
        sections.append(
            f"## {entry.title}\n\n"
            f"[![{name}](pictures/gallery/{name}.png)](gallery/{name}.py)\n\n"
            f"`carrierflex {entry.command}`, {entry.kind}\n"
        )
    return "\n".join(sections)


def main(names: list[str]) -> None:
    """Run the named scripts, all of them without a name."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for entry in entries():
        if names and entry.path.stem not in names:
            continue
        start = time.perf_counter()
        sys.argv = [str(entry.path), str(PICTURES)]
        runpy.run_path(str(entry.path), run_name="__main__")
        picture = PICTURES / f"{entry.path.stem}.png"
        size = picture.stat().st_size / 1e3
        seconds = time.perf_counter() - start
        print(f"{entry.path.stem:<20} {seconds:6.1f} s {size:6.0f} kB", flush=True)
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])

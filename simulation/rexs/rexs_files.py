"""REXS files: read in each of the three forms, and copied with load cases added.

XML (.rexs), JSON (.rexsj) and a ZIP archive (.rexsz) that holds one of them; told apart by their
content. Sizes are checked before anything is unpacked or read, and a file that declares entities or
another document type is refused. Of the standard's values, matrices and binary arrays are passed
over: a stage needs numbers and vectors of three.
"""

import datetime
import io
import json
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from carrierflex.files.archives import DAMAGED_ARCHIVE
from carrierflex.files.plain_files import check_plain_file
from carrierflex.files.shown_values import shortened, shown
from carrierflex.files.versions import software_name
from carrierflex.files.whole_files import refuse_to_replace, whole_file
from carrierflex.simulation.rexs.rexs_model import (
    Attribute,
    Component,
    LoadCase,
    Relation,
    RexsModel,
)
from carrierflex.simulation.rexs.rexs_units import STANDARD_UNITS, in_standard_unit

_APPLICATION = "carrierflex"
_WHAT = "a REXS file (.rexs, .rexsj or .rexsz)"
#: Larger files [bytes] hold meshes; what a stage needs takes a few 100 kB.
MOST_BYTES = 50_000_000
#: Files of an archive, of which one is the model.
_MOST_MEMBERS = 10_000
_MODEL_NAME = re.compile(r"\.(rexs|rexsj|rexs\.xml|rexs\.json)$", re.IGNORECASE)
#: Keys of an attribute in JSON that are no value.
_NO_VALUE = ("id", "unit")

#: What a damaged file raises.
_BAD = (*DAMAGED_ARCHIVE, ValueError, RuntimeError)

#: New values [SI] of one load case: by component and attribute.
Results = Mapping[int, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class _Document:
    """Content of a model file, as XML or JSON, and the archive that it came in."""

    model: ElementTree.Element | dict[str, Any]
    member: str = ""


class _Builder(ElementTree.TreeBuilder):
    """Tree with its comments; a document type, which may declare entities, is refused."""

    def __init__(self) -> None:
        super().__init__(insert_comments=True)

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        """Refuse it."""
        raise ValueError("it declares a document type; expected a model alone")


def read_rexs(path: Path) -> RexsModel:
    """Read a REXS file.

    Parameters
    ----------
    path : Path
        XML, JSON, or a ZIP archive with one of them.

    Returns
    -------
    RexsModel
        Components, relations and load cases.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is too large, damaged, or no REXS file; one line that names it.
    """
    document = _document(path)
    plain = _of_xml if isinstance(document.model, ElementTree.Element) else _of_json
    try:
        return _model(path, plain(document.model))  # type: ignore[arg-type]
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: not {_WHAT}: {_reason(error)}") from error


def write_with_load_cases(path: Path, source: Path, cases: Sequence[tuple[str, Results]]) -> None:
    """Write a copy of a REXS file, in its form, with load cases added to its load spectrum.

    Parameters
    ----------
    path : Path
        File to write; an existing one is replaced where this program wrote it.
    source : Path
        File that is copied.
    cases : sequence of (str, Results)
        Name and values of each load case; units are the standard's.

    Raises
    ------
    FileExistsError
        Where a file is in the way that another program wrote.
    ValueError
        Where the source is refused.
    """
    refuse_foreign_model(path)
    document = _document(source)
    model = read_rexs(source)
    first = 1 + max((case.id for case in model.load_cases), default=0)
    numbered = [(first + k, name, results) for k, (name, results) in enumerate(cases)]
    if isinstance(document.model, ElementTree.Element):
        document.model.attrib.update(_head())
        _add_to_xml(document.model, model, numbered)
        stream = io.BytesIO()
        ElementTree.ElementTree(document.model).write(
            stream, encoding="UTF-8", xml_declaration=True
        )
        content = stream.getvalue()
    else:
        document.model["model"] |= _head()
        _add_to_json(document.model, model, numbered)
        content = json.dumps(document.model, indent=2, ensure_ascii=False).encode()
    with whole_file(path) as temporary:
        if not document.member:
            temporary.write_bytes(content)
            return
        try:
            with zipfile.ZipFile(source) as old, zipfile.ZipFile(temporary, "w") as new:
                for member in old.infolist():
                    data = content if member.filename == document.member else old.read(member)
                    new.writestr(member, data, zipfile.ZIP_DEFLATED)
        except _BAD as error:
            raise ValueError(f"{source}: a damaged archive: {_reason(error)}") from error


def refuse_foreign_model(path: Path) -> None:
    """Refuse to replace a file that is no REXS file of this program.

    Raises
    ------
    FileExistsError
        Where there is one.
    """
    if not path.exists():
        return
    try:
        ours = read_rexs(path).application.split()[:1] == [_APPLICATION]
    except ValueError:
        ours = False
    if not ours:
        refuse_to_replace(path)


def _head() -> dict[str, str]:
    """Who wrote a file, and when."""
    name, _, number = software_name().partition(" ")
    now = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
    return {"applicationId": name, "applicationVersion": number, "date": now}


def _document(path: Path) -> _Document:
    """Content of a file, unpacked and parsed."""
    check_plain_file(path, _WHAT, MOST_BYTES)
    try:
        content = path.read_bytes()
        member = ""
        if content.startswith(b"PK"):
            member, content = _unpacked(content)
        begin = content[:200].lstrip(b"\xef\xbb\xbf \t\r\n")
        if begin.startswith(b"{"):
            model = json.loads(content.decode("utf-8-sig"))
            if not isinstance(model, dict) or not isinstance(model.get("model"), dict):
                raise ValueError("it has no object 'model'")
            return _Document(model, member)
        parser = ElementTree.XMLParser(target=_Builder())
        parser.feed(content)
        root = parser.close()
        if _tag(root) != "model":
            raise ValueError(f"its element is '{shortened(_tag(root))}'; expected 'model'")
        return _Document(root, member)
    except _BAD as error:
        raise ValueError(f"{path}: not {_WHAT}: {_reason(error)}") from error


def _unpacked(content: bytes) -> tuple[str, bytes]:
    """Name and content of the model in an archive."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        if len(members) > _MOST_MEMBERS or sum(each.file_size for each in members) > MOST_BYTES:
            raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes or {_MOST_MEMBERS} files")
        models = [each for each in members if _MODEL_NAME.search(each.filename)]
        if len(models) != 1:
            names = ", ".join(each.filename for each in models) or "none"
            raise ValueError(f"models in it: {shortened(names)}; expected one")
        with archive.open(models[0]) as file:
            unpacked = file.read(MOST_BYTES + 1)
        if len(unpacked) > MOST_BYTES:
            raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes")
        return models[0].filename, unpacked


def _reason(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "nested too deep"
    words = " ".join(str(error).split()) or type(error).__name__
    return shortened(f"missing {words}" if isinstance(error, KeyError) else words, 200)


def _of_xml(root: ElementTree.Element) -> dict[str, Any]:
    """A model in XML as what one in JSON holds."""
    relations = [
        {**each.attrib, "refs": [ref.attrib for ref in _children(each, "ref")]}
        for group in _children(root, "relations")
        for each in _children(group, "relation")
    ]
    components = [
        _component_of_xml(each)
        for group in _children(root, "components")
        for each in _children(group, "component")
    ]
    cases = [
        {**case.attrib, "components": [_component_of_xml(c) for c in _children(case, "component")]}
        for spectrum in _children(root, "load_spectrum")
        for case in _children(spectrum, "load_case")
    ]
    return {
        **root.attrib,
        "relations": relations,
        "components": components,
        "load_spectrum": {"load_cases": cases},
    }


def _of_json(document: dict[str, Any]) -> dict[str, Any]:
    model: dict[str, Any] = document["model"]
    return model


def _component_of_xml(element: ElementTree.Element) -> dict[str, Any]:
    return {
        **element.attrib,
        "attributes": [
            {**each.attrib, "value": _value_of_xml(each)}
            for each in _children(element, "attribute")
        ],
    }


def _value_of_xml(attribute: ElementTree.Element) -> object:
    """Text of a scalar, texts of an array; None for what is neither."""
    array = next(_children(attribute, "array"), None)
    if array is not None:
        return [(cell.text or "").strip() for cell in _children(array, "c")]
    return None if len(attribute) else (attribute.text or "").strip()


def _children(element: ElementTree.Element, tag: str) -> Iterator[ElementTree.Element]:
    return (child for child in element if _tag(child) == tag)


def _tag(element: ElementTree.Element) -> str:
    """Name without its namespace; empty for a comment."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _model(path: Path, content: Mapping[str, Any]) -> RexsModel:
    components = {}
    for entry in content.get("components") or ():
        component = Component(
            _id(entry["id"]),
            str(entry["type"]),
            str(entry.get("name") or ""),
            _attributes(entry),
        )
        if component.id in components:
            raise ValueError(f"{path}: component {component.id} stands there twice; expected once")
        components[component.id] = component
    relations = []
    for entry in content.get("relations") or ():
        roles = {str(ref["role"]): _id(ref["id"]) for ref in entry["refs"]}
        missing = [number for number in roles.values() if number not in components]
        if missing:
            raise ValueError(
                f"{path}: relation {shown(entry.get('id'))} names the component {missing[0]}; "
                "expected one of the file"
            )
        relations.append(Relation(str(entry["type"]), roles))
    spectrum = content.get("load_spectrum") or {}
    cases = tuple(
        LoadCase(
            _id(case["id"]),
            {_id(each["id"]): _attributes(each) for each in case.get("components") or ()},
        )
        for case in spectrum.get("load_cases") or ()
    )
    return RexsModel(
        path,
        str(content.get("version", "")),
        f"{content.get('applicationId', '')} {content.get('applicationVersion', '')}".strip(),
        components,
        tuple(relations),
        cases,
    )


def _attributes(component: Mapping[str, Any]) -> dict[str, Attribute]:
    return {
        str(each["id"]): Attribute(
            next((value for key, value in each.items() if key not in _NO_VALUE), None),
            each.get("unit") and str(each["unit"]),
        )
        for each in component.get("attributes") or ()
    }


def _id(value: object) -> int:
    """An id, a whole number of at most 32 bits as the schema has it."""
    text = str(value).strip()
    if not re.fullmatch(r"-?\d{1,10}", text) or isinstance(value, bool):
        raise TypeError(f"the id {shown(value)}; expected a whole number")
    return int(text)


_Numbered = Iterable[tuple[int, str, Results]]


def _add_to_xml(root: ElementTree.Element, model: RexsModel, cases: _Numbered) -> None:
    """Load cases behind those of the first load spectrum, before its accumulation."""
    space = root.tag.rpartition("}")[0]
    if space:
        ElementTree.register_namespace("", space[1:])
    prefix = f"{space}}}" if space else ""
    spectrum = next(_children(root, "load_spectrum"), None)
    if spectrum is None:
        spectrum = ElementTree.SubElement(root, f"{prefix}load_spectrum", id="1")
    index = sum(_tag(child) != "accumulation" for child in spectrum)
    for k, (number, name, results) in enumerate(cases):
        case = ElementTree.Element(f"{prefix}load_case", id=str(number))
        case.append(ElementTree.Comment(f" carrierflex, run {name} ".replace("--", "- ")))
        for component, values in results.items():
            what = model.components[component]
            entry = ElementTree.SubElement(
                case, f"{prefix}component", id=str(component), type=what.type
            )
            for attribute, value in values.items():
                ElementTree.SubElement(
                    entry, f"{prefix}attribute", id=attribute, unit=STANDARD_UNITS[attribute]
                ).text = repr(in_standard_unit(attribute, value))
        spectrum.insert(index + k, case)
    ElementTree.indent(spectrum, level=1)


def _add_to_json(document: dict[str, Any], model: RexsModel, cases: _Numbered) -> None:
    spectrum = document["model"].setdefault("load_spectrum", {"id": 1, "load_cases": []})
    spectrum["load_cases"] += [
        {
            "id": number,
            "components": [
                {
                    "id": component,
                    "type": model.components[component].type,
                    "attributes": [
                        {
                            "id": attribute,
                            "unit": STANDARD_UNITS[attribute],
                            "floating_point": in_standard_unit(attribute, value),
                        }
                        for attribute, value in values.items()
                    ],
                }
                for component, values in results.items()
            ],
        }
        for number, _, results in cases
    ]

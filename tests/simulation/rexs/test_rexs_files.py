"""REXS files in their three forms, damaged ones, and copies with load cases."""

import json
import re
import zipfile
from xml.etree import ElementTree

import pytest

from carrierflex.simulation.rexs.rexs_files import (
    MOST_BYTES,
    read_rexs,
    write_with_load_cases,
)
from tests.simulation.rexs.public_sample import public_stage, shipped_gearbox

RESULTS = {
    61: {"torque_around_u_axis": -7302.4},
    211: {"mesh_load_factor_iso_6336_2019": 1.045},
    34: {"rotational_speed": 157.07963267948966},
}
FORMS = {"a.rexs": "write_xml", "a.rexsj": "write_json", "a.rexsz": "write_archive"}


def plain(model):
    """What a model holds, without its path; numbers as numbers."""
    components = {
        number: (
            each.type,
            each.name,
            {key: (numbers(a.value), a.unit) for key, a in each.attributes.items()},
        )
        for number, each in model.components.items()
    }
    return components, model.relations, model.version, model.application


def numbers(value):
    if isinstance(value, list):
        return [float(x) for x in value]
    try:
        return float(value)
    except ValueError:
        return value


@pytest.mark.parametrize("make", [public_stage, shipped_gearbox])
def test_the_three_forms_hold_the_same(make, tmp_path):
    models = [read_rexs(getattr(make(), write)(tmp_path / name)) for name, write in FORMS.items()]
    assert len(models[0].components) == len(make().components)
    for other in models[1:]:
        assert other.relations == models[0].relations
        assert [case.id for case in other.load_cases] == [case.id for case in models[0].load_cases]
        for number, component in models[0].components.items():
            for key in component.attributes:
                if key in ("center_distance", "number_of_teeth", "rotational_speed", "length"):
                    value = models[0].number(component, key)
                    assert other.number(other.components[number], key) == value


def test_a_namespace_and_a_byte_order_mark_are_read(tmp_path):
    text = public_stage().write_xml(tmp_path / "a.rexs").read_text(encoding="utf-8")
    expected = plain(read_rexs(tmp_path / "a.rexs"))
    text = text.replace("<model ", '<model xmlns="https://rexs.info" ')
    (tmp_path / "b.rexs").write_text(text, encoding="utf-8-sig")
    assert plain(read_rexs(tmp_path / "b.rexs")) == expected


XML = '<model version="1.7" applicationId="x" applicationVersion="1" date="">{}</model>'
DAMAGED = {
    "empty": (b"", "no element found"),
    "text": (b"REXS", "syntax error"),
    "other": (b"<gearbox/>", "its element is 'gearbox'"),
    "cut": (XML.format("<components>").encode(), "mismatched tag"),
    "list": (b"[1]", "syntax error"),
    "no model": (b'{"gearbox": 1}', "no object 'model'"),
    "no id": (XML.format("<components><component type='shaft'/></components>").encode(), "id"),
    "id": (
        XML.format("<components><component id='x' type='shaft'/></components>").encode(),
        "expected a whole number",
    ),
    "twice": (
        XML.format(
            "<components><component id='1' type='a'/><component id='1' type='a'/></components>"
        ).encode(),
        "stands there twice",
    ),
    "relation": (
        XML.format(
            "<relations><relation id='7' type='side'><ref id='5' role='a'/></relation></relations>"
        ).encode(),
        "names the component 5",
    ),
    "deep": (b'{"model": ' + b"[" * 100_000, "nested too deep"),
    "entities": (
        b'<!DOCTYPE m [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
        b'<model version="&b;"/>',
        "declares a document type",
    ),
    "outside": (b'<!DOCTYPE model SYSTEM "file:///etc/passwd"><model/>', "document type"),
    "encoding": (b'<?xml version="1.0" encoding="nowhere"?><model/>', "encoding"),
}


@pytest.mark.parametrize(("content", "words"), DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_file_is_refused_in_one_line(content, words, tmp_path):
    path = tmp_path / "a.rexs"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=re.escape(words)) as refusal:
        read_rexs(path)
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).startswith(str(path))


def test_archives_that_hold_no_one_model_or_too_much_are_refused(tmp_path):
    path = tmp_path / "a.rexsz"
    for names, words in (((), "none"), (("a.rexs", "b.rexsj"), "a.rexs, b.rexsj")):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("readme.txt", "")
            for name in names:
                archive.writestr(name, "<model/>")
        with pytest.raises(ValueError, match=words):
            read_rexs(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.rexs", b" " * (MOST_BYTES + 1))
    with pytest.raises(ValueError, match=f"more than {MOST_BYTES} bytes"):
        read_rexs(path)


def test_another_damaged_file_of_the_archive_is_told_by_the_copy(tmp_path):
    path = public_stage().write_archive(tmp_path / "a.rexsz")
    content = path.read_bytes()
    name = content.index(b"pictures/housing.txt")
    path.write_bytes(content[: name + 20] + b"XX" + content[name + 22 :])
    assert read_rexs(path).components
    with pytest.raises(ValueError, match=r"a\.rexsz: a damaged archive"):
        write_with_load_cases(tmp_path / "b.rexsz", path, [])
    assert not (tmp_path / "b.rexsz").exists()


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"a\.rexs: no such file; expected a REXS file"):
        read_rexs(tmp_path / "a.rexs")


def schema_findings(root):
    """What is against rexs-file.xsd of REXS: order of elements, required attributes, keys."""
    kinds = {
        "model": (
            ["relations", "components", "load_spectrum"],
            ["version", "applicationId", "applicationVersion", "date"],
        ),
        "relations": (["relation"], []),
        "relation": (["ref"], ["id", "type"]),
        "ref": ([], ["id", "role"]),
        "components": (["component"], []),
        "component": (["attribute"], ["id", "type"]),
        "attribute": (["array", "matrix", "array_of_arrays"], ["id"]),
        "array": (["c"], []),
        "c": ([], []),
        "load_spectrum": (["load_case", "accumulation"], ["id"]),
        "load_case": (["component"], ["id"]),
    }
    elements = [each for each in root.iter() if isinstance(each.tag, str)]
    for element in elements:
        children, required = kinds[element.tag]
        order = [children.index(child.tag) for child in element if isinstance(child.tag, str)]
        if order != sorted(order):
            yield f"order below {element.tag}"
        for name in required:
            if name not in element.attrib:
                yield f"{element.tag} without {name}"
    for path in ("relations/relation", "components/component", "load_spectrum/load_case"):
        ids = [int(each.get("id")) for each in root.findall(path)]
        if len(ids) != len(set(ids)):
            yield f"{path} with an id twice"
    known = {each.get("id") for each in root.findall("components/component")}
    for path in ("relations/relation/ref", "load_spectrum/load_case/component"):
        for each in root.findall(path):
            if each.get("id") not in known:
                yield f"{path} names {each.get('id')}"
    for each in root.findall("load_spectrum/load_case/component"):
        (meant,) = (
            c for c in root.findall("components/component") if c.get("id") == each.get("id")
        )
        if meant.get("type") != each.get("type"):
            yield f"component {each.get('id')} is of another type"


def test_the_check_of_the_schema_finds_what_is_wrong():
    root = ElementTree.fromstring(
        "<model version='1.7'><components><component id='1' type='a'/></components><relations/>"
        "<load_spectrum id='1'><load_case id='1'><component id='2' type='a'/></load_case>"
        "</load_spectrum></model>"
    )
    with pytest.raises(ValueError, match="unpack"):
        list(schema_findings(root))
    root.find("load_spectrum/load_case/component").set("id", "1")
    assert len(list(schema_findings(root))) == 4


@pytest.mark.parametrize(("name", "write"), FORMS.items(), ids=FORMS)
def test_a_copy_with_load_cases_is_the_file_and_the_cases(name, write, tmp_path):
    source = getattr(public_stage(), write)(tmp_path / name)
    copy = tmp_path / f"copy_{name}"
    write_with_load_cases(copy, source, [("LC1", RESULTS), ("LC2", RESULTS)])
    before, after = read_rexs(source), read_rexs(copy)
    assert plain(after)[:3] == plain(before)[:3]
    assert after.application.startswith("carrierflex")
    assert [case.id for case in after.load_cases] == [1, 2]
    for case in after.load_cases:
        for component, values in RESULTS.items():
            for attribute, value in values.items():
                read = after.number(after.components[component], attribute, case)
                assert read == pytest.approx(value, rel=1e-11)
    if name.endswith("z"):
        with zipfile.ZipFile(copy) as archive:
            assert sorted(archive.namelist()) == ["gearbox.rexs", "pictures/housing.txt"]
    # Its load cases count on, behind the first ones.
    write_with_load_cases(tmp_path / name.replace("a", "b"), copy, [("LC3", RESULTS)])
    again = read_rexs(tmp_path / name.replace("a", "b"))
    assert [case.id for case in again.load_cases] == [1, 2, 3]


def test_a_copy_states_the_standard_s_units_and_keeps_to_its_schema(tmp_path):
    source = shipped_gearbox().write_xml(tmp_path / "a.rexs")
    results = {40: {"torque_around_u_axis": 1.0}, 10: {"rotational_speed": 2.0}}
    write_with_load_cases(tmp_path / "b.rexs", source, [("LC1", results)])
    root = ElementTree.parse(tmp_path / "b.rexs").getroot()
    assert not list(schema_findings(root))
    speed = root.find("load_spectrum/load_case[@id='3']/component[@id='10']/attribute")
    # By hand: 2 rad/s are 60/pi revolutions a minute.
    assert speed.get("unit") == "1 / min"
    assert float(speed.text) == pytest.approx(19.098593171027442, rel=1e-14)
    source = shipped_gearbox().write_json(tmp_path / "a.rexsj")
    write_with_load_cases(tmp_path / "b.rexsj", source, [("LC1", results)])
    spectrum = json.loads((tmp_path / "b.rexsj").read_text())["model"]["load_spectrum"]
    assert spectrum["load_cases"][2]["components"][1]["attributes"] == [
        {"id": "rotational_speed", "unit": "1 / min", "floating_point": float(speed.text)}
    ]


def test_a_file_of_another_program_is_not_replaced(tmp_path):
    source = public_stage().write_xml(tmp_path / "a.rexs")
    other = shipped_gearbox().write_xml(tmp_path / "b.rexs")
    before = other.read_bytes()
    with pytest.raises(FileExistsError, match="not replaced"):
        write_with_load_cases(other, source, [("LC1", RESULTS)])
    assert other.read_bytes() == before
    write_with_load_cases(tmp_path / "c.rexs", source, [("LC1", RESULTS)])
    write_with_load_cases(tmp_path / "c.rexs", source, [("LC1", RESULTS), ("LC2", RESULTS)])
    assert len(read_rexs(tmp_path / "c.rexs").load_cases) == 2

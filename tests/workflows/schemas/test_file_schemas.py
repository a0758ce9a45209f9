"""Schemas of TOML and JSON files: shipped and written files fulfil them, every key has words."""

import tomllib
from typing import Annotated, NotRequired, TypedDict, get_args

import jsonschema
import numpy as np
import pytest

from carrierflex.files.json_files import plain
from carrierflex.files.result_schemas import result_schema
from carrierflex.geometry.cad_surface_files import write_cad_statements
from carrierflex.geometry.parameters import CarrierParameters, PinParameters
from carrierflex.identification.campaign.campaign_files import campaign_document
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows.identification import read_printed_tables
from carrierflex.workflows.outputs import schema_file
from carrierflex.workflows.schemas.file_schemas import FILE_KINDS, file_schema, schema_text
from carrierflex.workflows.schemas.show_schema import Name
from tests.identification.campaign.test_campaign_files import element_campaign, mounting_campaign
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.workflows.checked_documents import checked_document

SHIPPED = {
    "carrier_lc1_to_lc4": "carrier case",
    "mounting_2011": "mounting case",
    "stage_load_sharing": "stage case",
    "stage_papers_gap": "stage case",
    **{
        f"stage_{group}lc{number}": "stage case"
        for group in ("", "paper_", "table4_")
        for number in (1, 2, 3, 4)
    },
}
#: The schema of what --json prints asks every workflow for its result.
KINDS = [
    pytest.param(kind, marks=[pytest.mark.long] if kind == "result" else []) for kind in FILE_KINDS
]


def checked(document, kind):
    """Errors of a document under the schema of its kind."""
    validator = jsonschema.Draft202012Validator(file_schema(kind))
    return [error.message for error in validator.iter_errors(document)]


def tables(schema):
    """Every table of a schema, but those of the schemas that it holds as a whole."""
    result = (schema, *schema.get("$defs", {}).values())
    return [table for table in result if "properties" in table and "$id" not in table]


def test_every_shipped_case_is_known_here():
    folder = shipped_case().parent
    assert {path.stem for path in folder.glob("*.toml")} == set(SHIPPED)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_case_fulfils_its_schema(name):
    document = tomllib.loads(shipped_case(name).read_text(encoding="utf-8"))
    assert checked(document, SHIPPED[name]) == []


@pytest.mark.parametrize(
    "campaign",
    [
        carrier_campaign(),
        mounting_campaign(),
        element_campaign("V", periodic=True, period_samples=4),
    ],
)
def test_written_campaigns_fulfil_the_schema(campaign):
    assert checked(campaign_document(campaign), "campaign") == []


def test_a_written_surfaces_file_fulfils_the_schema(tmp_path):
    write_cad_statements(tmp_path / "surfaces.toml", CarrierParameters(), PinParameters())
    document = tomllib.loads((tmp_path / "surfaces.toml").read_text(encoding="utf-8"))
    assert checked(document, "cad surfaces") == []


@pytest.mark.parametrize(
    ("kind", "document"),
    [
        ("carrier parameters", {"carrier": {"outer_radios": 0.4}}),
        ("carrier parameters", {"pin": {"diameter": -1}}),
        ("cad surfaces", {"format": "carrierflex-surfaces", "version": 1, "surfaces": {}}),
        ("stage case", {"format": "carrierflex-case"}),
    ],
)
def test_what_is_wrong_with_one_key_breaks_the_schema(kind, document):
    assert checked(document, kind)


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_of_a_schema_is_described_and_other_keys_are_refused(kind):
    schema = file_schema(kind)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert tables(schema) or kind == "salts"
    for table in tables(schema):
        assert table["additionalProperties"] is False
        for name, entry in table["properties"].items():
            # Words that are also those of the table below stand there alone.
            below = schema.get("$defs", {}).get(entry.get("$ref", "").rpartition("/")[2], {})
            assert {**below, **entry}["description"].endswith("."), (kind, name)


def test_lengths_carry_their_unit_and_defaults_are_those_of_the_classes():
    carrier = file_schema("carrier parameters")["$defs"]["CarrierParameters"]["properties"]
    assert "unit" not in carrier.pop("n_planets")
    assert {entry["unit"] for entry in carrier.values()} == {"m"}
    assert carrier["outer_radius"]["default"] == CarrierParameters().outer_radius


def test_an_unknown_kind_of_file_names_those_there_are():
    with pytest.raises(
        ValueError,
        match="'gear case'; expected one of carrier parameters, cad surfaces",
    ):
        file_schema("gear case")


@pytest.mark.parametrize("kind", KINDS)
def test_the_schema_that_comes_along_is_that_of_the_definition(kind):
    # tools/write_schemas.py writes it anew.
    assert schema_file(kind).read_text(encoding="utf-8") == schema_text(kind)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_case_names_its_schema_to_editors(name):
    case = shipped_case(name).resolve()
    first = case.read_text(encoding="utf-8").splitlines()[0]
    named = case.parent / first.removeprefix("#:schema ")
    assert first.startswith("#:schema ")
    assert named.resolve() == schema_file(SHIPPED[name])


def test_every_schema_is_shown_by_its_name():
    assert set(get_args(Name)) == {kind.replace(" ", "-") for kind in FILE_KINDS}


class Measured(TypedDict):
    """A document of every type of value."""

    count: Annotated[int, "Count"]
    size: Annotated[float, "Size [m]"]
    values: Annotated[np.ndarray, "Values"]
    pair: Annotated[tuple[float, float] | None, "Pair"]
    note: NotRequired[Annotated[str, "Note"]]


WRITTEN = {"count": 1, "size": np.inf, "values": np.zeros(2), "pair": (1.0, 2.0)}


@pytest.mark.parametrize(
    ("change", "refusal"),
    [
        ({}, ""),
        ({"note": "n", "pair": None}, ""),
        ({"count": 1.5}, "1.5 is not of type 'integer'"),
        ({"size": "2"}, "'2' is not of type 'number', 'null'"),
        ({"pair": (1.0,)}, "[1.0] is not valid under any of the given schemas"),
        ({"sise": 2.0}, "Additional properties are not allowed ('sise' was unexpected)"),
        ({"values": None}, "None is not of type 'array'"),
    ],
)
def test_a_written_document_with_another_key_or_type_is_refused(change, refusal):
    validator = jsonschema.Draft202012Validator(result_schema(Measured))
    result = [error.message for error in validator.iter_errors(plain(WRITTEN | change))]
    assert result == ([refusal] if refusal else [])


def test_a_document_that_lacks_a_key_is_refused():
    validator = jsonschema.Draft202012Validator(result_schema(Measured))
    lacking = {name: value for name, value in plain(WRITTEN).items() if name != "size"}
    assert [error.message for error in validator.iter_errors(lacking)] == [
        "'size' is a required property"
    ]


def test_the_printed_tables_fulfil_their_schema(tmp_path):
    read_printed_tables.main(out=tmp_path)
    assert checked_document(tmp_path / "printed_tables.json")["facts"]["phi_PLC"]

"""Schemas of the TOML files: shipped and written files fulfil them, and every key is described."""

import tomllib

import jsonschema
import pytest

from carrierflex.geometry.cad_surface_files import write_cad_statements
from carrierflex.geometry.parameters import CarrierParameters, PinParameters
from carrierflex.identification.campaign.campaign_document import campaign_document
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows.support.file_schemas import (
    FILE_KINDS,
    file_schema,
    schema_file,
    schema_text,
)
from tests.identification.campaign.test_campaign_files import element_campaign, mounting_campaign
from tests.identification.synthetic_campaigns import carrier_campaign

SHIPPED = {
    "carrier_lc1_to_lc4": "carrier case",
    "mounting_2011": "mounting case",
    "stage_order_one": "stage case",
    **{
        f"stage_{group}lc{number}": "stage case"
        for group in ("", "paper_", "table4_")
        for number in (1, 2, 3, 4)
    },
}


def checked(document, kind):
    """Errors of a document under the schema of its kind."""
    validator = jsonschema.Draft202012Validator(file_schema(kind))
    return [error.message for error in validator.iter_errors(document)]


def tables(schema):
    """Every table of a schema."""
    return [table for table in (schema, *schema.get("$defs", {}).values()) if "properties" in table]


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


@pytest.mark.parametrize("kind", FILE_KINDS)
def test_every_key_of_a_schema_is_described_and_other_keys_are_refused(kind):
    schema = file_schema(kind)
    jsonschema.Draft202012Validator.check_schema(schema)
    for table in tables(schema):
        assert table["additionalProperties"] is False
        for name, entry in table["properties"].items():
            # Words that are also those of the table below stand there alone.
            below = schema["$defs"].get(entry.get("$ref", "").rpartition("/")[2], {})
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


@pytest.mark.parametrize("kind", FILE_KINDS)
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

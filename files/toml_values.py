"""What the keys of a TOML file may hold: types that check a value and carry the words of a refusal.

Built on pydantic, which takes longer to load than all else that reads TOML. Modules that state
tables (``*_tables.py``) are therefore imported inside the functions that read, never at the top of
a module that the command line loads for every command.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    create_model,
)
from pydantic import GetJsonSchemaHandler as JsonHandler
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import CoreSchema, core_schema, to_jsonable_python

from carrierflex.files.problems import refuse, repeated_names


class TomlTable(BaseModel):
    """A table whose keys are the fields of its class; other keys are refused."""

    # Built when a document is checked: of several kinds in a module, one is.
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

    def given(self) -> dict[str, Any]:
        """Values of the keys that the file gives, by name."""
        names = [name for name in type(self).model_fields if name in self.model_fields_set]
        return {name: getattr(self, name) for name in names}


class FileSchema(GenerateJsonSchema):
    """JSON Schema of a file: TOML has no null; a key without default may be left out."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        """Schema of the value itself."""
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        """Schema with its default, where there is one."""
        if schema.get("default", ...) is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def encode_default(self, dft: Any) -> Any:
        """Default as JSON: all are plain, no adapter of their type is made for each."""
        return to_jsonable_python(dft)

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Leave out titles that only repeat the key."""
        return False


@cache
def json_schema(table: type[TomlTable]) -> Mapping[str, Any]:
    """JSON Schema of a file whose top table is `table`, with descriptions and units."""
    return table.model_json_schema(schema_generator=FileSchema)


@dataclass(frozen=True)
class Expected:
    """What a value may be, in words: they stand for every other message about the value.

    Parameters
    ----------
    words : str
        For the message ``key 'x' is ...; expected <words>``.
    """

    words: str

    def __get_pydantic_core_schema__(
        self,
        source: Any,
        handler: GetCoreSchemaHandler,
    ) -> CoreSchema:
        """Check as the annotated type does, with one message."""
        return core_schema.custom_error_schema(
            handler(source),
            custom_error_type="expected",
            custom_error_message=self.words,
        )

    def __get_pydantic_json_schema__(
        self,
        schema: CoreSchema,
        handler: JsonHandler,
    ) -> dict[str, Any]:
        """Schema of the annotated type with the words."""
        return {**handler(schema), "expected": self.words}


def key(
    words: str,
    unit: str = "",
    *,
    expected: str = "",
    since: int = 1,
    newer_values: Mapping[str, int] | None = None,
    **options: Any,
) -> Any:
    """Key of a table.

    Parameters
    ----------
    words : str
        What the key states.
    unit : str, optional
        Unit of its value.
    expected : str, optional
        What a refusal says where the key is missing. Types of this module, tables and lists of
        tables say it themselves.
    since : int
        Version of the file's format that brought the key.
    newer_values : mapping of str to int, optional
        Versions that brought some of its values.
    **options
        ``default`` or ``default_factory`` of a key that may be left out.
    """
    described = f"{words} [{unit}]." if unit else f"{words}."
    annotations = {
        "unit": unit,
        "expected": expected,
        "since": since if since > 1 else None,
        "newer_values": newer_values,
    }
    extra: dict[str, Any] = {name: value for name, value in annotations.items() if value}
    return Field(description=described, json_schema_extra=extra or None, **options)


@dataclass(frozen=True, eq=False)
class Key:
    """Key of a table that is stated as data: type of its value, what it states, unit."""

    value: Any
    words: str
    unit: str = ""


@dataclass(frozen=True, eq=False)
class FieldsOf:
    """Table whose keys are fields of the annotated dataclass, which the checked values make.

    Names and defaults are those of the dataclass, so neither can differ from it.

    Parameters
    ----------
    keys : mapping of str to Key
        Types, words and units of the keys.
    without : tuple of str
        Fields of the dataclass that a file cannot give.
    """

    keys: Mapping[str, Key]
    without: tuple[str, ...] = ()

    def __get_pydantic_core_schema__(
        self,
        source: Any,
        handler: GetCoreSchemaHandler,
    ) -> CoreSchema:
        """Check the table, then make the dataclass of the keys it gives."""
        names = {field.name for field in fields(source)} - set(self.without)
        if names != set(self.keys):
            raise TypeError(
                f"{source.__name__}: fields and keys differ by {sorted(names ^ set(self.keys))}",
            )
        table = table_of(
            source.__name__,
            self.keys,
            defaults={name: getattr(source, name) for name in names},
        )
        return core_schema.no_info_after_validator_function(
            lambda values: source(**values.given()),
            handler.generate_schema(table),
        )


@dataclass(frozen=True, eq=False)
class KeysOf:
    """Table of the annotated kind whose keys are stated as data.

    Parameters
    ----------
    keys : mapping of str to Key
        Types, words and units of the keys.
    required : bool
        Whether a file must give them all; otherwise those left out are None.
    """

    keys: Mapping[str, Key]
    required: bool = True

    def __get_pydantic_core_schema__(
        self,
        source: Any,
        handler: GetCoreSchemaHandler,
    ) -> CoreSchema:
        """Check the table of these keys."""
        defaults = None if self.required else dict.fromkeys(self.keys)
        return handler.generate_schema(table_of(source.__name__, self.keys, defaults=defaults))


def table_of(
    name: str,
    keys: Mapping[str, Key],
    *,
    defaults: Mapping[str, Any] | None = None,
) -> type[TomlTable]:
    """Class of a table whose keys are stated as data.

    Parameters
    ----------
    name : str
        Name of the table's class.
    keys : mapping of str to Key
        Its keys.
    defaults : mapping, optional
        Defaults of those that may be left out.
    """
    definitions: dict[str, Any] = {}
    for known, entry in keys.items():
        options = {"default": defaults[known]} if defaults else {}
        definitions[known] = (entry.value, key(entry.words, entry.unit, **options))
    return create_model(name, __base__=TomlTable, **definitions)


def different(what: str, key_name: str = "name") -> AfterValidator:
    """Check of a list of tables: the values of one key differ; `what` says whose names they are."""

    def checked(tables: Any) -> Any:
        refuse(repeated_names([getattr(table, key_name) for table in tables], what))
        return tables

    return AfterValidator(checked)


def _whole_number(value: Any) -> Any:
    """Whole number of a float that is one, as ``99.0``; anything else as it is."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


_Finite = Annotated[float, Field(allow_inf_nan=False)]
#: TOML has lists only; a list of fixed length becomes a tuple.
_Fixed = Field(strict=False)

#: Control characters and line ends: in a terminal, a deck or a figure they do something else.
_CONTROL = r"\x00-\x1f\x7f-\x9f" + "\u2028\u2029"
Text = Annotated[
    str,
    Field(pattern=rf"^[^{_CONTROL}]*[^\s{_CONTROL}][^{_CONTROL}]*$", max_length=500),
    Expected("a non-empty string on one line"),
]
#: Becomes the name of a file.
FileStem = Annotated[
    str,
    Field(pattern=rf"^[^\s./\\{_CONTROL}][^/\\{_CONTROL}]*$", max_length=100),
    Expected("a name that a file can have: on one line, not hidden, without slashes"),
]
Texts = Annotated[list[Text], Expected("a list of strings")]
Flag = Annotated[bool, Expected("true or false")]
Number = Annotated[_Finite, Expected("a finite number")]
Positive = Annotated[_Finite, Field(gt=0), Expected("a positive number")]
NotNegative = Annotated[_Finite, Field(ge=0), Expected("a number >= 0")]
Count = Annotated[int, Field(ge=0), Expected("a whole number >= 0")]
PositiveCount = Annotated[int, Field(ge=1), Expected("a whole number >= 1")]
#: Also as ``99.0``, for keys that took any number before they were counted.
Teeth = Annotated[int, Field(ge=1), BeforeValidator(_whole_number), Expected("a whole number >= 1")]
Harmonics = Annotated[
    int, Field(ge=0), BeforeValidator(_whole_number), Expected("a whole number >= 0")
]
TwoNumbers = Annotated[tuple[_Finite, _Finite], _Fixed, Expected("two finite numbers")]
ThreeNumbers = Annotated[tuple[_Finite, _Finite, _Finite], _Fixed, Expected("three finite numbers")]
FourNumbers = Annotated[
    tuple[_Finite, _Finite, _Finite, _Finite],
    _Fixed,
    Expected("four finite numbers"),
]
_Greater = Annotated[_Finite, Field(gt=0)]
_EachPlanet = Field(min_length=3, max_length=8)
#: One a planet.
PlanetNumbers = Annotated[
    tuple[_Finite, ...], _Fixed, _EachPlanet, Expected("finite numbers, one a planet (3 to 8)")
]
PlanetPositive = Annotated[
    tuple[_Greater, ...], _Fixed, _EachPlanet, Expected("positive numbers, one a planet (3 to 8)")
]
#: Of a planetary stage.
Planets = Annotated[int, Field(ge=3, le=8), Expected("a whole number from 3 to 8")]
ThreePositive = Annotated[
    tuple[_Greater, _Greater, _Greater],
    _Fixed,
    Expected("three positive numbers"),
]

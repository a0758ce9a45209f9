"""The kinds of files of simulations, told apart before anything else of them is read."""

from carrierflex.files.toml_files import TomlKind

#: Case files of every kind are written by hand.
MOST_CASE_BYTES = 1_000_000
CARRIER_CASE = TomlKind("a case file", most_bytes=MOST_CASE_BYTES, format="carrierflex-case")
MOUNTING_CASE = TomlKind(
    "a case file of kind mounting",
    most_bytes=MOST_CASE_BYTES,
    format="carrierflex-case",
)
#: First line of a stage case.
STAGE_FORMAT = "carrierflex-stage-case"
STAGE_CASE = TomlKind("a case file of the stage", most_bytes=MOST_CASE_BYTES, format=STAGE_FORMAT)
LAW_FILE = TomlKind(
    "a law file",
    holds="keys name, kind, effect_class, the table [units] and tables [[part]] with type and "
    "acts_on",
    most_bytes=5_000_000,
    format="carrierflex-law",
    version=3,
)

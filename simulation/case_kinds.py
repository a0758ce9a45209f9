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
    holds="keys name, effect_class, force_unit, deflection_unit and the table [table]",
    most_bytes=1_000_000,
    format="carrierflex-law",
)
MEMORY_LAW_FILE = TomlKind(
    "a law file with a memory",
    holds="keys name, effect_class, force_unit, deflection_unit, visited and tables [[stop]], "
    "[[loop]] or [[branch]]",
    most_bytes=1_000_000,
    format="carrierflex-memory-law",
    version=2,
)
SURFACE_LAW_FILE = TomlKind(
    "a law file of a surface",
    holds="keys name, force_unit, deflection_unit, the table [table] with x, v, y and tables "
    "[[stop]]",
    most_bytes=1_000_000,
    format="carrierflex-surface-law",
)
BUSHING_LAW_FILE = TomlKind(
    "a law file of bushings",
    holds="keys name, effect_class and tables [[part]] with acts, bushing, x, y",
    most_bytes=1_000_000,
    format="carrierflex-bushing-law",
)
BUSHING_MEMORY_LAW_FILE = TomlKind(
    "a law file of bushings with a memory",
    holds="keys name, effect_class, visited and tables [[stop]] or [[branch]]",
    most_bytes=1_000_000,
    format="carrierflex-bushing-memory-law",
)
CARRIER_LAW_FILE = TomlKind(
    "a law file of a carrier",
    holds="keys name, frame, pattern, n_planets, sensor_radius, the table [visited] and tables "
    "[[part]] with follows, x and [[part.wave]]",
    most_bytes=1_000_000,
    format="carrierflex-carrier-law",
)

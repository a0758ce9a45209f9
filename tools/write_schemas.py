"""Write the schemas and names that come with the package anew, after a change of what files hold.

Run it with ``.venv/bin/python -P tools/write_schemas.py``.
"""

from carrierflex.identification.campaign.effect_names import effect_names_text
from carrierflex.identification.campaign.file_names import EFFECT_NAMES


def main() -> None:
    """Names of effects first: the schema of a campaign lists them, as they stand in their file."""
    EFFECT_NAMES.write_text(effect_names_text(), encoding="utf-8")
    from carrierflex.workflows.outputs import schema_file
    from carrierflex.workflows.schemas.file_schemas import FILE_KINDS, schema_text

    for kind in FILE_KINDS:
        schema_file(kind).write_text(schema_text(kind), encoding="utf-8")


if __name__ == "__main__":
    main()

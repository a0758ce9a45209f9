"""Write the schemas that come with the package anew, after a change of what a file holds.

Run it with ``.venv/bin/python -P tools/write_schemas.py``.
"""

from carrierflex.workflows.support.file_schemas import FILE_KINDS, schema_file, schema_text

for kind in FILE_KINDS:
    schema_file(kind).write_text(schema_text(kind), encoding="utf-8")

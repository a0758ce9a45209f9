"""Converters of single public records: ``python -m examples.NAME FOLDER --out CAMPAIGN``.

They run from the repository (docs/validation.md), are not installed, and no package imports
them.
"""

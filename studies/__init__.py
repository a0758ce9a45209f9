"""Studies run by hand from the repository: ``python -m studies.NAME --help``.

A study has a function ``main`` and writes a table over many campaigns, or data of the package. It
is not installed, and no package imports it.
"""

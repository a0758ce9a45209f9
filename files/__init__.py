"""Files of any package: written whole or not at all, TOML files read and checked.

Leftmost of the chain, since every package right of it reads or writes files. It knows no planet
carrier: each package states what its own files hold in modules ``*_tables.py``, imported where a
file is read (:mod:`carrierflex.files.toml_values` says why).
"""

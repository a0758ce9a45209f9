"""One script per engineering question, and the ``carrierflex`` command that offers them.

Workflows read as stories and hold no algorithm: they call the packages, write files into an
explicit ``--out`` and return a frozen result. Files are written to a temporary name and renamed, so
that an interrupted run leaves whole files.
"""

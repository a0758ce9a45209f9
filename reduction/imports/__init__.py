"""Reduced bodies of other programs, read as bodies of this one.

What a format does not hold is not invented: every reader returns, beside the body, one line for
each thing that the file has and the body has not, or the reverse.
"""

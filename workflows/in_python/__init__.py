"""The chain in Python: what ``import carrierflex as cf`` offers, a file a result.

Every function returns a frozen result that writes nothing unless it is asked to.
"""

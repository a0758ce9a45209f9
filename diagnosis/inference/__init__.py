"""Which effects the records support.

Fits of sets of laws, held-out scores, selection, intervals, gap reduction; knows no kind.
"""

"""Which effects the records support.

Screening, selection, alias classes, gap reduction, verdict; knows no kind.
"""

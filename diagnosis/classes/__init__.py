"""Classes of a missing effect: models without a fixed form, compared on held-out records.

Knows no kind: a kind gives a :class:`~carrierflex.diagnosis.classes.gram_table.GramTable`, and gets
a :class:`~carrierflex.diagnosis.classes.results.ClassAnswer`.
"""

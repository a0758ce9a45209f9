"""The blind check: campaigns whose missing effect is sealed, the diagnosis of each, and the score once all are in.

Three parts that share nothing but :mod:`carrierflex.blind_check.labels`, :mod:`carrierflex.blind_check.case_plans`,
:mod:`carrierflex.blind_check.truth.alias_table` and one function::

    carrierflex.blind_check.truth.campaigns.write_case(plan: CasePlan, folder: Path, *, repeat: int = 0) -> Label

Truth (``truth.py``, ``*_truth.py``, ``*_laws.py`` and what they import)
    Writes campaigns. Own equations and own integrator; imports the types and files of a campaign
    from :mod:`carrierflex.identification` and nothing of what fits (:mod:`carrierflex.simulation`,
    :mod:`carrierflex.diagnosis`, the models of :mod:`carrierflex.identification`). A test reads the
    imports.
Seals
    SHA-256 of every label and a random salt, published before the first diagnosis and verified at
    the opening.
Score
    Reads diagnosis.json by its contract and the labels.

Every random number follows from the seed, the kind and the number of a case.
"""

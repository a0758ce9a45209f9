"""What a campaign could see and part before it is measured, and what to add to it.

Nothing here knows a kind: a kind brings the products of its signatures, run by run and channel by
channel (:class:`carrierflex.diagnosis.inference.planning.plan.PlannedTable`).
"""

"""Causes that a campaign can detect and separate before it is measured, and what to add.

Nothing here knows a kind: a kind brings the products of its signatures, run by run and channel by
channel (:class:`carrierflex.diagnosis.inference.planning.plan.PlannedTable`).
"""

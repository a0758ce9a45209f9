"""The effects at the carrier's rim, each one object, listed in ``library``.

A new effect is an :class:`carrierflex.simulation.carrier.effect.Effect` in the file of its family.
"""

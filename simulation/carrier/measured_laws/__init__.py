"""Measured laws of a carrier: patterns at the rim whose amplitudes follow the loads as tables."""

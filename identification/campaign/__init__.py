"""Measurement campaigns.

What they hold, how they are read and written, and signals made ready for a fit.
"""

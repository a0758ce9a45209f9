"""Measured laws of the bushings as tables, which act in the plane of each bushing."""

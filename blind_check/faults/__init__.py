"""Faults of a measuring chain, put into campaigns without one, to see which are noticed."""

"""Errors of wiring, sign and clock as rivals of what the library names."""

"""Errors of sign and clock of an element's records."""

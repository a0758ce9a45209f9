"""Whole files or none: what every package needs to read and write safely; it knows no mechanics."""

"""Seals of labels, and the order in which cases are written, diagnosed and opened."""

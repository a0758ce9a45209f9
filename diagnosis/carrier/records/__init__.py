"""Columns of the carrier's signals by run and sensor, and the sums over all records."""

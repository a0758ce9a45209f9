"""Measured shapes of classes: what every kind makes of them alike."""

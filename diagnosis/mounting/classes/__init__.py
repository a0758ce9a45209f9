"""Classes of missing effect of a mounting: bushings, housing, loads, sensors, clock."""

"""Two diagnoses of one measurement, before and after the simulator changed."""

"""Truth and scoring: repeats what is published of the diagnosis. No shipped package imports it."""

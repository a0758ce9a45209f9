"""The motion of a run in force space: how well it is known, and the samples that count."""

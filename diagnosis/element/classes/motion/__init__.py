"""The motion of a run in force space: what is known of it, and how its memories begin."""

"""Motion of one element under a force: compiled laws and time integration."""

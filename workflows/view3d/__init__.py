"""Bodies, curves and rims that one can turn: a scene of each, and the page that shows it."""

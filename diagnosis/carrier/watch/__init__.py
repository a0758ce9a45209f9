"""Watch of a running turbine: a sequential test of every revolution, and the class of a change."""

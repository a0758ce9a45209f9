"""Factors from SI to the units of the printed tables."""

#: Micrometres in a metre: deflections are printed in um.
MICROMETRES = 1e6

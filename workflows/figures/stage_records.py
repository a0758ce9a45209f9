"""Load cases LC1 to LC4 of the 2012 paper: records, identified motion, and LC2 simulated.

The records stand for the measurement. They come from the stage in time with a kink in the joint of
shaft and carrier, bearing clearances and soft bearings (``stage_order_one.toml``), read by sensors
with errors; no equation of the identified models went into them. The simulation is another stage,
the paper's own model (``stage_paper_lc2.toml``), with the tilt that was identified imposed.
"""

#: Load case that the papers show in time.
SHOWN = "LC2"

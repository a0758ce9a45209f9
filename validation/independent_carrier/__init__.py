"""A planet carrier by CalculiX: wedges stacked along the axis, nothing shared with the chain."""

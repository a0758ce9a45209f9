"""Truth of the kind "element"."""

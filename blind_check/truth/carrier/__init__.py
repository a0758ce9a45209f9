"""Truth of the kind "carrier"."""

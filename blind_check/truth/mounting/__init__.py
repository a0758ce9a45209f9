"""Truth of the kind "mounting"."""

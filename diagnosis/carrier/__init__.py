"""The kind "carrier": rim sensors of a planet carrier as a comparison problem."""

"""Commands for a fleet: many campaigns diagnosed alike, and what they say together."""

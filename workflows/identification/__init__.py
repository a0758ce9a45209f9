"""Questions about parameters: motion of the carrier, bushings, printed tables."""

"""Questions about deflection: curves, couplings, pin fit, mesh size."""

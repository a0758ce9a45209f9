"""The kind "mounting": the gearbox housing on two bushings as a comparison problem."""

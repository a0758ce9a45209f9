"""Bushings of the gearbox mounting identified from measured load histories (2011 paper)."""

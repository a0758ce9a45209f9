"""Meshes of other programs: read with their groups, linear tetrahedra made quadratic."""

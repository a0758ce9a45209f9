"""Questions about the carrier's shape: meshes and CAD."""

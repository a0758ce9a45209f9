"""Plain methods that answer the same sealed campaigns, to set a diagnosis beside."""

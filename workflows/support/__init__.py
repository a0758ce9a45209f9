"""What several workflows share: output folders, progress, processes, cached results, named bodies."""

"""What several workflows share.

Output folders, progress, processes, cached results, named bodies.
"""

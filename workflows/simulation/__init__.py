"""Questions about motion in time: load cases, mounting, stage, the paper's tables."""

"""The carrier's motion and deflection turned into rim sensor signals."""

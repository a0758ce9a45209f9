"""Estimation that knows no machine: least squares, bounded fits, resampling, uncertainty."""

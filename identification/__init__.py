"""Measurement campaigns and the parameters of the carrier's motion identified from them.

Frame, angles and signs: :mod:`carrierflex.geometry`; sensor readings and the conversion of the 2012
paper's equations: :mod:`carrierflex.simulation`. This package owns three more conventions.

Whole revolutions
    Records are trimmed to whole revolutions from their first sample: static terms, tilt (order 1)
    and deflection (orders 3, 6, ...) are then orthogonal to each other. Missing samples (NaN) are
    left out one by one.
Weights
    Every sample of every axial sensor counts the same, so that RMS values compare with table 4 of
    the 2012 paper.
Polar parameters
    A tilt is linear in ``(phi cos theta, phi sin theta)``; published are ``phi >= 0`` and ``theta``
    in (-pi, pi], with errors by the delta method.
"""

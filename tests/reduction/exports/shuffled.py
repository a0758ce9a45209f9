"""A body whose coordinates stand in another order, as a body file may hold them."""

from dataclasses import replace

import numpy as np


def shuffled(model):
    """Same body, its coordinates in an order drawn by lot.

    Modal coordinates keep their order among themselves.
    """
    n, n_pilot = model.n_coordinates, 6 * len(model.pilots)
    order = np.random.default_rng(4).permutation(n)
    order[n_pilot:] = np.sort(order[n_pilot:])
    old = np.argsort(order)
    return replace(
        model,
        K=model.K[np.ix_(old, old)],
        M=model.M[np.ix_(old, old)],
        D=model.D[np.ix_(old, old)],
        labels=tuple(model.labels[i] for i in old),
        pilot_coordinates={name: order[rows] for name, rows in model.pilot_coordinates.items()},
        sensor_rows=model.sensor_rows[:, old],
        ffrf=model.ffrf.transformed(np.eye(n)[:, old]),
    )

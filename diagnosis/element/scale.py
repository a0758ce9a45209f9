"""Sizes of an element from its measured motion.

The scale of every parameter, and where fits start.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.element.linear import linear_element
from carrierflex.diagnosis.element.model import ElementModel, ElementScale
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.signatures import base_columns, known_force


def element_scale(model: ElementModel, records: Sequence[ElementRecord]) -> ElementScale:
    """Sizes of an element from its measured motion, and its baseline.

    From its response where it moves by a force.
    """
    plain = replace(model, contained=())
    rows = [base_columns(plain, record)[:, record.block >= 0] for record in records]
    force = [known_force(model, record)[record.block >= 0] for record in records]
    design, target = np.concatenate(rows, axis=1), np.concatenate(force)
    size = np.linalg.norm(design, axis=1)
    solution = np.linalg.lstsq((design / size[:, None]).T, target, rcond=1e-10)[0] / size
    mass = model.mass if model.mass is not None else max(float(solution[0]), 0.0)
    inertia = 0.0 if model.mass is not None else solution[0] * design[0]
    K1, C1, f0 = (float(value) for value in solution[-3:])
    restoring = target - inertia
    if model.by_force:
        mass, K1, C1, f0 = linear_element(records, (mass, K1, C1, f0), mass=model.mass)
    return ElementScale(
        force=float(restoring.std()) or float(target.std()),
        deflection=float(design[-3].std()),
        speed=float(np.sqrt(np.mean(design[-2] ** 2))),
        m=mass,
        K1=max(K1, 0.0),
        C1=max(C1, 0.0),
        f0=f0,
    )

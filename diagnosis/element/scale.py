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
from carrierflex.identification.campaign.signals import pass_gain
from carrierflex.identification.estimation.scaled_least_squares import design_solution

#: Frequencies at which the gain of noise is averaged.
_FREQUENCIES = 4097


def carried_noise(model: ElementModel, record: ElementRecord) -> float:
    """Variance in the channel of the white noise of the measured force or deflection.

    Through the linear baseline, whose dynamic stiffness is ``D = K1 - w² m + j w C1``: ``sigma²
    mean |1/D|²`` under a force, ``sigma² mean |D|²`` over the usable band under a deflection.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    record : ElementRecord
        Its step, its usable band and the noise of its drive.
    """
    if record.drive_noise == 0.0:
        return 0.0
    frequency = np.linspace(0.0, 0.5 / record.step, _FREQUENCIES)
    w = 2.0 * np.pi * frequency
    scale = model.scale
    D = scale.K1 - w**2 * scale.m + 1j * w * scale.C1
    if model.by_force:
        gain = 1.0 / np.maximum(np.abs(D), np.finfo(float).tiny)
    else:
        gain = np.abs(D) * pass_gain(frequency, record.cutoff_hz)
    return float(record.drive_noise * np.mean(gain**2))


def element_scale(model: ElementModel, records: Sequence[ElementRecord]) -> ElementScale:
    """Sizes of an element from its measured motion, and its baseline.

    From its response where it moves by a force.
    """
    plain = replace(model, contained=())
    rows = [base_columns(plain, record)[:, record.block >= 0] for record in records]
    force = [known_force(model, record)[record.block >= 0] for record in records]
    design, target = np.concatenate(rows, axis=1), np.concatenate(force)
    solution = design_solution(design.T, target)
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

"""The measured law of a mount whose stiffness the simulation has linear.

Command: diagnose, element
"""

import sys
from pathlib import Path

import numpy as np

import carrierflex as cf
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.report.figures import shape_figure
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.workflows.in_python.campaigns import Records

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

rng = np.random.default_rng(0)
time = 0.005 * np.arange(3000)
runs = []
for number, size in enumerate((0.5e-3, 1e-3, 2e-3)):  # m
    waves = [np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 6.3)) for f in (0.4, 1.2, 1.9, 2.7)]
    q = size * np.sum(waves, axis=0)
    force = 8e3 * q + 12.0 * np.gradient(q, time) + 5e8 * q**3 + 0.05 * rng.standard_normal(q.size)
    run = Run(f"R{number}", f"R{number}.csv", f"{size} m", time, {"displacement": q}, {"F": force})
    runs.append(run)
rig = {"drive": "displacement", "settle_samples": 100}
channel = Channel("F", "force", "N", noise_std=0.05)
campaign = Campaign("element", "mount", Baseline("model"), rig, (channel,), tuple(runs))
answer = cf.diagnosed(Records(campaign))
finding = answer.result.classes.classes[0]
shape_figure(finding.shape, plain_name(finding.law)).savefig(picture, dpi=110)

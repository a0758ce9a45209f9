"""A German logger's file, and what the import makes of it.

Command: import, element
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

import carrierflex as cf
from carrierflex.workflows.identification import import_records, new_campaign

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

time = 0.01 * np.arange(2000)
motion = np.sin(3.0 * time) + 0.3 * np.sin(11.0 * time)  # mm
rows = [f"{1e3 * t:.1f};{2.0 * x:.4f};{x:.4f}" for t, x in zip(time, motion, strict=True)]
rows[700:712] = [";".join((*row.split(";")[:2], "OVERLOAD")) for row in rows[700:712]]
text = "\n".join(["Messung;Prüfstand 3", "", "Zeit;Kraft;Weg", "ms;kN;mm", *rows])
with TemporaryDirectory() as folder:
    out = Path(folder)
    (out / "run.csv").write_bytes(text.replace(".", ",").encode("utf-16"))
    files = [out / "run.csv"]
    guess = new_campaign.main(kind="element", from_=files, drive="force", out=out / "map.toml")
    import_records.main(files, map_=guess.path, out=out / "campaign")
    table = cf.measured_campaign(out / "campaign").to_dataframe()
figure = Figure(figsize=(7.2, 3.2), layout="constrained")
axes = figure.subplots()
table[6.0:9.0].iloc[:, -1].mul(1e3).plot(ax=axes, ylabel="displacement [mm]", xlabel="time [s]")
axes.set_title("12 samples of OVERLOAD are a gap, not a value")
figure.savefig(picture, dpi=110)

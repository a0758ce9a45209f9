"""A STEP file's surfaces from the command line: the file, its picture, and what is refused."""

import numpy as np
import pytest
from matplotlib.image import imread
from numpy.testing import assert_allclose

from carrierflex.geometry.cad_export import write_step
from carrierflex.geometry.carrier_interface import carrier_interface
from carrierflex.workflows.geometry import propose_cad_surfaces
from carrierflex.workflows.geometry.carrier_files import CarrierFiles
from carrierflex.workflows.screen.tables import proposal_table


@pytest.fixture(scope="module")
def step(tmp_path_factory, carrier):
    path = tmp_path_factory.mktemp("own") / "own.step"
    write_step(carrier, path)
    return path


def written(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.long
def test_the_proposed_file_is_meshed_as_it_is_and_drawn_beside(step, tmp_path, carrier):
    out = tmp_path / "surfaces.toml"
    proposal = propose_cad_surfaces.main(step, out=out, sensor_radius=0.412)
    assert written(tmp_path) == ["surfaces.png", "surfaces.toml"]
    interface = carrier_interface(CarrierFiles(step, out).mesh("stiff", 0.08))
    assert interface.n_planets == carrier.n_planets
    assert_allclose(interface.sensor_radius, 0.412, atol=1e-6)
    assert_allclose(interface.centre_distance, carrier.centre_distance, atol=1e-6)
    picture = (255 * imread(tmp_path / "surfaces.png")[:, :, :3]).astype(int)
    # Every name is drawn in a colour of its own, beside a grey body on white.
    hues = picture.max(axis=2) - picture.min(axis=2) > 60
    names = np.unique(picture[hues] // 32, axis=0, return_counts=True)[1]
    assert (names > 500).sum() >= 6
    lines = [str(line) for line in proposal_table(proposal).renderables]
    assert any(
        line.startswith("unit millimetre, as declared: 0.53 x 0.87 x 0.87") for line in lines
    )
    assert sum(line.startswith("pin_") for line in lines) == 6


WRONG = [
    ({"out": "surfaces.txt"}, r"--out is .*surfaces.txt; expected the name of a surfaces file"),
    ({"out": "stands.toml"}, r"stands.toml: exists already, and may be edited; expected"),
    ({"axis": (0.0, 0.0, 0.0)}, r"--axis is \[0.0, 0.0, 0.0\]; expected a direction"),
    ({"origin": (0.0, float("nan"), 0.0)}, r"--origin is .*nan.*; expected three finite"),
    ({"sensor_radius": -1.0}, r"--sensor-radius is -1.0 m; expected a positive length"),
    ({"bearing_width": 0.0}, r"--bearing-width is 0.0 m; expected a positive length"),
    ({"step": "absent.step"}, r"absent.step: no such file"),
    ({"step": "text.step"}, r"text.step: not a STEP file; expected one that begins with"),
]


@pytest.mark.parametrize(("wrong", "message"), WRONG)
def test_wrong_input_is_refused_in_one_line_and_nothing_is_written(wrong, message, step, tmp_path):
    (tmp_path / "stands.toml").write_text("mine")
    (tmp_path / "text.step").write_text("solid of no kind\n")
    before = written(tmp_path)
    arguments = {"step": step, "out": tmp_path / "surfaces.toml"}
    paths = {key: tmp_path / name for key, name in wrong.items() if isinstance(name, str)}
    with pytest.raises((ValueError, OSError), match=message) as refusal:
        propose_cad_surfaces.main(**{**arguments, **wrong, **paths})
    assert "\n" not in str(refusal.value)
    assert written(tmp_path) == before
    assert (tmp_path / "stands.toml").read_text() == "mine"

"""The command `carrierflex view`: what it takes, what it refuses, what it leaves out."""

import sys

import numpy as np
import pytest

from carrierflex.fe.curve_files import write_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.reduction.body_files import read_body, write_body
from carrierflex.workflows.view3d import view

ANGLE = np.deg2rad(np.arange(360.0))


@pytest.fixture
def curves(tmp_path):
    (tmp_path / "curves").mkdir()
    path = tmp_path / "curves" / "deflection_curves.csv"
    shapes = {"delta_s": 6, "delta_f": 3, "g_s": 1, "g_f": 2}
    write_curves(
        path,
        {
            name: DeflectionCurve(name, 0.412, 1.0, 1e-7 * np.cos(order * ANGLE), 0.0 * ANGLE)
            for name, order in shapes.items()
        },
    )
    return path


def refused(command, *arguments):
    ended = command("view", *arguments)
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    return ended.stderr


def test_a_body_without_shapes_is_refused_and_the_option_named(command, tmp_path, pin_reduction):
    write_body(pin_reduction.model, tmp_path / "pin.h5")
    line = refused(command, "pin.h5", "--html")
    assert "pin.h5: the body file holds no shapes" in line
    assert "carrierflex reduce --shapes" in line
    assert not list(tmp_path.glob("*.html"))


def test_what_is_none_of_these_is_refused(command, tmp_path, curves):
    (tmp_path / "notes.txt").write_text("notes")
    assert "suffix '.txt'; expected a body (.h5)" in refused(command, "notes.txt", "--html")
    assert "holds neither rim_motion.json nor" in refused(command, ".", "--html")
    assert "suffix '.png'; expected .html" in refused(command, "curves", "--out", "page.png")
    assert "Unknown option: --no-html" in refused(command, "curves", "--no-html")
    assert "none.csv: no such file or folder" in refused(command, "none.csv", "--html")


def test_without_k3d_the_extra_is_named(command, curves, monkeypatch):
    monkeypatch.setitem(sys.modules, "k3d", None)
    line = refused(command, "curves", "--html", "--quiet")
    assert 'expected: pip install "carrierflex[view]"' in line
    assert not (curves.parent / "view.html").exists()


def test_a_folder_of_curves_gives_one_page_that_says_what_is_in_it(command, curves):
    pytest.importorskip("k3d")
    ended = command("view", "curves", "--html")
    assert ended.returncode == 0, ended.stderr
    page = (curves.parent / "view.html").read_text(encoding="utf-8")
    assert f"{len(page.encode()) / 1e6:.1f} MB" in ended.stdout
    assert all(name in ended.stdout for name in ("delta_s", "delta_f", "g_s", "g_f"))
    assert len(page) < 2_000_000
    assert page.count("<title>deflection curves, curves</title>") == 1


def test_a_page_of_others_is_not_replaced_and_one_of_this_program_is(command, tmp_path, curves):
    pytest.importorskip("k3d")
    (tmp_path / "page.html").write_text("<title>notes of a colleague</title>")
    assert "page.html: is there already" in refused(
        command, "curves", "--quiet", "--out", "page.html"
    )
    (tmp_path / "page.html").unlink()
    for _ in range(2):
        ended = command("view", "curves", "--quiet", "--out", "page.html")
        assert ended.returncode == 0, ended.stderr


def test_entries_that_find_no_room_are_left_out_and_told(command, curves, monkeypatch):
    pytest.importorskip("k3d")
    complete = command("view", "curves", "--quiet", "--out", "whole.html")
    assert complete.returncode == 0, complete.stderr
    size = len((curves.parents[1] / "whole.html").read_text(encoding="utf-8"))
    monkeypatch.setattr(view, "MOST_BYTES", size - 5000)
    ended = command("view", "curves", "--out", "less.html")
    assert ended.returncode == 0, ended.stderr
    assert "1 more found no room" in ended.stdout
    monkeypatch.setattr(view, "MOST_BYTES", 1000)
    assert "the page would have" in refused(command, "curves", "--quiet", "--out", "none.html")


def test_a_name_from_a_file_cannot_become_markup(command, tmp_path, curves):
    pytest.importorskip("k3d")
    curves.parent.rename(tmp_path / "<script>alert(1)<")
    ended = command("view", tmp_path / "<script>alert(1)<", "--quiet", "--out", "page.html")
    assert ended.returncode == 0, ended.stderr
    assert "<script>alert" not in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_shapes_need_a_mesh(command):
    matrices = ("--stiffness", "k.mtx", "--mass", "m.mtx", "--interfaces", "i.toml")
    ended = command("reduce", *matrices, "--shapes", "--out", "c.h5")
    assert "--shapes is given together with --stiffness" in ended.stderr


@pytest.mark.long
def test_a_pin_is_reduced_with_shapes_and_seen(command, tmp_path):
    pytest.importorskip("k3d")
    options = ("--body", "pin", "--size", "0.03", "--modes", "4", "--coupling", "rbe2")
    ended = command("reduce", *options, "--shapes", "--quiet", "--no-cache", "--out", "pin.h5")
    assert ended.returncode == 0, ended.stderr
    assert read_body(tmp_path / "pin.h5").name == "pin"
    ended = command("view", "pin.h5", "--html")
    assert ended.returncode == 0, ended.stderr
    assert "free mode 1, " in ended.stdout
    assert (tmp_path / "pin.html").stat().st_size < 15e6

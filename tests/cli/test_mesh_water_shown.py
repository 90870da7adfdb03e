"""What `show` tells of the water around meshes: added mass by panels, first guesses of drag, and a missing extra."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from nectosome.description import Rigid, load_robot, mesh_added_mass
from nectosome.description.loads import LumpedDragLoad
from nectosome.geometry import panel_added_mass as panels

BALL = """
name: ball
body:
  kind: rigid
  shape: {mesh: ball.stl, unit: mm}
  mass: 1 kg
  joint: {kind: free}
  loads: {water: {kind: mesh_added_mass, panels: 400}}
"""


@pytest.fixture(autouse=True)
def ball_file(nectosome):
    trimesh.creation.icosphere(3, radius=50).export("ball.stl")
    Path("ball.yaml").write_text(BALL)


@pytest.fixture
def no_memory():
    """Of what was computed, and of the package."""
    mesh_added_mass._by_panels.cache_clear()
    panels._capytaine.cache_clear()
    yield
    panels._capytaine.cache_clear()


def test_added_mass_is_told_with_its_error(nectosome):
    """Half of the displaced mass of a ball, 0.2618 kg; what was computed is no line of its own."""
    pytest.importorskip("capytaine")
    rows = json.loads(nectosome("show", "ball.yaml", "--json").out)["tables"]["assumed"]
    told = {row["what"]: row for row in rows}
    assert [told[f"along {axis}"]["value"]["value"] for axis in "xyz"] == pytest.approx([0.2618] * 3, rel=0.02)
    assert "panels, +- " in told["along x"]["source"]
    text = nectosome("show", "ball.yaml").out
    assert "mesh added mass, panels 400" in text
    assert "sha256" not in text


def test_added_mass_is_that_in_the_water_of_the_robot(nectosome):
    """1025 / 1000 of it; value and error in one unit; a ball that turns has none, which is below the error."""
    pytest.importorskip("capytaine")
    values = []
    for density in (1000, 1025):
        Path("ball.yaml").write_text(f"water: {{density: {density} kg/m3}}{BALL}")
        rows = json.loads(nectosome("show", "ball.yaml", "--json").out)["tables"]["assumed"]
        told = {row["what"]: row for row in rows}
        values.append(told["along y"]["value"]["value"])
        assert re.fullmatch(r"panels, \+- \S+ g", told["along y"]["source"])
        assert re.fullmatch(r"below \S+ \S+ \S+", told["about y"]["value"])
    assert values[1] / values[0] == pytest.approx(1.025, rel=1e-6)


def test_without_the_extra_a_sentence_says_so(nectosome, monkeypatch, no_memory):
    monkeypatch.setitem(sys.modules, "capytaine", None)
    answer = nectosome("show", "ball.yaml")
    assert answer.code == 2
    assert "ball.yaml, line 8, body.loads.water.kind" in answer.err
    assert "the package capytaine is missing: pip install 'nectosome[mesh]'" in answer.err


def test_a_first_guess_of_drag_can_be_copied(nectosome):
    """0.47 of the silhouette of a ball of 50 mm, 78.5 cm2; what is copied is a load that reads."""
    Path("ball.yaml").write_text(BALL.replace("loads: {water: {kind: mesh_added_mass, panels: 400}}", ""))
    lines = " ".join(nectosome("show", "ball.yaml").out.replace("│", " ").split())
    load = re.search(r"drag, a first guess ({.*?})", lines)
    assert load and "0.47 on the projected area, as a ball (Hoerner 1965" in lines
    Path("ball.yaml").write_text(BALL.replace("{kind: mesh_added_mass, panels: 400}", load[1]))
    body = load_robot("ball.yaml").body
    assert isinstance(body, Rigid)
    water = body.loads["water"]
    assert isinstance(water, LumpedDragLoad)
    assert water.drag_area == pytest.approx([0.47 * np.pi * 0.05**2] * 3, rel=0.02)
    rows = json.loads(nectosome("show", "ball.yaml", "--json").out)["tables"]["meshes"]
    guessed = next(row for row in rows if row["what"] == "guessed_drag_area")
    assert guessed["x"]["value"] == pytest.approx(0.47 * np.pi * 0.05**2, rel=0.01)

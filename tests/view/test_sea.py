"""Waves and streams in pictures: the surface is where the waves are, and the arrow goes along the water."""

import re

import numpy as np
import pytest
import viser

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.view.display.scene_graph import Look, Stage
from nectosome.view.drawing import Scene
from nectosome.view.sea import Sea
from nectosome.view.still import standing

A, T, U, LEVEL = 0.03, 1.0, 0.2, 0.02
K = (2 * np.pi / T) ** 2 / 9.80665  # wave number in deep water [rad/m]
BOX = parse_robot(
    f"""
name: box
water:
  surface: {LEVEL} m
  flows:
    swell: {{kind: regular_waves, height: {2 * A} m, period: {T} s}}
    drift: {{kind: changing_current, direction: y, speed: {{kind: constant, value: {U} m/s}}}}
body: {{kind: rigid, shape: box, length: 0.4 m, width: 0.2 m, height: 0.2 m, mass: 8 kg,
  joint: {{kind: free, start: {{position: [-0.2 m, 0 m, 0 m]}}}}}}
"""
)


def height(x, t):
    """Of the surface in the world, by the closed form."""
    return LEVEL + A * np.cos(K * x - 2 * np.pi * t / T)


def test_heights_and_velocities_are_those_of_the_waves():
    sea, points = Sea(BOX.water), np.random.default_rng(0).normal(size=(7, 3, 3))
    np.testing.assert_allclose(LEVEL + sea.rise(0.3, points), height(points[..., 0], 0.3), atol=1e-14)
    c = sea.velocity(0.0, np.array([0.0, 0.0, LEVEL]))
    np.testing.assert_allclose(c, [2 * np.pi / T * A, U, 0.0], atol=1e-12)  # under a crest
    assert sea.waves and sea.streams
    still = Sea(parse_robot("name: still\nbody: {kind: rigid, shape: point, mass: 1 kg}\n").water)
    assert not (still.waves or still.streams)


@pytest.mark.parametrize("time", [0.0, 0.35])
def test_the_line_on_the_robot_is_where_the_waves_cut_it(time: float):
    """At the three edges of the box that are seen from above, within a pixel; the arrow says how fast it is."""
    scene = Scene(standing(BOX, build(BOX)), 0.0, (640, 360), "three-quarter")
    drawn = scene.svg(time)
    light = re.findall(r'<path d="M([-\d.]+)[ ,]([-\d.]+)L([-\d.]+)[ ,]([-\d.]+)" stroke="#ffffff"', drawn)
    ends = np.array(light, dtype=float).reshape(-1, 2)
    for x, y in ((-0.2, -0.1), (0.2, -0.1), (-0.2, 0.1)):
        at = scene.camera(time).project(np.array([[x, y, height(x, time)]]))[0][0]
        assert np.hypot(*(ends - at).T).min() < 1.0
    speed = np.linalg.norm(Sea(BOX.water).velocity(time, scene._target(time)))
    assert f"water {speed:.2g} m/s" in drawn


def test_the_stage_has_the_waves_of_its_time_and_an_arrow_along_the_water():
    server = viser.ViserServer(port=18_760, verbose=False)
    try:
        stage = Stage(server.scene)
        stage.load(standing(BOX, build(BOX)), BOX, 0.0, Look())
        for time in (0.0, 0.4):
            stage.at(time)
            nodes = stage._nodes
            points = np.asarray(nodes["/tank/waves"].points)
            np.testing.assert_allclose(points[..., 2], height(points[..., 0], time), atol=1e-6)
            root, tip = np.asarray(nodes["/tank/stream"].points)[0]
            c = Sea(BOX.water).velocity(time, stage.playback.place[0])
            np.testing.assert_allclose((tip - root) / np.linalg.norm(tip - root), c / np.linalg.norm(c), atol=1e-5)
    finally:
        server.stop()

"""The surface of the water in pictures: it cuts a body, and what is beyond it is seen through it."""

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.view.camera import walls
from nectosome.view.drawing import Scene
from nectosome.view.still import standing
from nectosome.view.tubes import parted

from .test_raster import sphere

SIZE = (640, 360)


def area(faces):
    return 0.5 * np.linalg.norm(np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1]), axis=-1)


def test_a_level_cuts_a_sphere_into_caps():
    """2 pi r h of the upper one; the line is a circle, and each piece keeps its colour and which way it faces."""
    faces = walls(sphere(1.0, around=192))
    colours = np.sign(faces.mean(axis=1))
    pieces, tints, line = parted(faces, colours, 0.4)
    low, high = pieces[..., 2].min(axis=1), pieces[..., 2].max(axis=1)
    assert np.all((low > 0.4 - 1e-12) | (high < 0.4 + 1e-12))
    assert area(pieces).sum() == pytest.approx(area(faces).sum(), rel=1e-4)  # its faces are not all flat
    assert area(pieces[low > 0.4 - 1e-12]).sum() == pytest.approx(2 * np.pi * 0.6, rel=1e-3)
    assert np.linalg.norm(line[:, 1] - line[:, 0], axis=-1).sum() == pytest.approx(2 * np.pi * 0.84**0.5, rel=1e-3)
    assert line[..., 2] == pytest.approx(0.4, abs=1e-15)
    normal = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
    assert np.sum(normal * pieces.mean(axis=1), axis=1).min() > -1e-12
    assert np.abs(tints - np.sign(pieces.mean(axis=1))).max() == 0


def scene(water):
    """A box of 0.4 x 0.2 x 0.2 m about the origin."""
    robot = parse_robot(
        f"name: box\n{water}body: {{kind: rigid, shape: box, length: 0.4 m, width: 0.2 m, height: 0.2 m, mass: 8 kg,\n"
        "  joint: {kind: free, start: {position: [-0.2 m, 0 m, 0 m]}}}\n"
    )
    return Scene(standing(robot, build(robot)), 0.0, SIZE, "three-quarter")


def test_what_is_under_water_is_seen_through_it():
    """From above, on the near side: as without a surface above it, bluer below, and a light line between."""
    with_surface, without = scene("water: {surface: 2 cm}\n"), scene("")
    wet, dry = (next(each.pictures(np.zeros(1))).astype(int) for each in (with_surface, without))

    def around(image, z):
        (x, y), _ = with_surface.camera(0.0).project(np.array([0.0, -0.1, z]))
        return image[int(y) - 2 : int(y) + 3, int(x) - 2 : int(x) + 3]

    assert np.abs(around(wet, 0.06) - around(dry, 0.06)).max() <= 2
    assert around(wet, 0.02).min(axis=-1).max() > around(dry, 0.02).max() + 60
    bluer = [image[..., 0] - image[..., 2] for image in (around(wet, -0.04), around(dry, -0.04))]
    assert np.median(bluer[0]) > np.median(bluer[1]) + 25
    assert 'fill-opacity="0.035"' in with_surface.svg(0.0)

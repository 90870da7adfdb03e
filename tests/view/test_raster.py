"""From geometry to pixels: places, areas, light, and what hides what."""

import numpy as np
import pytest

from nectosome.view.camera import Perspective, axes_towards, lit, outlines, seen, walls
from nectosome.view.canvas import FINER, Raster

SIZE, FOCAL = (240, 180), 300.0
EDGE = 0.3  # px: OpenCV paints what an edge runs through as well, half a pixel of an image of twice the size
RED, BLUE = np.array([0.0, 0, 200]), np.array([200.0, 0, 0])


def camera_at(eye, viewer=None):
    return Perspective(np.array(eye, float), axes_towards(tuple(viewer or eye)), FOCAL, SIZE)


def sphere(radius, middle=(0, 0, 0), around=96):
    """Rings from pole to pole along x, as parts have them."""
    polar, turn = np.linspace(np.pi, 0, around // 2 + 1), 2 * np.pi * np.arange(around) / around
    x = np.broadcast_to(np.cos(polar)[:, None], (len(polar), around))
    y, z = np.sin(polar)[:, None] * np.cos(turn), np.sin(polar)[:, None] * np.sin(turn)
    return radius * np.stack([x, y, z], axis=-1) + np.array(middle, float)


def box(half, middle=(0, 0, 0)):
    """A box of half widths along x, y, z, closed by rings without extent at its ends."""
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    section = np.column_stack([np.zeros(4), corners * np.array(half[1:])])
    along = np.array([[half[0], 0, 0]])
    return np.stack([-along + 0 * section, section - along, section + along, along + 0 * section]) + np.array(middle)


def painted(camera, *coloured):
    canvas = before(255)
    faces = [walls(rings) for rings, _ in coloured]
    colours = [np.tile(colour, (len(each), 1)) for each, (_, colour) in zip(faces, coloured, strict=True)]
    canvas.paint(*seen(camera, np.concatenate(faces), np.concatenate(colours)))
    return canvas.image


def before(grey):
    """An empty picture."""
    return Raster(SIZE, np.full((SIZE[1], 3), float(grey)))


def area(image):
    """Pixels of the camera that are not the background's."""
    return np.count_nonzero(image[..., 1] == 0) / FINER**2


def test_points_fall_where_the_pinhole_says():
    """u = w/2 + f x/d, v = h/2 - f z/d, seen towards +y from 2 m away."""
    pixels, depth = camera_at((0, -2, 0)).project(np.array([[0, 0, 0], [0.3, 0, 0.2], [0.3, 1, 0.2]]))
    np.testing.assert_allclose(depth, [2, 2, 3])
    np.testing.assert_allclose(pixels, [[120, 90], [165, 60], [150, 70]])
    assert np.all(np.isnan(camera_at((0, -2, 0)).project(np.array([0.0, -3, 0]))[0]))


@pytest.mark.parametrize("viewer", [(0, -1, 0), (0, 0, 1), (-1, 0, 0.25), (-0.55, -0.8, 0.5)])
def test_a_camera_is_upright_and_not_mirrored(viewer):
    axes = axes_towards(viewer)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes[0, 2] == 0  # right is level
    assert axes[1] @ ((0, 1, 0) if viewer == (0, 0, 1) else (0, 0, 1)) > 0


def test_the_silhouette_of_a_sphere_has_the_area_of_its_cone():
    """The cone around a sphere of radius R at distance d meets the picture in a circle of radius f tan(asin(R/d))."""
    radius, away = 0.4, 2.0
    half = FOCAL * np.tan(np.arcsin(radius / away))
    found = area(painted(camera_at((0, -away, 0)), (sphere(radius), RED)))
    assert 0.998 * np.pi * half**2 < found < np.pi * half**2 + EDGE * 2 * np.pi * half


def test_the_silhouette_of_a_box_is_that_of_its_near_face():
    image = painted(camera_at((0, -2, 0)), (box((0.4, 0.3, 0.2)), RED))
    scale = FOCAL / 1.7
    exact, around = 0.8 * 0.4 * scale**2, 2 * (0.8 + 0.4) * scale
    assert exact < area(image) < exact + EDGE * around


@pytest.mark.parametrize("order", [1, -1])
def test_what_is_in_front_hides_what_is_behind(order):
    boxes = [(box((0.2, 0.1, 0.1), (0, -0.4, 0)), RED), (box((0.3, 0.1, 0.3), (0, 0.4, 0)), BLUE)][::order]
    middle = (FINER * SIZE[1] // 2, FINER * SIZE[0] // 2)
    assert painted(camera_at((0, -2, 0)), *boxes)[middle].tolist() == RED.tolist()
    assert painted(camera_at((0, 2, 0)), *boxes)[middle].tolist() == BLUE.tolist()


def test_a_face_is_seen_from_outside_only():
    face = walls(box((0.4, 0.3, 0.2)))
    face = face[np.all(face[..., 1] < -0.29, axis=1)]
    assert len(face) == 1
    for faces, count in ((face, 1), (face[:, ::-1], 0)):
        assert len(seen(camera_at((0, -2, 0)), faces, RED[None])[0]) == count


def test_what_is_behind_the_eye_is_not_painted():
    assert area(painted(camera_at((0, -2, 0), (0, -1, 0)), (sphere(0.4, (0, -4, 0)), RED))) == 0


def test_light_comes_from_above_the_left_shoulder():
    camera = camera_at((0, -2, 0))
    faces = walls(sphere(0.4))
    bright = lit(faces, np.array([100.0, 100, 100]), camera)[:, 0]
    normal = faces.mean(axis=1) / np.linalg.norm(faces.mean(axis=1), axis=1, keepdims=True)
    lightest, darkest = normal[bright.argmax()], normal[bright.argmin()]
    assert lightest[0] < 0 and lightest[1] < 0 and lightest[2] > 0  # left, towards the viewer, up
    assert darkest[0] > 0 and darkest[1] > 0 and darkest[2] < 0
    assert 30 < bright.min() < 60 < 100 < bright.max() < 160


def test_a_shadow_darkens_by_its_share_and_nothing_else():
    """A plate of 0.4 m square at z = 0, seen from 2 m above: half as bright in the middle, as it was far away.

    In a mask of half the size its sides are up to half a pixel too far out, one of the picture's.
    """
    canvas = before(200)
    canvas.darken(outlines(camera_at((0, 0, 2)), [box((0.2, 0.2, 0.0))]), 0.5)
    grey = canvas.picture()[..., 0]
    assert grey[90, 120] == pytest.approx(100, abs=2)
    assert grey[10, 10] == 200
    side = 0.4 * FOCAL / 2
    assert side**2 <= np.sum(200.0 - grey) / 100 <= (side + 2.1) ** 2


def test_a_pane_lies_over_what_is_there_by_its_share():
    """A square within a square, half clear each: a half of the colour, and three quarters within both."""
    canvas, square = before(200), np.array([(-1.0, -1), (1, -1), (1, 1), (-1, 1)])
    canvas.glaze((120, 90) + np.array([60, 30])[:, None, None] * square, np.array([0.0, 100, 255]), 0.5)
    image = canvas.picture().astype(float)
    assert image[90, 120] == pytest.approx((50, 125, 241), abs=2)
    assert image[90, 70] == pytest.approx((100, 150, 227), abs=2)
    assert image[90, 50] == pytest.approx((200, 200, 200))


def test_lines_run_from_point_to_point():
    canvas = before(0)
    canvas.rule(np.array([[[90.0, 75], [150, 75]]]), np.array([[255.0, 255, 255]]), 0.5)
    rows, columns = np.nonzero(canvas.image[..., 0] > 100)
    assert np.unique(rows).tolist() in ([149], [150], [149, 150])
    assert columns.min() == pytest.approx(180, abs=2) and columns.max() == pytest.approx(300, abs=2)

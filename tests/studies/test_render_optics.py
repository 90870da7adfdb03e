"""The renderer's optics: closed forms of lenses, Snell, apparent depth, and pixels to rays and back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome_studies.track.render import Port, RenderCamera, RenderLens

DOWN = (0.0, 1.0, 0.0)  # `up` of a camera that looks straight down: the image's right is +x


def above(lens: RenderLens, height: float = 2.0, port: Port | None = None, size=(101, 81)) -> RenderCamera:
    return RenderCamera(size, lens, (0.0, 0.0, height), (0.0, 0.0, 0.0), DOWN, port)


def test_a_rectilinear_lens_is_a_pinhole():
    """u = c_u + f x / h, v = c_v - f y / h, and the middle of 101 by 81 pixels is pixel (50, 40)."""
    points = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [-0.03, 0.07, 0.5]])
    expected = [[50, 40], [75, 40], [50 - 20, 40 - 1000 * 0.07 / 1.5]]
    np.testing.assert_allclose(above(RenderLens(1000.0)).sees(points)[:2], expected[:2], atol=1e-10)
    np.testing.assert_allclose(above(RenderLens(1000.0)).project(points), expected, atol=1e-10)


@pytest.mark.parametrize(
    ("spread", "radius"), [(1.0, np.tan), (0.5, lambda a: 2 * np.tan(a / 2)), (0.0, lambda a: a), (1e-6, lambda a: a)]
)
def test_lenses_have_the_radii_of_their_names(spread, radius):
    angle = np.linspace(0, 1.4, 9)
    lens = RenderLens(700.0, spread)
    np.testing.assert_allclose(lens.radius(angle), 700 * radius(angle), rtol=1e-9)
    np.testing.assert_allclose(lens.angle(lens.radius(angle)), angle, atol=1e-9)


def test_a_wide_lens_sees_to_the_side_and_behind_but_a_pinhole_does_not():
    point = np.array([[1.0, 0.0, 2.5]])  # beside and a little behind a camera at z = 2 that looks down
    angle = np.pi / 2 + np.arctan(0.5)
    assert np.isnan(above(RenderLens(10.0)).sees(point)).all()
    np.testing.assert_allclose(above(RenderLens(10.0, 0.0)).sees(point), [[50 + 10 * angle, 40]], atol=1e-12)


def test_rays_obey_snell_and_a_pane_only_shifts_them():
    """sin(air) = 1.333 sin(water) in one plane; behind a pane a ray leaves T tan(glass) + a tan(air) aside."""
    camera = above(RenderLens(80.0), port=Port((0, 0, 1.5), (0, 0, 1), thickness=0.02))
    pixels = np.array([[90.0, 10.0], [50.0, 0.0], [50.0, 40.0]])
    origins, rays = camera.rays(pixels)
    image = (pixels - [50, 40]) * [1, -1] / 80
    tangent = np.linalg.norm(image, axis=1)
    air = tangent / np.hypot(1, tangent)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(rays[:, :2], axis=1), air / 1.333, atol=1e-14)
    np.testing.assert_allclose(rays[:, 0] * image[:, 1], rays[:, 1] * image[:, 0], atol=1e-14)
    aside = 0.5 * tangent + 0.02 * np.tan(np.arcsin(air / 1.5))
    np.testing.assert_allclose(np.linalg.norm(origins[:, :2], axis=1), aside, atol=1e-14)
    np.testing.assert_allclose(origins[:, 2], 1.48, atol=1e-14)


def test_water_looks_shallower_by_its_index():
    """Near the axis what is d deep looks d / 1.333 deep: u - c = f x / (h + d / 1.333)."""
    camera = above(RenderLens(1000.0), 2.0, Port((0, 0, 1.2), (0, 0, -1)))
    pixel = camera.sees(np.array([[1e-3, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    assert pixel[0, 0] - 50 == pytest.approx(1000 * 1e-3 / (0.8 + 1.2 / 1.333), rel=1e-6)
    np.testing.assert_allclose(pixel[1], [50, 40], atol=1e-12)


def test_what_is_behind_outside_or_not_in_the_water_is_not_seen():
    camera = above(RenderLens(1000.0), 2.0, Port((0, 0, 1.2), (0, 0, 1), 0.01))
    unseen = [[0, 0, 2.5], [0, 0, 1.5], [0, 0, 1.195], [0.1, 0, 0]]
    assert np.isnan(camera.sees(np.array(unseen))).all()
    assert np.isnan(above(RenderLens(1000.0)).sees(np.array([[0, 0, 2.5], [0.102, 0, 0]]))).all()
    assert np.isfinite(above(RenderLens(1000.0)).sees(np.array([[0.1009, 0, 0]]))).all()  # the last pixel's last tenth


@given(
    st.floats(-0.5, 1279.5),
    st.floats(-0.5, 719.5),
    st.floats(0.01, 3.0),
    st.floats(0.0, 1.0),
    st.floats(-0.6, 0.6),
    st.sampled_from([None, 0.0, 0.015]),
)
def test_a_point_on_a_pixels_ray_is_seen_in_that_pixel(u, v, away, spread, tilt, thickness):
    """To 1e-8 px, for any lens, with and without a port, tilted as it may be."""
    port = None if thickness is None else Port((0.2, -0.3, 0.4), (0.1, np.sin(tilt), np.cos(tilt)), thickness)
    camera = RenderCamera(
        (1280, 720), RenderLens(900.0, spread, (13.0, -8.0)), (0.1, -0.4, 0.9), (0.2, 0.1, -0.5), port=port
    )
    pixel = np.array([[u, v]])
    origin, ray = camera.rays(pixel)
    if np.isnan(ray).any():  # looks past a tilted port
        return
    np.testing.assert_allclose(camera.sees(origin + away * ray), pixel, atol=1e-8)


def test_a_grazing_ray_is_followed_back():
    """A camera 1 mm before the water sees what is far aside, nearly along the surface."""
    camera = RenderCamera(
        (400, 400), RenderLens(100.0, 0.0), (0, 0, 1e-3), (0, 0, -1), DOWN, Port((0, 0, 0), (0, 0, 1))
    )
    point = np.array([[1.0, 0.5, -1.0]])
    pixel = camera.sees(point)
    origin, ray = camera.rays(pixel)
    along = (point - origin) @ ray[0]
    np.testing.assert_allclose(origin + along * ray, point, atol=1e-9)
    assert np.hypot(*(pixel[0] - 199.5)) > 100 * np.radians(75)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RenderLens(-5.0), "focal"),
        (lambda: RenderLens(5.0, 1.2), "spread"),
        (lambda: Port((0, 0, 0), (0, 0, 1), -0.1), "thickness"),
        (lambda: Port((0, 0, 0), (0, 0, 1), air=1.4), "thinnest"),
        (lambda: RenderCamera((9, 9), RenderLens(5.0), (0, 0, 1), (0, 0, 0)).axes, "up"),
        (lambda: above(RenderLens(5.0), port=Port((0, 0, 2), (0, 0, 1))).rays(np.zeros((1, 2))), "in the pane"),
    ],
)
def test_what_cannot_be_is_told(make, message):
    with pytest.raises(ValueError, match=message):
        make()

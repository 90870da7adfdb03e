"""Rendered markers: their places and sizes, which hides which, rods, halos."""

import numpy as np
import pytest

from nectosome_studies.track.render import (
    Film,
    Lamps,
    Port,
    RenderCamera,
    RenderLens,
    RodSolid,
    TankScene,
    TankWater,
)

SIZE = (160, 120)
RED, GREEN, WHITE = (240.0, 40.0, 30.0), (20.0, 230.0, 60.0), (240.0, 240.0, 240.0)
BLACK = TankWater(haze=(0.0, 0.0, 0.0))


def camera(port: Port | None = None, focal: float = 400.0, place=(0.0, -1.0, 0.0)) -> RenderCamera:
    """Looks along +y: the image's right is +x, down is -z."""
    return RenderCamera(SIZE, RenderLens(focal), place, (place[0], 0.0, place[2]), port=port)


def resting(*places):
    return lambda t: np.broadcast_to(np.array(places, float), (len(t), len(places), 3))


def centroid(picture: np.ndarray) -> np.ndarray:
    light = picture.astype(float).sum(axis=-1)
    v, u = np.indices(light.shape)
    return np.array([np.sum(u * light), np.sum(v * light)]) / light.sum()


@pytest.mark.parametrize("place", [(0.003, 0.0, 0.001), (0.15, 0.1, 0.0), (0.11, 0.0, 0.09)])
def test_a_ball_is_seen_as_the_ellipse_of_its_cone(place):
    """Half angle a = asin(R / D) at phi off the axis: from f tan(phi - a) to f tan(phi + a); area pi p q."""
    radius = 0.02
    scene = TankScene(camera(), Film(), resting(place), Lamps(radius, [WHITE]), water=BLACK)
    away = np.array(place) - [0.0, -1.0, 0.0]
    distance, phi = np.linalg.norm(away), np.arctan(np.hypot(away[0], away[2]) / away[1])
    a = np.arcsin(radius / distance)
    near, far = 400 * np.tan(phi - a), 400 * np.tan(phi + a)
    way = np.array([away[0], -away[2]]) / np.hypot(away[0], away[2])
    frame = scene.frame(0.0)
    np.testing.assert_allclose(centroid(frame), [79.5, 59.5] + 0.5 * (near + far) * way, atol=0.02)
    p = 0.5 * (far - near)
    q = 400 * np.sin(a) / np.sqrt(np.cos(phi) ** 2 - np.sin(a) ** 2)
    assert frame.sum() / 720 == pytest.approx(np.pi * p * q, rel=0.01)


def test_through_a_pane_a_small_marker_is_seen_where_its_middle_is():
    port = Port((0, -0.6, 0), (0.1, 1, -0.05), 0.012)
    for place in ([0.02, 0.3, 0.01], [-0.1, 0.1, 0.06]):
        scene = TankScene(camera(port), Film(), resting(place), Lamps(0.004, [WHITE]), water=BLACK)
        np.testing.assert_allclose(centroid(scene.frame(0.0)), camera(port).sees(np.array([place]))[0], atol=0.02)


def test_the_nearer_marker_hides_the_other():
    lamps = Lamps(0.02, [RED, GREEN])
    both = TankScene(camera(), Film(), resting((0, 0, 0), (0.003, 0.2, 0)), lamps, water=BLACK).frame(0.0)
    assert (both[..., 1] <= 40).all()
    swapped = TankScene(camera(), Film(), resting((0, 0, 0), (0.0, -0.2, 0)), lamps, water=BLACK).frame(0.0)
    assert (swapped[..., 0] <= 20).all()
    aside = TankScene(camera(), Film(), resting((0, 0, 0), (0.02, 0.2, 0)), lamps, water=BLACK).frame(0.0)
    shown = (aside[..., 1] > 100).sum()
    assert 50 < shown < np.pi * (400 * 0.02 / 1.2) ** 2


def test_a_rod_hides_exactly_and_a_halo_goes_with_its_marker():
    """A marker wholly behind a rod leaves no trace; one half hidden has half the light."""
    rod = RodSolid((0.0, -0.2, -1.0), (0.0, -0.2, 1.0), 0.03)
    film = Film(veil=0.3, grain=1.0, defocus=0.6)
    lamps = Lamps(0.01, [RED])
    hidden = TankScene(camera(), film, resting((0.01, 0.0, 0.02)), lamps, bar=rod).frame(0.1)
    none = TankScene(camera(), film, resting((0.01, -3.0, 0.02)), lamps, bar=rod).frame(0.1)  # behind the camera
    np.testing.assert_array_equal(hidden, none)
    edge = 1.0 * np.tan(np.arcsin(0.03 / 0.8))
    half, whole = (
        TankScene(camera(), Film(), resting((x, 0.0, 0.0)), lamps, water=BLACK, bar=rod).frame(0.0)[..., 0].astype(int)
        for x in (edge, 0.08)
    )
    dark = TankScene(camera(), Film(), resting((0.0, -3.0, 0.0)), lamps, water=BLACK, bar=rod).frame(0.0)[..., 0]
    assert (half - dark).sum() / (whole - dark).sum() == pytest.approx(0.5, abs=0.02)


def test_markers_at_rest_and_in_motion_are_drawn_alike():
    """A marker that passes another at rest leaves it as it was, and one that stops is as one at rest."""
    film = Film(veil=0.2, veil_width=3.0)
    still = np.array([[0.02, 0.1, 0.0], [-0.06, 0.0, 0.04]])
    scene = TankScene(
        camera(), film, lambda t: np.array([[[0.2 * s, 0.0, 0.0]] for s in t]), Lamps(0.012, [RED]), still
    )
    every = TankScene(camera(), film, resting((0.02, 0.0, 0.0), *still), Lamps(0.012, [RED]))
    np.testing.assert_allclose(scene.frame(0.1).astype(int), every.frame(0.0), atol=1)
    gone = TankScene(camera(), film, resting((9.0, 0.0, 0.0)), Lamps(0.012, [RED]), still)
    np.testing.assert_array_equal(scene.frame(5.0), gone.frame(0.0))


def test_a_moving_marker_is_smeared_over_its_way():
    """Variance along its way grows by d^2 (1 - 1 / k^2) / 12."""

    def markers(t):
        return np.array([[[0.02 * (s * 100.0), 0.0, 0.0]] for s in t])  # 8 px in a hundredth of a second

    def variance(film):
        light = TankScene(camera(), film, markers, Lamps(0.01, [WHITE]), water=BLACK).frame(0.0)[..., 0].astype(float)
        profile, u = light.sum(axis=0), np.arange(SIZE[0])
        mean = np.sum(u * profile) / profile.sum()
        return np.sum((u - mean) ** 2 * profile) / profile.sum()

    grown = variance(Film(100.0, shutter=1.0, instants=10)) - variance(Film(100.0))
    assert grown == pytest.approx(8**2 * (1 - 1 / 100) / 12, rel=0.02)


def test_a_marker_cut_by_the_edge_of_the_image_is_drawn_as_far_as_it_goes():
    frame = TankScene(camera(), Film(), resting((0.2, 0.0, 0.0)), Lamps(0.03, [WHITE]), water=BLACK).frame(0.0)
    assert frame[59, 159, 0] == 240
    assert frame.sum() / 720 == pytest.approx(0.5 * np.pi * 12**2, rel=0.07)


def test_colours_that_do_not_match_the_markers_are_told():
    scene = TankScene(camera(), Film(), resting((0, 0, 0)), Lamps(0.02, [RED, GREEN]))
    with pytest.raises(ValueError, match="2 for 1 markers"):
        scene.frame(0.0)

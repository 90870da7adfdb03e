"""Rendered paddles: areas, places, smear and what hides what, against closed forms."""

import numpy as np
import pytest

from nectosome_studies.track.render import (
    Bubbles,
    Film,
    Floor,
    Occluder,
    Paddle,
    PaddleScene,
    Port,
    RenderCamera,
    RenderLens,
    Strip,
)
from nectosome_studies.track.render.boxes import PixelBox, split
from nectosome_studies.track.render.plane import Disc, RenderPlane, plane_points

SIZE = (160, 120)
WHITE, BLACK, RED, BLUE = (250.0, 250.0, 250.0), (0.0, 0.0, 0.0), (200.0, 40.0, 30.0), (30.0, 60.0, 210.0)
DARK = Floor(-0.2, BLACK, contrast=0.0)


def camera(port: Port | None = None, spread: float = 1.0) -> RenderCamera:
    return RenderCamera(SIZE, RenderLens(500.0, spread), (0.02, 0.01, 1.0), (0.02, 0.01, 0.0), (0, 1, 0), port)


def layer(start, end):
    """One layer that rests."""
    return lambda t: np.broadcast_to(np.array([[start, end]]), (len(t), 1, 2, 2))


def centroid(picture: np.ndarray) -> np.ndarray:
    """Of its light, u and v [px]."""
    light = picture.astype(float).sum(axis=-1)
    v, u = np.indices(light.shape)
    return np.array([np.sum(u * light), np.sum(v * light)]) / light.sum()


@pytest.mark.parametrize("degrees", [0.0, 33.0, 90.0])
def test_a_layer_has_its_area_and_its_place(degrees):
    """Length x width x (500 px/m)^2, within 1 %, and its middle where the closed form of the pinhole has it."""
    way = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    start, end = np.array([0.0131, 0.0072]) - 0.05 * way, np.array([0.0131, 0.0072]) + 0.05 * way
    frame = PaddleScene(camera(), Film(), layer(start, end), Paddle([WHITE], 0.0123), DARK).frame(0.0)
    assert frame.sum() / 750 == pytest.approx(0.1 * 0.0123 * 500**2, rel=0.01)
    middle = [79.5 + 500 * (0.0131 - 0.02), 59.5 - 500 * (0.0072 - 0.01)]
    np.testing.assert_allclose(centroid(frame), middle, atol=0.02)


def test_under_water_a_layer_looks_nearer():
    """Area times (f / (h + d / n))^2, about the place that the camera sees the middle in."""
    under = camera(Port((0, 0, 0.4), (0, 0, 1)))
    frame = PaddleScene(under, Film(), layer((-0.03, 0.03), (0.05, 0.0)), Paddle([WHITE], 0.014), DARK).frame(0.0)
    scale = 500 / (0.6 + 0.4 / 1.333)
    assert frame.sum() / 750 == pytest.approx(np.hypot(0.08, 0.03) * 0.014 * scale**2, rel=0.01)
    np.testing.assert_allclose(centroid(frame), under.sees(np.array([[0.01, 0.015, 0.0]]))[0], atol=0.02)


def test_a_layer_that_moves_is_smeared_over_its_way():
    """A box of width w that moves by d: variance (w^2 + d^2 (1 - 1 / k^2)) / 12 of k instants, and the same light."""
    way, width, k = 9.0, 5.0, 12

    def ends(t):
        x = 0.02 + (way / 500) * (np.asarray(t) * 60 / 0.5)  # over half of a sixtieth of a second
        start, end = (np.stack([x, np.full_like(x, y)], -1) for y in (-0.03, 0.05))
        return np.stack([start, end], axis=1)[:, None]

    film = Film(60.0, shutter=0.5, instants=k)
    frame = PaddleScene(camera(), film, ends, Paddle([WHITE], width / 500), DARK).frame(0.0).astype(float)[..., 0]
    profile, u = frame.sum(axis=0), np.arange(SIZE[0])
    mean = np.sum(u * profile) / profile.sum()
    variance = np.sum((u - mean) ** 2 * profile) / profile.sum()
    assert mean == pytest.approx(79.5, abs=0.02)
    assert variance == pytest.approx((width**2 + way**2 * (1 - 1 / k**2)) / 12 + 1 / 12, rel=0.02)  # and of pixels
    assert profile.sum() / 250 == pytest.approx(40 * width, rel=0.01)
    lit = np.flatnonzero(profile > 0.02 * profile.max())
    assert lit[-1] - lit[0] + 1 == pytest.approx(way + width, abs=2)


def test_only_edges_are_traced_finely_and_nothing_is_lost_by_it():
    """The same as all parts of all pixels by hand, for a wide lens and a tilted port."""
    eye = RenderCamera(
        (70, 60),
        RenderLens(60.0, 0.2),
        (0.1, -0.3, 0.8),
        (0.0, 0.0, 0.0),
        port=Port((0, 0, 0.3), (0.1, 0.2, 1.0), 0.01),
    )
    plane = RenderPlane(eye, 0.02, parts=4)
    shapes = [
        Strip((-0.3, -0.1), (0.2, 0.15), 0.08, RED),
        Strip((0.2, 0.15), (0.25, -0.2), 0.02, BLUE),
        Disc((-0.1, 0.0), 0.07, WHITE),
        Disc((0.0, -0.1), 0.004, RED),
    ]
    ground = np.random.default_rng(0).uniform(0, 90, (60, 70, 3)).astype(np.float32)
    box = PixelBox(0, 60, 0, 70)
    made = plane.painted(ground, box, list(zip(shapes, plane.boxes(shapes), strict=True)))
    x, y = plane_points(eye, split(box.pixels, 4).reshape(-1, 2), 0.02).T
    light = np.repeat(ground.reshape(-1, 3), 16, axis=0)
    for shape in shapes:
        light[shape.beyond(x, y) < 0] = shape.colour
    np.testing.assert_allclose(made, light.reshape(60, 70, 16, 3).mean(axis=2), atol=1e-3)


def test_an_occluder_hides_exactly_and_only_while_it_is_there():
    """Where it is no trace of the paddle is left; before, it is as if there were none."""
    bar = Strip((0.03, -0.2), (0.05, 0.2), 0.03, (20.0, 25.0, 30.0))
    film, floor = Film(grain=2.0), Floor(-0.2)
    ends, paddle = layer((-0.08, 0.0), (0.12, 0.03)), Paddle([RED], 0.02)
    barred = PaddleScene(camera(), film, ends, paddle, floor, occluder=Occluder(bar, (1.0, 2.0)))
    free = PaddleScene(camera(), film, ends, paddle, floor)
    away = PaddleScene(camera(), film, layer((5.0, 0.0), (5.1, 0.0)), paddle, floor, occluder=Occluder(bar, (1.0, 2.0)))
    np.testing.assert_array_equal(barred.frame(0.5), free.frame(0.5))
    np.testing.assert_array_equal(barred.frame(2.0), free.frame(2.0))
    with_paddle, without = barred.frame(1.5), away.frame(1.5)
    plane = RenderPlane(camera(), 0.0)
    covered = bar.beyond(plane.centres[..., 0], plane.centres[..., 1]) < -0.0015  # the whole pixel, of 2 mm
    assert covered.sum() > 1000
    np.testing.assert_array_equal(with_paddle[covered], without[covered])
    assert (with_paddle != without).sum() > 1000


def test_layers_joints_and_horn_have_their_colours():
    """Along the middle: horn, layer, thinner joint, layer."""
    ends = np.array([[[-0.05, 0.0], [0.0, 0.0]], [[0.02, 0.0], [0.07, 0.0]]])
    paddle = Paddle([RED, BLUE], 0.02, horn=(-0.09, 0.0))
    eye = RenderCamera(SIZE, RenderLens(500.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0, 1, 0))
    frame = PaddleScene(eye, Film(), lambda t: ends[None], paddle, Floor(-0.1, WHITE, contrast=0.0)).frame(0.0)

    def at(x: float, y: float = 0.0):
        return tuple(frame[round(59.5 - 500 * y), round(79.5 + 500 * x)])

    assert [at(-0.09), at(-0.07), at(-0.02), at(0.01), at(0.04)] == [
        (45, 45, 48),
        (45, 45, 48),
        (200, 40, 30),
        (105, 105, 100),
        (30, 60, 210),
    ]
    assert at(0.01, 0.008) == (250, 250, 250)
    assert at(-0.02, 0.008) == (200, 40, 30)


def test_bubbles_drift_straight_on_and_stay_over_the_paddle():
    bubbles = Bubbles(8, radius=0.006, speed=0.05, seed=3)
    low, high = np.array([-0.1, -0.1]), np.array([0.2, 0.1])
    one, two = ([d.centre for d in bubbles.shapes(t, low, high)] for t in (0.0, 0.1))
    ways = np.linalg.norm(np.subtract(two, one), axis=1)
    inside = ways < 0.1  # the others came back on the other side
    assert inside.sum() >= 6
    assert ways[inside].max() <= 0.005
    assert ways[inside].min() >= 0.0025 - 1e-12
    scene = PaddleScene(camera(), Film(), layer((-0.1, 0.0), (0.1, 0.0)), Paddle([RED], 0.3), DARK, bubbles=bubbles)
    frame = scene.frame(0.0)
    low, high = (f(scene.plane.centres, axis=(0, 1)) for f in (np.min, np.max))
    placed = np.array([(*d.centre, 0.0) for d in bubbles.shapes(0.0, low, high)])
    seen = [c for c in camera().sees(placed) if np.all(np.isfinite(c))]
    assert seen
    for u, v in seen:
        assert tuple(frame[round(v), round(u)]) == (225, 232, 235)


def test_colours_that_do_not_match_the_layers_are_told():
    scene = PaddleScene(camera(), Film(), layer((0, 0), (0.1, 0)), Paddle([RED, BLUE], 0.01), DARK)
    with pytest.raises(ValueError, match="2 for 1 layers"):
        scene.frame(0.0)

"""The renderer's sensor: noise, exposure time, spread; and what a scene leaves it to do."""

import numpy as np
import pytest

from nectosome_studies.track.render import Film
from nectosome_studies.track.render.boxes import PixelBox, apart, split
from nectosome_studies.track.render.film import Mottling, Plate


def flat(value: float, height: int = 100, width: int = 160) -> np.ndarray:
    return np.full((height, width, 3), value)


def test_grain_has_its_sigma_and_comes_back():
    """Of 3 counts, with a twelfth of a count squared from rounding; neighbours, colours and frames are independent."""
    plate = Plate(Film(grain=3.0, seed=4), flat(128))
    one, again, other = plate.exposed(0.25, []), plate.exposed(0.25, []), plate.exposed(0.26, [])
    assert (one == again).all()
    x, y = one.astype(float) - 128, other.astype(float) - 128
    assert x.std() == pytest.approx(np.sqrt(9 + 1 / 12), rel=0.01)
    assert abs(x.mean()) < 4 * 3 / np.sqrt(x.size)
    pairs = [(x[1:], x[:-1]), (x[:, 1:], x[:, :-1]), (x[..., 0], x[..., 1]), (x, y)]
    for a, b in pairs:
        assert abs(np.mean(a * b)) / 9 < 5 / np.sqrt(a.size)
    assert (one != Plate(Film(grain=3.0, seed=5), flat(128)).exposed(0.25, [])).mean() > 0.5


def test_light_is_averaged_before_it_is_clipped():
    """Half of the time 400 counts is 200, not half of 255."""
    plate = Plate(Film(gain=2.0), flat(0))
    box = PixelBox(10, 20, 30, 50)
    frame = plate.exposed(0.0, [(box, np.full((*box.shape, 3), 0.5 * 200))])
    assert (frame[box.slices] == 200).all()
    assert frame.sum() == 200 * 3 * 200


def test_the_exposure_time_has_the_frames_time_in_its_middle():
    film = Film(rate=50.0, shutter=0.5, instants=5)
    np.testing.assert_allclose(film.exposure(2.0), 2.0 + np.array([-4, -2, 0, 2, 4]) * 1e-3)
    np.testing.assert_array_equal(Film().exposure(2.0), [2.0])


@pytest.mark.parametrize("film", [Film(defocus=1.3), Film(veil=0.4, veil_width=3.0)])
def test_spread_keeps_light_and_is_that_of_the_whole_picture(film):
    """What changes in a box is spread beyond it, as if all had been spread at once."""
    ground = 40 + 10 * np.random.default_rng(0).normal(size=(60, 80, 3))
    box = PixelBox(25, 31, 30, 41)
    changed = ground.copy()
    changed[box.slices] = 200.0
    partly = Plate(film, ground).exposed(0.0, [(box, changed[box.slices])])
    whole = Plate(film, changed).exposed(0.0, [])
    assert np.abs(partly.astype(int) - whole).max() <= 1  # of rounding
    dot = np.zeros((61, 61, 3))
    dot[30, 30] = 1.0
    spread = film.spread(dot)
    assert spread.sum() == pytest.approx(3.0, rel=1e-6)
    second = np.sum(spread[..., 0] * (np.arange(61) - 30.0) ** 2)
    wanted = 1.3**2 if film.defocus else 0.4 * 9.0
    assert second == pytest.approx(wanted, rel=0.01)


def test_parts_of_a_pixel_pass_an_edge_one_by_one():
    """16 of them at 16 rows and columns a sixteenth apart, all in the pixel; in the next elsewhere; always the same."""
    pixels = np.array([[7.0, 3.0], [8.0, 3.0], [7.0, 4.0]])
    parts = split(pixels, 4) - pixels[:, None]
    assert np.abs(parts).max() <= 0.5
    np.testing.assert_allclose(np.diff(np.sort(parts, axis=1), axis=1), 1 / 16, atol=1e-12)
    assert np.abs(parts[1:] - parts[:1]).max() > 0.05
    np.testing.assert_array_equal(split(pixels[1:], 4) - pixels[1:, None], parts[1:])


def test_boxes_are_joined_until_they_are_apart():
    boxes = [PixelBox(0, 2, 0, 2), PixelBox(5, 7, 0, 2), PixelBox(2, 5, 4, 9), PixelBox(3, 3, 0, 9)]
    assert set(apart(boxes, 0)) == set(boxes[:3])
    assert apart(boxes, 3) == [PixelBox(0, 7, 0, 9)]


def test_mottling_is_smooth_with_unit_variance():
    mottling = Mottling(0.02, 0.3)
    places = np.random.default_rng(0).uniform(-5, 5, (20000, 2))
    values = mottling(places)
    assert abs(values.mean()) < 0.05
    assert values.std() == pytest.approx(1, rel=0.05)
    assert np.abs(mottling(places + np.array([1e-4, 0])) - values).max() < 0.05
    np.testing.assert_array_equal(values, Mottling(0.02, 0.3)(places))


def test_settings_out_of_range_are_told():
    with pytest.raises(ValueError, match="shutter is"):
        Film(shutter=1.5)
    with pytest.raises(ValueError, match="grain"):
        Film(grain=-1.0)

"""Known points that tell no camera, or not that of their pixels: each refusal names the reason and the way out."""

import re
import sys

import numpy as np
import pytest

from nectosome.units import InputError
from nectosome.vision.cameras import Lens, calibrate

from .cameras_made import BOX, CENTRES, SIZE, UNEVEN, camera, inside

TRUE = camera(CENTRES[0])
K = np.array([[1200.0, 0, 640], [0, 1200, 512], [0, 0, 1]])


def noisy(points=UNEVEN, seed=0, sd=0.3, true=TRUE):
    return true.project(points) + sd * np.random.default_rng(seed).normal(size=(len(points), 2))


def replaced(values, k, by):
    out = values.copy()
    out[k] = by
    return out


def refused(*args, **settings) -> InputError:
    with pytest.raises(InputError) as error:
        calibrate(*args, **settings)
    return error.value


FLAT = UNEVEN * [1, 1, 0.01]
LINE = np.outer(np.arange(8.0), [1, 2, 0.5]) + 1e-3 * UNEVEN


@pytest.mark.parametrize(
    ("points", "settings", "field", "message"),
    [
        (UNEVEN[:5], {}, "points", "5 points give 10 equations, and the 11 parameters of a camera need 6 points"),
        (UNEVEN[:6], {"lens": "k1"}, "points", r"\(12 parameters\) need 7 points.* or give the lens"),
        (replaced(UNEVEN, (3, 1), np.nan), {}, "points.3", "is NaN or infinite: leave the point out"),
        (replaced(UNEVEN, 5, UNEVEN[2]), {}, "points.5", "equals points.2"),
        (FLAT, {}, "points", r"lie in a plane, .* m \(rms\) off it, 0\..* % of their spread of 0\.\d* m"),
        (LINE, {}, "points", r"lie on a line, .* m \(rms\) off it"),
        (replaced(FLAT, (6, 2), 0.2), {}, "points", r"all but points.6 lie in a plane.* one point is not enough"),
    ],
)
def test_points_that_tell_no_camera(points, settings, field, message):
    pixels = noisy()[: len(points)]
    error = refused(points, pixels, **settings)
    assert error.field == field
    assert re.search(message, str(error)), str(error)


def test_six_and_seven_points_are_enough():
    x = inside(7, 3)
    assert calibrate(x[:6], noisy(x[:6])).report.freedom == 1
    assert calibrate(x, noisy(x), lens="k1 k2").report.freedom == 1


@pytest.mark.parametrize(
    ("pixels", "settings", "field", "message"),
    [
        (replaced(noisy(), (2, 0), np.nan), {}, "pixels.2", "is NaN or infinite"),
        (replaced(noisy(), (2, 0), 1290.0), {"size": SIZE}, "pixels.2", "outside the picture of 1280 x 1024"),
        (noisy() * [1, 0], {}, "pixels", "lie on a line"),
        (noisy() / SIZE, {}, "pixels", "not fractions of the picture's size"),
        (noisy(), {"lens": Lens(K, np.array([-3.0, 0, 0, 0, 0]))}, "pixels.0", "outside the image of this lens"),
    ],
)
def test_pixels_that_no_camera_sees(pixels, settings, field, message):
    error = refused(UNEVEN, pixels, **settings)
    assert error.field == field and message in str(error)


def test_a_curve_that_goes_through_the_camera_determines_none():
    """A twisted cubic (s, s^2, s^3) through the camera's centre (Hartley & Zisserman 2004, section 22.1.2)."""
    s = np.array([-1, -0.7, -0.3, 0.1, 0.4, 0.8, 1.1, 1.5])
    curve = 0.1 * np.stack([s, s**2, s**3], axis=1)
    on = camera(0.1 * np.array([3.0, 9.0, 27.0]), 3000, at=(0, 0.1, 0))
    assert "do not determine a camera: its equations have a condition number of" in str(
        refused(curve, on.project(curve))
    )
    off = camera([0.5, 0.9, 2.7], 3000, at=(0, 0.1, 0))
    assert calibrate(curve, off.project(curve)).report.rms < 1e-6


def test_points_on_a_circle_around_the_axis_tell_no_lens():
    """Seen head-on, the corners of a box are two rectangles: two radii, two depths, nothing over for k1."""
    error = refused(BOX, camera([0, -2, 0]).project(BOX), lens="k1")
    assert "do not determine the lens beside the camera" in str(error)


def test_a_lens_that_turns_back_before_the_points_is_refused():
    """k1 = -1.44 turns back at x = 0.48; what is beyond is made as if it did not."""
    folded = camera([0.2, -1, 0.3], 400, [-1.44, 0, 0, 0, 0]).project_with_jacobian(inside(40))[0]
    assert "determine no lens: the best fit folds back" in str(refused(inside(40), folded, lens="k1", chance=0))


@pytest.mark.parametrize("seed", range(8))
def test_a_misread_point_is_named(seed):
    pixels = noisy(seed=seed)
    pixels[seed] += [60.0, -40.0]
    error = refused(UNEVEN, pixels)
    assert error.field == f"points.{seed}"
    assert f"points.{seed}: is read" in str(error) and "points, which fit to 0." in str(error)


def test_one_point_of_many_that_is_a_little_off_is_named():
    x = inside(40, 1)
    pixels = noisy(x)
    pixels[17] += [3.0, 0.0]
    assert refused(x, pixels).field == "points.17"


def test_readings_that_are_right_are_rarely_refused():
    """At a chance of 1 in 100, 5 or more of 60 are refused in one of 2500 such tests."""
    count = 0
    for seed in range(60):
        try:
            calibrate(UNEVEN, noisy(seed=seed))
        except InputError:
            count += 1
    assert count < 5


def test_what_few_points_cannot_tell_is_said():
    """Of 16 equations for 11 unknowns 5 are over; of 12 for 11, one, which tells nothing of single points."""
    known = replaced(noisy(), 4, noisy()[4] + [3.0, 2.0])
    found = calibrate(UNEVEN, known, sd_px=0.3)
    assert any(
        "is read" in note and "it may be misread, or this is the effect of refraction" in note
        for note in found.report.notes
    )
    assert "5 more equations than unknowns: a misreading of less than" in found.report.notes[-1]
    few = calibrate(UNEVEN[:6], known[:6])
    assert few.report.notes[-1] == "1 more equation than unknowns: a misreading of any size may be undetected"


@pytest.mark.parametrize(("i", "j"), [(0, 1), (2, 5), (3, 7), (0, 6)])
def test_points_that_were_swapped_are_named(i, j):
    pixels = noisy()
    pixels[[i, j]] = pixels[[j, i]]
    assert f"points.{i} and points.{j} are probably swapped" in str(refused(UNEVEN, pixels))


def test_of_the_swaps_of_a_box_that_fit_as_well_only_what_can_be_seen_is_named():
    """By numbers 1 and 7 would do as well, in a mirror; 2 and 4 or 3 and 5, with a face behind the camera."""
    pixels = noisy(BOX)
    pixels[[0, 6]] = pixels[[6, 0]]
    error = refused(BOX, pixels)
    assert "points.0 and points.6 are probably swapped: they fit" in str(error)


def test_another_order_is_named():
    assert "in the opposite order" in str(refused(UNEVEN, noisy()[::-1]))
    assert "that of points.0 is pixels.2" in str(refused(UNEVEN, np.roll(noisy(), 2, axis=0)))


def test_pixels_of_other_points_fit_no_camera():
    error = refused(UNEVEN, np.random.default_rng(3).uniform(0, 1000, (8, 2)))
    assert "fit no camera" in str(error) and 'lens="k1"' in str(error)


@pytest.mark.parametrize("mirror", [lambda x, p: (x * [1, -1, 1], p), lambda x, p: (x, p * [1, -1])])
def test_a_mirrored_world_is_refused(mirror):
    """It fits as well as the true one: only that all would be behind the camera shows it."""
    assert "are mirrored: x, y, z are left-handed" in str(refused(*mirror(UNEVEN, noisy())))


def test_wrong_shapes_and_settings_are_mistakes_of_the_program():
    with pytest.raises(ValueError, match=r"\[n, 3\] and \[n, 2\] are expected"):
        calibrate(UNEVEN, noisy()[:7])
    with pytest.raises(ValueError, match="sd_px is -1 px"):
        calibrate(UNEVEN, noisy(), sd_px=-1.0)
    with pytest.raises(ValueError, match='lens is "k3"'):
        calibrate(UNEVEN, noisy(), lens="k3")  # type: ignore[arg-type]


def test_without_opencv_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(InputError, match=r"cv2 is missing: pip install 'nectosome\[video\]'"):
        calibrate(UNEVEN, noisy())

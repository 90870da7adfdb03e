"""Sheets: scales, known points, lenses, colours, and mistakes in them."""

import cv2
import numpy as np
import pytest

from nectosome.units import InputError
from nectosome.vision.video import Colour, MarkerSheet, SegmentSheet, load_sheet
from nectosome.vision.video.plane import plane_of
from nectosome.vision.video.segments import ColourGroups

SIZE = (200, 120)
COLOUR = {"hue": (0.0, 1.0)}


def sheet(**more):
    return SegmentSheet.model_validate({"segments": {"a": COLOUR}} | more)


def known(places, pixels):
    return [{"at": tuple(p), "seen": tuple(q)} for p, q in zip(places, pixels, strict=True)]


def test_a_scale_puts_the_origin_where_it_is_said_and_y_upwards():
    plane = plane_of(sheet(pixel=0.002, origin=(50.0, 60.0)), SIZE)
    np.testing.assert_allclose(plane.grid[60, 50], 0, atol=1e-15)
    np.testing.assert_allclose(plane.grid[40, 80], [0.06, 0.04], atol=1e-15)
    assert plane.pixel == pytest.approx(0.002, rel=1e-12)
    np.testing.assert_allclose(plane.pixels(np.array([[0.06, 0.04]])), [[80, 40]], atol=1e-9)


def test_without_a_scale_places_are_in_pixels_from_the_lower_left():
    plane = plane_of(sheet(), SIZE)
    assert plane.unit == "px"
    np.testing.assert_allclose(plane.grid[119, 0], 0, atol=1e-12)
    np.testing.assert_allclose(plane.grid[0, 10], [10, 119], atol=1e-12)


def test_known_points_undo_a_camera_that_looks_aslant():
    """Exact for a plane seen by a pinhole, however it stands."""
    rotation = cv2.Rodrigues(np.array([0.5, -0.3, 0.2]))[0]
    K = np.array([[180, 0, 99.5], [0, 180, 59.5], [0, 0, 1.0]])

    def see(places):
        points = np.column_stack([places, np.zeros(len(places))]) @ rotation.T + [0, 0, 1.1]
        pixels = points @ K.T
        return pixels[:, :2] / pixels[:, 2:]

    places = np.array([[-0.3, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.3, 0.2], [0.05, 0.02]])
    plane = plane_of(sheet(points=known(places, see(places))), SIZE)
    assert plane.residual < 1e-5  # OpenCV stops there
    others = np.random.default_rng(0).uniform(-0.25, 0.25, (20, 2))
    np.testing.assert_allclose(plane.pixels(others), see(others), atol=1e-4)
    u, v = 70, 45
    np.testing.assert_allclose(see(plane.grid[v, u][None]), [[u, v]], atol=1e-4)


def test_a_known_lens_is_undone_as_opencv_does():
    lens = {"focal": (150.0, 152.0), "centre": (98.0, 61.0), "distortion": (-0.2, 0.05, 0.001, -0.002, 0.0)}
    plane = plane_of(sheet(pixel=0.001, origin=(98.0, 61.0), lens=lens), SIZE)
    K = np.array([[150, 0, 98.0], [0, 152, 61], [0, 0, 1]])
    exact = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    seen = np.array([[[10.0, 100.0]]])
    straight = cv2.undistortPoints(seen, K, np.array(lens["distortion"]), None, None, K, exact)[0, 0]
    np.testing.assert_allclose(plane.grid[100, 10], (straight - [98, 61]) * [0.001, -0.001], atol=1e-9)
    np.testing.assert_allclose(plane.pixels(plane.grid[100, 10][None]), [[10, 100]], atol=1e-6)


@pytest.mark.parametrize(
    ("places", "pixels", "told"),
    [
        ([[0, 0], [1, 0], [2, 0], [3, 0]], [[0, 0], [10, 0], [20, 0], [30, 0]], "lie on a line"),
        ([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]], [[0, 0], [50, 0], [50, 50], [0, 50], [40, 12]], "does not fit"),
    ],
)
def test_points_that_tell_nothing_or_contradict_are_refused(places, pixels, told):
    with pytest.raises(InputError, match=told):
        plane_of(sheet(points=known(places, pixels)), SIZE)


def test_hues_go_over_the_full_turn():
    """Red lies on both sides of 0 deg."""
    d = np.deg2rad
    groups = ColourGroups(
        [Colour(hue=(d(340), d(20)), saturation=(0.5, 1)), Colour(hue=(d(100), d(140)), saturation=(0.5, 1))]
    )
    bgr = np.array([[[0, 0, 255], [40, 0, 255], [0, 60, 255], [0, 255, 0], [200, 200, 255], [255, 0, 0]]], np.uint8)
    np.testing.assert_array_equal(groups.find(bgr), [[1, 1, 1, 2, 0, 0]])


def test_colours_that_are_alike_are_one_group():
    a, b = Colour(hue=(0.0, 1.0)), Colour(hue=(2.0, 3.0))
    groups = ColourGroups([a, b, a])
    assert groups.of == [0, 1, 0]
    assert groups.count == 2


BAD = {
    "about: nothing": "does not say what to track",
    "segments: {}": "segments",
    "segments: {a: {hue: [10, 20]}}": "Angle expected",
    "segments: {a: {hue: [10 deg, 400 deg]}}": "out of range",
    "segments: {a: {saturation: [0.9, 0.2]}}": "its lower end comes first",
    "segments: {a: {hue: [10 deg, 10 deg]}}": "its ends are the same",
    "segments: {a: {length: 10 mm}}": "give the size of a pixel",
    "segments: {a: {huw: [10 deg, 20 deg]}}": "there is no field",
    "pixel: 5\nsegments: {a: {}}": "no unit",
    "pixel: 1 mm\nfit: circle\nsegments: {a: {}}": "fit",
    "cameras: {a: {}}\npoints: {}\nmarkers: {}": "cameras",
    "[1, 2]": "no named fields",
}


@pytest.mark.parametrize("text", BAD)
def test_mistakes_in_a_sheet_are_told(tmp_path, text):
    path = tmp_path / "track.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=BAD[text]) as error:
        load_sheet(path)
    assert error.value.file == str(path)


def test_a_sheet_of_markers_is_told_by_its_cameras(tmp_path):
    path = tmp_path / "track.yaml"
    point = "{{at: [{0} m, 0 m, 1 m], seen: {{left: [1, 2], right: [3, 4]}}}}"
    points = ", ".join(f"p{k}: {point.format(k)}" for k in range(6))
    marker = "{{hue: [0 deg, 20 deg], at: [{0} mm, 0 mm, 0 mm]}}"
    markers = ", ".join(f"m{k}: {marker.format(k)}" for k in range(3))
    path.write_text(f"cameras: {{left: {{}}, right: {{}}}}\npoints: {{{points}}}\nmarkers: {{{markers}}}\n")
    assert isinstance(load_sheet(path), MarkerSheet)
    path.write_text(f"cameras: {{left: {{}}, rigth: {{}}}}\npoints: {{{points}}}\nmarkers: {{{markers}}}\n")
    with pytest.raises(InputError, match="there is no such camera"):
        load_sheet(path)

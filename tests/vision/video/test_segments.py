"""Segments in pictures whose truth is known: middles, directions, and gaps where something is in the way."""

import json

import numpy as np
import pytest

from nectosome.units import InputError
from nectosome.vision.video import Reason, track_segments
from nectosome.vision.video.plane import plane_of
from nectosome.vision.video.segments import blobs, coverage, segment_pose
from nectosome_studies.track.render import Film, Strip, write_clip

from . import scenes
from .conftest import RATE, sheet_of


def off(tracked, time):
    """Errors of directions [deg] and of middles [mm]."""
    turn = np.rad2deg(tracked["direction"].values - scenes.angles(time))
    place = 1e3 * (tracked["position"].values - scenes.ends(time).mean(axis=2))
    return (turn + 180) % 360 - 180, place


def rms(x):
    return float(np.sqrt(np.nanmean(np.square(x))))


def test_angles_and_places_are_those_of_the_scene(rowing):
    """At 5 px/cm with grain of 2 counts: the asked 0.5 deg and 1 mm with room to spare."""
    path, time = rowing
    tracked = track_segments(path, sheet_of())
    turn, place = off(tracked, time)
    assert not tracked["reason"].values.any()
    assert rms(turn) < 0.25
    assert rms(place) < 0.2
    assert np.abs(np.mean(place, axis=(0, 1))).max() < 0.05  # and none of it a shift
    np.testing.assert_allclose(tracked["time"], time, atol=2e-3)  # .mkv keeps milliseconds
    bend = np.diff(scenes.angles(time), axis=1)
    assert rms(np.rad2deg(tracked["joint_angle"].values - bend)) < 0.4


def test_a_rectangle_about_whole_pixels_is_worse(rowing):
    """What the paper used; it must work, and moments must be better by far."""
    path, time = rowing
    turn, place = off(track_segments(path, sheet_of(fit="rectangle")), time)
    fine, _ = off(track_segments(path, sheet_of()), time)
    assert rms(turn) < 4
    assert rms(place) < 1
    assert rms(fine) < 0.3 * rms(turn)


def test_lengths_and_widths_are_those_of_the_layers(rowing):
    tracked = track_segments(rowing[0], sheet_of())
    length = np.median(tracked["length"], axis=0)
    np.testing.assert_allclose(length, np.array(scenes.LENGTHS) - 2 * scenes.GAP, rtol=0.05)
    np.testing.assert_allclose(np.median(tracked["width"], axis=0), scenes.THICKNESS, rtol=0.35)  # blurred: wider


def test_seen_from_below_everything_turns_the_other_way(rowing):
    above, below = (track_segments(rowing[0], sheet_of(seen_from=side)) for side in ("above", "below"))
    np.testing.assert_allclose(below["direction"], -above["direction"], atol=1e-9)
    np.testing.assert_allclose(below["position"], above["position"] * [1, -1], atol=1e-12)


def test_a_chain_that_points_to_the_left_has_directions_without_jumps(tmp_path):
    """Turned by half a turn, the directions swing about 180 deg; each is on the same side as those before it."""
    time = np.arange(25) / 15
    scene = scenes.paddle(motion=lambda t: -scenes.ends(t))
    path = write_clip(tmp_path / "left.mkv", (scene.frame(t) for t in time), 15, "ffv1")
    tracked = track_segments(path, sheet_of())
    turn = tracked["direction"].values - scenes.angles(time)
    np.testing.assert_allclose(turn, np.pi * np.sign(np.median(turn)), atol=np.deg2rad(1.5))


def test_layers_of_one_colour_are_told_apart_by_the_chain(tmp_path):
    time = np.arange(25) / 15
    scene = scenes.paddle(colours=(scenes.BLUE, scenes.RED, scenes.RED, scenes.RED))
    path = write_clip(tmp_path / "one.mkv", (scene.frame(t) for t in time), 15, "ffv1")
    sheet = sheet_of()
    red = sheet.segments["first"]
    sheet = sheet.model_copy(update={"segments": sheet.segments | {"second": red, "third": red}})
    tracked = track_segments(path, sheet)
    turn, place = off(tracked, time)
    assert np.mean(tracked["reason"].values == 0) > 0.9
    assert np.nanmax(np.abs(turn)) < 1.5
    assert np.nanmax(np.abs(place)) < 1.0


def test_what_is_behind_a_bar_is_a_gap_and_never_a_guess(tmp_path):
    """The bar hides the third layer in part, the fourth altogether, while the paddle passes under it."""
    time = np.arange(50) / RATE
    bar = Strip((0.19, -0.1), (0.13, 0.13), 0.03, (60, 60, 62))
    scene = scenes.paddle(bar=bar)
    path = write_clip(tmp_path / "bar.mkv", (scene.frame(t) for t in time), RATE, "ffv1")
    tracked = track_segments(path, sheet_of())
    turn, place = off(tracked, time)
    why = tracked["reason"].values
    assert {Reason.LOST, Reason.COVERED} <= set(np.unique(why))
    assert np.all(np.isnan(turn) == (why != 0))
    assert np.nanmax(np.abs(turn)) < 3  # of what a bar covers less than a tenth of
    assert np.nanmax(np.abs(place)) < 2.5
    told = json.loads(tracked.attrs["provenance"])["warnings"]
    assert any("not seen in" in said for said in told)


def test_a_segment_at_the_edge_of_the_picture_is_a_gap(tmp_path):
    scene = scenes.paddle(size=(320, 160))
    path = write_clip(tmp_path / "edge.mkv", (scene.frame(t) for t in np.arange(25) / 15), 15, "ffv1")
    tracked = track_segments(path, sheet_of(size=(320, 160)))
    reach = np.abs(scenes.ends(np.arange(25) / 15)[..., 1]).max(axis=2) * 500  # px from the middle
    why = tracked["reason"].values
    assert np.all(why[reach > 81] != 0)
    assert np.all(why[reach < 75] == 0)
    assert Reason.EDGE in why


def test_noise_that_hides_everything_gives_gaps(tmp_path):
    scene = scenes.paddle(film=Film(rate=30, grain=120.0))
    path = write_clip(tmp_path / "noise.mkv", (scene.frame(t) for t in np.arange(4) / 4), 4, "ffv1")
    tracked = track_segments(path, sheet_of())
    assert np.isnan(tracked["direction"].values).mean() > 0.8


def test_the_wrong_size_is_refused(rowing):
    with pytest.raises(InputError, match="320 x 320 pixels, and the sheet is for 640 x 480"):
        track_segments(rowing[0], sheet_of().model_copy(update={"size": (640, 480)}))


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (4, 1), (2, 2), (3, 5)])
def test_blobs_of_any_shape_are_found(shape):
    bits = np.zeros((20, 30), np.uint8)
    bits[5 : 5 + shape[0], 7 : 7 + shape[1]] = 2
    none, (one,) = blobs(bits, [True, False], 1)
    assert none == []
    assert (one.left, one.top, one.width, one.height, one.pixels) == (7, 5, shape[1], shape[0], shape[0] * shape[1])


def test_what_does_not_stand_out_of_its_surroundings_is_a_gap():
    """Such a blob has no area, and its nan must not turn its neighbours."""
    bits = np.zeros((60, 60), np.uint8)
    bits[20:24, 10:40] = 1
    ((blob,),) = blobs(bits, [True], 4)
    even = np.full((60, 60, 3), 90, np.uint8)
    assert not coverage(blob, even, bits)[1].any()
    plane = plane_of(sheet_of(size=(60, 60)), (60, 60))
    assert segment_pose(blob, even, bits, plane, "moments", False).area == 0

"""Markers before two cameras behind glass: places and poses, doubts, and what is refused."""

import json

import numpy as np
import pytest

from nectosome.units import InputError
from nectosome.vision.cameras import Camera, Glass, calibrate_through_glass
from nectosome.vision.video import Reason, track_markers
from nectosome.vision.video.marker_identity import Candidate, MarkerBody
from nectosome_studies.track import tank
from nectosome_studies.track.render import Port, RenderLens
from nectosome_studies.track.render import RenderCamera as Seeing
from nectosome_studies.track.tank import Filming

HOW = Filming(scale=3.0, rate=20.0)


def path(t):
    t = np.asarray(t, float)
    place = np.stack([-0.1 + 0.3 * t, 0.05 * np.sin(3 * t), 0.3 + 0.05 * np.sin(5 * t)], axis=-1)
    return place, np.stack([0.2 * np.sin(3 * t), 0.25 * np.sin(4 * t + 0.4), 0.4 * np.sin(2 * t)], axis=-1)


@pytest.fixture(scope="module")
def videos(tmp_path_factory):
    return tank.film(tmp_path_factory.mktemp("tank"), path, HOW, 0.6, lambda share: None)


@pytest.fixture(scope="module")
def found(videos):
    return track_markers(videos, tank.sheet(HOW))


def test_places_and_poses_are_those_of_the_scene(found):
    """At 3 px/cm, 5 being what 1 mm is asked at; standard errors tell how far off it is."""
    time = found["time"].values
    place, angle = path(time)
    off = tank.marker_errors(found.assign(true_marker=(("time", "name", "axis"), tank.markers_of(path)(time))))
    assert np.mean(found["reason"].values != 0) < 0.1
    assert np.sqrt(np.nanmean(off**2)) < 0.7e-3
    ratio = (found["position"].values - place) / found["position_se"].values
    assert 0.4 < np.sqrt(np.nanmean(ratio**2)) < 2.5
    assert np.nanmax(np.rad2deg(np.abs(found["angle"].values - angle))) < 0.5
    assert np.all((found["quality"].values > 0) == (found["status"].values == 0))


def test_glass_that_is_not_told_of_shows_in_the_points(videos, found):
    """A matrix of eleven numbers cannot do what the pane does: centimetres off, and the report says by how many px."""
    bare = tank.sheet(HOW).model_copy(update={"glass": None})
    blind = track_markers(videos, bare)
    off = np.linalg.norm(blind["marker"].values - found["marker"].values, axis=2)
    assert np.nanmean(off) > 5e-3
    told = json.loads(blind.attrs["provenance"])["found"]
    assert any("points are 0." in line or "points are 1" in line for line in told)


def test_a_camera_that_is_late_is_put_on_the_clock_of_the_first():
    how = Filming(scale=2.15, rate=20.0, late=0.02)
    late = tank.tracked(path, how, 0.6, lambda share: None)
    off = tank.marker_errors(late)
    assert np.sqrt(np.nanmean(off**2)) < 1.5e-3
    assert "frames of the cameras are up to" in late.attrs["provenance"]


def test_a_rod_before_one_camera_makes_gaps_which_are_filled_only_on_request(tmp_path):
    how = Filming(scale=2.15, rate=20.0, bar=0.05)
    videos = tank.film(tmp_path, path, how, 0.6, lambda share: None)
    gaps = track_markers(videos, tank.sheet(how))
    hidden = np.isnan(gaps["position"].values[:, 0])
    assert 0 < hidden.sum() < len(hidden)
    assert not gaps["filled"].values.any()
    assert np.all((gaps["reason"].values == Reason.SEEN) == np.isfinite(gaps["marker"].values[..., 0]))
    filled = track_markers(videos, tank.sheet(how).model_copy(update={"fill": 5.0}))
    inside = filled["filled"].values.astype(bool)
    assert inside.any()
    assert np.all(hidden[inside])
    place, _ = path(filled["time"].values)
    assert np.abs(filled["position"].values - place)[inside].max() < 0.02
    assert np.isfinite(filled["angle"].values[inside]).all()


def test_one_video_for_two_cameras_is_refused(videos):
    with pytest.raises(InputError, match=r"2 cameras \(left, right\), and there are 1 videos"):
        track_markers(videos[:1], tank.sheet(HOW))


def test_videos_of_another_size_are_refused(videos):
    sheet = tank.sheet(HOW)
    cameras = {name: camera.model_copy(update={"size": (1280, 720)}) for name, camera in sheet.cameras.items()}
    with pytest.raises(InputError, match="894 x 502 pixels, and camera left has 1280 x 720"):
        track_markers(videos, sheet.model_copy(update={"cameras": cameras}))


def test_videos_in_the_wrong_order_are_refused(videos):
    with pytest.raises(InputError, match=r"points\.p\d"):
        track_markers(videos[::-1], tank.sheet(HOW))


def test_a_lamp_that_is_not_there_is_named(videos):
    sheet = tank.sheet(HOW)
    gone = sheet.points["p3"].model_copy(update={"seen": {"left": (450.0, 20.0), "right": (450.0, 20.0)}})
    with pytest.raises(InputError, match=r"points\.p3\.seen\.left: there is no lamp within 10 px"):
        track_markers(videos, sheet.model_copy(update={"points": sheet.points | {"p3": gone}}))


def eyes():
    """Two cameras without glass, exact."""
    out = []
    for x in (-0.8, 0.8):
        seeing = Seeing((1280, 720), RenderLens(900), (x, -1.8, 0.5), (0, 0, 0.3))
        right, down, forward = seeing.axes
        K = np.array([[900, 0, seeing.axis[0]], [0, 900, seeing.axis[1]], [0, 0, 1]])
        R = np.stack([right, down, forward])
        out.append(Camera(K @ np.column_stack([R, -R @ np.array(seeing.place)])))
    return out


def seen(cameras, places, groups, order=None):
    """Candidates by camera and group, in a mixed order."""
    out = []
    for camera in cameras:
        pixels = camera.project(places)
        by_group = [
            [Candidate(tuple(pixels[k]), 9.0) for k in range(len(places)) if groups[k] == g]
            for g in range(max(groups) + 1)
        ]
        out.append([row[::-1] if order else row for row in by_group])
    return out


SCALENE = np.array([[0.12, 0.0, 0.0], [-0.08, 0.1, 0.0], [-0.05, -0.08, 0.06], [0.02, 0.03, 0.12]])


def test_markers_of_one_colour_are_told_apart_by_their_distances():
    cameras = eyes()
    body = MarkerBody(SCALENE, [0, 0, 0, 0], 2.0, 0.003, list("abcd"))
    places = SCALENE + np.array([0.1, 0.05, 0.3])
    picked, reasons = body.find(cameras, seen(cameras, places, [0, 0, 0, 0], order=True))
    assert reasons == [Reason.SEEN] * 4
    np.testing.assert_array_equal(picked, [[3, 2, 1, 0]] * 2)


def test_a_marker_that_is_hidden_leaves_the_others():
    cameras = eyes()
    body = MarkerBody(SCALENE, [0, 0, 0, 0], 2.0, 0.003, list("abcd"))
    there = seen(cameras, SCALENE + np.array([0.1, 0.05, 0.3]), [0, 0, 0, 0])
    del there[1][0][2]
    picked, reasons = body.find(cameras, there)
    assert reasons == [Reason.SEEN, Reason.SEEN, Reason.LOST, Reason.SEEN]
    assert picked[:, 2].tolist() == [-1, -1]


def test_reflections_are_no_markers():
    cameras = eyes()
    body = MarkerBody(SCALENE[:3], [0, 1, 2], 2.0, 0.003, list("abc"))
    places = SCALENE[:3] + np.array([0.0, 0.0, 0.3])
    there = seen(cameras, np.vstack([places, places * [1, 1, -1] + [0, 0, 1.0]]), [0, 1, 2, 0, 1, 2])
    picked, reasons = body.find(cameras, there)
    # the mirror image of three markers has their distances as well
    assert reasons == [Reason.DOUBT] * 3
    assert np.all(picked == -1)
    one = seen(cameras, np.vstack([places, places[:1] * [1, 1, -1] + [0, 0, 1.0]]), [0, 1, 2, 0])
    picked, reasons = body.find(cameras, one)
    assert reasons == [Reason.SEEN] * 3


def test_twins_are_refused():
    with pytest.raises(InputError, match=r"markers\.a: cannot be distinguished from b: they have one colour"):
        MarkerBody(np.array([[0.1, 0, 0], [-0.1, 0, 0], [0, 0.15, 0]]), [0, 0, 1], 2.0, 0.003, list("abc"))


def test_cameras_behind_glass_are_found_exactly():
    """Against the renderer's own rays: two codes, one law."""
    port = Port((0, -0.5, 0), (0, 1, 0), 0.012, 1.0, 1.52, 1.333)
    seeing = Seeing((1280, 720), RenderLens(900), (-0.8, -1.8, 0.7), (0, 0, 0.3), port=port)
    glass = Glass(np.array([0, -0.5, 0.3]), np.array([0, -2.0, 0]), 0.012)
    known = tank.lamps_at()
    camera = calibrate_through_glass(known, seeing.sees(known), glass)
    np.testing.assert_allclose(camera.centre, seeing.place, atol=1e-8)
    others = np.random.default_rng(0).uniform([-0.9, -0.4, 0], [0.9, 0.5, 0.6], (50, 3))
    np.testing.assert_allclose(camera.project(others), seeing.project(others), atol=1e-6)


def test_points_before_the_glass_are_refused():
    known = tank.lamps_at()
    with pytest.raises(InputError, match=r"points\.2: is not behind the glass"):
        moved = known.copy()
        moved[2, 1] = -0.7
        calibrate_through_glass(moved, np.zeros((8, 2)), Glass(np.array([0, -0.5, 0.0]), np.array([0, 1.0, 0])))

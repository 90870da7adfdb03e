"""Pictures and videos of a run: what is in them, where, and that nothing half-written is left."""

import re
from xml.etree import ElementTree

import av
import numpy as np
import pytest
from tests.made_up_runs import made_up_run

from nectosome.units import InputError
from nectosome.view.drawing import CAMERAS, Scene
from nectosome.view.film import write_film, write_still
from nectosome.view.tubes import tubes

SIZE = (320, 180)


def picture(run, time, camera="side", size=SIZE, **told):
    (image,) = Scene(run, float(run["time"][-1]), size, camera, **told).pictures(np.array([time]))
    return image.astype(int)


def blue(image):
    """Where the filament is: much more blue than red, which water is not."""
    return image[..., 0] - image[..., 2] > 80


def orange(image):
    return image[..., 2] - image[..., 0] > 40


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_the_robot_stays_in_the_picture_and_fills_its_share(camera, speed):
    run = made_up_run(speed)
    scene, times = Scene(run, 1.0, SIZE, camera), np.linspace(0, 1, 23)
    parts = tubes(run, times)
    seen = [[scene.camera(t).project(rings[k])[0] for rings in parts.values()] for k, t in enumerate(times)]
    share = np.concatenate([np.abs(x.reshape(-1, 2) / SIZE - 0.5) for each in seen for x in each]).max(axis=0) * 2
    assert share.max() < 0.73
    if camera != "front":  # there it is deeper than wide, and seen from no nearer than that
        assert share.max() > 0.7


def test_the_camera_goes_along_evenly_with_what_moves_evenly(run):
    """From the first moment to the last, although its way is smoothed."""
    scene, times = Scene(run, 1.0, SIZE, "side"), np.linspace(0, 1, 11)
    eyes = np.array([scene.camera(t).eye for t in times])
    np.testing.assert_allclose(eyes - eyes[0], np.outer(times, [-0.5, 0, 0]), atol=1e-9)


def test_the_camera_does_not_shake_with_the_robot():
    """A wobble of 2 Hz is left with exp(-(2 pi 2 Hz 0.5 s)^2 / 2), nothing, but for what the ends of the run make."""
    run = made_up_run(0.0)
    wobble = 0.05 * np.sin(2 * np.pi * 2 * run["time"].values)
    run["position"].values[..., 2] += wobble[:, None]
    scene = Scene(run, 1.0, SIZE, "side")
    height = [scene.camera(t).eye[2] for t in np.linspace(0, 1, 40)]
    assert np.ptp(height) < 0.2 * np.ptp(wobble)


def test_it_is_seen_from_where_it_goes():
    ahead, back = (Scene(made_up_run(speed), 1.0, SIZE, "three-quarter").camera(0.5) for speed in (0.5, -0.5))
    assert ahead.axes[2, 0] < 0 < back.axes[2, 0]


def test_water_robot_and_trail_have_their_colours(run):
    first, last = picture(run, 0.0), picture(run, 1.0)
    for image in (first, last):
        assert 0.01 < blue(image).mean() < 0.3
        assert np.all(np.abs(image[2, -3] - (248, 246, 238)) < 12)  # light water above, deeper below
        assert np.all(np.abs(image[-3, -3] - (216, 203, 169)) < 12)
    assert not orange(first).any()
    assert orange(last).sum() > 20
    assert np.nonzero(orange(last))[1].min() > np.nonzero(blue(last))[1].min()  # it lies where the robot came from


def test_the_grid_stands_still_in_the_world(run):
    """The robot, at 0.5 m/s, passes so many squares that those far above it are seen as they were."""
    scene = Scene(run, 1.0, SIZE, "top")
    time = scene._step / 0.5  # until it has come one square further
    assert 0 < time < 1
    a, b = (picture(run, t, "top")[-30:, 200:] for t in (0.0, time))
    half = picture(run, time / 2, "top")[-30:, 200:]
    assert np.abs(a - b).max() <= 8
    assert np.abs(a - half).max() > 20


def test_the_scale_is_as_long_as_it_says(run):
    scene = Scene(run, 1.0, (640, 360), "side")
    image = picture(run, 0.5, size=(640, 360))
    row = image[360 - 20, :320].max(axis=1) < 60
    camera = scene.camera(0.5)
    middle = camera.eye - scene._away * camera.axes[2]
    pixels, _ = camera.project(middle + np.outer([0, 0.1], camera.axes[0]))
    assert row.sum() == pytest.approx(pixels[1, 0] - pixels[0, 0], abs=1)  # 10 cm, as is written


def test_another_pace_is_told(run):
    plain, told = picture(run, 0.5), picture(run, 0.5, note="0.25 x real time")
    where = np.nonzero(np.any(plain != told, axis=-1))
    assert len(where[0]) > 50 and where[0].max() < 45 and where[1].max() < 180


def test_pictures_in_a_stream_are_those_of_their_moments(run):
    times = np.linspace(0.0, 1.0, 40)
    streamed = list(Scene(run, 1.0, (128, 128), "side").pictures(times))
    assert len(streamed) == 40
    for k in (31, 32, 39):
        assert np.array_equal(streamed[k], picture(run, times[k], size=(128, 128)))


def test_one_moment_is_enough_for_a_picture(run, tmp_path):
    write_still(run.isel(time=[0]), tmp_path / "a.png", at=0.0, end=0.0, size=SIZE, camera="three-quarter")
    assert blue(picture(run.isel(time=[0]), 0.0)).any()


def test_a_robot_of_points_is_refused(run):
    with pytest.raises(InputError, match="no part of this robot has a size"):
        Scene(run.assign(half_width=0 * run["half_width"]), 1.0, SIZE, "side")


def test_a_video_has_its_frames_size_and_length(run, tmp_path):
    """0.8 s of a run, twice as slow, at 20 frames a second: 32 frames, 1.6 s."""
    path, shares = tmp_path / "a.mp4", []
    options = {"size": SIZE, "camera": "side", "rate": 20, "speed": 0.5}
    assert write_film(run, path, end=0.8, progress=shares.append, **options) == 32
    assert shares == [k / 32 for k in range(32)]
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height, stream.pix_fmt, stream.average_rate) == (*SIZE, "yuv420p", 20)
        assert stream.codec_context.name == "h264"
        assert float((stream.duration or 0) * (stream.time_base or 0)) == pytest.approx(1.6)
        images = [frame.to_ndarray(format="bgr24").astype(int) for frame in container.decode(video=0)]
    assert len(images) == 32
    assert all(0.01 < blue(image).mean() < 0.3 for image in images)
    rest = Scene(run, 0.8, SIZE, "side", "0.5 x real time").pictures(np.array([31 * 0.025]))
    assert np.abs(images[-1] - next(rest)).mean() < 4


def test_what_is_interrupted_leaves_nothing(run, tmp_path):
    def stop(share: float) -> None:
        if share > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(run, tmp_path / "a.mp4", end=1.0, size=SIZE, camera="side", progress=stop)
    assert not list(tmp_path.iterdir())


def test_a_picture_in_lines_shows_what_that_in_pixels_does(run, tmp_path):
    """The same words, and the filament, by its colour, in the same place."""
    write_still(run, tmp_path / "a.svg", at=0.5, end=1.0, size=SIZE, camera="side")
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    space = "{http://www.w3.org/2000/svg}"
    assert (root.get("width"), root.get("height")) == ("320", "180")
    assert [each.text for each in root.iter(f"{space}text")] == ["made up", "0.500 s", "10 cm"]
    faces = [path for path in root.iter(f"{space}path") if path.get("fill")]
    fill = np.array([[int(str(path.get("fill"))[k : k + 2], 16) for k in (5, 3, 1)] for path in faces])
    places = np.array([re.findall(r"-?[\d.]+", str(path.get("d"))) for path in faces], float).reshape(-1, 4, 2)
    filament = places[blue(fill)].reshape(-1, 2)
    shown = np.argwhere(blue(picture(run, 0.5)))[:, ::-1] + 0.5
    for end in (np.min, np.max):
        np.testing.assert_allclose(end(filament, axis=0), end(shown, axis=0), atol=1.5)

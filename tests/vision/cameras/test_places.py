"""Places from pixels of several cameras."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from nectosome.vision.cameras import PlaceStatus, calibrate, triangulate

from .cameras_made import BOX, CENTRES, camera, inside

LENS = [-0.25, 0.1, 0.001, -0.001, 0.02]


def three(distortion=None):
    return [camera(centre, 1000, distortion) for centre in CENTRES]


def seen(cameras, x, sd=0.0, seed=0):
    noise = sd * np.random.default_rng(seed).normal(size=(len(cameras), *x.shape[:-1], 2))
    return np.stack([c.project(x.reshape(-1, 3)).reshape(*x.shape[:-1], 2) for c in cameras]) + noise


@given(
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.tuples(*[st.floats(-0.3, 0.3)] * 3),
    st.sampled_from([None, LENS]),
    st.integers(0, 1000),
)
def test_places_are_recovered_exactly(shift, turn, distortion, seed):
    a = camera(np.add(CENTRES[0], 0.3 * np.array(shift)), 1000, distortion, turn=turn[0])
    b = camera(np.add(CENTRES[1], turn), 1000, distortion)
    found = triangulate([a, b], seen([a, b], inside(30, seed)), sd_px=0.1)
    assert (found.status == PlaceStatus.GOOD).all()
    assert np.abs(found.place - inside(30, seed)).max() < 1e-9
    assert found.residual.max() < 1e-9


def test_opencv_finds_the_same_places():
    cv2 = pytest.importorskip("cv2")
    a, b, _ = three()
    pixels = seen([a, b], inside(50))
    theirs = cv2.triangulatePoints(a.matrix, b.matrix, pixels[0].T, pixels[1].T)
    found = triangulate([a, b], pixels, sd_px=0.1)
    assert found.place == pytest.approx((theirs[:3] / theirs[3]).T, abs=1e-9)


@pytest.mark.parametrize("distortion", [None, LENS])
def test_places_are_those_of_least_squares(distortion):
    cameras, sd = three(distortion), np.array([0.3, 2.0, 1.0])
    pixels = seen(cameras, inside(5), 2.0)
    found = triangulate(cameras, pixels, sd_px=sd)
    for k in range(5):

        def off(x, k=k):
            put = np.stack([c.project(x[None])[0] for c in cameras])
            return ((put - pixels[:, k]) / sd[:, None]).ravel()

        best = least_squares(off, found.place[k] + 0.01, xtol=1e-14, ftol=1e-14, gtol=1e-14)
        assert found.place[k] == pytest.approx(best.x, abs=1e-7)
        left = (off(best.x).reshape(3, 2)) * sd[:, None]
        assert found.residual[k] == pytest.approx(np.sqrt(np.sum(left**2) / 3), rel=1e-6)


@pytest.mark.parametrize("distortion", [None, LENS])
def test_standard_errors_are_those_of_many_readings(distortion):
    cameras, sd = three(distortion), np.array([0.1, 0.3, 0.2])
    x = np.tile([0.2, -0.1, 0.15], (20_000, 1))
    noise = np.random.default_rng(1).normal(size=(3, 20_000, 2)) * sd[:, None, None]
    found = triangulate(cameras, seen(cameras, x) + noise, sd_px=sd)
    spread = np.cov(found.place.T)
    assert np.median(found.se, axis=0) == pytest.approx(np.sqrt(np.diag(spread)), rel=0.03)
    correlation = spread / np.sqrt(np.outer(np.diag(spread), np.diag(spread)))
    told = found.covariance[0] / np.outer(found.se[0], found.se[0])
    assert told == pytest.approx(correlation, abs=0.03)


def test_places_of_calibrated_cameras_do_not_depend_on_the_frame_or_the_unit():
    cameras = three()
    noisy = seen(cameras, BOX, 0.3, 1)
    R = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    here = [calibrate(BOX, p) for p in noisy]
    there = [calibrate(1000 * BOX @ R.T + [5e3, 0, 100], p) for p in noisy]
    pixels = seen(cameras, inside(40), 0.3, 2)
    a, b = (triangulate(cs, pixels, sd_px=0.3) for cs in (here, there))
    assert b.place == pytest.approx(1000 * a.place @ R.T + [5e3, 0, 100], abs=1e-4)
    assert b.residual == pytest.approx(a.residual, abs=1e-7)


def test_a_point_that_two_cameras_see_has_a_place():
    cameras, x = three(), inside(4)
    pixels = seen(cameras, x)
    pixels[0, 0], pixels[:2, 1], pixels[:, 2] = np.nan, np.nan, np.nan
    found = triangulate(cameras, pixels, sd_px=0.1)
    assert found.status.tolist() == [
        PlaceStatus.GOOD,
        PlaceStatus.FEW_CAMERAS,
        PlaceStatus.FEW_CAMERAS,
        PlaceStatus.GOOD,
    ]
    for values in (found.place, found.residual[:, None], found.se):
        assert np.isfinite(values).all(axis=1).tolist() == [True, False, False, True]
    assert np.abs(found.place[[0, 3]] - x[[0, 3]]).max() < 1e-9
    assert (found.se[0] > triangulate(cameras, seen(cameras, x), sd_px=0.1).se[0]).all()


def test_frames_and_markers_keep_their_shape():
    cameras, x = three(), inside(12).reshape(4, 3, 3)
    found = triangulate(cameras, seen(cameras, x), sd_px=0.1)
    assert found.place.shape == (4, 3, 3) and found.covariance.shape == (4, 3, 3, 3)
    assert found.residual.shape == found.status.shape == (4, 3)
    assert np.abs(found.place - x).max() < 1e-9
    none = triangulate(cameras, np.empty((3, 0, 2)), sd_px=0.1)
    assert none.place.shape == (0, 3)


def test_a_point_taken_for_another_shows_in_the_residual():
    cameras, x = three()[:2], inside(2)
    pixels = seen(cameras, x)
    pixels[1] = pixels[1, ::-1]
    assert (triangulate(cameras, pixels, sd_px=0.1).residual > 5).all()


@pytest.mark.parametrize("apart", [0.005, 0.05])
def test_rays_that_are_nearly_parallel_give_no_place(apart):
    """Two cameras 2 m away, 0.01 m or 0.1 m apart: 0.29 deg and 2.9 deg."""
    cameras = [camera([s * apart, -2, 0], at=(s * apart, 0, 0)) for s in (-1, 1)]
    x = np.zeros((1, 3))
    found = triangulate(cameras, seen(cameras, x), sd_px=0.1)
    assert found.status[0] == (PlaceStatus.PARALLEL if apart == 0.005 else PlaceStatus.GOOD)
    assert np.isnan(found.place).all() == (apart == 0.005)
    assert np.isfinite(triangulate(cameras, seen(cameras, x), sd_px=0.1, least_angle=1e-3).place).all()


def test_cameras_that_face_each_other_are_parallel():
    cameras = [camera([0, -2, 0]), camera([0, 2, 0])]
    assert triangulate(cameras, seen(cameras, np.zeros((1, 3))), sd_px=0.1).status[0] == PlaceStatus.PARALLEL


def test_rays_that_meet_behind_a_camera_give_no_place():
    cameras = three()[:2]
    behind = np.array([[1.0, -6.0, 0.5]])
    pixels = np.stack([c.project_with_jacobian(behind)[0] for c in cameras])
    found = triangulate(cameras, pixels, sd_px=0.1)
    assert found.status[0] == PlaceStatus.BEHIND and np.isnan(found.place).all()


def test_pixels_at_random_never_give_a_place_behind_a_camera():
    """Most rays come nowhere near each other; what is called good lies before both and fits best."""
    cameras = three(LENS)[:2]
    pixels = np.random.default_rng(0).uniform(-500, 2000, (2, 3000, 2))
    found = triangulate(cameras, pixels, sd_px=1.0)
    kinds = {PlaceStatus(s) for s in found.status}
    assert kinds >= {PlaceStatus.GOOD, PlaceStatus.BEHIND, PlaceStatus.NOT_CONVERGED}
    good = found.status == PlaceStatus.GOOD
    assert np.isfinite(found.place).all(axis=1).tolist() == good.tolist()
    assert all((c.depth(found.place[good]) > 0).all() for c in cameras)
    for step in 1e-3 * np.vstack([np.eye(3), -np.eye(3)]):
        there = np.stack([c.project_with_jacobian(found.place[good] + step)[0] for c in cameras]) - pixels[:, good]
        assert (np.sum(there**2, axis=(0, 2)) > 2 * found.residual[good] ** 2 - 1e-6).all()


def test_every_status_has_words():
    assert len({status.reason for status in PlaceStatus}) == len(PlaceStatus)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pixels": np.zeros((2, 5, 2))}, r"pixels are \(2, 5, 2\)"),
        ({"sd_px": 0.0}, "one positive number"),
        ({"sd_px": np.ones(2)}, "one a camera"),
        ({"least_angle": 0.0}, "least_angle is 0 rad"),
    ],
)
def test_settings_that_go_with_nothing_are_refused(change, message):
    given = {"pixels": np.zeros((3, 5, 2)), "sd_px": 0.1} | change
    with pytest.raises(ValueError, match=message):
        triangulate(three(), given.pop("pixels"), **given)

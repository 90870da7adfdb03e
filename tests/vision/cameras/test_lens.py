"""What a lens does to a picture, against OpenCV."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.vision.cameras import Camera, Lens

from .cameras_made import camera, inside, opencv

K = np.array([[1100.0, 0, 640], [0, 1120, 500], [0, 0, 1]])
BARREL, PINCUSHION = [-0.32, 0.14, 0.001, -0.002, -0.03], [0.2, -0.05, -0.0015, 0.001, 0.01]


@pytest.mark.parametrize("distortion", [None, BARREL, PINCUSHION])
def test_projections_are_those_of_opencv(distortion):
    cv2 = pytest.importorskip("cv2")
    ours = camera([0.3, -1.2, 0.4], 900, distortion)
    K, rvec, t, d = opencv(ours)
    theirs = cv2.projectPoints(inside(200), rvec, t, K, d)[0].reshape(-1, 2)
    assert np.abs(ours.project(inside(200)) - theirs).max() < 1e-9


@pytest.mark.parametrize("distortion", [BARREL, PINCUSHION])
def test_straight_pixels_are_those_of_opencv(distortion):
    cv2 = pytest.importorskip("cv2")
    pixels = np.random.default_rng(0).uniform([0, 0], [1280, 1000], (500, 2))
    exact = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-15)
    theirs = cv2.undistortPoints(pixels[:, None], K, np.array(distortion), None, None, K, exact).reshape(-1, 2)
    assert np.abs(Lens(K, np.array(distortion)).undistort(pixels) - theirs).max() < 1e-9


@given(st.tuples(*[st.floats(-w, w) for w in (0.25, 0.1, 0.003, 0.003, 0.02)]), st.integers(0, 1000))
def test_straightening_undoes_bending(distortion, seed):
    lens = Lens(K, np.array(distortion))
    straight = np.random.default_rng(seed).uniform([0, 0], [1280, 1000], (50, 2))
    bent, _, shown = lens.distort(straight)
    assert (shown > 0).all()
    assert np.abs(lens.undistort(bent) - straight).max() < 1e-9


def test_slopes_are_differences():
    ours, x, h = camera([0.3, -1.2, 0.4], 900, BARREL), inside(20), 1e-6
    _, slope, _ = ours.project_with_jacobian(x)
    for i in range(3):
        step = h * np.eye(3)[i]
        assert slope[:, :, i] == pytest.approx((ours.project(x + step) - ours.project(x - step)) / (2 * h), abs=1e-4)


def test_a_lens_shows_nothing_beyond_where_its_barrel_turns_back():
    """k1 = -0.3: x (1 - 0.3 x^2) is largest at x = 1 / sqrt(0.9) = 1.054, with 0.7027."""
    lens = Lens(K, np.array([-0.3, 0, 0, 0, 0]))
    aside = 640 + 1100 * np.array([0.702, 0.7, 0.704, 2.0])
    straight = lens.undistort(np.column_stack([aside, np.full(4, 500.0)]))
    assert np.isfinite(straight[:2]).all() and np.isnan(straight[2:]).all()
    bare = Camera(np.column_stack([K, np.zeros(3)]), lens)
    x = np.array([[1.05, 0, 1], [1.06, 0, 1], [2.0, 0, 1]])
    assert np.isfinite(bare.project(x)).tolist() == [[True] * 2, [False] * 2, [False] * 2]


def test_what_is_behind_a_camera_is_not_seen():
    ours = camera([0.0, -2.0, 0.0])
    assert np.isfinite(ours.project(np.array([[0.0, 1.0, 0.0]]))).all()
    assert np.isnan(ours.project(np.array([[0.0, -3.0, 0.0]]))).all()


def test_a_matrix_has_one_scale_and_sign():
    ours = camera([0.3, -1.2, 0.4])
    again = Camera(-3.7 * ours.matrix)
    assert again.matrix == pytest.approx(ours.matrix, rel=1e-12)
    assert again.centre == pytest.approx([0.3, -1.2, 0.4], rel=1e-12)
    assert again.depth(np.zeros((1, 3)))[0] == pytest.approx(np.linalg.norm([0.3, -1.2, 0.4]), rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Camera(np.ones((3, 3))), "3 x 4 finite numbers"),
        (lambda: Camera(np.ones((3, 4))), "singular"),
        (lambda: Lens(np.eye(3).T[::-1], np.zeros(5)), "is expected"),
        (lambda: Lens(np.diag([1.0, -1.0, 1.0]), np.zeros(5)), "is expected"),
        (lambda: Lens(np.eye(3), np.zeros(4)), "five numbers"),
    ],
)
def test_what_is_no_camera_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()

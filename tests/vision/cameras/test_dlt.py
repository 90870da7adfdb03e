"""Cameras from known points: exact ones exactly, noisy ones with the errors that are told."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nectosome.vision.cameras import Lens, calibrate
from nectosome.vision.cameras.least_squares import fit, project

from .cameras_made import BOX, CENTRES, SIZE, UNEVEN, camera, inside, opencv

coordinate = st.floats(-1.0, 1.0)


@given(
    st.tuples(coordinate, st.floats(-3.0, -1.2), coordinate),
    st.floats(300.0, 6000.0),
    st.floats(-3.0, 3.0),
    st.integers(0, 10_000),
    st.integers(6, 30),
)
def test_a_camera_is_recovered_from_its_own_pixels(centre, focal, turn, seed, n):
    """Up to what rounding does: a place is exact to 1e-12 m, and conditions reach a few hundred."""
    true, x = camera(centre, focal, turn=turn), inside(n, seed)
    found = calibrate(x, true.project(x))
    assert np.abs(found.matrix - true.matrix).max() < 1e-9 * np.abs(true.matrix).max()
    assert np.abs(found.project(BOX) - true.project(BOX)).max() < 1e-9 * focal
    assert found.report.rms < 1e-9


@pytest.mark.parametrize(("estimate", "k"), [("k1", [-0.25, 0.0]), ("k1", [0.2, 0.0]), ("k1 k2", [-0.3, 0.12])])
def test_a_lens_is_recovered_with_the_camera(estimate, k):
    true = camera(CENTRES[0], 1000, [*k, 0, 0, 0])
    found = calibrate(inside(30), true.project(inside(30)), lens=estimate)
    assert found.lens.distortion == pytest.approx(true.lens.distortion, abs=1e-9)
    assert found.lens.intrinsics == pytest.approx(true.lens.intrinsics, abs=1e-6)
    assert np.abs(found.project(BOX) - true.project(BOX)).max() < 1e-9
    assert calibrate(inside(30), true.project(inside(30))).report.rms > 0.1


def test_a_strong_lens_is_found_where_a_weaker_one_fits_in_part():
    """From k1 = 0 least squares come to rest at k1 = -0.22 with 0.3 px left."""
    true = camera(CENTRES[2], 600, [-0.6, 0, 0, 0, 0])
    found = calibrate(inside(40), true.project(inside(40)), lens="k1")
    assert found.lens.distortion[0] == pytest.approx(-0.6, abs=1e-9)


def test_a_known_lens_is_taken_out():
    true = camera(CENTRES[0], 1000, [-0.3, 0.1, 0.001, -0.002, 0.03])
    found = calibrate(BOX, true.project(BOX), lens=true.lens)
    assert np.abs(found.matrix - true.matrix).max() < 1e-9 * np.abs(true.matrix).max()
    assert "the lens is known" in found.report.notes


def test_opencv_solves_for_the_same_pose():
    cv2 = pytest.importorskip("cv2")
    true = camera(CENTRES[0], 1000, [-0.3, 0.1, 0.001, -0.002, 0.03])
    K, _, _, d = opencv(true)
    found = calibrate(UNEVEN, true.project(UNEVEN), lens=true.lens)
    _, rvec, t = cv2.solvePnP(UNEVEN, true.project(UNEVEN), K, d, flags=cv2.SOLVEPNP_ITERATIVE)
    theirs = K @ np.column_stack([cv2.Rodrigues(rvec)[0], t])
    assert found.matrix == pytest.approx(theirs, abs=1e-4)


def test_opencv_finds_the_same_lens_in_noise():
    """OpenCV has no skew, and so one unknown less: its sum of squares is a little larger."""
    cv2 = pytest.importorskip("cv2")
    true, x = camera(CENTRES[0], 1000, [-0.25, 0, 0, 0, 0]), inside(80)
    pixels = true.project(x) + 0.2 * np.random.default_rng(1).normal(size=(80, 2))
    found = calibrate(x, pixels, lens="k1", size=SIZE)
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
    guess = np.array([[900.0, 0, 640], [0, 900, 512], [0, 0, 1]])
    exact = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-14)
    rms, K, d, rvecs, ts = cv2.calibrateCamera(
        [x.astype(np.float32)], [pixels.astype(np.float32)], SIZE, guess, np.zeros(5), flags=flags, criteria=exact
    )
    theirs = cv2.projectPoints(inside(50, 1), rvecs[0], ts[0], K, d)[0].reshape(-1, 2)
    assert 0.9 * rms < found.report.rms < rms * (1 + 1e-6)
    assert np.abs(found.project(inside(50, 1)) - theirs).max() < 0.1
    se = np.sqrt(found.report.covariance[12, 12])
    assert found.lens.distortion[0] == pytest.approx(d.ravel()[0], abs=se)
    assert found.lens.distortion[0] == pytest.approx(-0.25, abs=4 * se)


@pytest.mark.parametrize("lens", [None, "k1"])
def test_nothing_depends_on_the_frame_or_on_the_unit(lens):
    true = camera(CENTRES[1], 1000, [-0.2, 0, 0, 0, 0])
    x = np.vstack([UNEVEN, inside(6)])
    pixels = true.project(x) + 0.3 * np.random.default_rng(2).normal(size=(14, 2))
    R, t = Rotation.from_euler("xyz", [0.3, -1.2, 2.0]).as_matrix(), np.array([30.0, -4.0, 1.0])
    here, there = calibrate(x, pixels, lens=lens), calibrate(1000 * (x @ R.T + t), pixels, lens=lens)
    assert there.project(1000 * (inside(40) @ R.T + t)) == pytest.approx(here.project(inside(40)), abs=1e-5)
    assert there.report.rms == pytest.approx(here.report.rms, rel=1e-9)
    assert there.report.place_se == pytest.approx(1000 * here.report.place_se, rel=1e-4)


def test_the_refined_camera_is_nearer_than_any_beside_it():
    true = camera(CENTRES[0], 1000, [-0.2, 0, 0, 0, 0])
    x = inside(20)
    pixels = true.project(x) + 0.5 * np.random.default_rng(3).normal(size=(20, 2))
    found = calibrate(x, pixels, lens="k1")
    K, rotation, shift, d = opencv(found)
    best = np.concatenate([K[[0, 0, 1, 0, 1], [0, 1, 1, 2, 2]], rotation.ravel(), shift.ravel(), d[:1]])

    def squares(change):
        return np.sum((project(best * (1 + change[:12]), x)[0] - pixels) ** 2)

    least = squares(np.zeros(12))
    assert least == pytest.approx(20 * found.report.rms**2, rel=1e-9)
    rng = np.random.default_rng(4)
    assert all(squares(1e-4 * rng.normal(size=12)) > least for _ in range(50))


@pytest.mark.parametrize(("lens", "runs"), [(None, 400), ("k1", 200)])
def test_standard_errors_are_those_of_many_calibrations(lens, runs):
    """Each number of the matrix, k1, and the place in the middle; 200 runs tell a spread to 5 %, 400 to 3.5 %.

    2500 runs with k1 agreed with all of them to 4.5 %.
    """
    true, x, sd = camera(CENTRES[0], 1000, [-0.2, 0, 0, 0, 0] if lens else None), inside(25), 0.2
    rng, exact = np.random.default_rng(6), true.project(x)
    middle = x.mean(axis=0, keepdims=True)
    at, slope, _ = true.project_with_jacobian(middle)
    back = np.linalg.pinv(slope[0])
    numbers, places = [], []
    for _ in range(runs):
        found = fit(x, exact + sd * rng.normal(size=exact.shape), terms=1 if lens else 0).camera
        numbers.append([*found.matrix.ravel(), *(found.lens.distortion[:1] if lens else [])])
        places.append(back @ (found.project(middle) - at)[0])
    predicted = calibrate(x, exact, lens=lens, sd_px=sd, chance=0).report
    assert np.sqrt(np.diag(predicted.covariance)) == pytest.approx(np.std(numbers, axis=0), rel=0.1)
    spread = np.sqrt(np.mean(np.sum(np.square(places), axis=1)) / 2)
    assert sd * predicted.place_se == pytest.approx(spread, rel=0.1)


@pytest.mark.parametrize(
    ("terms", "lens"),
    [(0, None), (2, None), (0, Lens(np.diag([900.0, 900.0, 1.0]), np.array([-0.2, 0.1, 0.001, -0.002, 0.03])))],
)
def test_slopes_are_differences(terms, lens):
    """K has a skew: all of its derivatives count."""
    _, rotation, shift, _ = opencv(camera(CENTRES[0]))
    p = np.array([1000.0, 40, 900, 600, 500, *rotation.ravel(), *shift.ravel(), *[-0.2, 0.1][:terms]])
    slopes = project(p, inside(6), lens)[1]
    for i in range(len(p)):
        h = 1e-6 * max(abs(p[i]), 0.1) * np.eye(len(p))[i]
        apart = project(p + h, inside(6), lens)[0] - project(p - h, inside(6), lens)[0]
        assert slopes[:, :, i] == pytest.approx(apart / (2 * h[i]), rel=1e-5, abs=1e-4)


def test_the_noise_of_readings_is_estimated():
    """50 runs of 5 equations that are over: 250 degrees of freedom tell a variance to 9 %."""
    true, rng = camera(CENTRES[0]), np.random.default_rng(6)
    runs = [calibrate(UNEVEN, true.project(UNEVEN) + 0.3 * rng.normal(size=(8, 2)), chance=0) for _ in range(50)]
    assert {run.report.freedom for run in runs} == {5}
    assert np.mean([run.report.sd**2 for run in runs]) == pytest.approx(0.09, rel=0.25)
    report = runs[0].report
    assert report.rms == pytest.approx(np.sqrt(np.mean(np.sum(report.residual**2, axis=1))))


def test_the_report_says_when_points_are_further_off_than_they_should_be():
    true, rng = camera(CENTRES[0]), np.random.default_rng(8)
    pixels = true.project(UNEVEN) + 1.0 * rng.normal(size=(8, 2))
    notes = calibrate(UNEVEN, pixels, sd_px=0.05).report.notes
    assert any("px instead of 0.05 px" in note for note in notes)
    assert not any("instead of" in note for note in calibrate(UNEVEN, pixels, sd_px=1.0).report.notes)


def test_a_lens_that_points_do_not_tell_is_said_to_be_unsure():
    true = camera(CENTRES[0])
    pixels = true.project(UNEVEN) + 0.5 * np.random.default_rng(9).normal(size=(8, 2))
    notes = calibrate(UNEVEN, pixels, lens="k1").report.notes
    assert any(note.startswith("k1 = ") and note.endswith("not distinguishable from 0") for note in notes)


def test_a_lens_in_the_words_of_opencv_comes_back():
    true = camera(CENTRES[0], 1000, [-0.25, 0, 0, 0, 0])
    found = calibrate(inside(30), true.project(inside(30)), lens="k1")
    again = calibrate(BOX, true.project(BOX), lens=Lens(found.lens.intrinsics, found.lens.distortion))
    assert again.report.rms < 1e-6

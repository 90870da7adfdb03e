"""Poses of a body from its markers."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nectosome.core.se3 import rotation_from_rpy
from nectosome.units import InputError
from nectosome.vision.cameras import PlaceStatus, pose

THREE = np.array([[0.10, 0.0, 0.02], [-0.05, 0.08, 0.03], [-0.06, -0.07, 0.0]])
FIVE = np.vstack([THREE, [[0.0, 0.02, 0.09], [0.03, -0.04, -0.05]]])


def project_normalised(body, rotations, places):
    return np.einsum("tij,mj->tmi", rotations, body) + places[:, None]


def rpy(angles):
    return np.asarray(rotation_from_rpy(jnp.asarray(angles, float)))


def some(t, seed=0):
    rng = np.random.default_rng(seed)
    return Rotation.random(t, rng=rng).as_matrix(), rng.uniform(-1, 1, (t, 3))


@given(st.integers(0, 10_000), st.sampled_from([THREE, FIVE, FIVE[:4] * [1, 1, 0]]))
def test_a_pose_is_recovered_exactly(seed, body):
    R, x = some(10, seed)
    found = pose(project_normalised(body, R, x), body)
    assert np.abs(found.rotation - R).max() < 1e-9 and np.abs(found.place - x).max() < 1e-9
    assert found.residual.max() < 1e-9


def test_angles_are_those_of_robots_here():
    """R = Rz(yaw) Ry(pitch) Rx(roll), as `core.se3` has it, and scipy's intrinsic ZYX."""
    angles = np.array([[0.3, -0.4, 1.0], [-2.5, 1.2, 3.0], [3.1, -1.4, -3.1], [0.0, 0.5, 0.0]])
    R = rpy(angles)
    found = pose(project_normalised(THREE, R, np.zeros((4, 3))), THREE)
    assert found.angles == pytest.approx(angles, abs=1e-9)
    assert Rotation.from_matrix(R).as_euler("ZYX")[:, ::-1] == pytest.approx(found.angles, abs=1e-9)


def test_the_rotation_of_noisy_markers_is_that_of_scipy():
    R, x = some(20)
    places = project_normalised(FIVE, R, x) + 0.01 * np.random.default_rng(1).normal(size=(20, 5, 3))
    found = pose(places, FIVE)
    for k in range(20):
        centred = places[k] - places[k].mean(axis=0), FIVE - FIVE.mean(axis=0)
        best, distance = Rotation.align_vectors(*centred)
        assert found.rotation[k] == pytest.approx(best.as_matrix(), abs=1e-9)
        assert found.residual[k] == pytest.approx(distance / np.sqrt(5), rel=1e-6)
    off = places - project_normalised(FIVE, found.rotation, found.place)
    assert found.residual == pytest.approx(np.sqrt(np.mean(np.sum(off**2, axis=2), axis=1)))


@given(st.integers(0, 1000))
def test_poses_turn_with_the_world_and_scale_with_the_unit(seed):
    R, x = some(5, seed)
    places = project_normalised(FIVE, R, x) + 0.01 * np.random.default_rng(seed).normal(size=(5, 5, 3))
    (turn,), (shift,) = some(1, seed + 1)
    here, there = pose(places, FIVE), pose(1000 * (places @ turn.T + shift), 1000 * FIVE)
    assert there.rotation == pytest.approx(turn @ here.rotation, abs=1e-9)
    assert there.place == pytest.approx(1000 * (here.place @ turn.T + shift), abs=1e-6)
    assert there.residual == pytest.approx(1000 * here.residual, rel=1e-9)


def test_a_marker_may_be_missing():
    R, x = some(4)
    places = project_normalised(FIVE, R, x)
    places[0, 3], places[1, [0, 4]], places[2, :3] = np.nan, np.nan, np.nan
    found = pose(places, FIVE, covariance=np.tile(1e-6 * np.eye(3), (4, 5, 1, 1)))
    assert found.status.tolist() == [PlaceStatus.GOOD, PlaceStatus.GOOD, PlaceStatus.FEW_MARKERS, PlaceStatus.GOOD]
    good = [0, 1, 3]
    assert np.abs(found.rotation[good] - R[good]).max() < 1e-9
    assert np.abs(found.place[good] - x[good]).max() < 1e-9
    for values in (found.place, found.angles, found.place_se, found.angles_se, found.rotation[:, 0]):
        assert np.isfinite(values).all(axis=1).tolist() == [True, True, False, True]
    assert (found.angles_se[1] > found.angles_se[3]).any()


def test_markers_on_a_line_that_remain_give_no_pose():
    body = np.vstack([FIVE, (FIVE[0] + FIVE[1]) / 2])
    R, x = some(2)
    places = project_normalised(body, R, x)
    places[0, 2:5] = np.nan
    found = pose(places, body)
    assert found.status.tolist() == [PlaceStatus.LINE, PlaceStatus.GOOD]
    assert np.isnan(found.rotation[0]).all() and np.isfinite(found.rotation[1]).all()


@pytest.mark.parametrize("body", [THREE, FIVE])
def test_standard_errors_are_those_of_many_frames(body):
    """Errors along one direction are three times those across, and differ from marker to marker."""
    t, m = 8_000, len(body)
    rng = np.random.default_rng(2)
    root = np.array([rng.normal(size=(3, 3)) * [3, 1, 1] * 2e-4 for _ in range(m)])
    noise = np.einsum("mij,tmj->tmi", root, rng.normal(size=(t, m, 3)))
    R = np.tile(rpy([0.4, -0.9, 2.0]), (t, 1, 1))
    places = project_normalised(body, R, np.tile([0.1, 0.2, -0.3], (t, 1))) + noise
    covariance = np.broadcast_to(root @ root.transpose(0, 2, 1), (t, m, 3, 3))
    found = pose(places, body, covariance=covariance)
    assert np.median(found.place_se, axis=0) == pytest.approx(found.place.std(axis=0), rel=0.05)
    assert np.median(found.angles_se, axis=0) == pytest.approx(found.angles.std(axis=0), rel=0.05)


def test_standard_errors_hold_where_the_body_does_not_fit():
    """A marker that is 20 mm off where the body has it: G of the places, not of the body alone."""
    t = 10_000
    R, x = np.tile(np.eye(3), (t, 1, 1)), np.zeros((t, 3))
    wrong = FIVE + np.array([[0.02, 0, 0]] + [[0, 0, 0]] * 4)
    places = project_normalised(wrong, R, x) + 1e-4 * np.random.default_rng(3).normal(size=(t, 5, 3))
    found = pose(places, FIVE, covariance=np.broadcast_to(1e-8 * np.eye(3), (t, 5, 3, 3)))
    assert np.median(found.angles_se, axis=0) == pytest.approx(found.angles.std(axis=0), rel=0.03)


def test_without_errors_of_markers_there_are_none_of_the_pose():
    R, x = some(2)
    found = pose(project_normalised(THREE, R, x), THREE)
    assert np.isnan(found.place_se).all() and np.isnan(found.angles_se).all()


def test_a_mirrored_body_shows_unless_it_is_flat():
    """Five markers in space: nothing turns the one into the other. Three are turned over, and nothing is left."""
    R, x = some(5)
    mirror = np.array([1, -1, 1])
    space = pose(project_normalised(FIVE, R, x), FIVE * mirror)
    assert (space.residual > 0.02).all()
    assert np.linalg.det(space.rotation) == pytest.approx(1)
    assert (pose(project_normalised(THREE, R, x), THREE * mirror).residual < 1e-9).all()


def test_exchanged_markers_show_unless_the_body_is_as_symmetric():
    R, x = some(5)
    assert (pose(project_normalised(THREE, R, x)[:, [1, 0, 2]], THREE).residual > 0.005).all()
    isosceles = np.array([[0.1, 0, 0], [-0.05, 0.06, 0], [-0.05, -0.06, 0]])
    assert (pose(project_normalised(isosceles, R, x)[:, [0, 2, 1]], isosceles).residual < 1e-9).all()


def test_near_a_pitch_of_90_deg_the_rotation_holds():
    pitch = np.radians([80.0, 89.5, 90.0, -89.5])
    R = np.array([rpy([0.3, p, 0.7]) for p in pitch])
    covariance = np.broadcast_to(1e-8 * np.eye(3), (4, 3, 3, 3))
    found = pose(project_normalised(THREE, R, np.zeros((4, 3))), THREE, covariance=covariance)
    assert found.status.tolist() == [PlaceStatus.GOOD, PlaceStatus.GIMBAL, PlaceStatus.GIMBAL, PlaceStatus.GIMBAL]
    assert np.abs(found.rotation - R).max() < 1e-9
    assert found.angles[:, 1] == pytest.approx(pitch, abs=1e-7)
    assert (found.angles_se[1] > 10 * found.angles_se[0])[[0, 2]].all()


def test_angles_are_unwrapped_only_when_asked():
    turn = np.linspace(0, 4 * np.pi, 60)
    R = Rotation.from_rotvec(np.outer(turn, [0, 0, 1])).as_matrix()
    places = project_normalised(THREE, R, np.zeros((60, 3)))
    places[20:25] = np.nan
    there = np.isfinite(places).all(axis=(1, 2))
    plain, whole = pose(places, THREE), pose(places, THREE, unwrap=True)
    assert np.abs(plain.angles[there]).max() <= np.pi
    assert whole.angles[there, 2] == pytest.approx(turn[there], abs=1e-9)
    assert np.isnan(whole.angles[~there]).all()


@pytest.mark.parametrize(
    ("body", "field", "message"),
    [
        (THREE[:2], "body", "has 2 markers, and a pose needs three"),
        (THREE * [1, 0.01, 0.01], "body", "has its markers on a line, .* m .rms. off it, .* % of their"),
        (FIVE[[0, 1, 2, 1]], "body.3", "equals body.1"),
        (THREE * [1, np.nan, 1], "body", "NaN or infinite"),
    ],
)
def test_a_body_that_has_no_pose_is_refused(body, field, message):
    with pytest.raises(InputError, match=message) as error:
        pose(np.zeros((2, len(body), 3)), body)
    assert error.value.field == field


def test_shapes_that_do_not_go_together_are_refused():
    with pytest.raises(ValueError, match="are expected"):
        pose(np.zeros((2, 4, 3)), THREE)
    with pytest.raises(ValueError, match="covariance is"):
        pose(np.zeros((2, 3, 3)), THREE, covariance=np.zeros((2, 3, 3)))

"""Rotations with a shift between points that belong together."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import special_ortho_group

from nectosome.identification import align_inliers, align_points


@given(st.integers(2, 5), st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_a_motion_is_found_again(d, seed):
    rng = np.random.default_rng(seed)
    R, T = special_ortho_group.rvs(d, random_state=rng), rng.normal(size=d)
    points = rng.normal(size=(d + 3, d))
    found = align_points(points, points @ R.T + T)
    np.testing.assert_allclose(found.rotation, R, atol=1e-10)
    np.testing.assert_allclose(found.translation, T, atol=1e-10)


def test_noisy_and_mirrored_points_are_aligned_as_by_scipy():
    """What is nearest to a mirror image is still a rotation; and the centroid goes to the centroid."""
    rng = np.random.default_rng(0)
    s = rng.normal(size=(12, 3)) * [1, 2, 0.5]
    for e in (s @ special_ortho_group.rvs(3, random_state=rng).T + 0.3 * rng.normal(size=s.shape), s * [1, 1, -1] + 2):
        found = align_points(s, e)
        theirs, _ = Rotation.align_vectors(e - e.mean(axis=0), s - s.mean(axis=0))
        np.testing.assert_allclose(found.rotation, theirs.as_matrix(), atol=1e-12)
        assert np.linalg.det(found.rotation) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(found(s).mean(axis=0), e.mean(axis=0), atol=1e-12)


def test_one_point_is_shifted_and_none_is_an_error():
    found = align_points(np.array([[1.0, 2.0, 3.0]]), np.array([[1.0, 2.0, 5.0]]))
    np.testing.assert_allclose(found(np.array([[1.0, 2.0, 3.0]])), [[1.0, 2.0, 5.0]], atol=1e-12)
    with pytest.raises(ValueError, match="no points"):
        align_points(np.zeros((0, 3)), np.zeros((0, 3)))


@pytest.mark.parametrize(("count", "wrong"), [(10, 3), (40, 12)])
def test_outliers_are_left_out(count, wrong):
    """All subsets, or some; three in ten points are wrong by many times the noise."""
    rng = np.random.default_rng(1)
    R, T, s = special_ortho_group.rvs(3, random_state=rng), np.array([0.1, -0.2, 0.3]), rng.uniform(size=(count, 3))
    e = s @ R.T + T + 1e-3 * rng.normal(size=s.shape)
    e[:wrong] += np.array([1.0, -1.0, 1.0]) * rng.uniform(0.3, 1.0, size=(wrong, 1))
    found, kept = align_inliers(s, e)
    assert not kept[:wrong].any()
    assert kept[wrong:].sum() >= 0.9 * (count - wrong)
    np.testing.assert_allclose(found.rotation, R, atol=5e-3)
    assert np.abs(align_points(s, e).rotation - R).max() > 0.05


def test_points_without_outliers_or_too_few_are_all_kept():
    rng = np.random.default_rng(2)
    s = rng.uniform(size=(8, 3))
    found, kept = align_inliers(s, s + 0.5)
    assert kept.all()
    np.testing.assert_allclose(found(s), s + 0.5, atol=1e-12)
    _, kept = align_inliers(s[:5], rng.uniform(size=(5, 3)))
    assert kept.all()

"""Which blob is which segment, and which way it points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nectosome.vision.video.angles import along_chain, assign_segments
from nectosome.vision.video.reasons import Reason
from nectosome.vision.video.segments import SegmentPose

turns = st.lists(st.floats(-1.2, 1.2), min_size=3, max_size=3)


def chain(start, bends, lengths=(0.1, 0.035, 0.03, 0.04), gap=0.006):
    """Poses and directions of segments one after another; axes are told only up to half a turn."""
    place, direction = np.zeros(2), start
    poses, directions = [], []
    for length, bend in zip(lengths, [0.0, *bends], strict=True):
        direction += bend
        unit = np.array([np.cos(direction), np.sin(direction)])
        poses.append(
            SegmentPose(place + unit * (0.5 * gap + 0.5 * length), direction % np.pi, length, 0.005, 1.0, False)
        )
        directions.append(direction)
        place = place + unit * (length + gap)
    return poses, directions


def off(found, wanted):
    return abs((found - wanted + np.pi) % (2 * np.pi) - np.pi)


@settings(max_examples=60, deadline=None)
@given(start=st.floats(-3.1, 3.1), bends=turns)
def test_directions_follow_from_the_neighbours(start, bends):
    poses, wanted = chain(start, bends)
    row, reasons, found = assign_segments([[pose] for pose in poses], [0, 1, 2, 3], None)
    assert row == poses
    assert reasons == [Reason.SEEN] * 4
    assert max(off(a, b) for a, b in zip(found, wanted, strict=True)) < 1e-9


@settings(max_examples=40, deadline=None)
@given(
    start=st.floats(-3.1, 3.1),
    bends=st.lists(st.floats(-0.8, 0.8), min_size=3, max_size=3),
    order=st.permutations(range(3)),
)
def test_segments_of_one_colour_are_told_apart_or_a_doubt(start, bends, order):
    """Never one for the other."""
    poses, wanted = chain(start, bends)
    last = [poses[1:][k] for k in order]
    row, reasons, found = assign_segments([[poses[0]], last], [0, 1, 1, 1], None)
    for k in range(4):
        if reasons[k] == Reason.SEEN:
            assert row[k] is poses[k]
            assert off(found[k], wanted[k]) < 1e-9
        else:
            assert found[k] is None


def test_a_straight_chain_is_no_doubt():
    poses, _ = chain(0.3, [0.05, -0.1, 0.05])
    row, reasons, _ = assign_segments([[poses[0]], [poses[3], poses[1], poses[2]]], [0, 1, 1, 1], None)
    assert row == poses
    assert reasons == [Reason.SEEN] * 4


def test_a_segment_without_neighbours_has_a_place_and_no_direction():
    poses, _ = chain(0.3, [0.4, -0.1, 0.05])
    row, reasons, found = assign_segments([[poses[0]], [], [poses[2]], [poses[3]]], [0, 1, 2, 3], None)
    assert reasons == [Reason.DIRECTION, Reason.LOST, Reason.SEEN, Reason.SEEN]
    assert row[0] is poses[0]
    assert found[:2] == [None, None]


def test_the_base_tells_the_direction_of_the_first():
    poses, wanted = chain(2.0, [0.4, -0.1, 0.05])
    _, reasons, found = assign_segments([[poses[0]], [], [poses[2]], [poses[3]]], [0, 1, 2, 3], np.zeros(2))
    assert reasons[0] == Reason.SEEN
    assert off(found[0], wanted[0]) < 1e-9


def test_more_or_fewer_blobs_than_segments_are_gaps():
    poses, _ = chain(0.3, [0.4, -0.1, 0.05])
    assert assign_segments([[poses[0]], poses[1:3]], [0, 1, 1, 1], None)[1][1:] == [Reason.MERGED] * 3
    assert assign_segments([[poses[0]], [*poses[1:], poses[1]]], [0, 1, 1, 1], None)[1][1:] == [Reason.PIECES] * 3
    assert assign_segments([[poses[0], poses[1]], []], [0, 1], None)[1] == [Reason.PIECES, Reason.LOST]


def test_what_is_as_wide_as_long_has_no_direction():
    poses, _ = chain(0.3, [0.4, -0.1, 0.05])
    square = SegmentPose(poses[1].middle, 0.0, 0.02, 0.019, 1.0, False)
    _, reasons, found = assign_segments([[poses[0]], [square], [poses[2]], [poses[3]]], [0, 1, 2, 3], None)
    assert reasons == [Reason.SEEN, Reason.ROUND, Reason.SEEN, Reason.SEEN]
    assert found[1] is None


@pytest.mark.parametrize("lost", [(), (0,), (2,), (1, 4)])
def test_a_chain_that_curls_beyond_half_a_turn_and_goes_round_has_directions_without_jumps(lost):
    """Eight segments bent by up to 50 deg each make 350 deg; the first one turns 3.2 times, 1.6 while some are lost."""
    t = np.linspace(0.0, 4.0, 200)
    bends = np.radians(50) * np.sin(2 * t)[:, None] * np.ones(7)
    truth = np.cumsum(np.column_stack([2 * np.pi * 0.8 * t, bends]), axis=1)
    seen = (truth + np.pi) % (2 * np.pi) - np.pi
    for k in lost:
        seen[40:140, k] = np.nan
    direction, turn = along_chain(seen)
    known = np.isfinite(seen)
    shift = (direction - truth)[0, 0]
    np.testing.assert_allclose((direction - shift)[known], truth[known], atol=1e-12)
    there = np.isfinite(turn)
    np.testing.assert_allclose(turn[there], bends[there], atol=1e-12)

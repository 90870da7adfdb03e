"""Bags of ROS 2 in SQLite: the same topics as in MCAP, where the file has the definitions of its messages."""

import sqlite3
from importlib.util import find_spec

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from nectosome.measure import read as read_recording
from nectosome.measure.formats.db3 import open_db3
from nectosome.measure.formats.mcap import open_mcap
from nectosome.units import InputError

from . import bags
from .read import check_refusals, cuts, read, survived

pytestmark = pytest.mark.skipif(find_spec("mcap_ros2") is None, reason="the extra mcap is not installed")


def test_a_bag_reads_as_the_same_messages_in_mcap(tmp_path):
    rows = [*bags.wrenches(20)], [*bags.poses(6)]
    ours = read(open_db3, bags.write_db3(tmp_path / "a.db3", *rows))
    other = read(open_mcap, bags.write_bag(tmp_path / "a.mcap", *rows))
    assert (ours.names, ours.units, ours.found) == (other.names, other.units, other.found)
    assert_array_equal(ours.values, other.values)
    run = read_recording(tmp_path / "a.db3")
    assert_allclose(run["cell.wrench.force.y"], 0.25 * np.arange(20))
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["a.db3", "a.mcap"]  # SQLite left nothing


def test_a_bag_without_definitions_says_how_to_convert_it(tmp_path):
    bags.write_db3(tmp_path / "old.db3", bags.wrenches(3), defined=False)
    with pytest.raises(
        InputError, match=r"no definitions of its messages.*before ROS 2 Iron.*`mcap convert .*ros2 bag convert`"
    ):
        read(open_db3, tmp_path / "old.db3")


def test_a_topic_without_definition_is_left_out_with_a_word(tmp_path):
    bags.write_db3(tmp_path / "a.db3", bags.wrenches(3), bags.poses(2))
    with sqlite3.connect(tmp_path / "a.db3") as bag:
        bag.execute("DELETE FROM message_definitions WHERE topic_type LIKE '%Pose%'")
    bag.close()
    found = read(open_db3, tmp_path / "a.db3").found
    assert (
        found[-1] == "left out: /camera/pose (geometry_msgs/msg/PoseStamped, 2 messages): the file lacks its definition"
    )


def test_what_is_no_bag_is_told_and_a_cut_one_is_refused(tmp_path):
    with sqlite3.connect(tmp_path / "other.db3") as other:
        other.execute("CREATE TABLE force(x REAL)")
    other.close()
    files = {
        "other.db3": ((tmp_path / "other.db3").read_bytes(), "is a database, and no bag of ROS 2"),
        "text.db3": (b"t,F\n0,1\n" * 100, "this is not a bag of ROS 2 in SQLite"),
        "empty.db3": (b"", "is empty"),
    }
    check_refusals(open_db3, tmp_path, files)
    raw, whole = bags.write_db3(tmp_path / "a.db3", bags.wrenches(60)).read_bytes(), None
    for cut in cuts(raw):
        whole = survived(open_db3, tmp_path / "cut.db3", cut)
        assert whole is None or len(whole.values) == 60

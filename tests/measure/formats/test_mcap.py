"""Recordings of ROS 2 and Foxglove: topics as columns with units and times of their own; damaged files."""

import json
import struct
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from nectosome.cli.app import main
from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, load_campaign
from nectosome.measure import read as read_recording
from nectosome.measure.formats.mcap import open_mcap
from nectosome.units import InputError

from . import bags
from .read import check_refusals, cuts, read, survived

pytestmark = pytest.mark.skipif(find_spec("mcap_ros2") is None, reason="the extra mcap is not installed")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return bags.write_bag(tmp_path_factory.mktemp("bag") / "run.mcap", bags.wrenches(), bags.poses())


def about(run):
    return json.loads(run.attrs["provenance"])


def one_topic(path, kind, *contents, topic="/a"):
    """Read messages of one topic, a second apart."""
    times = [bags.ZERO + k * 10**9 for k in range(max(2, len(contents)))]
    rows = [contents[min(k, len(contents) - 1)] for k in range(len(times))]
    if "Header header" in bags.KINDS[kind]:
        rows = [{"header": bags.header(time)} | row for time, row in zip(times, rows, strict=True)]
    bags.write_bag(path / "one.mcap", [(topic, kind, time, row) for time, row in zip(times, rows, strict=True)])
    return read(open_mcap, path / "one.mcap")


def test_topics_come_back_with_names_units_and_times_of_their_own(bag):
    contents = read(open_mcap, bag)
    wrench = [f"cell.wrench.{what}.{axis}" for what in ("force", "torque") for axis in "xyz"]
    assert contents.names[:7] == ["cell.wrench.header.stamp", *wrench]
    assert contents.units[:7] == ["s", *["N"] * 3, *["N m"] * 3]
    assert contents.names[7:12] == ["camera.pose.header.stamp", *(f"camera.pose.position.{axis}" for axis in "xyz"),
                                    "camera.pose.orientation.x"]  # fmt: skip
    assert contents.units[7:12] == ["s", *["m"] * 3, ""]
    assert_allclose(contents["cell.wrench.header.stamp"], 0.01 * np.arange(200), rtol=1e-15)
    assert_array_equal(contents["cell.wrench.force.x"], np.sin(0.1 * np.arange(200)))
    stamps = contents["camera.pose.header.stamp"]
    assert_allclose(stamps[:60], 0.005 + 0.033333333 * np.arange(60), rtol=1e-15)
    assert np.isnan(stamps[60:]).all()
    assert "cell.wrench (geometry_msgs/msg/WrenchStamped): 200 messages, times of header.stamp" in contents.found


def test_a_slower_topic_is_resampled_at_the_times_of_the_longest_and_that_is_said(bag):
    run = read_recording(bag)
    assert run.attrs["since"] == "2026-03-01 12:00:00+00:00"
    assert_allclose(run["time"], 0.01 * np.arange(200), rtol=1e-15)
    inside = slice(1, 196)
    assert_allclose(
        run["camera.pose.position.x"][inside], 0.01 * (run["time"][inside] - 0.005) / 0.033333333, rtol=1e-9
    )
    assert np.isnan(run["camera.pose.position.x"][0])
    (told,) = [note for note in about(run)["conversions"] if "resampled" in note]
    assert "by clocks.camera.pose.header.stamp (60 samples, every 0.03333 s)" in told
    assert any("most values are interpolated" in note for note in about(run)["warnings"])


def test_a_sheet_that_names_one_topic_takes_its_samples_as_they_are(bag):
    sheet = validate_as(Sheet, {"columns": {"tip": {"column": "camera.pose.position.x", "unit": "m"}}}, "sheet")
    run = read_recording(bag, sheet)
    assert_array_equal(run["tip"], 0.01 * np.arange(60))
    assert_allclose(run["time"], 0.005 + 0.033333333 * np.arange(60), rtol=1e-15)
    chosen = validate_as(Sheet, {"file": {"table": "/camera/pose"}}, "sheet")
    run = read_recording(bag, chosen)
    assert run["time"][0] == 0.0 and run.sizes["time"] == 60
    assert any("left out: /cell/wrench" in note for note in about(run)["found"])


def test_clocks_of_a_sheet_move_and_guard_topics(bag):
    columns = {"force": {"column": "cell.wrench.force.y"}, "tip": {"column": "camera.pose.position.x"}}
    late = columns | {"tip": {"column": "camera.pose.position.x", "clock": "camera"}}
    run = read_recording(bag, validate_as(Sheet, {"columns": late, "clocks": {"camera": {"shift": "5 ms"}}}, "sheet"))
    assert_allclose(run["tip"][:190], 0.01 * run["time"][:190] / 0.033333333, atol=1e-12)
    slow = {"columns": columns, "time": {"column": "camera.pose.header.stamp"}}
    run = read_recording(bag, validate_as(Sheet, slow, "sheet"))
    assert_array_equal(run["tip"], 0.01 * np.arange(60))
    assert any("force: by clocks.cell.wrench.header.stamp" in note for note in about(run)["conversions"])
    with pytest.raises(InputError, match="topics with times of their own"):
        read_recording(bag, validate_as(Sheet, {"columns": columns, "time": {"rate": "100 Hz"}}, "sheet"))
    both = {name: entry | {"clock": "cam"} for name, entry in columns.items()}
    warm = [
        ("/warm", "sensor_msgs/msg/Temperature", time + 7, {"header": bags.header(time), "temperature": 20.0})
        for _, _, time, _ in bags.wrenches(30)
    ]
    path = bags.write_bag(bag.with_name("three.mcap"), bags.wrenches(20), bags.poses(6), warm)
    three = {"columns": both | {"other": {"column": "warm.temperature"}}, "clocks": {"cam": {"shift": "5 ms"}}}
    with pytest.raises(InputError, match=r"clocks.cam: has columns with the times .* and .*Write a clock for each"):
        read_recording(path, validate_as(Sheet, three, "sheet"))


def test_known_messages_have_units_and_others_are_numbers(tmp_path):
    joints = {"name": ["fin", "tail/hinge"], "position": [0.1, 0.2], "velocity": [], "effort": [1.0, 2.0]}
    contents = one_topic(tmp_path, "sensor_msgs/msg/JointState", joints, topic="/joint_states")
    assert contents.names[1:] == [
        f"joint_states.{name}" for name in ("fin.position", "tail.hinge.position", "fin.effort", "tail.hinge.effort")
    ]
    assert contents.units[1:] == [""] * 4
    assert any("write the unit in a sheet" in note for note in contents.found)
    vectors = {"angular_velocity": bags.xyz(1.0, 2.0, 3.0), "linear_acceleration": bags.xyz(4.0, 5.0, 6.0)}
    contents = one_topic(tmp_path, "sensor_msgs/msg/Imu", vectors)
    units = dict(zip(contents.names, contents.units, strict=True))
    assert (units["a.angular_velocity.x"], units["a.linear_acceleration.z"]) == ("rad/s", "m/s2")
    assert units["a.angular_velocity_covariance[8]"] == ""
    contents = one_topic(tmp_path, "sensor_msgs/msg/FluidPressure", {"fluid_pressure": 1e5, "variance": 2.0})
    assert (contents.names[1:], contents.units[1:]) == (["a.fluid_pressure", "a.variance"], ["Pa", ""])
    one_topic(tmp_path, "sensor_msgs/msg/Temperature", {"temperature": 20.0, "variance": 0.0})
    assert_allclose(read_recording(tmp_path / "one.mcap")["a.temperature"], 293.15)
    contents = one_topic(tmp_path, "std_msgs/msg/Float64", {"data": 1.5})
    assert contents.names == ["a.log_time", "a.data"] and "times of the log" in contents.found[0]


def test_arrays_are_indexed_up_to_a_length_and_bytes_and_texts_left_out(tmp_path):
    rows = [{"on": [True, False, True], "count": 2**60 + 1, "note": "x", "raw": b"\1\2", "scan": scan}
            for scan in ([1.0], [2.0, 3.0], [0.0] * 101)]  # fmt: skip
    contents = one_topic(tmp_path, "lab_msgs/msg/Lamps", *rows)
    assert contents.names[1:] == ["a.on[0]", "a.on[1]", "a.on[2]", "a.count", "a.scan[0]", "a.scan[1]"]
    assert_array_equal(contents["a.on[2]"], 1.0)
    assert_array_equal(contents["a.scan[1]"], [np.nan, 3.0, np.nan])
    assert contents.repairs == ["a.count: integers beyond 2^53 are rounded."]


def test_each_frame_of_a_tree_has_columns_and_times_of_its_own(tmp_path):
    def transform(time, frame, x):
        turn = {"translation": bags.xyz(x, 0.0, 0.0), "rotation": bags.xyz(0.0, 0.0, 0.0, 1.0)}
        return {"header": bags.header(time), "child_frame_id": frame, "transform": turn}

    messages = []
    for k in range(4):
        time = bags.ZERO + k * 10**9
        frames = [transform(time, "tail", 1.0 * k)] + ([transform(time, "hull", -1.0 * k)] if k % 2 else [])
        messages.append(("/tf", "tf2_msgs/msg/TFMessage", time, {"transforms": frames[::-1]}))
    contents = read(open_mcap, bags.write_bag(tmp_path / "tf.mcap", messages))
    assert_array_equal(contents["tf.tail.translation.x"], [0, 1, 2, 3])
    assert_array_equal(contents["tf.hull.translation.x"], [-1, -3, np.nan, np.nan])
    assert_array_equal(contents["tf.hull.header.stamp"], [1, 3, np.nan, np.nan])
    assert contents.units[contents.names.index("tf.hull.translation.x")] == "m"


def test_stamps_that_were_not_set_give_way_to_the_log(tmp_path):
    rows = [
        (topic, kind, time, contents | {"header": bags.header(0)}) for topic, kind, time, contents in bags.wrenches(5)
    ]
    contents = read(open_mcap, bags.write_bag(tmp_path / "a.mcap", rows))
    assert contents.names[0] == "cell.wrench.log_time"
    assert "times of the log, as header.stamp is not set" in contents.found[0]
    assert_allclose(contents.values[:, 0], 0.01 * np.arange(5), rtol=1e-15)


def test_clocks_without_a_date_count_from_their_own_zero(tmp_path):
    path = bags.write_bag(tmp_path / "sim.mcap", bags.wrenches(5, zero=0), bags.poses(3, zero=2 * 10**9))
    run = read_recording(path, validate_as(Sheet, {"columns": {"x": {"column": "camera.pose.position.x"}}}, "sheet"))
    assert_allclose(run["time"], 2.0 + 0.033333333 * np.arange(3), rtol=1e-15)
    assert run.attrs["since"] == ""


def test_topics_of_the_same_times_are_one_table(tmp_path):
    times = [k * 10**7 for k in range(1, 6)]
    rows = {name: ("lab.Number", {"units": '{"x": "mN"}'}, [(t, {"x": k * t}) for t in times])
            for k, name in enumerate(("/a/b", "/c"), 1)}  # fmt: skip
    contents = read(open_mcap, bags.write_json(tmp_path / "a.mcap", rows))
    assert (contents.names, contents.units) == (["a.b.log_time", "a.b.x", "c.x"], ["s", "mN", "mN"])
    run = read_recording(tmp_path / "a.mcap")
    assert_allclose(run["c.x"], 2e-3 * np.array(times))
    assert_allclose(run["time"], 0.01 * np.arange(1, 6), rtol=1e-15)


def test_json_of_foxglove_has_its_time_and_units(tmp_path):
    def pose(k):
        place = {"position": {"x": 0.5 * k, "y": None, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
        return {"timestamp": {"sec": 1_772_366_400 + k, "nsec": 500}, "frame_id": "world", "pose": place}

    rows = {"/pose": ("foxglove.PoseInFrame", {}, [(bags.ZERO + 7 + k, pose(k)) for k in range(3)])}
    contents = read(open_mcap, bags.write_json(tmp_path / "a.mcap", rows))
    assert contents.names[:3] == ["pose.timestamp", "pose.position.x", "pose.position.z"]
    assert contents.units[:3] == ["s", "m", "m"]
    assert_array_equal(contents.values[:, :2], [[0, 0], [1, 0.5], [2, 1.0]])


def test_pictures_logs_and_single_messages_are_left_out_with_a_word(tmp_path):
    picture = {"height": 480, "data": bytes(300_000)}
    more = [
        ("/camera/image", "sensor_msgs/msg/Image", time, {"header": bags.header(time)} | picture)
        for _, _, time, _ in bags.poses(3)
    ]
    more.append(("/depth", "std_msgs/msg/Float64", bags.ZERO, {"data": 2.0}))
    more.append(("/raw", "lab_msgs/msg/Lamps", bags.ZERO, {"raw": bytes(100_001)}))
    contents = read(open_mcap, bags.write_bag(tmp_path / "a.mcap", bags.wrenches(5), more))
    assert not any(name.startswith(("camera", "depth", "raw")) for name in contents.names)
    assert [note for note in contents.found if note.startswith("left out")] == [
        "left out: depth (std_msgs/msg/Float64): a single message",
        "left out: /raw (lab_msgs/msg/Lamps, 1 message): 1 of more than 100 kB",
        "left out: /camera/image (sensor_msgs/msg/Image, 3 messages): pictures",
    ]


def test_rows_are_in_the_order_of_the_log_whatever_that_of_the_file(tmp_path):
    rows = {"/a": ("lab.Number", {}, [(k * 10**9, {"x": k}) for k in (1, 3, 2, 4)])}
    contents = read(open_mcap, bags.write_json(tmp_path / "a.mcap", rows))
    assert_array_equal(contents.values, [[1, 1], [2, 2], [3, 3], [4, 4]])


def test_a_stamp_that_goes_back_is_refused_with_its_row_and_the_way_out(tmp_path):
    rows = [*bags.wrenches(6)]
    rows[3][3]["header"] = bags.header(bags.ZERO)
    path = bags.write_bag(tmp_path / "a.mcap", rows)
    with pytest.raises(
        InputError, match=r"cell.wrench.header.stamp: the time 0 s comes after 0.02 s.*repair: drop"
    ) as caught:
        read_recording(path)
    assert caught.value.line == 4
    drop = {"time": {"column": "cell.wrench.header.stamp", "repair": "drop"}}
    assert read_recording(path, validate_as(Sheet, drop, "sheet")).sizes["time"] == 5


def test_of_a_file_that_was_not_finished_all_whole_messages_are_kept(tmp_path):
    path = bags.write_bag(tmp_path / "a.mcap", bags.wrenches(60), chunk_size=600)
    raw, whole, rows = path.read_bytes(), read(open_mcap, path), []
    assert whole.repairs == []
    for cut in cuts(raw):
        contents = survived(open_mcap, tmp_path / "cut.mcap", cut)
        if contents is not None:
            rows.append(len(contents.values))
            assert_array_equal(contents.values, whole.values[: rows[-1]])
            assert contents.repairs == [
                "the file ends within a record, as after a power loss; all that is whole before it is kept."
            ]
    assert rows == sorted(rows) and 0 < rows[0] < 20 and rows[-1] == 60 and len(rows) > 80


@pytest.mark.parametrize("compression", ["NONE", "LZ4", "ZSTD"])
def test_a_byte_that_is_wrong_in_a_part_is_refused(tmp_path, compression):
    from mcap.writer import CompressionType

    path = bags.write_bag(
        tmp_path / "a.mcap", bags.wrenches(60), chunk_size=600, compression=CompressionType[compression]
    )
    raw, seen = path.read_bytes(), set()
    for place in range(200, len(raw) // 2, 97):
        damaged = bytearray(raw)
        damaged[place] ^= 0x55
        (tmp_path / "b.mcap").write_bytes(damaged)
        try:
            contents = read(open_mcap, tmp_path / "b.mcap")
        except InputError as error:
            seen.add(error.message.partition(":")[0])
            assert error.file == str(tmp_path / "b.mcap")
        else:  # in an index, which is not used
            assert_array_equal(contents.values, read(open_mcap, path).values)
    assert "is damaged" in seen


def test_what_cannot_be_read_is_told_with_what_to_do(tmp_path, bag):
    raw = bag.read_bytes()
    bags.write_json(tmp_path / "protobuf.mcap", {"/a": ("foxglove.Pose", {}, [(1, {})])}, encoding="protobuf")
    bags.write_json(tmp_path / "words.mcap", {"/a": ("lab.Text", {}, [(1, {"say": "hello"})])})
    bags.write_json(tmp_path / "none.mcap", {})
    (kind,) = {kind for _, kind, _, _ in bags.wrenches(1)}
    unlike = bags.write_bag(tmp_path / "unlike.mcap", bags.wrenches(2), compression=_no_compression()).read_bytes()
    definition = bags.KINDS[kind].encode()
    files = {
        "protobuf.mcap": ((tmp_path / "protobuf.mcap").read_bytes(), r"no numbers that can be read. Messages of ROS 2 "
                          r"\(cdr\) and in JSON.*/a \(foxglove.Pose, 1 message\): encoded as protobuf"),
        "words.mcap": ((tmp_path / "words.mcap").read_bytes(), "holds no numbers.*no numbers"),
        "none.mcap": ((tmp_path / "none.mcap").read_bytes(), "Inside: no topic"),
        "empty.mcap": (b"", "is empty"),
        "text.mcap": (b"t,F\n0,1\n" * 100, "this is not an MCAP file but a text file"),
        "twice.mcap": (raw[:-30] + raw[-8:], "damaged"),
        "short.mcap": (raw[:9], "holds no numbers"),
        "packed.mcap": (raw.replace(b"\x04\x00\x00\x00zstd", b"\x04\x00\x00\x00brot"), "packed by brot; lz4 and zstd"),
        "defined.mcap": (_without_checks(unlike.replace(definition, definition.replace(b"float64 x", b"float99 x"))),
                         "its definition is not understood"),
    }  # fmt: skip
    check_refusals(open_mcap, tmp_path, files)
    sheet = validate_as(Sheet, {"file": {"table": "/cell/wrnch"}}, "sheet")
    with pytest.raises(InputError, match=r'no topic called "cell.wrnch".*Did you mean "/cell/wrench"'):
        read_recording(bag, sheet)
    with pytest.raises(InputError, match="split: is for tables"):
        read_recording(bag, validate_as(Sheet, {"split": "cell.wrench.force.x"}, "sheet"))


def _no_compression():
    from mcap.writer import CompressionType

    return CompressionType.NONE


def _without_checks(raw):
    """A file whose parts say no checksum."""
    out, at = bytearray(raw), 8
    while at < len(raw) - 8:
        kind, size = raw[at], struct.unpack_from("<Q", raw, at + 1)[0]
        if kind == 6:
            out[at + 9 + 24 : at + 9 + 28] = bytes(4)
        at += 9 + size
    return bytes(out)


def test_a_message_that_is_not_as_defined_is_named(tmp_path):
    from mcap.writer import Writer

    kind = "geometry_msgs/msg/WrenchStamped"
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel(
            "/a", "cdr", writer.register_schema(kind, "ros2msg", bags.KINDS[kind].encode())
        )
        writer.add_message(channel, log_time=1, publish_time=1, data=b"\0\1\0\0" + bytes(20))
        writer.finish()
    with pytest.raises(InputError, match=f"a.mcap: message 1 of /a is not as {kind} is defined: the file is damaged"):
        read(open_mcap, tmp_path / "a.mcap")


def test_what_takes_too_much_memory_is_refused_before(tmp_path):
    with pytest.raises(InputError, match="numbers of its messages take, and 10 kB are allowed"):
        read(open_mcap, bags.write_bag(tmp_path / "b.mcap", bags.wrenches(), chunk_size=600), memory=10_000)
    rows = [("/a", "lab_msgs/msg/Lamps", bags.ZERO + k, {"raw": bytes(50_000)}) for k in range(100)]
    bags.write_bag(tmp_path / "a.mcap", rows, chunk_size=10**7)
    with pytest.raises(InputError, match=r"5.01 MB are what it holds when it is unpacked, and 1 MB are allowed"):
        read(open_mcap, tmp_path / "a.mcap", memory=1_000_000)


def test_the_command_line_measures_it_and_campaigns_join_topics(bag, capsys):
    assert main(["measure", str(bag)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "mcap, 200 rows, 0 to 1.99 s, every 0.01 s" in shown and "camera.pose.position.x" in shown
    campaign = bag.with_name("campaign.yaml")
    campaign.write_text(
        "columns: {force: cell.wrench.force.y, tip: camera.pose.position.x}\n"
        "recordings: [{file: run.mcap, conditions: {f: 1 Hz}}]\n"
    )
    (run,) = load_campaign(campaign).recordings()
    assert [*run.data_vars] == ["force", "tip"] and (run["force"].attrs["units"], run["tip"].attrs["units"]) == (
        "N",
        "m",
    )
    assert_allclose(run["force"], 0.25 * np.arange(200))
    assert run["tip"].attrs["clock"] == "clocks.camera.pose.header.stamp"
    assert main(["measure", "--campaign", str(campaign)]) == 0


def test_without_its_package_the_extra_is_named(bag, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcap_ros2", None)
    with pytest.raises(InputError, match=r"the package mcap_ros2 is missing: pip install 'nectosome\[mcap\]'"):
        read(open_mcap, bag)

"""Recordings of ROS 2, written by the library itself: a wrench at 100 Hz, a pose at 30 Hz, and what a test adds."""

import json
import sqlite3
from pathlib import Path

import numpy as np

ZERO = 1_772_366_400_000_000_000  # 2026-03-01 12:00:00 UTC [ns]
LATE = 1_500_000  # from a stamp until it is recorded [ns]
_BREAK = "=" * 80 + "\n"


def _with(text, *used):
    return text + "".join(f"{_BREAK}MSG: {kind}\n{DEFINED[kind]}" for kind in used)


_VECTOR, _STAMPED = "float64 x\nfloat64 y\nfloat64 z\n", ("std_msgs/Header", "builtin_interfaces/Time")
DEFINED = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "geometry_msgs/Vector3": _VECTOR,
    "geometry_msgs/Point": _VECTOR,
    "geometry_msgs/Quaternion": _VECTOR + "float64 w\n",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
    ),
}
KINDS = {
    "geometry_msgs/msg/WrenchStamped": _with(
        "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
        *_STAMPED,
        "geometry_msgs/Wrench",
        "geometry_msgs/Vector3",
    ),
    "geometry_msgs/msg/PoseStamped": _with(
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
        *_STAMPED,
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
    ),
    "sensor_msgs/msg/JointState": _with(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n", *_STAMPED
    ),
    "sensor_msgs/msg/Imu": _with(
        "std_msgs/Header header\ngeometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\n",
        *_STAMPED,
        "geometry_msgs/Vector3",
    ),
    "sensor_msgs/msg/Temperature": _with("std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n", *_STAMPED),
    "sensor_msgs/msg/FluidPressure": _with(
        "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n", *_STAMPED
    ),
    "sensor_msgs/msg/Image": _with("std_msgs/Header header\nuint32 height\nuint8[] data\n", *_STAMPED),
    "std_msgs/msg/Float64": "float64 data\n",
    "lab_msgs/msg/Lamps": "bool[3] on\nuint64 count\nstring note\nuint8[] raw\nfloat32[] scan\n",
    "tf2_msgs/msg/TFMessage": _with(
        "geometry_msgs/TransformStamped[] transforms\n",
        "geometry_msgs/TransformStamped",
        *_STAMPED,
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3",
        "geometry_msgs/Quaternion",
    ),
}
"""Types and their definitions, as rosbag2 writes them."""


def header(time):
    """A header with this stamp [ns]."""
    return {"stamp": {"sec": time // 10**9, "nanosec": time % 10**9}, "frame_id": "world"}


def xyz(*values, **more):
    return dict(zip("xyzw", values, strict=False)) | more


def wrenches(rows=200, period=10_000_000, zero=ZERO):
    """Messages of /cell/wrench: topic, type, time of the log [ns], contents."""
    for k in range(rows):
        time = zero + k * period
        force = xyz(np.sin(0.1 * k), 0.25 * k, -1.0)
        contents = {"header": header(time), "wrench": {"force": force, "torque": xyz(0.0, 0.0, 0.5)}}
        yield "/cell/wrench", "geometry_msgs/msg/WrenchStamped", time + LATE, contents


def poses(rows=60, period=33_333_333, zero=ZERO + 5_000_000):
    """Messages of /camera/pose."""
    for k in range(rows):
        time = zero + k * period
        pose = {"position": xyz(0.01 * k, 0.0, -0.2), "orientation": xyz(0.0, 0.0, 0.0, 1.0)}
        yield "/camera/pose", "geometry_msgs/msg/PoseStamped", time + LATE, {"header": header(time), "pose": pose}


def write_bag(path: Path, *messages, **options) -> Path:
    """Write messages of ROS 2, in the order in which they were recorded, to an .mcap file."""
    from mcap_ros2.writer import Writer

    with path.open("wb") as file, Writer(file, **options) as writer:
        schemas = {}
        for topic, kind, time, contents in sorted((m for each in messages for m in each), key=lambda m: m[2]):
            schemas[kind] = schemas.get(kind) or writer.register_msgdef(kind, KINDS[kind])
            writer.write_message(topic, schemas[kind], contents, log_time=time)
    return path


def write_json(path: Path, topics: dict, encoding="json", **options) -> Path:
    """Write messages in JSON, by topics: their type, metadata, and times [ns] with contents."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start()
        for topic, (kind, metadata, messages) in topics.items():
            schema = writer.register_schema(kind, "jsonschema", b"{}")
            channel = writer.register_channel(topic, encoding, schema, metadata)
            for time, contents in messages:
                writer.add_message(channel, log_time=time, publish_time=time, data=json.dumps(contents).encode())
        writer.finish()
    return path


def write_db3(path: Path, *messages, defined=True) -> Path:
    """Write messages of ROS 2 as rosbag2 does in SQLite, since Iron or before."""
    from mcap_ros2._dynamic import serialize_dynamic

    with sqlite3.connect(path) as bag:
        bag.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        bag.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        if defined:
            bag.execute(
                "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, "
                "encoded_message_definition TEXT)"
            )
        topics = {}
        for topic, kind, time, contents in (m for each in messages for m in each):
            if topic not in topics:
                topics[topic] = len(topics) + 1
                bag.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr')", (topics[topic], topic, kind))
                if defined:
                    row = (topics[topic], kind, "ros2msg", KINDS[kind])
                    bag.execute("INSERT INTO message_definitions VALUES (?, ?, ?, ?)", row)
            data = serialize_dynamic(kind, KINDS[kind])[kind](contents)
            bag.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", (topics[topic], time, data))
    bag.close()
    return path

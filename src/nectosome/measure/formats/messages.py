"""Numbers in decoded messages of ROS 2 and Foxglove: their names, units and times.

Fields have the units of their type, by the comments of common_interfaces (ros2/common_interfaces) and of Foxglove's
schemas (docs.foxglove.dev/docs/sdk/schemas). What may be one of two units, as an angle or a way of a joint, has none.
"""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

LONGEST = 100  # numbers of an array that are columns
_UNITS: Mapping[str, Mapping[str, str]] = {
    "geometry_msgs/Point": dict.fromkeys("xyz", "m"),
    "geometry_msgs/Pose": {"position": "m"},
    "geometry_msgs/Pose2D": {"x": "m", "y": "m", "theta": "rad"},
    "geometry_msgs/Transform": {"translation": "m"},
    "geometry_msgs/Twist": {"linear": "m/s", "angular": "rad/s"},
    "geometry_msgs/Accel": {"linear": "m/s2", "angular": "rad/s2"},
    "geometry_msgs/Wrench": {"force": "N", "torque": "N m"},
    "geometry_msgs/Inertia": {"m": "kg", "com": "m"}
    | dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "kg m2"),
    "sensor_msgs/Imu": {"angular_velocity": "rad/s", "linear_acceleration": "m/s2"},
    "sensor_msgs/Temperature": {"temperature": "degC"},
    "sensor_msgs/FluidPressure": {"fluid_pressure": "Pa"},
    "sensor_msgs/MagneticField": {"magnetic_field": "T"},
    "sensor_msgs/Range": {"field_of_view": "rad"} | dict.fromkeys(("min_range", "max_range", "range"), "m"),
    "sensor_msgs/BatteryState": {"voltage": "V", "temperature": "degC", "current": "A"},
    "foxglove.PoseInFrame": {"pose.position": "m"},
    "foxglove.FrameTransform": {"translation": "m"},
}
_IN_LISTS = {"tf2_msgs/TFMessage": "", "foxglove.FrameTransforms": "foxglove.FrameTransform"}  # type of what is in one
_NAMED = {"sensor_msgs/JointState": ("position", "velocity", "effort")}  # arrays whose columns are named by `name`


class FieldValue(NamedTuple):
    """A number of a message."""

    name: str  # of its field, as force.x
    value: float  # or a whole number
    unit: str  # "" where the type says none


class StampedMessage(NamedTuple):
    """What a message says at one time."""

    name: str  # of the frame that it is about, where a message has several; else ""
    stamp: int | None  # [ns]; None where it has none
    stamped_by: str  # the field of that; "" where it has none
    kind: str  # its type
    body: Any


def parts_of(kind: str, message: Any) -> Iterator[StampedMessage]:
    """A decoded message of this type, with its time; of a message of transforms each one by itself."""
    kind = short_kind(kind)
    if kind not in _IN_LISTS:
        yield _part("", kind, message)
        return
    for each in _field(message, "transforms") or ():
        yield _part(str(_field(each, "child_frame_id") or ""), _IN_LISTS[kind], each)


def numbers(part: StampedMessage) -> Iterator[FieldValue]:
    """The numbers of a part but for its time; texts, bytes and arrays of more than `LONGEST` numbers are left out.

    A field is named by its path, as `force.x` of a stamped wrench.
    """
    kind, body = part.kind, part.body
    if kind in _NAMED:
        names = [plain(str(name)) for name in _field(body, "name") or ()]
        for what in _NAMED[kind]:
            for name, value in zip(names, _field(body, what) or (), strict=False):
                yield FieldValue(f"{name}.{what}", value, "")
        return
    units = _UNITS.get(_kind_of(body) or kind, {})
    fields = {name: value for name, value in _items(body) if name not in ("header", part.stamped_by)}
    only = _only_message(kind, fields)
    for field, value in fields.items():
        name = plain(field)
        yield from _numbers("" if name == only else name, value, units, "", name)


def _only_message(kind: str, fields: Mapping[str, Any]) -> str:
    """The field of a message with a stamp that holds another message and nothing else: its name says nothing new."""
    held = {name: value for name, value in fields.items() if not isinstance(value, str)}
    is_message = all(_kind_of(x) or (isinstance(x, dict) and kind.startswith("foxglove.")) for x in held.values())
    return plain(next(iter(held))) if len(held) == 1 and is_message else ""


@lru_cache(10_000)
def plain(name: str) -> str:
    """A name without slashes: of the topic /cell/wrench `cell.wrench`."""
    return name.strip("/").replace("/", ".")


def short_kind(kind: str) -> str:
    """Type of a message as it was before ROS 2: geometry_msgs/Wrench of geometry_msgs/msg/Wrench."""
    return kind.replace("/msg/", "/")


def _part(name: str, kind: str, body: Any) -> StampedMessage:
    for field, within in (("header.stamp", _field(body, "header")), ("timestamp", body)):
        time = _field(within, field.rpartition(".")[2])
        fraction = next((x for key in ("nanosec", "nsec") if (x := _field(time, key)) is not None), None)
        seconds = _field(time, "sec")
        if isinstance(seconds, int) and isinstance(fraction, int):
            return StampedMessage(name, seconds * 10**9 + fraction, field, kind, body)
    return StampedMessage(name, None, "", kind, body)


def _numbers(path: str, value: Any, units: Mapping[str, str], unit: str, within: str) -> Iterator[FieldValue]:
    """The numbers below a field; `units` are those of the fields of its message, by their path `within` that."""
    unit = units.get(within, unit)
    if isinstance(value, int | float):
        yield FieldValue(path, value, unit)
    elif isinstance(value, list | tuple):
        if len(value) <= LONGEST:
            for k, one in enumerate(value):
                yield from _numbers(f"{path}[{k}]", one, units, unit, within)
    elif isinstance(value, dict):
        for name, one in value.items():
            yield from _numbers(_below(path, name), one, units, unit, f"{within}.{plain(name)}")
    elif (kind := _kind_of(value)) is not None:
        own = {} if unit else _UNITS.get(kind, {})  # a vector has the unit of what it is of
        for name, one in _items(value):
            yield from _numbers(_below(path, name), one, own, unit, name)


def _below(path: str, name: str) -> str:
    return f"{path}.{plain(name)}" if path else plain(name)


def _kind_of(value: Any) -> str | None:
    """Type of a message that was decoded by its definition; None of anything else."""
    return getattr(value, "_type", None)


def _items(value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        yield from value.items()
    elif _kind_of(value) is not None:
        yield from ((name, getattr(value, name)) for name in value.__slots__)


def _field(value: Any, name: str) -> Any:
    return value.get(name) if isinstance(value, dict) else getattr(value, name, None)

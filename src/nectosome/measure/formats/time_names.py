"""Names of times: whether a column is the time by its name, and the unit in the name."""

import re

_UNITS = (
    "s|secs?|seconds?|m(?:illi)?s(?:ecs?|econds?)?|millis|[uµμ]s(?:ecs?)?|micros(?:ecs?|econds?)?|"
    "ns(?:ecs?)?|nanos(?:ecs?|econds?)?|mins?|minutes?|h|hrs?|hours?|days?"
)
_KIND = "elapsed|relative|absolute|unix|epoch|utc|local|system|sample|test|host|ros|rosbag"
_WORDS = (
    rf"_*(?:(?:{_KIND})[ _]?)?time(?:[ _]?stamp)?s?|(?:{_KIND})[ _]?stamp|time[ _](?:since|of|from)[ _]\w+|"
    r"zeit|uhrzeit|clock|date[ _/&]*(?:and[ _])?time|(?:.*[./])?header[./_]stamp"
)
# "T" is a temperature or a torque; "timeMs" has its unit in capitals
_TIME = re.compile(
    rf"(?:t|(?i:{_WORDS}))(?:(?:[\s_.]+(?:in\s)?|\s*/\s*)(?i:(?P<unit>{_UNITS}|unix|utc|epoch))|"
    r"(?<=ime|amp)(?P<capital>M[sS]|U[sS]|N[sS]|S|Secs?|Seconds?|Millis|Micros|Nanos))?"
)
_UNIT_ALONE = re.compile(
    r"secs?|seconds?|millis(?:\(\))?|msecs?|milli(?:secs?|seconds?)|micros(?:\(\))?|usecs?|"
    r"micro(?:secs?|seconds?)|nano(?:secs?|seconds?)|ms",
    re.IGNORECASE,
)
_BRACKETED = re.compile(r"(.*?)[\s_]*[\[(](.*)[\])]")
_SECONDS, _NANOSECONDS = re.compile(r"(.*)(?<![a-z])secs?", re.I), ("nsecs", "nsec", "nanosec", "nanosecs")
_NO_UNIT = ("unix", "utc", "epoch", "gmt", "local", "h:m:s", "hh:mm:ss", "hh:mm:ss.fff", "")


def is_time(name: str) -> bool:
    """Whether a name means the time: `t`, `Time`, `time_ms`, `Zeit [s]`; `T` is a temperature or torque."""
    return time_unit(name) is not None


def time_unit(name: str) -> str | None:
    """Return the unit in the name of a time ("ms" of `time_ms`), as it is there, "" without one; None for other names.

    Whatever stands in brackets behind a time is its unit, but for words such as UTC.
    """
    name = name.strip()
    bracketed = _BRACKETED.fullmatch(name)
    if bracketed and not _UNIT_ALONE.fullmatch(name):
        inside = time_unit(bracketed[1])
        return None if inside is None else "" if bracketed[2].strip().lower() in _NO_UNIT else bracketed[2].strip()
    if _UNIT_ALONE.fullmatch(name):
        return name.removesuffix("()").lower()
    match = _TIME.fullmatch(name)
    if match is None:
        return None
    unit = (match["unit"] or match["capital"] or "").lower()
    return "" if unit in _NO_UNIT else unit


def nanoseconds_beside(name: str, names: list[str]) -> str | None:
    """Return the column with the nanoseconds that belong to whole seconds, as ROS writes a stamp; None without one.

    `header.stamp.secs` and `header.stamp.nsecs`, or `sec` and `nanosec`.
    """
    match = _SECONDS.fullmatch(name.strip())
    if match is None:
        return None
    beside = {match[1] + ending for ending in _NANOSECONDS}
    return next((other for other in names if other.strip() in beside), None)

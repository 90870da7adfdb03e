"""Bags of ROS 2 in SQLite (.db3), as rosbag2 writes them since Iron: the numbers of all topics.

Tables (ros2/rosbag2, rosbag2_storage_sqlite3): `topics`, `messages`, `message_definitions`; bags of older versions have
no definitions, by which messages are decoded.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from nectosome.io.extras import package
from nectosome.io.file_system import exists
from nectosome.measure.formats.file_errors import damage_as_input_error, first_bytes, wrong_format
from nectosome.measure.formats.mcap import decoder
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.topics import Message, Topic, TopicSource
from nectosome.units import InputError

ENDINGS = (".db3",)
BEGINNINGS = (b"SQLite format 3\0",)

_TABLES = {"topics", "messages"}


def open_db3(path: Path, options: Options) -> TableSource:
    """Open a .db3 file: all topics with numbers, or the one that `options.table` names.

    Raises InputError for another format, a damaged file, one without definitions or numbers, and where mcap_ros2 is not
    installed.
    """
    start = first_bytes(path)
    if not start.startswith(BEGINNINGS):
        raise wrong_format(path, "a bag of ROS 2 in SQLite (.db3)", start)
    with damage_as_input_error(path):
        package("mcap_ros2", "mcap")
        # immutable: nothing is written beside it; a recorder that was stopped leaves rows in a file of its own
        mode = "mode=ro" if exists(f"{path}-wal") else "immutable=1"
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?{mode}", uri=True)) as bag:
            return TopicSource("db3", _topics(bag), _messages(bag), options, [])


def _topics(bag: sqlite3.Connection) -> dict[int, Topic]:
    tables = {name for (name,) in bag.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not tables >= _TABLES:
        raise InputError("is a database, and no bag of ROS 2: it lacks the tables topics and messages.")
    defined = {}
    if "message_definitions" in tables:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        defined = {kind: (language, text) for kind, language, text in bag.execute(query)}
    topics = {}
    for number, name, kind, encoding in bag.execute("SELECT id, name, type, serialization_format FROM topics"):
        language, text = defined.get(kind, ("", ""))
        made = decoder(kind, encoding, text.encode(), language) if text else "the file lacks its definition"
        topics[number] = Topic(name, kind, left_out=made) if isinstance(made, str) else Topic(name, kind, made)
    if topics and not any(text for _, text in defined.values()):
        how = "`mcap convert bag.db3 bag.mcap`, of the command line tool of mcap.dev, or `ros2 bag convert` of ROS 2"
        raise InputError(
            f"holds no definitions of its messages, as bags from before ROS 2 Iron. Convert it where ROS 2 is: {how}."
        )
    return topics


def _messages(bag: sqlite3.Connection) -> Iterator[Message]:
    for row in bag.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id"):
        yield Message(*row)

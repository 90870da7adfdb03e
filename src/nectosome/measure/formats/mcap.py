"""MCAP files, as ROS 2 and Foxglove record them: the numbers of all topics (through mcap and mcap_ros2).

The format: mcap.dev/spec. Messages of ROS 2 are decoded by the definitions in the file, those in JSON as they are.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from nectosome.io.extras import package
from nectosome.measure.formats.file_errors import check_memory, damage_as_input_error, first_bytes, wrong_format
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.topics import Decoder, Message, Topic, TopicSource, not_measured
from nectosome.units import InputError, shorten

ENDINGS = (".mcap",)
BEGINNINGS = (b"\x89MCAP0\r\n",)

UNITS = "units"  # of a channel's metadata: a JSON object with the unit of each field, as nectosome writes it
_PACKED = {"", "lz4", "zstd"}
_MEND = "`mcap recover`, of the command line tool of mcap.dev, keeps what is whole"


def open_mcap(path: Path, options: Options) -> TableSource:
    """Open an .mcap file: all topics with numbers, or the one that `options.table` names.

    Of a file that was not finished, as after a power loss, all whole messages are kept, and `repairs` says so. Raises
    InputError for another format, a damaged file, one without numbers, and where mcap is not installed.
    """
    start = first_bytes(path)
    if not start.startswith(BEGINNINGS):
        raise wrong_format(path, "an MCAP file", start)
    with damage_as_input_error(path), path.open("rb") as file:
        package("mcap_ros2", "mcap")
        topics, repairs = dict[int, Topic](), list[str]()
        messages = _messages(file, topics, repairs, options.memory)
        return TopicSource("mcap", topics, messages, options, repairs)


def decoder(kind: str, encoding: str, definition: bytes, schema: str) -> Decoder | str:
    """What decodes messages of a type, or why they are not read.

    `encoding` is that of the messages, and `schema` that of their definition.
    """
    if what := not_measured(kind):
        return what
    if encoding == "json":
        return json.loads
    if encoding != "cdr":
        return f"encoded as {shorten(encoding) or 'nothing that the file says'}"
    if schema != "ros2msg":
        return f"defined in {shorten(schema) or 'no language that the file says'}, and ros2msg is needed"
    from mcap.records import Schema

    try:
        made = package("mcap_ros2.decoder", "mcap").DecoderFactory()
        return made.decoder_for("cdr", Schema(id=1, data=definition, encoding=schema, name=kind))
    except InputError:
        raise
    except Exception as error:  # of the parser of definitions
        return f"its definition is not understood ({shorten(str(error))})"


class _CutError(Exception):
    """The file ends before what it says."""


class _Whole:
    """A file that gives all bytes that it is asked for: mcap takes fewer for what there is."""

    def __init__(self, file: BinaryIO):
        self._file = file

    def read(self, size: int) -> bytes:
        data = self._file.read(size)
        if len(data) < size:
            raise _CutError
        return data


def _messages(file: BinaryIO, topics: dict[int, Topic], repairs: list[str], memory: int) -> Iterator[Message]:
    """The messages of a file in its order; topics are added as they come."""
    from mcap.exceptions import RecordLengthLimitExceeded
    from mcap.records import Channel, Chunk, Schema, Statistics
    from mcap.records import Message as Logged
    from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk

    file.seek(-len(BEGINNINGS[0]), 2)
    finished = file.read() == BEGINNINGS[0]
    file.seek(0)
    stream: Any = _Whole(file)
    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=memory)
    schemas, messages = dict[int, Schema](), 0
    try:
        for record in reader.records:
            if isinstance(record, Chunk):
                _check_chunk(record, memory)
                inside = breakup_chunk(record, validate_crc=True)
            else:
                inside = [record]
            for one in inside:
                if isinstance(one, Schema):
                    schemas[one.id] = one
                elif isinstance(one, Channel) and one.id not in topics:
                    topics[one.id] = _topic(one, schemas.get(one.schema_id))
                elif isinstance(one, Logged):
                    messages += 1
                    yield Message(one.channel_id, one.log_time, one.data)
                elif isinstance(one, Statistics) and one.message_count != messages:
                    raise InputError(f"is damaged: {messages} of {one.message_count} messages are there. {_MEND}.")
    except _CutError:
        if finished:
            raise InputError(f"is damaged: a record is longer than the file. {_MEND}.") from None
        repairs.append("the file ends within a record, as after a power loss; all that is whole before it is kept.")
    except CRCValidationError as error:
        what = "part" if isinstance(error.record, Chunk) else "file"
        raise InputError(f"is damaged: the checksum (CRC) of a {what} is not that of its contents. {_MEND}.") from None
    except RecordLengthLimitExceeded:
        raise InputError(f"holds a record of more than {memory:.3g} bytes, or is damaged. {_MEND}.") from None


def _check_chunk(chunk: Any, memory: int) -> None:
    """Raise InputError for a part that is packed in an unknown way, or to more than may be unpacked."""
    if chunk.compression not in _PACKED:
        how = "`mcap compress`, of the command line tool of mcap.dev, packs it anew"
        raise InputError(f"is packed by {shorten(chunk.compression)}; lz4 and zstd are read. {how}.")
    sizes = [chunk.uncompressed_size]
    if chunk.compression == "zstd":
        import zstandard

        sizes.append(zstandard.frame_content_size(chunk.data))
    elif chunk.compression == "lz4":
        import lz4.frame

        sizes.append(lz4.frame.get_frame_info(chunk.data)["content_size"])
    check_memory([max(sizes)], memory)


def _topic(channel: Any, schema: Any) -> Topic:
    """A topic by its record, and the one of its schema, if it has one."""
    kind, definition, language = (schema.name, schema.data, schema.encoding) if schema is not None else ("", b"", "")
    made = decoder(kind, channel.message_encoding, definition, language)
    units = json.loads(channel.metadata.get(UNITS, "{}"))
    if isinstance(made, str):
        return Topic(channel.topic, kind, left_out=made)
    return Topic(channel.topic, kind, made, units=units)

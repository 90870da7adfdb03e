"""The kinds of files that people write: what each is called, which command takes it, and how it is told from others."""

from dataclasses import dataclass
from typing import Any

from nectosome.units import InputError


@dataclass(frozen=True)
class FileKind:
    """A kind of file."""

    name: str
    title: str  # with its article
    command: str  # that takes it; FILE stands for the file
    least: str  # what it has at least, in a sentence
    told_by: tuple[str, ...]  # fields with one of which a file is of this kind, unless it is of one further up in KINDS

    @property
    def schema_file(self) -> str:
        """Name of the file with its JSON Schema."""
        return f"{self.name}.schema.json"

    @property
    def first_line(self) -> str:
        """Comment that begins a file of this kind, by which editors find the schema beside it."""
        return f"# yaml-language-server: $schema={self.schema_file}\n"


KINDS = {
    kind.name: kind
    for kind in (
        FileKind(
            name="mission",
            title="a mission",
            command="nectosome simulate ROBOT --mission FILE",
            least="A mission has at least one mode.",
            told_by=("modes",),
        ),
        FileKind(
            name="campaign",
            title="a campaign of recordings",
            command="nectosome measure --campaign FILE",
            least="A campaign has at least recordings: a list of files, each with its conditions.",
            told_by=("recordings",),
        ),
        FileKind(
            name="gaits",
            title="a file of gaits",
            command="nectosome identify gait --target FILE",
            least="A file of gaits has at least a robot, what may vary, and trials.",
            told_by=("trials",),
        ),
        FileKind(
            name="segments",
            title="a sheet of a video",
            command="nectosome track VIDEO --config FILE",
            least="A sheet of a video has at least segments; one of several videos has cameras, points and markers.",
            told_by=("segments",),
        ),
        FileKind(
            name="markers",
            title="a sheet of several videos",
            command="nectosome track VIDEO VIDEO --config FILE",
            least="A sheet of several videos has at least cameras, points and markers.",
            told_by=("cameras", "markers"),
        ),
        FileKind(
            name="rig",
            title="a rig file",
            command="nectosome control rig --config FILE",
            least="A rig file has at least dt, devices, and limits of their commands.",
            told_by=("dt", "devices"),
        ),
        FileKind(
            name="plan",
            title="a plan of runs",
            command="nectosome rig run FILE --config RIG --out FOLDER",
            least="A plan of runs has at least signals, and a time or periods.",
            told_by=("signals",),
        ),
        FileKind(
            name="loops",
            title="a file of loops",
            command="nectosome control loops ROBOT FILE",
            least="A file of loops has at least loops, each with a command, a measure and a reference.",
            told_by=("loops",),
        ),
        FileKind(
            name="problem",
            title="a design problem",
            command="nectosome design ROBOT --problem FILE",
            least="A problem says at least what may vary.",
            told_by=("vary", "maximise", "minimise", "keep"),
        ),
        FileKind(
            name="robot",
            title="a robot file",
            command="nectosome simulate FILE",
            least="A robot has at least a name and a body or limbs.",
            told_by=("body", "limbs", "pairs"),
        ),
        FileKind(
            name="sheet",
            title="a sheet of a recording",
            command="nectosome measure RECORDING --config FILE",
            least="A sheet says which column is which quantity.",
            told_by=("columns", "conditions", "time"),
        ),
    )
}


def kind_of_file(data: Any) -> FileKind | None:
    """Return the kind that the data of a file look like, None where they look like none."""
    if not isinstance(data, dict):
        return None
    return next((kind for kind in KINDS.values() if any(field in data for field in kind.told_by)), None)


def check_kind(data: Any, kind: str, file: str | None) -> None:
    """Raise InputError where the data of a file look like another kind than the one that is needed."""
    actual = kind_of_file(data)
    if file is not None and actual not in (None, KINDS[kind]):
        raise of_other_kind(actual, KINDS[kind].title, file)


def of_other_kind(found: FileKind, needed: str, file: str) -> InputError:
    """The error of a file that is of another kind than the one that is needed."""
    command = found.command.replace("FILE", file)
    return InputError(f"this is {found.title}, and {needed} is needed. It goes to: {command}", file=file)

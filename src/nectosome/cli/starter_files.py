"""Files that a person starts from: written together, over nothing that is there, with schemas for editors beside."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from nectosome.cli.output import check_folder, tell
from nectosome.cli.schema import schema_text
from nectosome.io import write_atomic
from nectosome.io.file_system import exists, is_file, is_folder, is_taken
from nectosome.io.schema.kinds import KINDS
from nectosome.units import InputError

_MARK = "# yaml-language-server:"


def for_editors(text: str, kind: str) -> str:
    """Return the text of a file, whose first line names the schema beside it."""
    if text.startswith(_MARK):
        text = text.partition("\n")[2]
    return KINDS[kind].first_line + text


def write_files(folder: Path, files: Mapping[str, bytes], kinds: Iterable[str], force: bool) -> None:
    """Write files, and the schemas of `kinds`, into a folder that is there.

    Raises InputError before anything is written: where one of the files exists, unless `force`, or cannot be written. A
    schema that differs from the one that is there is left alone, unless `force`.
    """
    for name, content in files.items():
        path = folder / name
        if is_folder(path) or (is_taken(path) and not force and not _holds(path, content)):
            raise InputError("exists. Give another name, or --force to overwrite it.", field=str(path))
    check_folder(folder, "FOLDER")
    for name, content in files.items():
        write_atomic(folder / name, content)
    for kind in kinds:
        path = folder / KINDS[kind].schema_file
        schema = schema_text(kind).encode()
        if force or not exists(path):
            write_atomic(path, schema)
        elif not _holds(path, schema):
            renew = f"nectosome schema {kind} --save {path} --force"
            tell(f"left alone: {path}, which is not the schema of this version. Renew it: {renew}")


def _holds(path: Path, content: bytes) -> bool:
    """Whether this, as far as may be read, is in a file."""
    try:
        return is_file(path) and path.read_bytes() == content
    except OSError:
        return False

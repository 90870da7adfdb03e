"""`nectosome schema`: the JSON Schema of a kind of file, for editors."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.command_list import command
from nectosome.cli.file_models import schema_text
from nectosome.cli.output import Force, check_target, report, write_text
from nectosome.io import write_atomic
from nectosome.io.schema.kinds import KINDS
from nectosome.units import check_choice


@command
def schema(
    kind: Annotated[str, Parameter(help=f"Kind of file: {', '.join(sorted(KINDS))}.")] = "robot",
    /,
    *,
    save: Annotated[Path | None, Parameter("--save", help="Write the schema to this file (.json).")] = None,
    force: Force = False,
) -> None:
    """Print the JSON Schema of a kind of file, with which editors complete and explain it.

    `nectosome new` and `nectosome tutorial` write it beside their files, whose first line names it.
    """
    check_choice(kind, KINDS, "KIND")
    check_target(save, "--save", ".json", force)
    text = schema_text(kind)
    if save is None:
        write_text(text.rstrip())
        return
    write_atomic(save, text.encode())
    report(save)

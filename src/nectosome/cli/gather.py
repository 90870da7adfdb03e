"""`nectosome gather`: one study of the shares that `--part` made of it."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.command_list import command
from nectosome.cli.output import Outputs, report, write
from nectosome.cli.sweep import code_of, sweep_summary
from nectosome.io.file_system import is_folder
from nectosome.units import InputError, count


@command
def gather(
    shares: Annotated[list[Path], Parameter(help="Files of a sweep's shares, or folders of a search's shares.")],
    /,
    *,
    out: Annotated[Path | None, Parameter(help="Folder into which the shares of a search are joined.")] = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Join the shares of a sweep, or of a design's starts, which --part computed one by one.

    Shares of a search are joined into a folder: the command that made them finds all starts there, by --out and without
    --part.
    """
    outputs.check()
    if any(map(is_folder, shares)):
        if out is None or outputs.given:
            raise InputError("folders of a search are joined into another one: --out FOLDER.", field="gather")
        from nectosome.search.executors.shares import gather_starts

        number = gather_starts(shares, out)
        report(out, words=f"{out}: {count(number, 'start')}. The design's command with --out {out} shows them.")
        return 0
    if out is not None:
        raise InputError("is for folders of a search. Files of a sweep: --save FILE.", field="--out")
    from nectosome import designs

    found = designs.gather(shares)
    write(sweep_summary(found))
    outputs.write(found, lambda data, path: view.show_sweep(data, path))
    return code_of(found)

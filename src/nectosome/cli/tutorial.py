"""`nectosome tutorial`: the pages that teach, each with the files that its commands need."""

import re
from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.options import command
from nectosome.cli.output import Force, Json, report, write
from nectosome.cli.starter_files import for_editors, write_files
from nectosome.io.file_system import entries, make_folder
from nectosome.io.schema.kinds import kind_of_file
from nectosome.io.summary import Summary
from nectosome.io.tables import Table
from nectosome.io.yaml_text import read_yaml
from nectosome.units import InputError, count, did_you_mean

_FILES = Path(__file__).parent / "tutorials"
_IN_A_CLONE = Path(__file__).parents[3] / "docs" / "tutorials"  # a wheel has the pages beside the files


@command
def tutorial(
    name: Annotated[str | None, Parameter(help="Tutorial; left out, all are listed.")] = None,
    folder: Annotated[Path | None, Parameter(help="Folder to write; named after the tutorial by default.")] = None,
    /,
    *,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a tutorial into a folder, with all files that its commands need. Without a name, list the tutorials."""
    pages = tutorial_pages()
    if name is None:
        titles = [(page, text.partition("\n")[0].removeprefix("# ")) for page, text in pages.items()]
        write(Summary(tables=[Table("tutorials", {"name": "tutorial", "title": ""}, titles)]))
        return
    if name not in pages:
        raise InputError(f'there is no tutorial called "{name}".{did_you_mean(name, pages)}')
    target = folder or Path(name)
    needed, kinds = tutorial_files(name, pages), set[str]()
    for file, text in needed.items():
        kind = kind_of_file(read_yaml(text, file)[0]) if file.endswith(".yaml") else None
        if kind is not None:
            needed[file] = for_editors(text, kind.name)
            kinds.add(kind.name)
    make_folder(target, "FOLDER", parents=False)
    written = {f"{name}.md": pages[name], **needed}
    write_files(target, {file: text.encode() for file, text in written.items()}, sorted(kinds), force)
    files = count(len(written), "file")
    words = f"wrote {files} into {target}. Read {target / name}.md; its commands run in that folder."
    report(*(target / file for file in written), words=words)


def tutorial_pages() -> dict[str, str]:
    """Texts of the tutorials by name, in the order of their numbers."""
    files = entries(_FILES, "*.md") or entries(_IN_A_CLONE, "*.md")
    texts = {file.stem: file.read_text(encoding="utf-8") for file in files}
    return dict(sorted(texts.items(), key=lambda page: int(page[1].removeprefix("# ").partition(".")[0])))


def tutorial_files(name: str, pages: dict[str, str]) -> dict[str, str]:
    """Texts of the files that a page needs, by name: those that it names, and those that these name in turn.

    A file stands in a page, as a block with its name as title, or was made by a command of one and lies beside this. A
    name may have signs *, as in a campaign.
    """
    blocks = re.findall(r'```\w+ title="([^"]+)"\n(.*?)```', "\n".join(pages.values()), re.DOTALL)
    known = dict(blocks) | {file.name: file.read_text(encoding="utf-8") for file in entries(_FILES, "*.[cy]*")}
    found, waiting = dict[str, str](), [pages[name]]
    while waiting:
        text = waiting.pop(0)
        several = [name for name in re.findall(r"[\w.*-]+", text) if "*" in name and "." in name]
        for file in known:
            named = re.search(rf"(?<![\w./]){re.escape(file)}(?!\w)", text) or any(fnmatch(file, x) for x in several)
            if file not in found and named:
                found[file] = known[file]
                waiting.append(known[file])
    return found

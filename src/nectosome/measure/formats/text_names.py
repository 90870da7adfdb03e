"""Names and units of the columns, from the lines above the first row."""

import re
from dataclasses import dataclass

from nectosome.measure.formats.headings import bare_unit, is_bracketed, is_unit
from nectosome.measure.formats.text_cells import BLANKS, COMMENT, Kind, kind, split

_WIDE_GAP = re.compile(r"\t+| {2,}")
_BEFORE_BRACKET = re.compile(r"[ \t]+(?=[\[(])")


@dataclass(frozen=True)
class Head:
    """Cells of the lines that hold names and units, and where these lines are, 0 for none."""

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    names_line: int = 0
    units_line: int = 0


def find_head(above: list[tuple[int, str]], delimiter: str, decimal: str, widths: range) -> Head:
    """Return what the numbered lines above the first row say, if they have as many cells as `widths` allows."""

    def fitting(line: str) -> list[str]:
        cells = name_cells(line, delimiter, widths)
        return [] if any(kind(cell, decimal) in (Kind.NUMBER, Kind.MOMENT) for cell in cells) else cells

    plain: list[tuple[int, list[str]]] = []
    comments: list[tuple[int, list[str]]] = []
    for number, line in reversed(above):
        cells = fitting(uncomment(line))
        if line.lstrip().startswith(COMMENT):
            comments += [(number, cells)] if len(cells) > 1 else []
        elif cells:
            plain.append((number, cells))
        else:
            break
    lines = plain or comments
    if not lines:
        return Head()
    (number, cells), (upper, more) = lines[0], lines[1] if len(lines) > 1 else (0, [])
    bracketed = all(is_bracketed(cell) for cell in cells if cell)
    if bracketed or (more and is_unit_row(cells) and not is_unit_row(more)):
        return Head(tuple(more), units_of(cells, len(more) or len(cells)), upper, number)
    return Head(tuple(cells), (), number)


def name_cells(line: str, delimiter: str, widths: range) -> list[str]:
    """Return the cells of a line of names, none if they are not as many as `widths` allows.

    Between blanks, names may hold blanks themselves: two blanks or a tab then end a name, or a unit in brackets does.
    """
    ways = [line]
    if delimiter == BLANKS:
        ways = [line, _WIDE_GAP.sub(" ", _glue(line)), _BEFORE_BRACKET.sub("\0", line)]
    for way in ways:
        try:
            cells = [cell.replace("\0", " ") for cell in split(way, delimiter)]
        except ValueError:
            continue
        if len(cells) == widths[-1] + 1 and cells[-1] == "Comment":
            cells.pop()  # LabVIEW heads a column of comments, and ends the rows before it
        said = max((k for k, cell in enumerate(cells, 1) if cell), default=0)
        count = max(said, widths[0])
        if said and count in widths and count <= len(cells):
            return cells[:count]
    return []


def units_of(cells: list[str], count: int) -> tuple[str, ...]:
    """Return the units in a row of them, as many as there are columns."""
    return tuple(bare_unit(cell) for cell in [*cells, *[""] * count][:count])


def uncomment(line: str) -> str:
    """Return a line without the sign that makes it a comment."""
    return line.lstrip().lstrip("".join(COMMENT)).lstrip() if line.lstrip().startswith(COMMENT) else line


def _glue(line: str) -> str:
    """Replace single blanks, which are within a name where two or more are between names."""
    return re.sub(r"(?<! ) (?! )", "\0", line.strip())


def is_unit_row(cells: list[str]) -> bool:
    """Whether every cell is empty or reads as a unit."""
    return all(is_unit(cell) for cell in cells if cell)

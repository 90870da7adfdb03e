"""The page of a correction in the terminal: what was read, how well it is met, and what to measure next."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.cli.page import columns, page
from nectosome.identify import Observed
from nectosome.view.correction_words import Rows, lines, read_lines, tables

if TYPE_CHECKING:
    import xarray as xr


def correction_page(found: "xr.Dataset", observed: Sequence[Observed], aim: str) -> Group:
    """Return the page of what `correct_grid` gives."""
    title = Text(str(found.attrs["title"]), "bold")
    head = Text("\n").join([title, Text(""), *map(Text, read_lines(observed))])
    return page(head, [_table(rows) for rows in tables(found, aim)], lines(found, observed))


def _table(rows: Rows) -> Table:
    table = columns(*rows.names)
    for row in rows.rows:
        table.add_row(*row)
    return table

"""The page of a robot that does not move: a picture that turns, and numbers."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

import xarray as xr

from .page import write_page
from .scenes import run_scene
from .style import Panel
from .tubes import description

Rows = Sequence[Sequence[str]]


def show_still(run: xr.Dataset, path: str | Path, tables: Sequence[Rows]) -> None:
    """Write a page with the robot of a run as it is at first, and tables of numbers, the first row their heads.

    The page works offline and is written whole or not at all. Raises InputError where it cannot be written.
    """
    title = str(run.attrs.get("title") or "robot")
    robot = description(run)
    about = [] if robot is None else [f"<p>{escape(robot.about)}</p>"]
    scene = Panel("The robot", "Drag to turn, scroll to come nearer. z is up.", run_scene(run.isel(time=slice(1))))
    write_page(path, title, [*about, scene, *map(_table, tables)])


def _table(rows: Rows) -> str:
    heads, *body = rows
    inner = "\n".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in body)
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heads)
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{inner}\n</tbody></table></div><br>'


def _cell(text: str) -> str:
    return f"<td>{escape(text)}</td>"

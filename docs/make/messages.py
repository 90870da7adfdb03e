"""Statuses of solvers, and the sentences that tell mistakes, as the code has them."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from nectosome.core import Status
from nectosome.vision.cameras.triangulate import PlaceStatus
from nectosome.vision.video import Reason

SOURCE = Path(__file__).parents[2] / "src" / "nectosome"
_TELLERS = {"InputError", "RigError", "UnsoundError", "_UnheardError", "_UnreadableError", "tell"}
_KINDS = {
    "Of a motion or an equilibrium": Status,
    "Of a coloured segment in a picture": Reason,
    "Of a marker in space": PlaceStatus,
}


def statuses() -> str:
    """A table for each kind of status."""
    parts = []
    for title, kind in _KINDS.items():
        rows = [f"| `{member.name}` | {member.reason} |" for member in kind]
        parts += [f"## {title}", "\n".join(["| status | meaning |", "|---|---|", *rows])]
    return "\n\n".join(parts)


def messages() -> str:
    """A list for each room; `…` stands for what the message fills in."""
    parts = []
    for room in sorted(path for path in SOURCE.iterdir() if path.is_dir()):
        found = sorted({text for file in room.rglob("*.py") for text in _sentences(file)}, key=str.lower)
        if found:
            parts += [f"## {room.name}", "\n".join(f"- {text}" for text in found)]
    return "\n\n".join(parts)


def _sentences(file: Path) -> Iterator[str]:
    """What is written as a sentence in the calls that tell users something."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in _TELLERS and node.args:
            text = re.sub(r"…[\s…]*…", "…", " ".join(_text(node.args[0]).split()))
            if len(re.findall(r"[a-zA-Z]{2,}", text)) > 2:
                yield re.sub(r"([\\`*_<>\[\]|$])", r"\\\1", text)


def _text(node: ast.expr) -> str:
    """Text of an expression, with `…` where it depends on something."""
    match node:
        case ast.Constant(str(text)):
            return text
        case ast.JoinedStr(values):
            return "".join(_text(value) for value in values)
        case ast.BinOp(left, ast.Add(), right):
            return _text(left) + _text(right)
        case _:
            return "…"

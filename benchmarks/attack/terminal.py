"""Orders to a terminal in the names of everything that a message or a table may show."""

import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.small_robots import BALL

from nectosome.io import save_dataset

from .attempt import Attack, Outcome, commanded
from .damage import ESCAPES
from .saved_runs import bare_run
from .yaml_files import BESIDE, starter

_ORDERS = (
    *(one.replace("\0", "\x0e") for one in ESCAPES),
    *("\x1b[31m", "\x1b]8;;http://127.0.0.1:9/\x07x\x1b]8;;\x07", "\x1bP$q\x1b\\", "\x1b[6n", "\x1bc"),
    *("\x1b[?1049h", "\x9d0;x\x9c"),
    *("\u200f", "\u061c", "\u202d", "\x85", "\x0b\x0c", "\x1b#8", "\x05", "\u2028"),
)  # fmt: skip


def terminal(rng: random.Random, count: int) -> Iterator[Attack]:
    """Names of robots, parts, loads, aliases, columns, conditions, runs, files and options, in text and in JSON."""
    for k in range(count):
        order = _ORDERS[k % len(_ORDERS)]
        name = f"a{order}b"
        argv, files, run = _case(rng, name, json.dumps(name))
        argv = (*argv, "--json") if rng.random() < 0.3 else argv
        yield Attack(
            f"{order!r}: {' '.join(argv)}", _attempt(argv, files, run, (name, argv[0], *argv[1:2], *files, "run.nc"))
        )


def _attempt(
    argv: tuple[str, ...], files: dict[str, bytes], run: dict[str, str], named: tuple[str, ...]
) -> Callable[[Path], Outcome]:
    def attempt(folder: Path) -> Outcome:
        if run:
            save_dataset(bare_run(**run), folder / "run.nc")
        return commanded(argv, files, named)(folder)

    return attempt


def _case(rng: random.Random, name: str, quoted: str) -> tuple[tuple[str, ...], dict[str, bytes], dict[str, str]]:
    """A command, its files, and attributes of its run; `quoted` is the name as YAML has it."""
    how = rng.randrange(9)
    command = rng.choice(("show", "check"))
    if how == 0:
        return (
            (command, "it.yaml"),
            {"it.yaml": BALL.replace("name: ball", f"name: {quoted}\nabout: {quoted}").encode()},
            {},
        )
    if how == 1:
        return (command, "it.yaml"), {"it.yaml": BALL.replace("drag:", f"{quoted}:").encode()}, {}
    if how == 2:
        limb = f"limbs:\n  {quoted}: {{on: body, kind: rigid, shape: point, mass: 1 kg, joint: {{kind: fixed}}}}\n"
        return (command, "it.yaml"), {"it.yaml": (BALL + limb + f"aliases: {{{quoted}: body.density}}\n").encode()}, {}
    if how == 3:
        return (command, f"{name}.yaml".replace("/", "_")), {f"{name}.yaml".replace("/", "_"): BALL.encode()}, {}
    if how == 4:
        table = f"time (s),{name} (N),force {name}\n0,1,2\n1,2,{rng.choice(('3', name))}\n"
        return ("measure", "it.csv"), {"it.csv": table.encode()}, {}
    if how == 5:
        text = (
            starter("sheet")
            .replace("force:", f"{quoted}:")
            .replace("{f:", f"{{{quoted}:")
            .replace("about: ", f"about: {quoted} #")
        )
        return ("measure", "run_1.csv", "--config", "it.yaml"), BESIDE | {"it.yaml": text.encode()}, {}
    if how == 6:
        return (
            ("show", "run.nc"),
            {},
            {rng.choice(("title", "status", "status_reason", "robot", "provenance", "x")): name},
        )
    if how == 7:
        words = rng.choice(
            (
                ("show", name),
                ("simulate", "it.yaml", "--set", f"{name}=3"),
                (name,),
                ("new", name),
                ("check", "it.yaml", name),
            )
        )
        return words, {"it.yaml": BALL.encode()}, {}
    field = rng.choice(("density: 1200 kg/m3", "kind: rigid", "shape: spheroid", "axis: z", "length: 40 mm"))
    return (command, "it.yaml"), {"it.yaml": BALL.replace(field, f"{field.split(':')[0]}: {quoted}").encode()}, {}

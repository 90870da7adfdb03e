"""Command lines: options of every command with hostile values and files that cannot be; streams that are closed."""

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from cyclopts import App
from tests.cli.test_terminal import ended
from tests.rights import ordinary_rights
from tests.small_robots import BALL

from nectosome.cli.app import app
from nectosome.identification.gait.files import load_gait_fit

from .attempt import Attack, Outcome, commanded, warm_up
from .damage import ESCAPES, LONG, MARKUP
from .yaml_files import BESIDE, starter

_TEXTS = (
    *("", " ", "nan", "inf s", "1e999 s", "-1 m", "3 parsec", "1..", "..", "[1, 2]", "{}", "=", "=3", "x="),
    *("1" * 5000, "0x10"),
    *("--", "-x", "--nonsense", "$(true)", "%s%n", "'", '"', "a,b,c", "é", *MARKUP, *ESCAPES, *LONG),
)  # fmt: skip
# files that cannot be read or written; some of them need an ending
_PATHS = ("locked/x", "readonly/x", "n" * 300, "gone/" + "n" * 300, "ball.yaml/x", "circle/x", "a\0b", "bad")
_ENDINGS = {"--save": ".nc", "--plot": ".html", "--write": ".yaml", "--overlay": ".mp4"}
_FILES = BESIDE | {
    "ball.yaml": BALL.encode(),
    "campaign.yaml": starter("campaign").encode(),
    "gaits.yaml": starter("gaits").encode(),
    "rig.yaml": starter("rig").encode(),
    "bad": bytes(99),
    **{f"bad{ending}": bytes(99) for ending in (".nc", ".html", ".yaml", ".mp4")},
}
# what each command needs, good
_NEEDED = {
    "control": ("ball.yaml", "--command", "body.density", "--measure", "position.z", "--reference", "1mm"),
    "control rig": ("--config", "rig.yaml", "--reference", "1mm"),
    "correct": ("ball.yaml", "--campaign", "campaign.yaml", "--over", "body.density=1100,1200kg/m3"),
    "design": ("ball.yaml", "--vary", "body.density=1100..1300kg/m3"),
    "design composite": ("--core", "1mm, 1MPa", "--shell", "2mm, 2MPa"),
    "identify": (
        "ball.yaml",
        "--campaign",
        "campaign.yaml",
        "--compare",
        "force=force.z",
        "--vary",
        "body.density=1..2g/cm3",
    ),
    "identify gait": ("--target", "gaits.yaml"),
    "identify hysteresis": ("--campaign", "campaign.yaml"),
    "identify surge": ("--campaign", "campaign.yaml", "--mass", "1kg"),
    "measure": ("run_1.csv",),
    "new": ("tail", "locked/x.yaml"),
    "reproduce": ("flagellum", "--out", "bad"),
    "schema": ("robot",),
    "studio": ("ball.yaml", "--no-browser"),
    "sweep": ("ball.yaml", "--over", "body.density=1100,1200kg/m3"),
    "track": ("a.mp4", "--config", "bad"),
    "tutorial": ("servo", "locked/x"),
    "render": ("ball.yaml", "--save", "x.png"),
}


def command_lines(rng: random.Random, count: int) -> Iterator[Attack]:
    """One option or name of a command is hostile, missing, unknown or twice."""
    warm_up(commanded(argv, _FILES, ()) for argv in (("check", "ball.yaml"), ("measure", "run_1.csv")))
    warm_up([commanded((), _FILES, (), lambda: load_gait_fit("gaits.yaml"))])
    found = [*_commands(app, ())]
    for k in range(count):
        path, options = found[k % len(found)]
        needed = list(_NEEDED.get(" ".join(path), ("ball.yaml",)))
        option, is_path = rng.choice(options)
        name = rng.choice(_PATHS) if is_path else rng.choice(_TEXTS)
        if is_path and option in _ENDINGS and rng.random() < 0.8:
            name = rng.choice((*_PATHS, "folder")) + _ENDINGS[option]
        how = rng.random()
        if how < 0.08:
            given = [
                *needed,
                rng.choice(("--nonsense", "-q", "--no-set", "--nonsense=3", f"--{MARKUP[0]}", ESCAPES[1], LONG[0])),
            ]
        elif how < 0.12 and path[0] not in ("studio", "new", "tutorial"):  # which need nothing
            given = needed[:-1]
        elif how < 0.3 and not needed[0].startswith("-"):
            given = [rng.choice((*_TEXTS, *_PATHS)), *needed[1:]]
            option, name = path[-1], given[0]
        elif option in needed:
            given = [*needed]
            given[needed.index(option) + 1] = name
        else:
            given = [*needed, option, name]
        named = (option, name, path[-1], *needed, *given, "locked", "run_1.csv", name.partition("=")[0])
        yield Attack(" ".join((*path, *given))[:300], _in_odd_folder((*path, *given), named))


def _commands(commands: App, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], list[tuple[str, bool]]]]:
    """Every command, and its options that take a value: whether that is a file."""
    for name in commands:
        if not name.startswith("-"):
            yield from _commands(commands[name], (*path, name))
    if path and commands.default_command is not None:
        arguments: Any = commands.assemble_argument_collection()
        known = [(one.names[0], one.hint) for one in arguments if one.names[0].startswith("--")]
        yield (
            path,
            [(name, "Path" in str(hint)) for name, hint in known if hint not in (bool, type(None))] or [("--x", False)],
        )


def _in_odd_folder(argv: tuple[str, ...], named: tuple[str, ...]) -> Callable[[Path], Outcome]:
    """A command in a folder with folders that may not be entered or written to, and a link in a circle."""
    attempt = commanded(argv, _FILES, named)

    def within(folder: Path) -> Outcome:
        (folder / "circle").symlink_to("circle")
        folders = {f"folder{ending}": 0o700 for ending in ("", *_ENDINGS.values())}
        for name, mode in {"locked": 0, "readonly": 0o500, **folders}.items():
            (folder / name).mkdir()
            (folder / name).chmod(mode)
        with ordinary_rights():
            return attempt(folder)

    return within


# by how a stream is closed or full: the code of a command that would succeed
_STREAMS = {"1>&-": 2, "2>&-": 0, "1>&- 2>&-": 2, "0<&- 1>&- 2>&-": 2, "1>/dev/full": 2, "2>/dev/full": 0, "0<&-": 0}


def closed_streams(rng: random.Random, count: int) -> Iterator[Attack]:
    """Commands in processes of their own, good and wrong ones, with streams that are closed or full."""
    good = (
        ("show", "ball.yaml"),
        ("check", "ball.yaml"),
        ("measure", "run_1.csv"),
        ("schema", "rig"),
        ("--help",),
        ("new",),
    )
    wrong = (("show", "gone.yaml"), ("simulate", "ball.yaml", "--time", "x"), ("measure", "bad"), ("nonsense",))
    for _ in range(count):
        redirection, is_good = rng.choice([*_STREAMS]), rng.random() < 0.5
        argv = rng.choice(good if is_good else wrong)
        expected = _STREAMS[redirection] if is_good else 2

        def attempt(folder: Path, redirection=redirection, argv=argv, expected=expected) -> Outcome:
            for name, content in _FILES.items():
                (folder / name).write_bytes(content)
            code, err = ended(redirection, *argv)
            found = [f"exit code {code}"] if code != expected else []
            found += ["more than a line"] if len(err.splitlines()) > 1 else []
            found += ["a traceback"] if "Traceback" in err else []
            found += [f"makes {sorted(left)}"] if (left := {path.name for path in folder.iterdir()} - {*_FILES}) else []
            return Outcome(code == 0, [f"{one}: {err[:400]}" for one in found])

        yield Attack(f"{' '.join(argv)} {redirection}", attempt)

"""How a command is to answer wrong input, and that examples are what their scripts make."""

import runpy
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np


def contents(folder: Path) -> list[tuple[str, int]]:
    """Every file and when it was changed, and every folder; a lock says only who has it."""
    there = [path for path in folder.rglob("*") if path.name != "lock"]
    return sorted((str(path), 0 if path.is_dir() else path.lstat().st_mtime_ns) for path in there)


def faults(code: int, err: str) -> list[str]:
    """What is not as it should be in the answer to wrong input."""
    words = ("Traceback", "Error:", "ValidationError", "CoercionError", "object at 0x", "pydantic", "cyclopts")
    found = [f"says {word}" for word in words if word in err]
    found += [f"exit code {code}"] if code != 2 else []
    return found + (["not one line"] if len(err.splitlines()) != 1 or not err.strip() else [])


def obeyed(text: str) -> list[str]:
    """The characters of a text that a terminal would obey instead of show."""
    return sorted({c for c in text if not c.isprintable() and c not in "\n"})


def check_wrong(nectosome: Callable[..., Any], cases: Iterable[tuple[str, ...]], folder: Path) -> None:
    """Each command line is answered with one sentence and exit code 2, and no file in the folder is new or changed."""
    before = contents(folder)
    wrong = []
    for argv in cases:
        answer = nectosome(*argv)
        found = faults(answer.code, answer.err) + (["prints to stdout"] if answer.out else [])
        wrong += [(argv, found, answer.err)] if found else []
    assert wrong == [], wrong[:3]
    assert contents(folder) == before


def check_made(example, folder, monkeypatch, off):
    """The recordings of an example are those that its script makes, but for so much by the name of the file."""
    monkeypatch.setattr("sys.argv", ["make.py", str(folder)])
    runpy.run_path(str(example / "make.py"), run_name="__main__")
    made = sorted(folder.glob("*.csv"))
    assert len(made) == len([*example.glob("*.csv")]) > 0
    for file in made:
        theirs, ours = (np.loadtxt(where / file.name, delimiter=",", skiprows=1) for where in (example, folder))
        np.testing.assert_allclose(ours, theirs, atol=off(file.name))

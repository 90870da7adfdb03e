"""Caches of programs: bits flipped, files cut, folders of others or open to them, a file for the folder."""

import os
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import patch

from tests.rights import ordinary_rights

from nectosome.core.programs.program_files import CompiledPrograms, why_refused
from nectosome.io.atomic import read_kept, write_kept

from .attempt import Attack, Outcome, measured
from .damage import FOREIGN, damaged_bytes


def caches(rng: random.Random, count: int) -> Iterator[Attack]:
    """Damaged programs are not read, and made anew; a folder that is not the user's own is refused; none raises."""
    kinds = (_damaged, _damaged, _compiled, _odd_folder, _refused)
    for k in range(count):
        about, act = kinds[k % len(kinds)](rng)
        yield Attack(about, _attempt(act))


def _attempt(act: Callable[[Path], list[str]]) -> Callable[[Path], Outcome]:
    def attempt(folder: Path) -> Outcome:
        found = list[str]()
        with measured(found), ordinary_rights():
            try:
                found += act(folder)
            except Exception as error:
                found.append(f"raised {error!r}")
        return Outcome(False, found)

    return attempt


def _damaged(rng: random.Random) -> tuple[str, Callable[[Path], list[str]]]:
    content = rng.randbytes(rng.choice((0, 1, 100, 100_000)))
    seed = rng.randrange(2**32)

    def act(folder: Path) -> list[str]:
        file = folder / "traced" / "program"
        write_kept(file, content)
        own, sound = random.Random(seed), file.read_bytes()
        damaged = sound
        while damaged == sound:
            damaged = own.choice(FOREIGN) if own.random() < 0.1 else damaged_bytes(sound, own)[1]
        file.write_bytes(damaged)
        found = [] if read_kept(file) is None else ["a damaged program is read"]
        write_kept(file, content)
        return found + ([] if read_kept(file) == content else ["it is not made anew"])

    return f"a damaged program of {len(content)} bytes", act


def _compiled(rng: random.Random) -> tuple[str, Callable[[Path], list[str]]]:
    content, seed = rng.randbytes(500), rng.randrange(2**32)

    def act(folder: Path) -> list[str]:
        kept = CompiledPrograms(str(folder / "xla"))
        kept.put("key", content)
        file, own = folder / "xla" / "key", random.Random(seed)
        sound = damaged = file.read_bytes()
        while damaged == sound:
            damaged = damaged_bytes(sound, own)[1]
        file.write_bytes(damaged)
        found = [] if kept.get("key") is None else ["damaged machine code is run"]
        kept.put("key", content)
        return found + ([] if kept.get("key") == content else ["it is not made anew"])

    return "damaged machine code", act


def _odd_folder(rng: random.Random) -> tuple[str, Callable[[Path], list[str]]]:
    kind = rng.choice(
        ("a file", "a link in a circle", "a folder", "may not be entered", "may not be written", "may not be read")
    )
    inner = rng.choice(("", "traced", "traced/program"))

    def act(folder: Path) -> list[str]:
        cache = folder / "cache"
        place = cache / inner
        place.parent.mkdir(parents=True, exist_ok=True)
        if kind == "a file":
            place.write_text("x")
        elif kind == "a link in a circle":
            place.symlink_to(place.name)
        else:
            place.mkdir(parents=True)
            place.chmod(
                {"may not be entered": 0, "may not be written": 0o500, "may not be read": 0o300}.get(kind, 0o700)
            )
        write_kept(cache / "traced" / "program", b"x")
        read = read_kept(cache / "traced" / "program")
        return [f"reads {read!r}"] if read not in (None, b"x") else []

    return f"{inner or 'the cache'} is {kind}", act


def _refused(rng: random.Random) -> tuple[str, Callable[[Path], list[str]]]:
    inner, other = rng.choice(("", "xla", "traced")), rng.random() < 0.3
    mode = rng.choice((0o777, 0o770, 0o702, 0o720, 0o1777, 0o775))

    def act(folder: Path) -> list[str]:
        (folder / inner).mkdir(exist_ok=True)
        (folder / inner).chmod(0o700 if other else mode)
        user = os.getuid()
        if other and user == 0:
            os.chown(folder / inner, 12_345, -1)
        with patch("os.getuid", return_value=user + (other and user != 0)):
            said = why_refused(folder)
        return [] if said else ["it is not refused"]

    return f"{inner or 'the cache'} {'of another owner' if other else f'of mode {mode:o}'}", act

"""Files that people write: those that ship, with one value, name, line or byte of each replaced by what is hostile."""

import copy
import random
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import nectosome
from nectosome.description import load_robot
from nectosome.description.mission import load_mission
from nectosome.designs.problem import load_problem
from nectosome.identification.gait.files import load_gait_fit
from nectosome.io.yaml_text import read_yaml, write_yaml
from nectosome.rigs.loops_file import load_loops
from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.run_plan import load_plan
from nectosome.vision.video.sheet import load_sheet

from .attempt import Attack, commanded, warm_up
from .damage import FOREIGN, KEYS, TEXTS, VALUES, damaged_text

_HERE = Path(nectosome.__file__).parent
_STARTS = _HERE / "cli" / "templates"
_ROBOTS = (*sorted((_HERE / "robots").glob("*.yaml")), *sorted((_HERE / "robots" / "templates").glob("*.yaml")))
BESIDE = {name: (_STARTS / name).read_bytes() for name in ("run_1.csv", "run_2.csv")}
_RIGS = """
dt: 5 ms
devices:
  tail:
    kind: ni
    outputs: {pressure: [{channel: Dev1/ao0, zero: 5 V, slope: 0.2 bar/V}]}
    inputs: {displacement: {channel: Dev1/ai0, zero: 2.5 V, slope: 10 mm/V, low: 0 V, high: 5 V}}
    watchdog: {device: cDAQ1, timeout: 100 ms}
commands: {tail.pressure: {low: -0.6 bar, high: 0.6 bar, slew: 3.8 bar/s}}
measurements: {tail.displacement: {least: -25 mm, most: 25 mm, error: 5 mm}}
---
dt: 10 ms
devices:
  servos: {kind: dynamixel, port: /dev/ttyUSB0, servos: {left: {number: 1}}, record: [current]}
commands: {servos.left: {low: -60 deg, high: 60 deg, slew: 100 deg/s}}
measurements: {servos.left: {least: -70 deg, most: 70 deg, error: 30 deg}}
---
dt: 10 ms
devices:
  motor: {kind: serial, port: /dev/ttyACM0}
commands: {motor.speed: {low: 0 rad/s, high: 20 rad/s, slew: 30 rad/s2}}
measurements: {motor.speed: {least: -1 rad/s, most: 25 rad/s, error: 10 rad/s}}
guards: {saturated_time: 2 s}
"""


def starter(kind: str) -> str:
    """The file that `nectosome new KIND` writes."""
    return (_STARTS / f"{kind}.yaml").read_text(encoding="utf-8")


def robots(rng: random.Random, count: int) -> Iterator[Attack]:
    """Robot files, each checked."""
    texts = [path.read_text(encoding="utf-8") for path in _ROBOTS]
    return _attacks(rng, count, texts, ("check", "it.yaml"))


def problems(rng: random.Random, count: int) -> Iterator[Attack]:
    """Design problems."""
    texts = [
        starter("problem"),
        *(path.read_text(encoding="utf-8") for path in (_HERE / "designs" / "problems").iterdir()),
    ]
    return _attacks(rng, count, texts, ("design", "flagellum", "--problem", "it.yaml"), load_problem)


def campaigns(rng: random.Random, count: int) -> Iterator[Attack]:
    """Campaigns of recordings."""
    return _attacks(rng, count, [starter("campaign")], ("measure", "--campaign", "it.yaml"))


def sheets(rng: random.Random, count: int) -> Iterator[Attack]:
    """Sheets of recordings."""
    return _attacks(rng, count, [starter("sheet")], ("measure", "run_1.csv", "--config", "it.yaml"))


def rigs(rng: random.Random, count: int) -> Iterator[Attack]:
    """Rig files of every device, of which none is opened."""
    texts = [starter("rig"), *_RIGS.split("---\n")]
    return _attacks(rng, count, texts, ("control", "rig", "--config", "it.yaml", "--reference", "1mm"), load_rig)


def plans(rng: random.Random, count: int) -> Iterator[Attack]:
    """Plans of runs on a simulated rig, which are listed."""
    beside = {"rig.yaml": starter("rig").encode()}
    argv = ("rig", "run", "it.yaml", "--config", "rig.yaml", "--dry-run")
    return _attacks(rng, count, [starter("plan")], argv, lambda path: load_plan(path, load_rig("rig.yaml")), beside)


def loops(rng: random.Random, count: int) -> Iterator[Attack]:
    """Loops of a robot, which are not run."""
    return _attacks(rng, count, [starter("loops")], ("control", "loops", "eel", "it.yaml"), load_loops)


def missions(rng: random.Random, count: int) -> Iterator[Attack]:
    """Missions of a robot."""
    robot = load_robot(_HERE / "robots" / "templates" / "tail.yaml")
    argv = ("simulate", "tail.yaml", "--mission", "it.yaml")
    beside = {"tail.yaml": (_HERE / "robots" / "templates" / "tail.yaml").read_bytes()}
    return _attacks(rng, count, [starter("mission")], argv, partial(load_mission, robot=robot), beside)


def gaits(rng: random.Random, count: int) -> Iterator[Attack]:
    """Files of gaits."""
    return _attacks(rng, count, [starter("gaits")], ("identify", "gait", "--target", "it.yaml"), load_gait_fit)


def videos(rng: random.Random, count: int) -> Iterator[Attack]:
    """Sheets of videos."""
    return _attacks(
        rng, count, [starter("segments"), starter("markers")], ("track", "a.mp4", "--config", "it.yaml"), load_sheet
    )


def _attacks(
    rng: random.Random,
    count: int,
    texts: list[str],
    argv: tuple[str, ...],
    read: Callable[[Path], object] | None = None,
    beside: dict[str, bytes] = BESIDE,
) -> Iterator[Attack]:
    """Foreign files, every whole text, then files of which a part is hostile."""
    good = [(text, read_yaml(text, "")[0]) for text in texts]
    whole = [(f"foreign {raw[:16]!r}", raw) for raw in FOREIGN] + [(f"text {t[:30]!r}", t.encode()) for t in TEXTS]
    whole = rng.sample(whole, min(len(whole), count // 4))
    reader = None if read is None else partial(read, Path("it.yaml"))
    warm_up(commanded(argv, beside | {"it.yaml": text.encode()}, (), reader) for text in texts)
    for k in range(count):
        text, data = good[k % len(good)]
        if k < len(whole):
            about, raw = whole[k]
        elif rng.random() < 0.3:
            about, raw = damaged_text(text, rng)
        else:
            about, changed = _changed(data, rng)
            raw = changed.encode()
        yield Attack(about, commanded(argv, beside | {"it.yaml": raw}, ("it.yaml", *beside), reader))


def _changed(data: Any, rng: random.Random) -> tuple[str, str]:
    """What was done to a part of a file, and its text."""
    data = copy.deepcopy(data)
    group, key = rng.choice([*_places(data)])
    where, how = f"{key}", rng.random()
    if how < 0.1 and isinstance(group, dict):
        del group[key]
        return f"{where} missing", write_yaml(data)
    if how < 0.35 and isinstance(group, dict):
        name = rng.choice(KEYS)
        items = [*group.items()]
        group.clear()
        renamed = rng.random() < 0.5
        for other, value in items:
            if other == key:
                group["VALUE"] = value
            if other != key or not renamed:
                group[other] = value
        said = "is called" if renamed else "again, as"
        return f"{where} {said} {name[:40]!r}", write_yaml(data).replace("VALUE", name, 1)
    value = rng.choice(VALUES)
    group[key] = "VALUE"
    return f"{where}: {value[:40]!r}", write_yaml(data).replace("VALUE", value, 1)


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Every value, by what it stands in and its name or number there."""
    for key, value in [*data.items()] if isinstance(data, dict) else [*enumerate(data)]:
        yield data, key
        if isinstance(value, dict | list):
            yield from _places(value)

"""The attacks of `python -m benchmarks attack`: some of each class whose attacks take milliseconds."""

import random

import pytest
from benchmarks.attack.attempt import commanded, judged
from benchmarks.attack.classes import CLASSES

CHEAP = (
    *("problems", "campaigns", "sheets", "rigs", "loops", "missions", "recordings", "tables", "meshes"),
    *("drawings", "terminal", "caches"),
)
SEED = 7


@pytest.mark.parametrize("count", [15, pytest.param(50, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [pytest.param("robots", marks=pytest.mark.slow), *CHEAP])  # some robots are computed
def test_every_attack_is_survived(tmp_path, monkeypatch, name, count):
    wrong = []
    for k, attack in enumerate(CLASSES[name].attacks(random.Random(f"{name} {SEED}"), count)):
        folder = tmp_path / f"{k}"
        folder.mkdir()
        monkeypatch.chdir(folder)
        if faults := attack.attempt(folder).faults:
            wrong.append((attack.about, faults))
    assert wrong == []


def test_there_are_two_thousand_and_a_seed_gives_the_same():
    assert sum(one.count for one in CLASSES.values()) >= 2000
    first, again = ([a.about for a in CLASSES["caches"].attacks(random.Random(3), 40)] for _ in range(2))
    assert first == again and len(set(first)) > 10


@pytest.mark.parametrize(
    ("code", "out", "err", "fault"),
    [
        (2, "", "it.yaml: wrong.\n", ""),
        (0, "fine\n", "", ""),
        (1, "", "it.yaml: wrong.\n", "exit code 1"),
        (2, "", "wrong.\n", "names none"),
        (2, "", "it.yaml: wrong.\nand more\n", "not one line"),
        (2, "x", "it.yaml: wrong.\n", "prints to stdout"),
        (2, "", "Traceback it.yaml\n", "says Traceback"),
        (0, "\x1b[2J", "", "would obey"),
        (2, "", f"it.yaml {'x' * 1000}\n", "a line of"),
        (0, "", "warning\n" * 21, "21 warnings"),
    ],
)
def test_an_answer_is_judged(code, out, err, fault):
    found = judged(code, out, err, ("it.yaml",))
    assert (fault in found[0]) if fault else found == []


def test_what_is_written_or_raised_is_found(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def fails() -> None:
        raise ZeroDivisionError

    outcome = commanded(("check", "it.yaml"), {"it.yaml": b"x"}, ("it.yaml",), fails)(tmp_path)
    assert len(outcome.faults) == 1 and "ZeroDivisionError" in outcome.faults[0]
    written = commanded(("check", "it.yaml"), {"it.yaml": b"x"}, (), lambda: (tmp_path / "new").touch())(tmp_path)
    assert written.accepted and "changes" in written.faults[0]

"""The house keeps its order: names that differ in more than grammar, one class name for one meaning, short files."""

import ast
import re
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "src").rglob("*.py"), *(ROOT / "studies").rglob("*.py")])
LONGEST = 450  # lines of a file
# longest first: what English puts at the end of a word
ENDINGS = re.compile(r"(ations?|ements?|ings?|ions?|able|[eo]rs?|ies|ied|ive|ity|ed|es|al|s|e|y)$")
LEAST = 4  # letters that are left of a word
UNLIKE = {"plane"}  # no form of the word that it looks like
ONE_MEANING = {
    "contract": "what every class of a kind promises",
    "correct": "a simulator corrected by experiments: the function, its command, its tab",
    "design": "the search for a robot's numbers: the function, its command, its tab",
    "mission": "a robot taken through modes: its description, its run, its page",
    "rig": "a real robot or actuator: its class, its commands, its tab",
    "sweep": "a motion over a grid of numbers: the function, its command, its figures",
}  # of each name of files that three rooms share


def stem(name: str) -> str:
    """The word without its ending: `track`, `tracked` and `tracking` have one stem."""
    found = ENDINGS.search(name, LEAST)
    return name if found is None or name in UNLIKE else name[: found.start()]


def modules() -> set[str]:
    """Names of all files; the same name in two rooms is the same idea seen by each."""
    return {path.stem for path in FILES if not path.stem.startswith("__")}


def test_words_with_one_root_have_one_stem():
    assert {stem(name) for name in ("track", "tracked", "tracking", "tracks")} == {"track"}
    assert {stem(name) for name in ("batch", "batches")} == {"batch"}
    assert stem("plan") != stem("plane")


def test_no_two_modules_differ_by_inflection_only():
    found = defaultdict(set)
    for name in modules():
        found[stem(name)].add(name)
    assert {key: names for key, names in found.items() if len(names) > 1} == {}


def test_a_name_that_three_rooms_share_has_one_meaning():
    rooms = defaultdict(set)
    for path in FILES:
        if path.is_relative_to(ROOT / "src") and not path.stem.startswith("__"):
            rooms[path.stem].add(path.relative_to(ROOT).parts[2])
    assert {name for name, where in rooms.items() if len(where) > 2} == set(ONE_MEANING)


def test_a_public_class_name_has_one_meaning():
    found = defaultdict(list)
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def test_no_class_name_stands_twice_in_a_room():
    """Private ones too: who reads a room meets both."""
    found = defaultdict(list)
    for path in FILES:
        room = path.relative_to(ROOT).parts[2]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                found[room, node.name].append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def test_a_file_is_read_in_one_sitting():
    lengths = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8").count("\n") for path in FILES}
    assert {name: lines for name, lines in lengths.items() if lines > LONGEST} == {}


def test_every_file_says_what_is_in_it():
    assert [str(p.relative_to(ROOT)) for p in FILES if not ast.get_docstring(ast.parse(p.read_text("utf-8")))] == []
    loud = re.compile(r"/work/|/tmp/|\bissue #?\d+", re.IGNORECASE)
    assert [str(p.relative_to(ROOT)) for p in FILES if loud.search(p.read_text(encoding="utf-8"))] == []

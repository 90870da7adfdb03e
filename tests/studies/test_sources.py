"""Data files in the studies: each has a source, the hash that is told, and its licence beside it."""

import hashlib
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from nectosome_studies import STUDIES

ROOT = Path(__file__).parents[2]
DISTRIBUTION = ROOT / "studies"
PAPERS = DISTRIBUTION / "nectosome_studies"
PROJECT = tomllib.loads((DISTRIBUTION / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SOURCES = tomllib.loads((PAPERS / "sources.toml").read_text(encoding="utf-8"))
MEASURED = SOURCES["measured"]
WRITTEN = {".py", ".pyc", ".toml", ".yaml", ".LICENSE"}  # code, printed numbers, robots and sheets: all others are data
WORDS = {
    "MIT": "Permission is hereby granted, free of charge, to any person obtaining a copy of this software",
    "CC0-1.0": "Affirmer hereby overtly, fully, permanently, irrevocably and unconditionally waives",
}
FIELDS = {"what", "by", "repository", "paper", "changes", "licence", "text", "studies", "files"}
EACH = pytest.mark.parametrize("name", MEASURED)


def test_every_data_file_has_a_source_and_only_one():
    found = [path.relative_to(PAPERS).as_posix() for path in PAPERS.rglob("*") if path.is_file()]
    sets = [*(one["files"] for one in MEASURED.values()), *SOURCES["computed"].values()]
    told = Counter(file for files in sets for file in files)
    assert told == Counter(file for file in found if Path(file).suffix not in WRITTEN)


@EACH
def test_a_source_says_everything(name):
    one = MEASURED[name]
    assert set(one) == FIELDS and all(one.values())
    assert set(one["studies"]) <= set(STUDIES)
    assert one["repository"].startswith("https://")


@EACH
def test_files_are_as_they_were_taken(name):
    files = MEASURED[name]["files"]
    assert {file: hashlib.sha256((PAPERS / file).read_bytes()).hexdigest() for file in files} == files


@EACH
def test_the_licence_lies_beside_its_files_and_is_the_one_told(name):
    one = MEASURED[name]
    text = PAPERS / one["text"]
    assert all(text.parent in (PAPERS / file).parents for file in one["files"])
    assert WORDS[one["licence"]] in " ".join(text.read_text(encoding="utf-8").split())


def test_nothing_ships_twice():
    hashes = Counter(digest for one in MEASURED.values() for digest in one["files"].values())
    assert max(hashes.values()) == 1


def test_what_computes_the_others_is_there():
    for script in SOURCES["computed"]:
        assert (ROOT / script).is_file()


def test_the_package_names_every_licence_and_carries_every_text():
    assert set(PROJECT["license"].split(" AND ")) == {"MIT"} | {one["licence"] for one in MEASURED.values()}
    texts = {f"nectosome_studies/{one['text']}" for one in MEASURED.values()}
    assert set(PROJECT["license-files"]) == texts

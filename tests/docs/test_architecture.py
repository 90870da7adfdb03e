"""The page on the house names what is there."""

import re
from pathlib import Path

HERE = Path(__file__).parents[2]
NAME = re.compile(r"`([A-Za-z_][\w./]*)`")
NO_SOURCE = {"pyproject.toml"}


def test_every_name_on_the_page_stands_in_the_source():
    files = [path for room in ("src", "tests") for path in (HERE / room).rglob("*") if path.suffix in {".py", ".yaml"}]
    words = {word for path in files for word in re.findall(r"\w+", f"{path} {path.read_text(encoding='utf-8')}")}
    names = set(NAME.findall((HERE / "docs" / "develop" / "architecture.md").read_text(encoding="utf-8"))) - NO_SOURCE
    assert len(names) > 100
    assert [name for name in sorted(names) if not set(re.findall(r"\w+", name)) <= words] == []

"""What is told of a release in several places is told alike, and the page on licences knows every package."""

import importlib.util
import json
import re
import tomllib
from pathlib import Path

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = YAML(typ="safe").load(ROOT / "packaging" / "recipe.yaml")
CITATION = YAML(typ="safe").load(ROOT / "CITATION.cff")
CODEMETA = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
CONDA = {"flatbuffers": "python-flatbuffers", "ruamel-yaml": "ruamel.yaml"}  # names that differ there
PAGE = (ROOT / "docs" / "develop" / "licences.md").read_text(encoding="utf-8")
PERMISSIVE = {
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "MIT-CMU",
    "PSF-2.0",
}
PERMISSIVE |= {"Apache-2.0 WITH LLVM-exception", "LicenseRef-Matplotlib", "LicenseRef-Public-Domain", "Zlib"}


def test_one_version_and_one_date():
    newest, date = re.findall(r"^## (\S+) \((.*)\)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)[0]
    told = {PROJECT["version"], RECIPE["context"]["version"], CITATION["version"], CODEMETA["version"], newest}
    assert len(told) == 1
    assert {CITATION["date-released"], CODEMETA["dateModified"]} == {date}


def test_a_change_is_a_line():
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").partition("\n## ")[2].splitlines()
    assert [line for line in lines if len(line) > 120 or line.startswith(" ")] == []
    headings = {line for line in lines if line.startswith("### ")}
    assert headings <= {"### Added", "### Changed", "### Deprecated", "### Removed", "### Fixed"}


def test_one_licence_and_one_summary():
    assert CITATION["license"] == "MIT"
    assert PROJECT["license"] == RECIPE["about"]["license"]
    assert CODEMETA["license"] == "https://spdx.org/licenses/MIT"
    assert PROJECT["license-files"] == RECIPE["about"]["license_file"]
    told = {RECIPE["about"]["summary"], CITATION["abstract"], CODEMETA["description"]}
    assert told == {PROJECT["description"]}


def test_the_recipe_needs_what_the_package_needs_but_nomad():
    needs = dict(re.match(r"([\w.-]+)(.*)", one).groups() for one in PROJECT["dependencies"])
    assert needs.pop("PyNomadBBO")
    needs["python"] = PROJECT["requires-python"]
    wanted = {f"{CONDA.get(name, name.lower())} {range_}" for name, range_ in needs.items()}
    assert set(RECIPE["requirements"]["run"]) == wanted


def test_the_page_on_licences_is_up_to_date():
    """As `python docs/make/licences.py` writes it for these lock files."""
    spec = importlib.util.spec_from_file_location("docs_licences", ROOT / "docs" / "make" / "licences.py")
    licences = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(licences)
    assert len(licences.locked("run")) > 50
    assert licences.renewed(PAGE) == PAGE


def test_every_package_that_is_not_permissive_is_explained():
    explained, _, tables = PAGE.partition("## Not permissive")[2].partition("### Always")
    rows = re.findall(r"^\| ([a-z][a-z0-9-]*) \| ([^|]+) \|", tables, re.M)
    strict = {name for name, licence in rows if set(re.split(" AND | OR ", licence)) - PERMISSIVE} - {"package"}
    assert strict > {"nptdms", "pynomadbbo", "tqdm"}
    assert [name for name in sorted(strict) if not re.search(rf"\b{name}\b", explained)] == []

"""The extras of this package: what the code asks for is in them, and what names one names one that there is."""

import ast
import re
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

ROOT = Path(__file__).parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
NAMED = re.compile(r"nectosome\[([\w,-]+)\]")


def plain(requirement: str) -> str:
    """Name of a distribution, as indexes compare them."""
    return re.sub(r"[-_.]+", "-", re.split(r"[\s\[<>=!;]", requirement)[0]).lower()


def asked() -> list[tuple[str | None, str]]:
    """Package, where the call itself names it, and extra of each call of `package` and `driver`."""
    calls = []
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"package", "driver"}:
                module, extra = map(ast.unparse, node.args)
                written = re.match(r"f?'(\w+)", module)
                calls.append((written and written[1], ast.literal_eval(extra)))
    return calls


def test_each_optional_package_comes_with_the_extra_that_its_message_names():
    owners = packages_distributions()
    assert {extra for _, extra in asked()} == set(EXTRAS) - {"all", "dev", "studio"}
    for module, extra in asked():
        if module:
            assert {plain(owner) for owner in owners[module]} & {plain(one) for one in EXTRAS[extra]}, module


def test_all_holds_every_extra_for_users():
    assert NAMED.findall(EXTRAS["all"][0])[0].split(",") == sorted(set(EXTRAS) - {"all", "dev"})


def test_texts_name_extras_that_there_are():
    texts = [*(ROOT / "src").rglob("*.py"), *(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")]
    named = {extra for path in texts for found in NAMED.findall(path.read_text("utf-8")) for extra in found.split(",")}
    assert named <= set(EXTRAS) and "video" in named

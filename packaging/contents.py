"""Check what the wheel and the sdist in dist/ hold: the package and its licences, and what the clone holds."""

import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "nectosome"
SDIST = ("benchmarks", "docs", "examples", "firmware", "packaging", "requirements", "src", "studies", "tests")
SDIST += ("CHANGELOG.md", "CITATION.cff", "Dockerfile", "LICENSE", "Makefile", "README.md", "pyproject.toml")
LEFT_OUT = {"__pycache__", "out", "schemas"}  # schemas are written by packaging/schemas.py


def files(path: Path, base: Path) -> set[str]:
    """A file, or those in a folder, by their paths from `base`."""
    found = {one.relative_to(base) for one in (path, *path.rglob("*")) if one.is_file()}
    return {one.as_posix() for one in found if not LEFT_OUT & set(one.parts)}


def in_wheel(held: set[str]) -> list[str]:
    """What is wrong with a wheel's files: all of the package, data too, and nothing else but what is told about it."""
    inside, about = set(), set()
    for path in held:
        folder, told, rest = path.partition(".dist-info/")
        (about if told else inside).add(rest or folder)
    package = files(PACKAGE, ROOT / "src")
    package |= {f"nectosome/cli/tutorials/{page.name}" for page in (ROOT / "docs" / "tutorials").iterdir()}
    lacking = (package - inside) | ({"licenses/LICENSE"} - about)
    return [f"lacks {path}" for path in lacking] + [f"holds {path}" for path in inside - package]


def in_sdist(held: set[str]) -> list[str]:
    """What is wrong with an sdist's files: all of the clone, and nothing that a run has left."""
    clone = set().union(*(files(ROOT / one, ROOT) for one in SDIST))
    left = {path for path in held if {*LEFT_OUT, ".venv", "site"} & set(path.split("/"))}
    return [f"lacks {path}" for path in clone - held] + [f"holds {path}" for path in left]


def main() -> int:
    """Print what is wrong; 1 where something is."""
    (wheel,), (sdist,) = (list((ROOT / "dist").glob(ending)) for ending in ("*.whl", "*.tar.gz"))
    with zipfile.ZipFile(wheel) as archive:
        wrong = [f"{wheel.name} {one}" for one in in_wheel(set(archive.namelist()))]
    with tarfile.open(sdist) as archive:
        held = {member.name.partition("/")[2] for member in archive if member.isfile()}
    wrong += [f"{sdist.name} {one}" for one in in_sdist(held)]
    print("\n".join(sorted(wrong)) or f"{wheel.name} and {sdist.name} hold what they should.")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())

"""Renew the tables of docs/develop/licences.md: every package in the lock files and its licence.

    python docs/make/licences.py

It reads the installed packages, so run it in the environment that `make test` makes. What READ says counts; else the
package's own SPDX expression; else its licence file.
"""

import re
import sys
import tomllib
from collections.abc import Iterable
from importlib.metadata import distribution, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "develop" / "licences.md"
LICENCE_FILE = re.compile(r"\.dist-info/(licenses/)?(licen[cs]e|copying)[^/]*$", re.IGNORECASE)
TEXTS = {  # words of a licence's own text, and the licence
    "Apache License Version 2.0": "Apache-2.0",
    "Licensed under the Apache License, Version 2.0": "Apache-2.0",
    "Mozilla Public License": "MPL-2.0",
    "Permission is hereby granted, free of charge": "MIT",
    "endorse or promote products": "BSD-3-Clause",
    "Redistribution and use in source and binary forms": "BSD-2-Clause",
}
_LEFT_OUT = {"all", "dev", "studio"}
READ = {  # read by hand where the files say nothing or too much, and for packages that not every system needs
    "backports-tarfile": "MIT",
    "colorama": "BSD-3-Clause",
    "docutils": "LicenseRef-Public-Domain AND BSD-2-Clause AND BSD-3-Clause",  # the wheel lacks the file under the GPL
    "flatbuffers": "Apache-2.0",
    "importlib-metadata": "Apache-2.0",
    "latex2mathml": "MIT",
    "lazy-importer": "Apache-2.0",
    "matplotlib": "LicenseRef-Matplotlib",
    "mcap": "MIT",
    "mcap-ros2-support": "MIT AND Apache-2.0",  # the latter: the parser of definitions, from rosidl_adapter
    "opencv-python-headless": "Apache-2.0 AND MIT",
    "pynomadbbo": "LGPL-3.0-or-later",
    "pyopengl": "BSD-3-Clause",
    "pyserial": "BSD-3-Clause",
    "pywin32-ctypes": "BSD-3-Clause",
    "tqdm": "MPL-2.0 AND MIT",
    "urdf-parser-py": "BSD-3-Clause",
    "zipp": "MIT",
}


def locked(name: str) -> set[str]:
    """Packages of a lock file."""
    text = (ROOT / "requirements" / f"{name}.lock").read_text(encoding="utf-8")
    return {canonicalize_name(package) for package in re.findall(r"^([\w.-]+)==", text, re.MULTILINE)}


def needed(requirements: Iterable[str]) -> set[str]:
    """Packages that requirements lead to."""
    found: set[str] = set()
    left = [Requirement(one) for one in requirements]
    while left:
        one = left.pop()
        name = canonicalize_name(one.name)
        if name not in found and (one.marker is None or one.marker.evaluate({"extra": ""})):
            found.add(name)
            left += [Requirement(inner) for inner in requires(name) or []]
    return found


def licence(name: str) -> str:
    """SPDX expression. Raises LookupError where none is found: read the package's licence, and add it to READ."""
    if name in READ:
        return READ[name]
    package = distribution(name)
    if expressions := package.metadata.get_all("License-Expression"):
        return str(expressions[0])
    for path in sorted(package.files or [], key=lambda path: len(str(path))):
        if LICENCE_FILE.search(str(path)):
            text = " ".join(Path(str(path.locate())).read_text(encoding="utf-8", errors="replace").split())
            for words, spdx in TEXTS.items():
                if words in text:
                    return spdx
    raise LookupError(f"{name}: no licence found")


def tables() -> str:
    """Three tables: what always comes along, what comes with an extra, what only development needs."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    optional = {name: needed(wanted) for name, wanted in extras.items() if name not in _LEFT_OUT}
    direct = {canonicalize_name(Requirement(one).name) for name in optional for one in extras[name]}
    core = locked("run") - direct
    lines = ["### Always", "", "| package | licence |", "| --- | --- |"]
    lines += [f"| {name} | {licence(name)} |" for name in sorted(core)]
    lines += ["", "### With an extra", "", "| package | licence | extra |", "| --- | --- | --- |"]
    for name in sorted(set().union(*optional.values()) - core):
        with_it = ", ".join(f"`{extra}`" for extra, packages in optional.items() if name in packages)
        lines.append(f"| {name} | {licence(name)} | {with_it} |")
    tools = locked("dev") - core - set().union(*optional.values())
    lines += ["", "### For development only", "", "| package | licence |", "| --- | --- |"]
    lines += [f"| {name} | {licence(name)} |" for name in sorted(tools)]
    return "\n".join(lines)


def renewed(page: str) -> str:
    """The page with its tables as they are now."""
    return page.partition("### Always")[0] + tables() + "\n"


if __name__ == "__main__":
    sys.stdout.write(f"written: {PAGE}, {PAGE.write_text(renewed(PAGE.read_text('utf-8')), 'utf-8')} characters\n")

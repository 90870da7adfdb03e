"""`nectosome check` and `nectosome schema`: mistakes in a robot file, and the schema for editors."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.output import tell, write
from nectosome.cli.weights import weigh
from nectosome.description import json_schema, load_robot
from nectosome.description.plausible import implausible
from nectosome.units import count


def check(file: Annotated[Path, Parameter(help="A robot file.")], /) -> None:
    """Check a robot file: print parts, degrees of freedom and mass, or the mistake.

    Values far outside of those of materials and water give warnings.
    """
    description = load_robot(file)

    from nectosome.model import build

    parts = weigh(build(description), str(file))
    for path, sentence in implausible(description):
        tell(f"{file}, {path}: {sentence}")
    freedoms = sum(len(part.freedoms) for part in parts)
    mass = sum(part.mass for part in parts)
    write(f"{file}: ok, {count(len(parts), 'part')}, {count(freedoms, 'degree')} of freedom, {mass:.4g} kg", wrap=False)


def schema() -> None:
    """Print the JSON Schema of robot files, for editors."""
    write(json.dumps(json_schema(), indent=2), wrap=False)

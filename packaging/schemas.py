"""Write the JSON Schemas that the robot and example files of a clone name in their first lines, for editors."""

from pathlib import Path

from nectosome.cli.schema import schema_text
from nectosome.io.schema.kinds import KINDS

FOLDER = Path(__file__).parents[1] / "src" / "nectosome" / "schemas"

if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, kind in KINDS.items():
        (FOLDER / kind.schema_file).write_text(schema_text(name), encoding="utf-8")

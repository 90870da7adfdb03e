"""Data flows one way: between rooms as `lint-imports` has it, and inside each room no file needs one that needs it.

Imports that only type checkers see count too: who reads one file of a circle has to read them all.
"""

import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("folder", [".", "studies"])
def test_no_room_imports_against_the_flow(folder):
    """The contracts are in the pyproject.toml of the folder; a room without a place there fails too."""
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT / folder, check=False)
    assert done.returncode == 0, done.stdout


def test_no_files_import_each_other_in_a_circle():
    graph = grimp.build_graph("nectosome", "nectosome_studies", cache_dir=None)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))

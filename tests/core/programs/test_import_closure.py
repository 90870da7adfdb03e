"""A remembered program is that of the sources that it depends on, and of no others."""

import re
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import nectosome
from nectosome.core.programs.import_closure import sources

PACKAGE = Path(nectosome.__file__).parent


def _named(*modules: str) -> set[str]:
    return {str(file.relative_to(PACKAGE)) for file in sources(modules)}


def test_an_integration_depends_on_its_steps_and_the_maths_and_on_no_search_or_view():
    found = _named("nectosome.solve.integrate", "nectosome.mechanism.robot")
    steps = {"solve/integrate.py", "solve/runge_kutta.py", "solve/sensitivity.py", "mechanism/joints.py", "core/se3.py"}
    assert steps <= found
    rooms = {name.partition("/")[0] for name in found}
    assert not rooms & {"designs", "search", "view", "studio", "cli", "papers", "identification", "controllers"}


def test_building_depends_on_all_loads():
    assert {f"loads/{file.name}" for file in PACKAGE.glob("loads/*.py")} <= _named("nectosome.model.build")


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A user's package of three modules, one behind the other."""
    folder = tmp_path / "mine_with_springs"
    folder.mkdir()
    (folder / "__init__.py").write_text("from .springs import (\n    Spring as S,  # soft\n    stiffness,\n)\n")
    (folder / "springs.py").write_text(
        "from .numbers import K\nclass Spring:\n    pass\ndef stiffness():\n    return K\n"
    )
    (folder / "numbers.py").write_text("K = 2.0\n")
    (folder / "robot.py").write_text("import numpy as np\nfrom mine_with_springs import S\n")
    monkeypatch.syspath_prepend(tmp_path)
    import_module("mine_with_springs.robot")
    yield folder
    for name in [name for name in sys.modules if name.startswith("mine_with_springs")]:
        del sys.modules[name]


def test_a_users_modules_count_with_the_constants_that_they_import(mine):
    assert sources({"mine_with_springs.robot"}) == {mine / name for name in ("robot.py", "springs.py", "numbers.py")}


def test_a_compiled_module_outside_of_the_installed_packages_is_not_read(tmp_path, monkeypatch):
    """As those of packages on PYTHONPATH are."""
    (tmp_path / "compiled_part.so").write_bytes(b"\x7fELF\xd9")
    module = ModuleType("compiled_part")
    module.__file__ = str(tmp_path / "compiled_part.so")
    monkeypatch.setitem(sys.modules, "compiled_part", module)
    assert sources({"compiled_part"}) == {tmp_path / "compiled_part.so"}


def test_no_equation_is_imported_within_a_function():
    within = re.compile(r"^[ \t]+from (?:nectosome|\.)\S* import \w+", re.MULTILINE)
    for_types = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+.*\n)+", re.MULTILINE)
    rooms = ("core", "mechanism", "loads", "drives", "model", "solve", "designs")
    files = [file for room in rooms for file in (PACKAGE / room).rglob("*.py")]
    hidden = {str(file): within.findall(for_types.sub("", file.read_text())) for file in files}
    assert {file for file, found in hidden.items() if found} == set()

"""Names and modules that moved work as before, with a warning that says what to write, or say it themselves."""

import importlib
import sys

import numpy as np
import pytest

import nectosome as ns
from nectosome import _renamed
from nectosome.units import InputError


@pytest.mark.parametrize("old", [name for name, (_, make) in _renamed.NAMES.items() if make and "Bench.of" not in name])
def test_a_former_name_is_there_and_says_what_to_write(old):
    room, _, name = f"nectosome.{old}".rpartition(".")
    with pytest.warns(DeprecationWarning, match=f"{name} goes with the next minor version: take ") as warned:
        assert getattr(importlib.import_module(room), name) is not None
    assert warned[0].filename == __file__


@pytest.mark.parametrize("old", list(_renamed.MODULES))
def test_a_former_module_is_the_one_that_it_became(old):
    sys.modules.pop(old, None)
    with pytest.warns(
        DeprecationWarning, match=f"{old} goes with the next minor version: take {_renamed.MODULES[old]}"
    ):
        module = importlib.import_module(old)
    assert module is importlib.import_module(_renamed.MODULES[old])
    assert module.__spec__ is not None
    assert module.__spec__.name == _renamed.MODULES[old]


def test_a_module_of_a_former_package_is_found_too():
    with pytest.warns(DeprecationWarning) as warned:
        from nectosome.papers.undulation import __name__ as name  # pyright: ignore[reportMissingImports]
    assert name == "nectosome_studies.undulation"
    assert warned[-1].filename == __file__
    assert ns.papers.STUDIES


def test_what_nothing_stands_for_says_so_however_it_is_imported():
    with pytest.raises(InputError, match=r"nectosome\.rigs\.BenchRun is gone: Bench\.runs gives"):
        from nectosome.rigs import BenchRun  # noqa: F401  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(AttributeError, match="has no attribute brench"):
        ns.rigs.brench  # noqa: B018


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_former_references_are_those_of_their_formulas():
    t, dt = np.arange(201) * 0.01, 0.01
    of = ns.controllers
    np.testing.assert_allclose(of.sine(2.0, 1.5, 2.0, dt), 2 * np.sin(3 * np.pi * t), atol=1e-12)
    triangle = 2 * (2 / np.pi) * np.arcsin(np.sin(3 * np.pi * t))
    np.testing.assert_allclose(of.triangle(2.0, 1.5, 2.0, dt), triangle, atol=1e-7)
    turns = 2.0 * np.expm1(np.log(4) / 2 * t) / (np.log(4) / 2)
    np.testing.assert_allclose(of.chirp(0.5, 2.0, 8.0, 2.0, dt), 0.5 * np.sin(2 * np.pi * turns), atol=1e-9)
    halves = np.where(t < 1, 2 * np.sin(2 * np.pi * t), 3 * np.sin(4 * np.pi * (t - 1)))[:151]
    np.testing.assert_allclose(of.varying([2.0, 3.0], [1.0, 2.0], dt), halves, atol=1e-9)
    assert ns.rigs.CONTROLLERS[:5] == ("pid", "scheduled", "ff-pid", "ilc", "mpc")  # others may have added their own

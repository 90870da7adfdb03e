"""Without the extra `mesh`."""

import sys

import pytest
from tests.geometry import closed_surfaces as made

from nectosome.geometry import panel_added_mass as panels
from nectosome.units import InputError


def test_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "capytaine", None)
    panels._capytaine.cache_clear()
    with pytest.raises(InputError, match=r"pip install 'nectosome\[mesh\]'"):
        panels.panel_added_mass(made.box(1, 1, 1))

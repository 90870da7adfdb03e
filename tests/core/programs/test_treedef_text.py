"""Structures of results come back from their text, and nothing else comes from one."""

import enum
import json
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

from nectosome.core.programs.treedef_text import structure_of, structure_text


class Colour(enum.Enum):
    RED = 1


class Pair(NamedTuple):
    first: Any
    second: Any


class Holder(eqx.Module):
    number: Any
    setting: Any = eqx.field(static=True)
    later: Any = None


def called() -> None:
    """A setting."""


SETTINGS = (
    None, True, 3, 0.1 + 0.2, float("inf"), "text \x1b[31m", (), (1, ("two",)), Colour.RED, Pair(1, Holder), called,
)  # fmt: skip


@pytest.mark.parametrize("setting", SETTINGS)
def test_a_structure_comes_back_from_its_text(setting):
    x = jnp.zeros(2)
    tree = {"b": [x, None, (x,)], "a": Pair(Holder(x, setting, {}), Holder([], setting))}
    structure = jax.tree.structure(tree)
    text = structure_text(structure)
    assert "\n" not in text and structure_of(text) == structure
    assert jax.tree.structure(jax.tree.unflatten(structure_of(text), [x] * 3)) == structure


@pytest.mark.parametrize("setting", [object(), lambda: 0, float("nan"), jnp.zeros(1), {1, 2}])
def test_a_setting_without_a_text_is_refused(setting):
    with pytest.raises((TypeError, ValueError)):
        structure_text(jax.tree.structure(Holder(jnp.zeros(2), setting)))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "3",
        '["os:system", null, []]',
        '["builtins:eval", null, []]',
        '["not_loaded:Thing", null, []]',
        '["builtins:tuple", ["odd", 1], []]',
        '["builtins:tuple", ["fields", "os:system", "true"], []]',
        '["builtins:tuple", ["member", "builtins:dict", "RED"], []]',
        json.dumps(["nectosome.core.gone:Thing", None, []]),
        "[" * 100_000,
    ],
)
def test_a_text_that_is_none_is_refused(text):
    with pytest.raises(ValueError):
        structure_of(text)

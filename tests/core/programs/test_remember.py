"""Programs remembered from one call to the next are those of the arguments at hand."""

import os
import subprocess
import sys
import time
from itertools import count

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from nectosome.core.programs.remember import Bound, _programs, remembered, runs_long


def called(module, x):
    return module(x)


def scale(factor):
    class Scale(eqx.Module):
        offset: Array

        def __call__(self, x):
            return factor * x + self.offset

    return Scale(jnp.asarray(0.5))


def test_two_classes_of_one_name_are_two_programs():
    x = jnp.arange(3.0)
    for factor in (2.0, 3.0, 2.0):
        assert remembered(called, scale(factor), x).tolist() == [0.5, factor + 0.5, 2 * factor + 0.5]


def test_a_new_shape_is_a_new_program():
    module = scale(2.0)
    for n in (2, 4):
        x = jnp.ones(n)
        assert remembered(called, module, x).tolist() == [2.5] * n


def test_a_bound_program_follows_the_kind_of_its_numbers_also_inside_jit():
    bound = Bound(called, scale(2.0))
    for x in (np.arange(2), np.array([0.25, 0.5]), np.arange(2)):
        assert bound(x).tolist() == (2 * x + 0.5).tolist()
        assert jax.jit(lambda y, x=x: y + bound(x))(1.0).tolist() == (2 * x + 1.5).tolist()


def test_a_plain_function_among_the_arguments_is_no_obstacle():
    x = jnp.arange(3.0)
    assert remembered(called, lambda x: 2 * x, x).tolist() == [0, 2, 4]


def doubled(x):
    return 2 * jnp.sin(x)


@runs_long
def doubled_at_length(x):
    return 2 * jnp.sin(x)


def test_what_runs_often_is_optimised_beside_its_runs_and_what_runs_long_from_the_start(monkeypatch):
    monkeypatch.setattr("nectosome.core.programs.remember._OFTEN", 20)
    x = jnp.arange(5.0)
    runs = [remembered(doubled, x) for _ in range(25)]
    remembered(doubled_at_length, x)
    often, long = (next(p.result() for k, p in _programs.items() if k[0] is f) for f in (doubled, doubled_at_length))
    deadline = time.monotonic() + 60
    while often.optimised is not None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert often.optimised is None and long.optimised is None
    for found in (*runs, remembered(doubled, x)):
        np.testing.assert_allclose(found, 2 * np.sin(np.arange(5.0)), rtol=1e-15)


TWICE = """
import time
import jax.numpy as jnp
from nectosome.core.programs.remember import remembered

def slow(x):
    print("traced", flush=True)
    time.sleep(2)
    return 2 * x

print(remembered(slow, jnp.arange(3.0)).tolist())
"""


def test_of_two_processes_one_makes_the_program_and_the_other_finds_it(tmp_path):
    (tmp_path / "twice.py").write_text(TWICE)
    environment = {**os.environ, "NECTOSOME_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    command = [sys.executable, "-c", "import nectosome.core.runtime, twice"]
    both = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate(timeout=100)[0].split("\n") for process in both]
    assert sum(lines.count("traced") for lines in said) == 1
    assert all("[0.0, 2.0, 4.0]" in lines for lines in said)
    assert [path.suffix for path in (tmp_path / "cache" / "traced").iterdir()] == [""]


def tripled(x):
    return 3 * jnp.cos(x)


@pytest.fixture
def kept(tmp_path):
    """Programs are kept on disk."""
    before = jax.config.values["jax_compilation_cache_dir"]
    jax.config.update("jax_compilation_cache_dir", str(tmp_path / "xla"))
    yield
    jax.config.update("jax_compilation_cache_dir", before)


@pytest.mark.parametrize(("growth", "times"), [(1.2, 4), (1.0, 1)])
def test_programs_that_fill_the_memory_are_forgotten_and_loaded_again(growth: float, times: int, monkeypatch, kept):
    """Where the memory is full and does not grow other things fill it, and looking for programs helps once."""
    name, looked, asked = "nectosome.core.programs.remember.", [], count()
    monkeypatch.setattr(name + "_MUCH", 0)
    monkeypatch.setattr(name + "_FEW", 2)
    monkeypatch.setattr(name + "_stays", 0)
    monkeypatch.setattr(name + "resident", lambda: 1e9 * growth ** next(asked))
    monkeypatch.setattr(name + "give_back", lambda: looked.append(1))
    sizes = range(2, 6)
    first = [remembered(tripled, jnp.arange(float(n))) for n in sizes]
    left = [key for key in _programs if key[0] is tripled]
    assert (len(left) < len(sizes), len(looked)) == (times > 1, times)
    again = [remembered(tripled, jnp.arange(float(n))) for n in sizes]
    assert all(a.tolist() == b.tolist() for a, b in zip(first, again, strict=True))

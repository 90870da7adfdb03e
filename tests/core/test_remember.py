"""Programs remembered from one call to the next are those of the arguments at hand."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from nectosome.core.remember import remembered


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


def test_a_plain_function_among_the_arguments_is_no_obstacle():
    x = jnp.arange(3.0)
    assert remembered(called, lambda x: 2 * x, x).tolist() == [0, 2, 4]

"""Systems with rates as blocks, integrated over each sample."""

from abc import abstractmethod
from typing import Any

import jax
import jax.numpy as jnp
from equinox import field
from jax import lax
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line, Stepper, System


class Driven(System):
    """A system with an input and an output."""

    @abstractmethod
    def output(self, x: Any, u: Float[Array, "*channels"]) -> Float[Array, "*outputs"]:
        """Output of a state and an input."""


class Integrated(Block):
    """A driven autonomous system, integrated by the classical Runge-Kutta method in `steps` per sample."""

    system: Driven
    steps: int = field(static=True, default=1)

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """Stepper with the step length dt / steps."""
        return _FixedStep(self.system, jnp.asarray(dt / self.steps), self.steps)


class _FixedStep(Stepper):
    system: Driven
    dt: Float[Array, ""]
    steps: int = field(static=True)

    def initial(self) -> Any:
        """Initial state of the system."""
        return self.system.initial()

    def step(self, state: Any, u: Line) -> tuple[Any, Line]:
        """State at the end of a sample."""
        time = jnp.zeros(())

        def moved(x: Any, rates: Any, h: Array) -> Any:
            return jax.tree.map(lambda a, b: a + h * b, x, rates)

        def once(k: Array, x: Any) -> Any:
            a, m, b = (u.begin + (k + share) / self.steps * (u.end - u.begin) for share in (0.0, 0.5, 1.0))
            k1 = self.system.rates(time, x, a)
            k2 = self.system.rates(time, moved(x, k1, 0.5 * self.dt), m)
            k3 = self.system.rates(time, moved(x, k2, 0.5 * self.dt), m)
            k4 = self.system.rates(time, moved(x, k3, self.dt), b)
            return jax.tree.map(lambda x, p, q, r, s: x + self.dt / 6 * (p + 2 * q + 2 * r + s), x, k1, k2, k3, k4)

        after = once(jnp.zeros(()), state) if self.steps == 1 else lax.fori_loop(0, self.steps, once, state)
        return after, Line(self.system.output(state, u.begin), self.system.output(after, u.end))

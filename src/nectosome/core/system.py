"""Contracts: what evolves in time (System, Mechanical), what acts on a body (Load) and between two (PairLoad)."""

from abc import abstractmethod
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .described import same_named
from .water import Water


class State(eqx.Module):
    """State of a mechanical system: coordinates, velocities, states of loads and actuators."""

    q: Float[Array, "*batch nq"]
    v: Float[Array, "*batch nv"]
    z: Any = ()


class System(eqx.Module):
    """Everything that evolves: a frozen pytree whose numbers are traced and whose structure is static."""

    @abstractmethod
    def initial(self) -> Any:
        """State to start from."""

    @abstractmethod
    def rates(self, t: Float[Array, ""], x: Any, u: Any = None) -> Any:
        """Time derivative of the state, same structure as the state."""


class Mechanical(System):
    r"""A system $M(q) \dot v + h(t, q, v) = 0$, $\dot q = N(q) v$, with load states $\dot z = f(t, q, v, z)$."""

    @abstractmethod
    def residual(self, t: Float[Array, ""], x: State, a: Float[Array, "nv"], u: Any = None) -> Float[Array, "nv"]:
        """Unbalanced generalised force M a + h [N or N m]: implicit integration, statics, inverse dynamics."""

    @abstractmethod
    def state_rates(self, t: Float[Array, ""], x: State, u: Any = None) -> Any:
        """Rate of the load states z."""

    @abstractmethod
    def advance(self, q: Float[Array, "nq"], v: Float[Array, "nv"], step: Float[Array, ""]) -> Float[Array, "nq"]:
        """Solve q1 = q + step N(q1) v: an implicit stage, and with step 1 a retraction along v."""


class Strips(eqx.Module):
    """Stations of one part as a load sees them, in each station's own frame (x along the body)."""

    rotation: Float[Array, "n 3 3"]  # station frame to world frame
    position: Float[Array, "n 3"]  # [m], world frame
    angular_velocity: Float[Array, "n 3"]  # [rad/s]
    velocity: Float[Array, "n 3"]  # relative to the water [m/s]
    x: Float[Array, "n"]  # place along the part [m]
    weight: Float[Array, "n"]  # length the station stands for [m]; 0 at frames and marks
    half_width: Float[Array, "n 2"]  # half axes of the section along y and z [m]
    volume: Float[Array, "n"]  # displaced water [m3]
    inertia: Float[Array, "n 6 6"]  # of the body's own matter [kg m2, kg m, kg]

    @property
    def radius(self) -> Float[Array, "n"]:
        """Mean half axis of the section [m]."""
        return 0.5 * (self.half_width[:, 0] + self.half_width[:, 1])

    def at_first(self, wrench: Float[Array, "6"]) -> Float[Array, "n 6"]:
        """A wrench on the first station, nothing on the others."""
        n = self.weight.shape[0]
        return wrench[None] if n == 1 else jnp.zeros((n, 6)).at[0].set(wrench)


class Load(eqx.Module):
    """What acts on the stations of one part; `tests/loads/test_contract.py` holds every load to what it declares.

    A `dissipative` load never puts energy into a body in still water.
    """

    dissipative: ClassVar[bool] = False
    inertial: ClassVar[bool] = False  # nothing but added mass, whose force is that of the water carried along
    described_by: ClassVar[type]

    @classmethod
    def from_description(cls, described: Any, part: Any) -> "Load":
        """The load of a description on a part, a `nectosome.loads.places.Carrier`."""
        return same_named(cls, described)

    @property
    def reshapes(self) -> bool:
        """Whether the water carried along changes, by shape or by place: a load that tells what is `carried`."""
        return type(self).carried is not Load.carried

    def initial(self) -> Any:
        """Initial state z of the load; () when it has none."""
        return ()

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"] | None:
        """Added mass at each station; asked once, so it may use sections but no motion: a body keeps all of it
        also where it stands out of the water.
        """
        return None

    def carried(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        """Added mass at the part's first station as it is now, and its rate; only of a load that `reshapes`.

        It comes on top of `inertia`. The water gives the wrench -d(A V)/dt, and -dA/dt V is told apart from the rest.
        Where it depends on the place, `force` gives the derivative of the energy V A V / 2 by the place.
        """
        raise NotImplementedError

    @abstractmethod
    def force(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "n 6"] | None, Any]:
        """Wrench (moment [N m], force [N]) on each station in its own frame, or None; and the rate of z."""


class JointLoad(eqx.Module):
    """What acts between a body and its parent along the joint that connects them."""

    dissipative: ClassVar[bool] = False

    @abstractmethod
    def force(self, displacement: Float[Array, "nv"], v: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """Generalised force [N m or N] at a displacement [rad or m] and velocity of the joint."""

    def bending(self, displacement: Float[Array, "nv"]) -> Float[Array, "2"] | None:
        """Strain and stress [Pa] at the face of the layer that bends in the joint; None where there is none."""
        return None


class RodLoad(eqx.Module):
    """What acts inside a rod, between its sections: what it takes from one it gives to the next."""

    described_by: ClassVar[type]

    @classmethod
    def from_description(cls, described: Any, part: Any) -> "RodLoad":
        """The load of a description on a part, a `nectosome.loads.places.Carrier`."""
        return same_named(cls, described)

    @abstractmethod
    def force(self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "nq"]:
        """Generalised force along the strain coordinates q of the rod, whose rates are v."""


class PairLoad(eqx.Module):
    """What acts between two parts of which neither need carry the other; `tests/loads/test_pairs.py` holds each to it.

    The velocities of the strips are those in the world, whatever the current. The wrenches on the two cancel: their
    forces add up to nothing, and so do their moments about any point. What a pair gives its parts it has stored: its
    power is never more than the rate at which `energy` falls.
    """

    described_by: ClassVar[type]

    @classmethod
    def from_description(cls, described: Any, first: Any, second: Any) -> "PairLoad":
        """The pair of a description, between two parts, each a `nectosome.loads.places.Carrier`."""
        return same_named(cls, described)

    @abstractmethod
    def force(self, first: Strips, second: Strips) -> tuple[Float[Array, "n 6"], Float[Array, "m 6"]]:
        """Wrench (moment [N m], force [N]) on each station of the two parts, in the station's own frame."""

    @abstractmethod
    def energy(self, first: Strips, second: Strips) -> Float[Array, ""]:
        """Energy stored [J]."""

"""Contracts of dynamic systems (System, Mechanical) and of loads on a body, a joint, a rod or a pair of bodies."""

from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .described import DescribedModule
from .one_sided import Gaps
from .signals import Jumping
from .water import Water


class State(eqx.Module):
    """State of a mechanical system: coordinates, velocities, states of loads and actuators."""

    q: Float[Array, "*batch nq"]
    v: Float[Array, "*batch nv"]
    z: Any = ()


class System(eqx.Module):
    """A dynamic system: a frozen pytree with traced numbers and static structure."""

    @abstractmethod
    def initial(self) -> Any:
        """Initial state."""

    @abstractmethod
    def rates(self, t: Float[Array, ""], x: Any, u: Any = None) -> Any:
        """Time derivative of the state, with the structure of the state."""

    @property
    def update_rates(self) -> Float[Array, "k"] | None:
        """Rates [Hz] of its sampled loops, which update at t = k/rate; None without any."""
        return None

    def next_jump(self, t: Float[Array, ""]) -> Float[Array, ""] | None:
        """First time [s] after t at which one of its signals jumps, inf where none follows; None if none ever does."""
        signals = jax.tree.leaves(self, is_leaf=lambda x: isinstance(x, Jumping))
        jumps = [jnp.min(x.next_jump(t), initial=jnp.inf) for x in signals if isinstance(x, Jumping)]
        return jnp.min(jnp.stack(jumps)) if jumps else None

    def updated(self, t: Float[Array, ""], x: Any) -> Any:
        """State after the updates of the loops that are `due` at t; it is x at all other times."""
        return x


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

    def gaps(self, t: Float[Array, ""], x: State) -> Gaps | None:
        """Gaps of contacts; None without any. Steps end where they close, and where dampers let go."""
        return None


class Stations(eqx.Module):
    """What the design says of stations along a part, in each station's own frame (x along the body)."""

    x: Float[Array, "n"]  # position along the part [m]
    half_length: Float[Array, "n"]  # half of its strip, of all at a rigid part's centre [m]; 0 at frames and marks
    weight: Float[Array, "n"]  # length of the strip [m]; 0 at frames and marks
    half_width: Float[Array, "n 2"]  # half axes of the section along y and z [m]
    round_axes: Float[
        Array, "n"
    ]  # number of axes in which its shape is round: 0 a box, 2 of elliptic section, 3 an ellipsoid
    volume: Float[Array, "n"]  # displaced water [m3]
    inertia: Float[Array, "n 6 6"]  # of the body's own matter [kg m2, kg m, kg]

    @classmethod
    def along(
        cls, x: Array, weight: Array, half_width: Array, volume: Array, inertia: Array, round_axes: Array | float = 2.0
    ) -> "Stations":
        """Of one part, with strips about its stations."""
        round_axes = jnp.broadcast_to(round_axes, x.shape)
        return cls(x, 0.5 * weight, weight, half_width, round_axes, volume, inertia)

    @property
    def radius(self) -> Float[Array, "n"]:
        """Mean half axis of the section [m]."""
        return 0.5 * (self.half_width[:, 0] + self.half_width[:, 1])


class Strips(Stations):
    """Stations and their motion for a load."""

    rotation: Float[Array, "n 3 3"]  # station frame to world frame
    position: Float[Array, "n 3"]  # [m], world frame
    angular_velocity: Float[Array, "n 3"]  # [rad/s]
    velocity: Float[Array, "n 3"]  # relative to the water [m/s]

    def at_first(self, wrench: Float[Array, "6"]) -> Float[Array, "n 6"]:
        """A wrench on the first station, zero on the others."""
        n = self.weight.shape[0]
        return wrench[None] if n == 1 else jnp.zeros((n, 6)).at[0].set(wrench)


class Flow(NamedTuple):
    """What a load sees of the water at one time, at places along its part: for the numbers of its ranges.

    The numbers of what a load leaves out, None, do not say whether its model holds.
    """

    speed: Float[Array, "*t k"] | None = None  # of its Reynolds number [m/s]
    length: Float[Array, "*t k"] | None = None  # of the same [m]
    across: Float[Array, "*t k 2"] | None = None  # velocities that go to and fro across the part or the chord [m/s]
    height: Float[Array, "*t k"] | None = None  # of the part across them, of its Keulegan-Carpenter number [m]
    ahead: Float[Array, "*t k"] | None = None  # velocity of a foil or a tail ahead [m/s]
    chord: Float[Array, "*t k"] | None = None  # of its reduced frequency [m]
    stalled: Float[Array, "*t k"] | None = None  # 1 where the angle of attack is beyond that of stall, else 0
    aspect_ratio: Float[Array, "*t k"] | None = None
    jet: Float[Array, "*t k"] | None = None  # speed of a jet over the diameter of its opening [1/s], negative inward


class Assumed(NamedTuple):
    """A number or a law of a load that its description does not give."""

    what: str
    value: Any  # a number of SI, or words
    source: str  # in few words
    unit: str = ""


class Load(DescribedModule):
    """A load on the stations of one part; `tests/loads/test_contract.py` tests every load against its declarations.

    A `dissipative` load never adds energy to a body in still water. A load whose crank a joint turns finds a
    `CrankState` in the place of its state, and returns a `CrankRate`. `from_description` has a description and the
    part, a `nectosome.loads.places.Carrier`.
    """

    dissipative: ClassVar[bool] = False
    inertial: ClassVar[bool] = False  # nothing but added mass, whose force is that of the water carried along
    carries: ClassVar[bool] = False  # has an added mass, also beside a force of its own
    by_station: ClassVar[bool] = False  # each station by itself: the load's numbers may have an axis of stations
    on_first: ClassVar[bool] = False  # looks at and acts on the part's first station only
    mild: ClassVar[bool] = False  # follows the motion evenly: no stiff spring, no pulse
    deep: ClassVar[str] = "is in what holds it by {} times its size"  # its `overlap` in words

    def initial(self) -> Any:
        """Initial state z of the load; () for a load without state."""
        return ()

    def crank_speed(self) -> Float[Array, ""] | None:
        """Speed at t = 0 of a crank that it turns itself [rad/s]: such a load is never at rest. None without one."""
        return None

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"] | None:
        """Added mass at each station with all of it under water, evaluated once: from sections, not from the motion."""
        return None

    def flow(self, strips: Strips) -> Flow | None:
        """What the `ranges` of its description are about, after a run; None of a load without ranges."""
        return None

    def assumed(self, described: Any, water: Water) -> tuple[Assumed, ...]:
        """What it takes by default or works out in this water, where its description leaves it open."""
        return ()

    def gaps(self, strips: Strips, z: Any, water: Water) -> Gaps | None:
        """Gaps of a load that acts on one side only; None of others."""
        return None

    def overlap(self, strips: Strips, z: Any, water: Water) -> Float[Array, ""]:
        """How deep the part is in what holds it, a share of what of it is there; 0 of loads that hold nothing."""
        return jnp.zeros(())

    @abstractmethod
    def force(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "n 6"] | None, Any]:
        """Wrench (moment [N m], force [N]) on each station in its own frame, or None; and the rate of z."""


class CrankState(NamedTuple):
    """State of a load whose crank a joint turns."""

    angle: Float[Array, "*n"]  # of the joint [rad]
    speed: Float[Array, "*n"]  # [rad/s]
    own: Any  # state of the load itself; () without one


class CrankRate(NamedTuple):
    """What `Load.force` of such a load returns in the place of rates."""

    torque: Float[Array, "*n"]  # of the load on its crank [N m]
    own: Any  # rate of the load's own state


class ReshapingLoad(Load):
    """A load whose added mass changes with shape or position."""

    driven: ClassVar[bool] = False  # by the motion of its own part, so that its power is that of the robot's drives

    @abstractmethod
    def carried(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "*n 6 6"], Float[Array, "*n 6 6"]]:
        """Current variable added mass at its stations, and its rate; of one `on_first` without an axis of stations.

        It adds to `inertia`, and like that is the one with all of the part under water. The wrench of the water is
        -d(A V)/dt; its part -dA/dt V is reported separately. If it depends on the position, `force` includes the
        derivative of the energy V A V / 2 by the position.
        """


class SectionedLoad(Load):
    """A load on a part's first station whose added mass there is that of sections, each under water by itself."""

    @abstractmethod
    def sections(self, strips: Strips) -> Strips:
        """Its sections as strips, with their motion."""

    @abstractmethod
    def section_inertia(self, water: Water) -> Float[Array, "k 6 6"]:
        """Added mass of each at the first station; their sum is `inertia`."""


class JointLoad(eqx.Module):
    """A load between a body and its parent along their joint."""

    dissipative: ClassVar[bool] = False

    def initial(self) -> Any:
        """Initial state z of the load; () for a load without state."""
        return ()

    @abstractmethod
    def force(self, displacement: Float[Array, "nv"], v: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """Generalised force [N m or N] at a displacement [rad or m] and velocity of the joint, in its initial state."""

    def at_state(
        self, displacement: Float[Array, "nv"], v: Float[Array, "nv"], z: Any
    ) -> tuple[Float[Array, "nv"], Any]:
        """The same in a state z, and the rate of z: for a load with a state."""
        return self.force(displacement, v), z

    def gaps(self, displacement: Float[Array, "nv"]) -> Gaps | None:
        """Gaps of a load that acts on one side only; None of others."""
        return None

    def bending(self, displacement: Float[Array, "nv"]) -> Float[Array, "2"] | None:
        """Strain and stress [Pa] at the face of the joint's flexible layer; None without one."""
        return None


class RodLoad(DescribedModule):
    """A load inside a rod, between its sections, with zero net wrench; made as a `Load`."""

    def initial(self) -> Any:
        """Initial state z of the load; () for a load without state."""
        return ()

    @abstractmethod
    def force(self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"]) -> Float[Array, "nq"]:
        """Generalised force along the strain coordinates q of the rod, with rates v, in its initial state."""

    def at_state(
        self, t: Float[Array, ""], q: Float[Array, "nq"], v: Float[Array, "nq"], z: Any
    ) -> tuple[Float[Array, "nq"], Any]:
        """The same in a state z, and the rate of z: for a load with a state."""
        return self.force(t, q, v), z

    def gaps(self, q: Float[Array, "nq"]) -> Gaps | None:
        """Gaps of a load that acts on one side only; None of others."""
        return None


class PairLoad(DescribedModule):
    """A load between any two parts; `tests/loads/test_pairs.py` tests each one.

    The velocities of the strips are those in the world, independent of the current. The wrenches on the two parts
    cancel: their forces sum to zero, and so do their moments about any point. The pair is passive: its power is at most
    the rate at which `energy` decreases. `from_description` has the two parts, `first` and `second`, as a `Load` has
    its one.
    """

    @abstractmethod
    def force(self, first: Strips, second: Strips) -> tuple[Float[Array, "n 6"], Float[Array, "m 6"]]:
        """Wrench (moment [N m], force [N]) on each station of the two parts, in the station's own frame."""

    @abstractmethod
    def energy(self, first: Strips, second: Strips) -> Float[Array, ""]:
        """Energy stored [J]."""

    def gaps(self, first: Strips, second: Strips) -> Gaps | None:
        """Gaps of a load that acts on one side only; None of others."""
        return None

    def overlap(self, first: Strips, second: Strips) -> Float[Array, ""]:
        """How deep one part is in the other, over the radius of the thinner one there; 0 of loads that let it be."""
        return jnp.zeros(())


class DriveOutput(NamedTuple):
    """Output of a drive with a motor at one time."""

    reference: Float[Array, ""]  # of the coordinate [rad, m]; NaN without a position loop
    torque: Float[Array, ""]  # along the coordinate, without the inertia of the rotor [N m, N]
    current: Float[Array, ""]  # of the winding [A]
    voltage: Float[Array, ""]  # at the winding, the mean of its pulses [V]
    electrical: Float[Array, ""]  # power from the supply [W], negative where it is given back
    heat: Float[Array, ""]  # of winding, gear and friction, with what goes into `Drive.stored` and comes back [W]
    speed_error: Float[Array, ""]  # what a velocity loop lacks of its reference [rad/s, m/s]; NaN without one
    demand: Float[Array, ""]  # share of the supply's voltage that a loop asks for, before its limit; NaN without one


class Drive(DescribedModule):
    """A drive with a motor along the one coordinate of a joint; `tests/drives/test_contract.py` tests every drive.

    Without a voltage it only takes energy, or gives back what is `stored`. Its account is closed: electrical power =
    torque times velocity + heat, and heat without what goes into store is never negative.
    """

    @property
    @abstractmethod
    def inertia(self) -> Float[Array, ""]:
        """Inertia of the rotor and its gears along the coordinate [kg m2, kg]."""

    @property
    def updates(self) -> Float[Array, ""] | None:
        """Rate at which its loop updates [Hz]; None of one that is continuous, and without one."""
        return None

    def initial(self) -> Any:
        """Initial state z of its controller; () without one."""
        return ()

    def stored(self, z: Any) -> Float[Array, ""]:
        """Energy in its state z [J]."""
        return jnp.zeros(())

    def updated(self, t: Float[Array, ""], x: Float[Array, ""], v: Float[Array, ""], z: Any) -> Any:
        """State z after an update of its loop at t, which reads the coordinate x and the velocity v."""
        return z

    def continuous(self) -> "Drive":
        """The drive with a loop that is continuous, with states of the same structure."""
        return self

    @abstractmethod
    def output(
        self, t: Float[Array, ""], x: Float[Array, ""], v: Float[Array, ""], supply: Any, z: Any
    ) -> tuple[DriveOutput, Any]:
        """Torque and powers at a coordinate x [rad, m] and velocity v, and the rate of z.

        They are those by a supply [V]; None where it has no end.
        """

    @abstractmethod
    def frozen(self) -> "Drive":
        """The drive with its signal fixed at the value of t = 0."""

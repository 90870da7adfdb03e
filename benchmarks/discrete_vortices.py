"""A thin plate in plane flow by discrete vortices from both edges: an independent check of `foil` where it stalls.

Ramesh, Gopalarathnam, Granlund, Ol and Edwards (2014), J. Fluid Mech. 751: potential flow round a plate, with the bound
vorticity of thin-aerofoil theory for any angle, a vortex from the trailing edge in each step, and one from the leading
edge while the suction there would be more than the edge can hold.

Positions are complex, x + i y [m]. In the plate's frame x runs ahead from -b to b, with x = b cos(phi); turning is
counterclockwise. The velocity normal to the plate that the bound vorticity has to make is sum of w_n cos(n phi); it is

    gamma = (G - 2 w_0 cos(phi)) / sin(phi) + 2 sum over n > 0 of w_n sin(n phi)

with G by the circulation, pi b (G + w_1). At the edge ahead its strength is G - 2 w_0, at the other G + 2 w_0; an edge
with the strength C has the suction pi rho b C^2 / 8. The force is that by which the impulse of all vortices falls.

`tests/validation/test_discrete_vortices.py` holds it against closed forms.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

POINTS = 64  # along the plate
_CORE = 1.3  # of vortices for each other, over the way between two that are shed (Ramesh et al. 2014)
_THIN = 0.1  # the same for the plate: a larger core would hide the youngest ones from it
# A new vortex lies 0.3027 of the way d between two from its edge, where zeta(1/2, x) = 0: so the sum over vortices at
# (n + x) d is the integral over their sheet, whose effect goes with the root of the distance from the edge.
_FIRST = 0.3027
_SHED = _FIRST / (1 + _FIRST)  # of the way to the one before


class Motion(NamedTuple):
    """Of a plate through water at rest, by time [s]."""

    place: Callable[[float], complex]  # of its middle [m]
    angle: Callable[[float], float]  # of the direction ahead, from x [rad]


class History(NamedTuple):
    """What acts on the plate per span, at the middles of the time steps."""

    time: np.ndarray  # [s]
    force: np.ndarray  # complex [N/m]
    moment: np.ndarray  # about the plate's middle [N]
    power: np.ndarray  # of the water on the plate [W/m]


class _Edge(NamedTuple):
    """Vortices of one edge, oldest first."""

    place: np.ndarray
    strength: np.ndarray
    going: bool  # it shed in the step before


def velocity(at: np.ndarray, place: np.ndarray, strength: np.ndarray, core: float) -> np.ndarray:
    """Velocity of vortices at places, complex [m/s]; with cores after Vatistas et al. (1991), n = 2."""
    away = at[:, None] - place[None, :]
    square = away.real**2 + away.imag**2
    return 1j / (2 * np.pi) * np.sum(strength * away / np.sqrt(square**2 + core**4), axis=1)


class Plate:
    """A plate of half chord b [m] and what it has shed. `held` is the suction angle that an edge ahead holds [rad]."""

    def __init__(
        self, motion: Motion, half_chord: float, held: float, step: float, speed: float, density: float
    ) -> None:
        self.motion, self.b, self.held, self.dt, self.density = motion, half_chord, held, step, density
        self.core, self.thin = _CORE * step * speed, _THIN * step * speed
        self.phi = np.pi * (np.arange(POINTS) + 0.5) / POINTS
        self.x = half_chord * np.cos(self.phi)
        n = np.arange(POINTS)
        self.to_modes = np.where(n == 0, 1.0, 2.0)[:, None] / POINTS * np.cos(np.outer(n, self.phi))
        self.smooth = 2 * np.sin(np.outer(self.phi, n))
        none = np.zeros(0, complex)
        self.edges = [_Edge(none, none.real, False), _Edge(none, none.real, False)]  # ahead, behind
        self.bound = np.zeros(POINTS)  # circulations of the points

    def rates(self, t: float) -> tuple[complex, float]:
        """Velocity of the middle, and rate of turning, by central differences."""
        h = 0.05 * self.dt
        place, angle = self.motion
        return (place(t + h) - place(t - h)) / (2 * h), (angle(t + h) - angle(t - h)) / (2 * h)

    def points(self, t: float) -> np.ndarray:
        """Places of the points of the plate."""
        return self.motion.place(t) + self.x * np.exp(1j * self.motion.angle(t))

    def impulse(self, t: float) -> tuple[complex, float]:
        """Impulse of all vortices, and its moment about the origin, over the density."""
        place = np.concatenate([self.points(t), *(edge.place for edge in self.edges)])
        strength = np.concatenate([self.bound, *(edge.strength for edge in self.edges)])
        return complex(-1j * np.sum(strength * place)), float(-0.5 * np.sum(strength * np.abs(place) ** 2))

    def advance(self, t: float) -> None:
        """Take the vortices to time t, shed new ones, and find the bound vorticity."""
        self._convect(t)
        turn = np.exp(1j * self.motion.angle(t))
        here, (moving, turning) = self.points(t), self.rates(t)
        normal = 1j * turn
        own = (moving * np.conj(normal)).real + turning * self.x
        free = np.concatenate([edge.place for edge in self.edges]), np.concatenate([e.strength for e in self.edges])
        w = self.to_modes @ (own - (velocity(here, *free, self.thin) * np.conj(normal)).real)
        ahead = (moving * np.conj(turn)).real
        total = float(np.sum(free[1]))
        new = [self._born(k, t, moving, turning) for k in (0, 1)]
        one = [
            self.to_modes @ -(velocity(here, np.array([z]), np.ones(1), self.thin) * np.conj(normal)).real for z in new
        ]
        limit = 4 * np.sin(self.held) * abs(ahead)  # water from the side leaves both edges alike
        behind = 1 if ahead >= 0 else 0  # the edge at which the flow leaves smoothly
        shed = {behind: 0.0}
        G, made = self._solved(w, one, total, shed)
        w0 = w[0] + sum(gamma * modes[0] for gamma, modes in zip(made, one, strict=True))
        strength = G - 2 * w0 if behind == 1 else G + 2 * w0
        if abs(strength) > limit:
            shed[1 - behind] = np.sign(strength) * limit
            G, made = self._solved(w, one, total, shed)
        for k, z in enumerate(new):
            edge = self.edges[k]
            if k in shed:
                self.edges[k] = _Edge(np.append(edge.place, z), np.append(edge.strength, made[k]), True)
            else:
                self.edges[k] = edge._replace(going=False)
        w = w + sum(gamma * modes for gamma, modes in zip(made, one, strict=True))
        self.bound = self._circulations(w, G)

    def _solved(
        self, w: np.ndarray, one: list[np.ndarray], total: float, shed: dict[int, float]
    ) -> tuple[float, list[float]]:
        """G and the circulations of new vortices: Kelvin's theorem, and the strengths at the edges that shed."""
        names = [2, *shed]  # unknowns: G, then a vortex of each edge that sheds
        rows, right = [], []
        kelvin = {2: np.pi * self.b} | {k: np.pi * self.b * one[k][1] + 1.0 for k in shed}
        rows.append([kelvin[k] for k in names])
        right.append(-total - np.pi * self.b * w[1])
        for k, strength in shed.items():
            sign = -2.0 if k == 0 else 2.0
            rows.append([1.0, *(sign * one[j][0] for j in shed)])
            right.append(strength - sign * w[0])
        found = dict(zip(names, np.linalg.solve(np.array(rows), np.array(right)), strict=True))
        return float(found[2]), [float(found.get(k, 0.0)) for k in (0, 1)]

    def _circulations(self, w: np.ndarray, G: float) -> np.ndarray:
        """Of the points: gamma times b sin(phi) d(phi)."""
        near = G - 2 * w[0] * np.cos(self.phi)
        return self.b * np.pi / POINTS * (near + (self.smooth @ w) * np.sin(self.phi))

    def _born(self, k: int, t: float, moving: complex, turning: float) -> complex:
        """Place of the next vortex of an edge."""
        turn = np.exp(1j * self.motion.angle(t))
        end = self.b if k == 0 else -self.b
        place, edge = self.motion.place(t) + end * turn, self.edges[k]
        if edge.going:
            return place + _SHED * (edge.place[-1] - place)
        return place - _FIRST * self.dt * (moving + 1j * turning * end * turn)

    def _convect(self, t: float) -> None:
        """Move free vortices with the flow to time t."""
        before = t - self.dt
        place = np.concatenate([edge.place for edge in self.edges])
        strength = np.concatenate([edge.strength for edge in self.edges])
        if not place.size:
            return
        all_ = np.concatenate([self.points(before), place]), np.concatenate([self.bound, strength])
        place = place + self.dt * velocity(place, *all_, self.core)
        first = self.edges[0].place.size
        self.edges = [self.edges[0]._replace(place=place[:first]), self.edges[1]._replace(place=place[first:])]


def run(
    motion: Motion, half_chord: float, held: float, step: float, steps: int, speed: float, density: float = 1000.0
) -> History:
    """Forces on a plate that starts from rest at t = 0 with the velocity that its motion has then.

    `speed` [m/s] is a typical one: cores of vortices are 1.3 of the way that it goes in a step.
    """
    plate = Plate(motion, half_chord, held, step, speed, density)
    impulses = []
    for k in range(steps + 1):
        plate.advance(k * step)
        impulses.append(plate.impulse(k * step))
    time = (np.arange(steps) + 0.5) * step
    linear, angular = (np.array(one) for one in zip(*impulses, strict=True))
    force = -density * np.diff(linear) / step
    about_origin = -density * np.diff(angular) / step
    middle = np.array([motion.place(t) for t in time])
    moment = about_origin - (np.conj(middle) * force).imag
    moving, turning = (np.array(one) for one in zip(*(plate.rates(t) for t in time), strict=True))
    power = (force * np.conj(moving)).real + moment * turning
    return History(time, force, moment, power)

r"""What a tail does: its amplitude, Strouhal number, stride and slip; thrust and Froude efficiency.

With the period T, the speed U through the water, the forward speed $U_f$ and the body length L (`Robot.body_length`):

- stride length $U_f T/L$ (body lengths a cycle; Videler 1993), and body lengths per second $U_f/L$,
- tail amplitude a: half of the largest distance, across the forward direction, between two places of the robot's
  rearmost end in the frame that goes along with the mean velocity; half the peak-to-peak excursion of a tail that beats
  in a plane. The rearmost end is the station, or the end of a rigid part, that is furthest behind on the mean: of the
  part that is the reference's `tail`, where there is one,
- Strouhal number $2a/(T U)$ (Triantafyllou et al. 1993),
- slip $U_f/V$ with the speed V of a wave of bending that runs along the robot (Lighthill 1960): see `wave_speed`,
- Froude efficiency $F U_f/P$ (Lighthill 1970) with the power P of all drives and the thrust F, where it can be told
  from drag: of a rigid first part on which nothing acts but drag, weight, buoyancy and added mass, the mean drag of
  that part against the forward direction, which the other parts overcome. NaN where a mount takes the difference.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from nectosome.core import safe_norm
from nectosome.loads import Buoyancy, Weight
from nectosome.mechanism import SLIDES, Diagnosis, Robot, load_names
from nectosome.mechanism.extent import points, points_of
from nectosome.mechanism.tree import Tree

_TRAVELS = 0.25  # least share of a wave that travels
_BENDS = 1e-6  # rad, of all places together
_ALONG = 0.5  # least cosine between the way from place to place and the forward axis
_CORRECTIONS = 8  # of the wavenumber
_POINT = 1e-8  # m: shorter bodies are points


class _Places(NamedTuple):
    """Hinges and stations of rods, as indices."""

    before: list[int]  # station whose frame is before it; the station of a rod itself
    after: list[int]
    point: list[int]  # where it lies, among `points`
    rod: list[int]  # its part; -1 of a hinge
    chain: list[int]  # number of its chain of parts
    steps: list[tuple[int, int]]  # neighbours on a chain, the one nearer to the root first


def _places(tree: Tree) -> _Places:
    found, last = _Places([], [], [], [], [], []), list[list[int]]()  # of each part the place at each of its nodes
    links, stations = 0, tree.layout[-1].stations.stop

    def add(at: int, *place: int) -> int:
        new = len(found.rod)
        own: tuple[list[int], ...] = found[:-1]
        for values, value in zip(own, (*place, found.chain[at] if at >= 0 else new), strict=True):
            values.append(value)
        found.steps.extend([(at, new)] if at >= 0 else [])
        return new

    for i, (part, place) in enumerate(zip(tree.structure, tree.layout, strict=True)):
        if part.between:
            continue  # a web lies between limbs that count
        first, soft, at = place.stations.start, part.strains is not None, -1
        rod = soft and not part.star  # a soft plate has no stations in a row
        if part.parent >= 0:
            at = last[part.parent][part.node]
            if {*part.joint.names} - SLIDES:
                own = tree.layout[part.parent].stations
                node = (own.stop if part.node < 0 else own.start) + part.node
                if tree.structure[part.parent].strains is None:
                    node = own.start  # of a link, which is stiff
                at = add(at, node, first, first if soft else stations + links, -1)
        last.append([] if rod else [at])
        for k in range(first, place.stations.stop if rod else first):
            at = add(at, k, k, k, i)
            last[-1].append(at)
        links += not soft
    return found


def wave_speed(
    robot: Robot, period: Float[Array, ""], once: Diagnosis, ahead: Float[Array, "3"]
) -> tuple[Bool[Array, ""], Float[Array, ""]]:
    r"""Whether a wave runs along the robot in a cycle of equally spaced samples, without its end, and its speed [m/s].

    Bending is the angle of a hinge, and the curvature of a rod times the length that a station stands for. With its
    Fourier coefficient $c_j$ at the frequency $\omega$ at which the robot bends most, and its distance $s_j$ from the
    beginning of its chain of parts, backwards along the body, a wave $\cos(\omega t - k s)$ has
    $c_j \propto e^{-i k s_j}$. Its wavenumber is where the spectrum along the chains is largest:

    $$ \sum_{chains} \left| \sum_j c_j e^{i k s_j} \right|^2 \to \max_k, \quad V = \frac{\omega}{k} $$

    So speeds of waves are taken from midlines of fish: by the phase of the lateral motion (Videler and Hess 1984) or of
    bending (Gillis 1996), which does not depend on how the body recoils. V is positive of a wave that runs backwards.
    How much of it travels is the ratio of the singular values of the real and imaginary parts of all $c_j$ (Feeny 2008)

    $$ \sqrt{(1 - \rho)/(1 + \rho)}, \quad \rho = \sum_{chains} |\sum_j c_j^2| / \sum |c_j|^2 $$

    0 of a standing wave, 1 of one that travels with one size over half a wavelength. Below 1/4, that of a wave of one
    size over an eighth of a wavelength, no wave runs along the robot. `ahead` is the forward direction, a unit vector;
    what lies across it, such as side fins, does not count.
    """
    p = _places(robot.tree)
    steady = once.rotation.shape[0] < 3
    if steady or len(p.steps) < 2:
        return jnp.zeros((), bool), jnp.ones(())
    first, second = np.array(p.steps).T
    at = points(robot.tree, once.rotation, once.position)[:, np.array(p.point)]
    way = at[:, second] - at[:, first]
    chord, x, rod = jnp.mean(safe_norm(way), axis=0), robot.tree.stations.x[np.array(p.after)], np.array(p.rod)
    behind = -jnp.mean(way, axis=0) @ ahead
    counts = jnp.abs(behind) > _ALONG * chord
    length = jnp.where((rod[first] == rod[second]) & (rod[first] >= 0), x[second] - x[first], chord)
    step = jnp.where(counts, jnp.sign(behind) * length, 0.0)

    bent = _bending(robot, once, p)
    spectrum = jnp.fft.rfft(bent, axis=0)[1:] / bent.shape[0]
    most = jnp.argmax(jnp.sum(jnp.abs(spectrum) ** 2, axis=1))
    cycles, axis = most // 3 + 1, most % 3
    used = (jnp.zeros(len(p.rod)).at[first].add(counts).at[second].add(counts)) > 0
    c = jnp.where(used, spectrum[cycles - 1, :, axis], 0.0)
    of_chain = (np.array(p.chain) == np.unique(p.chain)[:, None]).astype(float)
    whole, standing = jnp.sum(jnp.abs(c) ** 2), jnp.sum(jnp.abs(of_chain @ c**2))
    runs = (whole > _BENDS**2) & (whole - standing > _TRAVELS**2 * (whole + standing))
    # from the phases of neighbours on, by Newton's method
    s, z = jnp.asarray(_steps_before(p)) @ step, c[second] * jnp.conj(c[first])
    there = (z != 0) & counts & runs
    z = jnp.where(there, z, 1.0)
    weight = jnp.where(there, jnp.abs(z), 0.0) * step
    total = jnp.sum(weight * step)
    k = -jnp.sum(weight * jnp.angle(z)) / jnp.where(total > 0, total, 1.0)
    runs &= total > 0

    def corrected(_: Array, k: Array) -> Array:
        waves = c * jnp.exp(1j * k * s)
        S, S1, S2 = (of_chain @ x for x in (waves, 1j * s * waves, -s * s * waves))  # the spectrum, derived by k
        curve = jnp.sum(jnp.real(jnp.conj(S1) * S1 + jnp.conj(S) * S2))
        return k + jnp.sum(jnp.real(jnp.conj(S) * S1)) / jnp.where(runs, jnp.abs(curve), 1.0)

    k = jax.lax.fori_loop(0, _CORRECTIONS, corrected, k)
    runs &= k != 0
    return runs, 2 * jnp.pi * cycles / period / jnp.where(runs, k, 1.0)


def _bending(robot: Robot, once: Diagnosis, p: _Places) -> Float[Array, "n places 3"]:
    """Bending [rad] at each place, about axes of the first part; of hinges less its mean, sines of large angles."""
    R, after = once.rotation, np.array(p.after)
    turn = jnp.swapaxes(R[:, np.array(p.before)], -1, -2) @ R[:, after]
    turn = jnp.swapaxes(jnp.mean(turn, axis=0), -1, -2) @ turn
    of_hinge = 0.5 * jnp.stack([turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]], axis=-1)
    half, weight = robot.tree.stations.half_width[after], robot.tree.stations.weight[after]
    in_rod = (np.array(p.rod) >= 0)[:, None]
    known = in_rod & (half > 0)
    curvature = jnp.where(known, once.bending.strain[:, after], 0.0) / jnp.where(known, half, 1.0)
    of_rod = weight[:, None] * jnp.stack([curvature[..., 1], -curvature[..., 0]], axis=-1)  # about y and z
    across = jnp.where(in_rod, of_rod, of_hinge)
    to_first = jnp.mean(jnp.swapaxes(R[:, :1], -1, -2) @ R[:, after], axis=0)
    return jnp.sum(to_first[..., 1:] * across[..., None, :], axis=-1)


def _steps_before(p: _Places) -> Float[np.ndarray, "places steps"]:
    """Which steps lead from the beginning of its chain to each place."""
    found = np.zeros((len(p.rod), len(p.steps)))
    for k, (first, second) in enumerate(p.steps):
        found[second] = found[first]
        found[second, k] = 1.0
    return found


def tail_amplitude(
    robot: Robot, once: Diagnosis, travelled: Float[Array, "n 3"], ahead: Float[Array, "3"]
) -> Float[Array, ""]:
    """Half of the largest distance across `ahead` between two places of the rearmost end, less the way `travelled`."""
    places = points(robot.tree, once.rotation, once.position)
    if robot.tail is not None:
        places = places[:, points_of(robot.tree, robot.tail)]
    tail = places[:, jnp.argmin(jnp.mean(places, axis=0) @ ahead)] - travelled
    across = tail - (tail @ ahead)[:, None] * ahead
    most = jnp.max(jnp.sum((across[:, None] - across) ** 2, axis=-1))
    return 0.5 * jnp.where(most > 0, jnp.sqrt(jnp.where(most > 0, most, 1.0)), 0.0)


def stroke(
    robot: Robot,
    times: Float[Array, "n"],
    once: Diagnosis,
    over_ground: Float[Array, "3"],
    drift: Float[Array, "3"],
    ahead: Float[Array, "3"],
    goes: Bool[Array, ""],
) -> dict[str, tuple[bool | Bool[Array, ""], Float[Array, ""], Float[Array, ""]]]:
    """Body lengths per second, stride length, tail amplitude, Strouhal number and slip of a cycle.

    `over_ground` and `drift` are the mean velocities over ground and through the water [m/s], `ahead` a unit vector,
    and `goes` says whether the body goes through the water. Each number is (whether it is defined, numerator,
    denominator).
    """
    seen = times.shape[0] > 2
    length, period, forward = robot.body_length, times[-1], jnp.sum(drift * ahead)
    runs, wave = wave_speed(robot, period, once, ahead)
    tail = tail_amplitude(robot, once, times[:-1, None] * over_ground, ahead)
    extended = length > _POINT
    return {
        "body_lengths_per_second": (extended, forward, length),
        "stride_length": (seen & extended, forward * period, length),
        "tail_amplitude": (seen, tail, jnp.ones(())),
        "strouhal": (goes & seen, 2 * tail, period * safe_norm(drift)),
        "slip": (runs & seen, forward, wave),
    }


def hull_drag(robot: Robot, mean_force: Float[Array, "loads parts 3"]) -> Float[Array, "3"] | None:
    """Mean force of drag on the first part [N]; None where thrust acts on it too, or cannot be told from drag."""
    names, drag = load_names(robot), np.zeros(len(load_names(robot)))
    on_rail = any(0 in g.parts for g in robot.load_groups.on_joints)
    if robot.tree.structure[0].strains is not None or on_rail:
        return None
    for g in robot.load_groups.acting:
        for name, part in zip(g.names, g.parts, strict=True):
            if part == 0 and not isinstance(g.load, Weight | Buoyancy):
                if not g.load.dissipative:
                    return None
                drag[names.index(name)] = 1.0
    return jnp.asarray(drag) @ mean_force[:, 0]

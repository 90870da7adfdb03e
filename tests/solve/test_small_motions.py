"""Small motions about equilibria, and the loads at which these lose their stability, against closed forms."""

from math import pi

import jax.numpy as jnp
import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.core import Status
from nectosome.description import parse_robot, with_values
from nectosome.solve import critical, modes, static
from nectosome.solve.small_motions import SmallMotion, Stability, spectrum
from nectosome.units import InputError

L, R, E, RHO = 0.5, 5e-3, 1e9, 1200.0  # m, m, Pa, kg/m3
EI, MASS = E * pi / 4 * R**4, RHO * pi * R**2  # N m2, kg/m
EULER = pi**2 * EI / (4 * L**2)  # N, of a column clamped at its foot, under a dead load (Euler 1757)
BECK = 20.05 * EI / L**2  # N, of the same under a load that follows its tip (Beck 1952)
DAMPED = 10.94 * EI / L**2  # N, with an inner damping however small (Bolotin and Zhinzher 1969)

COLUMN = f"""
name: column
water: {{gravity: 0 m/s2}}
body:
  kind: rod
  section: circle
  radius: {R} m
  length: {L} m
  young: {E} Pa
  density: {RHO} kg/m3
  strains: {{bending_y: 4}}
  joint: {{kind: fixed}}
  loads: {{push: {{kind: force, force: [-1 N, 0 N, 0 N], frame: FRAME}}}}
aliases: {{P: body.loads.push.force.0}}
"""

FLAG = """
name: flag
water: {gravity: 0 m/s2, density: 1000 kg/m3, current: [1 m/s, 0 m/s, 0 m/s]}
body:
  kind: rod
  section: rectangle
  width: 2 mm
  height: 60 mm
  length: 200 mm
  young: 3 MPa
  density: 1100 kg/m3
  damping: 300 Pa s
  strains: {bending_z: 3}
  points: 6
  joint: {kind: fixed}
  loads:
    drag: {kind: drag, normal: 1.8, tangential: 0.01}
    water: {kind: added_mass, normal: 1}
    wake: {kind: trailing_edge}
aliases: {U: water.current.0}
"""


@pytest.fixture(scope="module")
def dead():
    return parse_robot(COLUMN.replace("FRAME", "world"))


def test_a_mass_on_a_spring_and_a_damper():
    """w0 = 10 rad/s, z = 0.3: lambda = -z w0 + i w0 sqrt(1 - z^2); above z = 1 both eigenvalues are real."""
    sprung = with_values(parse_robot(SLIDE), {"m": 2.0, "body.joint.stiffness": 200.0, "body.joint.damping": 12.0})
    found = modes(sprung)
    assert found.eigenvalue == pytest.approx([-3 + 1j * np.sqrt(91)], rel=1e-9)
    assert found.frequency == pytest.approx([np.sqrt(91) / (2 * pi)])
    assert found.damping_ratio == pytest.approx([0.3])
    assert found.stable and found.coordinates == ("body.position",) and found.shape == pytest.approx(np.ones((1, 1)))
    heavy = modes(with_values(sprung, {"body.joint.damping": 50.0}))
    assert heavy.eigenvalue == pytest.approx([-5, -20]) and heavy.damping_ratio == pytest.approx([1, 1])


def test_frequencies_of_a_cantilever(dead):
    """w = (1.87510, 4.69409)^2 sqrt(EI/(m L^4)): 1 %; it is slender, so that nothing else counts."""
    found = modes(with_values(dead, {"P": 0.0}))
    exact = np.array([1.87510, 4.69409]) ** 2 * np.sqrt(EI / (MASS * L**4)) / (2 * pi)
    assert found.frequency[:2] == pytest.approx(exact, rel=0.01)
    assert found.damping_ratio[:2] == pytest.approx([0, 0], abs=1e-6)
    data = found.to_dataset()
    assert data.sizes == {"mode": 5, "coordinate": 5, "component": 2}
    assert data["frequency"].attrs["units"] == "Hz" and "column" in data.attrs["robot"]


def test_a_column_buckles_under_eulers_load(dead):
    found = critical(dead, "P", (-0.5 * EULER, -2.0 * EULER)[::-1])
    assert (found.kind, found.frequency, found.unit) == ("divergence", 0.0, "N")
    assert found.value == pytest.approx(-EULER, rel=0.01)
    assert np.abs(found.shape).max() == pytest.approx(1.0)
    beyond = static(with_values(dead, {"P": -1.05 * EULER}))
    assert not modes(beyond).stable and modes(beyond).frequency[0] == 0


def test_becks_column_flutters_and_does_not_buckle():
    found = critical(parse_robot(COLUMN.replace("FRAME", "body")), "P", f"{-1.5 * BECK} N .. {-0.1 * EULER} N")
    assert found.kind == "flutter"
    assert found.value == pytest.approx(-BECK, rel=0.02)
    # at w = 11.02 sqrt(EI/(m L^4)) two modes meet (Beck 1952; Langthjem and Sugiyama 2000)
    assert 2 * pi * found.frequency == pytest.approx(11.02 * np.sqrt(EI / (MASS * L**4)), rel=0.01)


@pytest.fixture(scope="module")
def follower():
    return parse_robot(COLUMN.replace("FRAME", "body"))


@pytest.mark.parametrize("damping", [1e-3, 1e3])
def test_any_small_damping_lets_becks_column_flutter_at_half_the_load(follower, damping):
    found = critical(follower, "P", f"{-1.5 * BECK} N .. {-0.1 * EULER} N", settings=[f"body.damping={damping} Pa s"])
    assert found.kind == "flutter"
    assert found.value == pytest.approx(-DAMPED, rel=2e-3)


def test_becks_column_is_stable_where_a_dead_load_has_buckled_it(follower):
    """Up to Beck's load it is marginal without damping; with damping it is stable below 10.94 EI/L2, then flutters."""
    euler, beck, damped = 1.2 * EULER, 0.99 * BECK, 1.01 * DAMPED
    cases = [(euler, 0, "marginal"), (beck, 0, "marginal"), (1.01 * BECK, 0, "flutters")]
    for load, damping, kind in (*cases, (0.99 * DAMPED, 1, "decays"), (damped, 1, "flutters")):
        found = static(with_values(follower, {"P": -load, "body.damping": float(damping)}))
        assert found.stability is not None and found.stability.kind == kind
        assert int(found.status) == (Status.UNSTABLE if kind == "flutters" else Status.SOLVED)
        assert modes(found).stability.kind == kind


def test_a_torque_that_follows_the_tip_is_never_stable():
    """Galerkin's method, z^2 to z^6, for EI z'''' - i T z''' + m z_tt = 0, z'' = z''' = 0 at the tip (Nicolai)."""
    text = COLUMN.replace("bending_y: 4", "bending_y: 4, bending_z: 4").replace("force: [-1 N", "moment: [1 mN m")
    text = text.replace("0 N, 0 N], frame", "0 N m, 0 N m], force: [0 N, 0 N, 0 N], frame").replace("FRAME", "body")
    rod = parse_robot(text.replace("aliases: {P: body.loads.push.force.0}", "aliases: {T: body.loads.push.moment.0}"))
    n = np.arange(2, 7)
    total, a, b = np.add.outer(n, n), n[:, None], n[None, :]
    bent, mixed = a * (a - 1) * b * (b - 1) / (total - 3), a * b * (b - 1) / (total - 2)
    for T in (0.01, 1.0, 20.0):  # N m: 0.8 to 1600 millionths of EI/L
        K = EI / L**3 * bent + 1j * T / L**2 * mixed
        square = np.linalg.eigvals(np.linalg.solve(MASS * L / (total + 1.0), K))
        grows = np.max(np.real(1j * np.sqrt(np.concatenate([square, np.conj(square)]))))
        found = static(with_values(rod, {"T": T})).stability
        assert found is not None and found.kind == "flutters"
        assert found.growth == pytest.approx(np.abs(grows), rel=0.02)


def test_a_fin_that_trails_is_stable_and_one_that_leads_is_not():
    """Drag across a stream turns a fin to where it trails: its stiffness is not symmetric, and no energy tells."""
    flag = parse_robot(FLAG)
    trails, leads = (static(with_values(flag, {"U": U})) for U in (1.0, -1.0))
    assert int(trails.status) == Status.SOLVED and trails.stability.kind == "decays"
    assert int(leads.status) == Status.UNSTABLE and leads.stability.kind in ("diverges", "flutters")


@pytest.mark.parametrize(("light", "lag"), [(1e-6, 1e-3), (1e-9, 1.0), (1e-12, 1e-3), (1e-12, 1.0)])
def test_a_heavy_tip_on_what_is_light_and_damped_diverges(light, lag):
    """M l^2 + k/2 (1 + lag l) - k0 = 0 of two springs k with nothing between them, in place of 1e-6 to 1e-12 M."""
    k, k0, dampers = 10.0, 5.5, lag * np.array([[10.0, -10.0], [-10.0, 20.0]])
    jacobian = np.block([[np.zeros((2, 2)), np.eye(2)], [np.array([[k - k0, -k], [-k, 2 * k]]), dampers]])
    grows = max(np.roots([1.0, k / 2 * lag, k / 2 - k0]))
    motion = SmallMotion(jacobian, np.diag([1.0, light]))
    for xp in (np, jnp):
        values = np.asarray(spectrum(motion, (), xp)[0])
        assert max(values.real) == pytest.approx(grows, rel=5e-3)
    assert motion.stability.kind == "diverges"


def test_what_rounding_cannot_tell_from_rest_neither_grows_nor_decays():
    """Oscillators of 1 to 1e3 rad/s, none damped, a drift, and a damping of 1e-20 or against the motion by 1e-20."""
    rng = np.random.default_rng(1)
    Q, mass = np.linalg.qr(rng.normal(size=(6, 6)))[0], rng.normal(size=(6, 6))
    mass = mass @ mass.T + 0.01 * np.eye(6)

    def of(square, damping):
        root = np.linalg.cholesky(mass)
        K, D = (root @ Q @ np.diag(x) @ Q.T @ root.T for x in (square, damping))
        return SmallMotion(np.block([[np.zeros((6, 6)), np.eye(6)], [K, D]]), mass)

    square = np.array([0.0, 1.0, 1.0, 1.0, 1e4, 1e6])
    none = of(square, 0 * square).stability
    assert none.kind == "marginal" and none.frequency == pytest.approx(1 / (2 * pi), rel=1e-6)
    damped = of(square, np.array([0.0, 1, 2, 3, 1, 1]) * 1e-20).stability
    assert damped.kind == "decays" and damped.growth == pytest.approx(-5e-21, rel=1e-3)
    driven = of(square, np.array([0.0, 1, -2, 3, 1, 1]) * 1e-20).stability
    assert driven.kind == "flutters" and driven.growth == pytest.approx(1e-20, rel=1e-3)
    falls = of(square - np.array([1e-6, 0, 0, 0, 0, 0]), 0 * square).stability
    assert falls.kind == "diverges" and falls.growth == pytest.approx(1e-3, rel=1e-2)
    values, shapes = spectrum(of(square, 0 * square), drift=())
    assert values.shape == (12,) and shapes.shape == (6, 12)
    assert Stability.of(np.zeros(2, complex)).kind == "marginal"


def test_a_body_that_nothing_moves_is_neutral():
    """A linear motion of zeros: two bodies of different masses that neither forces nor water change."""
    for mass in (np.eye(2), np.diag([1.0, 1e-9])):
        none = SmallMotion(np.zeros((4, 4)), mass)
        assert none.stability == ("marginal", 0.0, 0.0)
        assert np.all(np.asarray(spectrum(none, (), jnp)[0]) == 0)


def test_what_has_no_critical_value_is_told(as_users_run, dead):
    with pytest.raises(InputError, match=r"stable at .* and between. Choose a wider range"):
        critical(dead, "P", (-0.5 * EULER, -0.1 * EULER), samples=2)
    with pytest.raises(InputError, match="no stable equilibrium at"):
        critical(dead, "P", (-2 * EULER, -1.5 * EULER), samples=2)
    with pytest.raises(InputError, match=r"give a range LOW..HIGH"):
        critical(dead, "P", (1.0,), samples=2)
    with pytest.raises(InputError, match='there is no quantity called "Q" in column'):
        critical(dead, "Q", "1 N .. 2 N")
    loose = SLIDE.replace("stiffness: 5 N/m, ", "").replace("axis: x", "axis: z")
    loose = loose.replace("water: {gravity: 0 m/s2}", "")
    with pytest.raises(InputError, match=r"no equilibrium found. Nothing holds body.position"):
        modes(parse_robot(loose))

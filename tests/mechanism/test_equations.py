"""The equations of motion of a robot with every kind of joint, link and load: kinematics, mass, energy, power."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.evaluations import equations

from nectosome.core import State
from nectosome.mechanism import diagnose
from nectosome.mechanism.diagnose import energies
from nectosome.model import build
from nectosome.robots import describe

T = jnp.asarray(0.3)


@jax.jit
def kinematics(robot, x, a):
    """Twists and their rates as the tree says, and as the motion of poses says."""
    tree = robot.tree

    def at(s):
        q, v, _ = tree.complete(T + s, robot.advance(x.q, x.v, s), x.v + s * a)
        shape = tree.shape(q)
        return shape.rotation, shape.position, tree.twists(shape, v)

    one = jnp.ones(())
    (R, _, twist), (dR, dp, dtwist) = jax.jvp(at, (0 * one,), (one,))
    turning = jnp.einsum("nji,njk->nik", R, dR)
    angular = jnp.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=-1)
    linear = jnp.einsum("nji,nj->ni", R, dp)
    q, v, prescribed = tree.complete(T, x.q, x.v)
    shape, split = tree.shape(q), tree.split(v, "v")
    rates = tree.rates_of(shape, tree.added(shape, split), split, tree.split(prescribed.at[tree.free_v].add(a), "v"))
    return twist, jnp.concatenate([angular, linear], axis=-1), rates, dtwist


@jax.jit
def dynamics(robot, x, a, b):
    M, h = robot.mass_bias(T, x)
    n = a.size
    accelerations = jnp.concatenate([jnp.zeros((1, n)), jnp.eye(n), a[None], a[None]])
    forces = jnp.zeros((n + 3, n)).at[-1].set(b)
    zero, *units, residual, pushed = jax.vmap(lambda a, u: robot.residual(T, x, a, u))(accelerations, forces)
    energy = jax.vmap(lambda s: energies(robot, T, State(x.q, x.v + s * a, x.z)).sum(axis=0))(
        jnp.array([-1.0, 0.0, 1.0])
    )
    return M, h, jnp.stack(units, axis=1) - zero[:, None], residual, pushed, energy


@pytest.mark.parametrize("seed", range(3))
def test_twists_are_the_velocities_of_the_poses(zoo, some_state, seed):
    twist, by_poses, rates, by_twists = kinematics(zoo, *some_state(zoo, seed))
    np.testing.assert_allclose(twist, by_poses, atol=1e-13)
    np.testing.assert_allclose(rates, by_twists, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_mass_matrix_is_the_residual_in_the_accelerations(zoo, some_state, seed):
    x, a = some_state(zoo, seed)
    M, h, by_residual, residual, pushed, energy = (np.asarray(y) for y in dynamics(zoo, x, a, x.v))
    size = np.max(np.abs(M))
    np.testing.assert_allclose(M, M.T, atol=1e-14 * size)
    assert np.min(np.linalg.eigvalsh(M)) > 0
    np.testing.assert_allclose(by_residual, M, atol=1e-14 * (size + np.max(np.abs(h))))
    np.testing.assert_allclose(residual, M @ a + h, rtol=1e-12, atol=1e-12 * np.max(np.abs(h)))
    np.testing.assert_allclose(pushed, residual - x.v, rtol=1e-12, atol=1e-12 * np.max(np.abs(h)))
    # kinetic energy, of body and water together, is quadratic in the velocities with M as its matrix
    low, middle, high = energy[:, :2].sum(axis=1)
    assert low - 2 * middle + high == pytest.approx(np.asarray(a) @ M @ np.asarray(a), rel=1e-11)


def test_kinetic_energy_of_a_free_rod(drifter, some_state):
    x, a = some_state(drifter)
    M, _, _, _, _, energy = dynamics(drifter, x, x.v, a)
    assert float(energy[1, 0]) == pytest.approx(float(0.5 * x.v @ M @ x.v), rel=1e-13)
    assert float(energy[1, 1]) == 0


balance = jax.jit(lambda robot, x: diagnose(robot, T, x))


@jax.jit
def energy_rate(robot, x):
    """d/dt of the energies by automatic differentiation."""
    of = lambda t, x: energies(robot, t, x).sum()  # noqa: E731
    return jax.jvp(of, (T, x), (jnp.ones(()), robot.rates(T, x)))[1]


@pytest.mark.parametrize("seed", range(4))
def test_power_goes_where_energy_goes(zoo, some_state, seed):
    """dE/dt = powers of loads and drives, at any state, in a current, with every load there is."""
    x = some_state(zoo, seed)[0]
    d = balance(zoo, x)
    powers = np.concatenate([d.load_power.ravel(), d.reaction_power])
    assert np.all(np.isfinite(powers))
    assert np.abs(float(d.energy_rate) - powers.sum()) < 1e-12 * np.abs(powers).sum()
    assert np.abs(float(d.energy_rate) - float(energy_rate(zoo, x))) < 1e-12 * np.abs(powers).sum()
    assert np.abs(float(d.reaction_power[0])) > 1e-6 * np.abs(powers).sum()


ROD = """
name: rod
water: {density: 1000 kg/m3}
body:
  kind: rod
  section: circle
  radius: 10 mm
  length: 0.5 m
  young: 1 MPa
  density: 1100 kg/m3
  strains: {bending_y: 1}
  points: POINTS
  loads: {drag: {kind: drag, normal: 1.1}, water: {kind: added_mass, normal: 1}}
"""


def of_residual(robot):
    x = robot.initial()
    return equations(jax.make_jaxpr(lambda x, a: robot.residual(T, x, a))(x, x.v).jaxpr)


def test_the_graph_does_not_grow_with_the_number_of_points(described):
    few, many = (of_residual(described(ROD.replace("POINTS", points))) for points in ("5", "50"))
    assert few == many > 100


@pytest.mark.parametrize(
    ("name", "most"), [("flagellum", 1200), ("turtle", 1900), ("octopus", 1250), ("krill", 950), ("flagella4", 1200)]
)
def test_the_graph_of_a_shipped_robot_grows_with_kinds_of_parts_only(name, most):
    """A krill has 27 parts and 148 loads."""
    assert 500 < of_residual(build(describe(name))) <= most


SWIMMER = """
name: swimmer
water: {surface: 0.4 m, current: [0.1 m/s, 0 m/s, 0 m/s]}
body: {kind: rigid, shape: point, mass: 1 kg, inertia: [0.01 kg m2, 0.02 kg m2, 0.03 kg m2], joint: {kind: free}}
limbs:
  arm:
    kind: rod
    section: circle
    length: 0.3 m
    radius: 10 mm
    young: 0.1 MPa
    density: 1100 kg/m3
    strains: {bending_z: 1}
    offset: [0 m, 50 mm, 0 m]
    repeat: {count: COUNT, around: x}
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 20 deg, frequency: 1 Hz}}
    loads:
      drag: {kind: drag, normal: 1.1}
      water: {kind: added_mass, normal: 1}
      pull: {kind: tendon, place: [1 mm, 0 mm], tension: {kind: constant, value: 1 N}}
  hand:
    on: arm
    kind: rigid
    shape: cylinder
    length: 50 mm
    radius: 5 mm
    density: 1000 kg/m3
    joint: {kind: spherical, stiffness: 0.1 N m/rad, damping: 0.01 N m s/rad}
    loads: {hull: {kind: lumped_drag, drag_area: [1 cm2, 2 cm2, 3 cm2], rotational: [0 kg m2, 0 kg m2, 0 kg m2]}}
"""


def test_a_copy_of_a_limb_adds_no_equation(described):
    counts = {of_residual(described(SWIMMER.replace("COUNT", str(count)))) for count in (2, 3, 8)}
    assert len(counts) == 1


LIMB = """
    kind: rod
    section: circle
    young: 0.1 MPa
    density: 1100 kg/m3
    strains: {torsion: 0, bending_y: 0, bending_z: 0}
    points: 3
    offset: [0 m, 50 mm, 0 m]
    loads: {drag: {kind: drag, normal: 1.1}, water: {kind: added_mass, normal: 1}}
"""
STAR = f"""
name: star
water: {{gravity: 9.81 m/s2}}
body: {{kind: rigid, shape: point, mass: 1 kg, inertia: [0.01 kg m2, 0.02 kg m2, 0.03 kg m2], joint: {{kind: free}}}}
limbs:
  a: {LIMB}
    length: 0.5 m
    radius: 10 mm
  b: {LIMB}
    rotation: [0 deg, 0 deg, 120 deg]
    length: 0.3 m
    radius: 8 mm
"""


def test_equal_rods_taken_together_are_as_each_by_itself(described, accelerations, some_state):
    """A mark without mass gives the second rod another structure, so that the two are no longer taken together."""
    together, apart = described(STAR), described(STAR + "    marks: [0.45]\n")
    kinds = [len({jax.tree.structure(part.body) for part in r.tree.parts[1:]}) for r in (together, apart)]
    assert kinds == [1, 2]
    x, _ = some_state(together)
    np.testing.assert_allclose(accelerations(together, x), accelerations(apart, x), rtol=1e-10, atol=1e-10)


def test_the_reaction_of_a_prescribed_joint_is_the_torque_that_drives_a_free_one(propeller, some_state, accelerations):
    """Given to the same joint as its torque, it makes all accelerations what they were, that of the joint as given."""
    import equinox as eqx

    from nectosome.description import Angle, ConstantSignal
    from nectosome.description.fields import Torque
    from nectosome.description.signals import SineSignal

    def shaft(**changes):
        joint = propeller.limbs["shaft"].joint.model_copy(update=changes)
        limbs = {**propeller.limbs, "shaft": propeller.limbs["shaft"].model_copy(update={"joint": joint})}
        return build(propeller.model_copy(update={"limbs": limbs}))

    motion = SineSignal[Angle](kind="sine", amplitude=0.8, frequency=2.0, phase=0.4)
    torque = ConstantSignal[Torque](kind="constant", value=1.0)
    prescribed, driven = shaft(motion=motion), shaft(motion=None, torque=torque)
    react = jax.jit(lambda robot, x: diagnose(robot, T, x))
    signal = [float(y) for y in prescribed.tree.parts[1].prescribed(T)]
    for seed in range(3):
        x, _ = some_state(prescribed, seed)
        d = react(prescribed, x)
        free = State(jnp.insert(x.q, 1, signal[0]), jnp.insert(x.v, 1, signal[1]), x.z)
        robot = eqx.tree_at(lambda r: r.tree.drives[0].things.value, driven, d.reaction[:1])
        wanted = np.insert(np.asarray(d.a), 1, signal[2])
        np.testing.assert_allclose(accelerations(robot, free), wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
        assert float(d.reaction_power[0]) == pytest.approx(float(d.reaction[0]) * signal[1])

"""The rowing paddle against a Lagrangian of its own, MuJoCo, and closed forms."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import RevoluteJoint, with_values
from nectosome.description.fields import Torque
from nectosome.description.signals import SineSignal
from nectosome.mechanism import diagnose
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate
from nectosome.units import InputError

L1, WIDTH, LENGTH, MASS, RHO = 0.105, 0.040, 0.105, 0.030, 1000.0
K = np.pi * 0.85**2 * 2e6 * (WIDTH * 0.006**3 / 12) / 0.105
KS, CS, D0 = 10.0, 0.01, np.radians(1.0)
S, W = np.polynomial.legendre.leggauss(8)


def stopper(angle, speed, np=jnp):
    """The law of the stops at 0, for angles below it; in arrays of NumPy or JAX."""
    x = -angle / D0
    inside = np.clip(x, 0, 1)
    smooth = inside**2 * (3 - 2 * inside)
    return np.maximum(0.0, KS * D0 * (inside**3 - inside**4 / 2 + np.maximum(x - 1, 0)) - CS * smooth * speed)


def lagrangian_residual(n, stroke):
    """d/dt dL/dv - dL/dq - Q of a planar chain of point masses whose first angle is beta(t); all by autodiff."""
    l2, m = LENGTH / n, MASS / n

    def place(t, q, segment, along):
        beta = stroke(t)
        angles = beta + jnp.cumsum(q)
        tip = L1 * jnp.stack([jnp.cos(beta), jnp.sin(beta)])
        for k in range(segment):
            tip += l2 * jnp.stack([jnp.cos(angles[k]), jnp.sin(angles[k])])
        return tip + along * jnp.stack([jnp.cos(angles[segment]), jnp.sin(angles[segment])])

    def velocity(t, q, v, segment, along):
        return jax.jvp(lambda t, q: place(t, q, segment, along), (t, q), (jnp.ones(()), v))[1]

    def L(t, q, v):
        kinetic = sum(0.5 * m * jnp.sum(velocity(t, q, v, k, l2) ** 2) for k in range(n))
        return kinetic - 0.5 * K * jnp.sum(q**2)

    def pushed(t, q, v):
        total = stopper(q, v)
        for k in range(n):
            angle = stroke(t) + jnp.sum(q[: k + 1])
            normal = jnp.stack([-jnp.sin(angle), jnp.cos(angle)])
            for s, w in zip(S, W, strict=True):
                along = 0.5 * l2 * (s + 1)
                vn = velocity(t, q, v, k, along) @ normal
                force = -0.5 * RHO * WIDTH * jnp.abs(vn) * vn * 0.5 * l2 * w * normal
                total += jax.jacfwd(lambda q: place(t, q, k, along))(q).T @ force  # noqa: B023
        return total

    def residual(t, q, v, a):
        momentum = jax.grad(L, argnums=2)
        rate = jax.jvp(momentum, (t, q, v), (jnp.ones(()), v, a))[1]
        return rate - jax.grad(L, argnums=1)(t, q, v) - pushed(t, q, v)

    return jax.jit(residual)


@pytest.mark.parametrize("n", [1, 3])
def test_the_equations_are_those_of_a_lagrangian(n):
    description = with_values(
        describe(f"paddle{n}"),
        {f"limbs.arm.joint.motion.{name}": x for name, x in (("forward_share", 0.4), ("phase", 0.3), ("offset", 0.2))},
    )
    robot = build(description)
    motion = robot.tree.parts[1].prescribed
    reference = lagrangian_residual(n, lambda t: motion(t)[0])
    ours = jax.jit(lambda t, q, v, a: robot.residual(t, State(q, v, robot.initial().z), a))
    rng = np.random.default_rng(0)
    for _ in range(50):
        t, q, v, a = rng.uniform(0, 2), rng.uniform(-0.1, 1.5, n), rng.normal(0, 10, n), rng.normal(0, 300, n)
        numbers = [jnp.asarray(x) for x in (t, q, v, a)]
        wanted = reference(*numbers)
        np.testing.assert_allclose(ours(*numbers), wanted, rtol=0, atol=1e-10 * np.max(np.abs(wanted)))


SECONDS, SAMPLES = 2.0, 41


def mujoco_angles(torque):
    """Hinges, point masses and springs are MuJoCo's; drag at the same Gauss points and stops are forces given to it."""
    l2, m = LENGTH / 3, MASS / 3
    body, closing, x = "", "", 0.0
    for k, length in enumerate((L1, l2, l2, l2)):
        stiffness = K if k else 0
        sites = "".join(f'<site name="s{k}_{i}" pos="{0.5 * l2 * (s + 1)} 0 0"/>' for i, s in enumerate(S)) if k else ""
        body += f"""<body pos="{x} 0 0"><joint type="hinge" axis="0 0 1" stiffness="{stiffness}"/>
            <inertial pos="{length} 0 0" mass="{m if k else 0.016}" diaginertia="1e-12 1e-12 1e-12"/>{sites}"""
        closing += "</body>"
        x = length
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="0.0002" integrator="RK4" gravity="0 0 0"/>
        <worldbody>{body}{closing}</worldbody></mujoco>""")
    data = mujoco.MjData(model)
    jac = np.zeros((3, model.nv))
    weight = 0.25 * RHO * WIDTH * l2 * np.tile(W, 3)

    def passive(model, data):
        normal = data.site_xmat.reshape(-1, 3, 3)[:, :, 1]
        for i in range(model.nsite):
            mujoco.mj_jacSite(model, data, jac, None, i)
            along = normal[i] @ jac
            vn = along @ data.qvel
            data.qfrc_passive[:] -= weight[i] * abs(vn) * vn * along
        data.qfrc_passive[1:] += stopper(data.qpos[1:], data.qvel[1:], np)
        data.qfrc_passive[0] += torque(data.time)

    out = [data.qpos.copy()]
    mujoco.set_mjcb_passive(passive)
    try:
        for _ in range(SAMPLES - 1):
            mujoco.mj_step(model, data, nstep=round(SECONDS / (SAMPLES - 1) / model.opt.timestep))
            out.append(data.qpos.copy())
    finally:
        mujoco.set_mjcb_passive(None)
    assert data.time == pytest.approx(SECONDS)
    return np.array(out)


@pytest.mark.slow
def test_a_paddle_driven_by_a_torque_moves_as_in_mujoco():
    torque = SineSignal[Torque](kind="sine", amplitude=0.4, frequency=1.1, phase=1.5)
    d = describe("paddle")
    arm = d.limbs["arm"].model_copy(update={"joint": RevoluteJoint(kind="revolute", axis="z", torque=torque)})
    robot = build(d.model_copy(update={"limbs": {**d.limbs, "arm": arm}, "aliases": {}}))
    run = simulate(robot, SECONDS, samples=SAMPLES, method="explicit", rtol=1e-9, atol=1e-10)
    theirs = mujoco_angles(lambda t: 0.4 * np.sin(2 * np.pi * 1.1 * t + 1.5))
    assert np.ptp(np.rad2deg(theirs), axis=0).min() > 20
    assert np.rad2deg(theirs[:, 1:]).min() < -0.3  # the stops are reached
    np.testing.assert_allclose(np.rad2deg(run.value.state.q), np.rad2deg(theirs), atol=1e-3)


def test_a_rigid_plate_feels_the_drag_and_the_inertia_of_a_rotating_bar():
    """Load cell and servo: rho w Cn/6 |b'| b' (r2^3 - r1^3) and m r b'', m r b'^2 of the ends, and their moments."""
    robot = build(describe("paddle", ["N=0"]))
    t = jnp.asarray(0.13)
    beta, rate, second = (float(x) for x in robot.tree.parts[1].prescribed(t))
    found = jax.jit(diagnose)(robot, t, robot.initial())
    r1, r2 = L1, L1 + LENGTH
    across = RHO * WIDTH / 6 * abs(rate) * rate * (r2**3 - r1**3) + (0.016 * r1 + MASS * r2) * second
    inward = (0.016 * r1 + MASS * r2) * rate**2
    n, r = np.array([-np.sin(beta), np.cos(beta)]), np.array([np.cos(beta), np.sin(beta)])
    np.testing.assert_allclose(found.reaction[:2], across * n - inward * r, rtol=1e-12)
    torque = RHO * WIDTH / 8 * abs(rate) * rate * (r2**4 - r1**4)
    torque += (0.016 * r1**2 + MASS * r2**2) * second
    assert float(found.reaction[3]) == pytest.approx(torque, rel=1e-12)


def test_segments_share_the_paddle():
    for n in range(6):
        d = describe("paddle", [f"N={n}"])
        parts = [part for name, part in d.limbs.items() if name != "arm"]
        assert len(parts) == max(n, 1)
        assert sum(part.length for part in parts) == pytest.approx(LENGTH)
        assert sum(part.mass for part in parts) == pytest.approx(MASS)
        assert len(build(d).coordinate_names) == n
    for wrong in ("6", "-1", "two", "1.5", ""):
        with pytest.raises(InputError):
            describe("paddle", [f"N={wrong}"])


def test_the_joint_has_the_stiffness_of_its_flexure():
    robot = build(describe("paddle"))
    springs = [a.load for a in robot.loads if a.name == "spring"]
    assert [float(s.stiffness) for s in springs] == pytest.approx([K] * 3)
    assert pytest.approx(0.031, rel=0.005) == K

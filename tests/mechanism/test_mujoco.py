"""A spatial chain of hinges with a tendon over three of them against MuJoCo, an independent engine."""

import mujoco
import numpy as np
import pytest

from nectosome.solve import simulate

#       axis           length width height mass  stiffness damping rest start
LINKS = [
    ((0, 1, 0), 0.30, 0.04, 0.06, 0.50, 0.8, 0.010, 0.2, 0.5),
    ((0, 0, 1), 0.25, 0.05, 0.03, 0.40, 0.5, 0.005, -0.3, -0.4),
    ((0.6, 0.8, 0), 0.20, 0.03, 0.05, 0.30, 0.2, 0.002, 0.4, 0.9),
    ((0, -0.6, 0.8), 0.15, 0.02, 0.03, 0.10, 0.05, 0.001, 0.0, -1.2),
]
# a taut cord; in MuJoCo a spring along L = sum of arms times angles, at ease where the cord has lost its stretch
ARMS, CORD, DAMPING, PRETENSION = {1: 0.02, 2: -0.015, 3: 0.01}, 100.0, 0.5, 10.0  # m, N/m, N s/m, N
SECONDS, SAMPLES = 2.0, 21


def mujoco_angles():
    body, closing, x = "", "", 0.0
    for axis, length, width, height, mass, stiffness, damping, rest, _ in LINKS:
        moments = mass / 12 * np.array([width**2 + height**2, length**2 + height**2, length**2 + width**2])
        body += f"""<body pos="{x} 0 0">
            <joint name="j{len(closing) // 7}" type="hinge" axis="{axis[0]} {axis[1]} {axis[2]}"
                stiffness="{stiffness}" damping="{damping}" springref="{np.rad2deg(rest)}"/>
            <inertial pos="{length / 2} 0 0" mass="{mass}" diaginertia="{moments[0]} {moments[1]} {moments[2]}"/>"""
        closing += "</body>"
        x = length
    arms = "".join(f'<joint joint="j{k}" coef="{arm}"/>' for k, arm in ARMS.items())
    spring = f'stiffness="{CORD}" damping="{DAMPING}" springlength="{PRETENSION / CORD}"'
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><compiler angle="degree"/>
        <option timestep="0.0005" integrator="RK4" gravity="0 0 -9.81"/>
        <worldbody>{body}{closing}</worldbody><tendon><fixed {spring}>{arms}</fixed></tendon></mujoco>""")
    data = mujoco.MjData(model)
    data.qpos[:] = [link[-1] for link in LINKS]
    out = [data.qpos.copy()]
    for _ in range(SAMPLES - 1):
        mujoco.mj_step(model, data, nstep=round(SECONDS / (SAMPLES - 1) / model.opt.timestep))
        out.append(data.qpos.copy())
    assert data.time == pytest.approx(SECONDS)
    return np.array(out)


def robot_file():
    parts = []
    for axis, length, width, height, mass, stiffness, damping, rest, start in LINKS:
        parts.append(f"""
    kind: rigid
    shape: box
    length: {length} m
    width: {width} m
    height: {height} m
    mass: {mass} kg
    volume: 0 m3
    joint: {{kind: revolute, axis: [{axis[0]}, {axis[1]}, {axis[2]}], position: {start} rad, rest: {rest} rad,
      stiffness: {stiffness} N m/rad, damping: {damping} N m s/rad}}""")
    limbs = "".join(
        f"\n  link{i}:\n    on: {'body' if i == 1 else f'link{i - 1}'}{part}" for i, part in enumerate(parts) if i
    )
    arms = ", ".join(f"link{k}: {arm} m" for k, arm in ARMS.items())
    cord = f"over: {{{arms}}}, stiffness: {CORD} N/m, damping: {DAMPING} N s/m, pretension: {PRETENSION} N"
    return (
        f"name: chain\nwater: {{gravity: 9.81 m/s2}}\nbody:{parts[0]}\nlimbs:{limbs}\n"
        f"tendons: {{cord: {{{cord}, softness: 1e-6 m}}}}\n"
    )


def test_a_chain_of_hinges_moves_as_in_mujoco(described):
    run = simulate(described(robot_file()), SECONDS, samples=SAMPLES, method="explicit", rtol=1e-10, atol=1e-11)
    ours, theirs = np.asarray(run.value.state.q), mujoco_angles()
    assert np.ptp(theirs, axis=0).min() > 0.3
    np.testing.assert_allclose(np.rad2deg(ours), np.rad2deg(theirs), atol=1e-5)

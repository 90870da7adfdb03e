"""Robots imported from a URDF against MuJoCo, an independent engine that reads URDFs itself."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nectosome.core import State
from nectosome.description.urdf import import_urdf
from nectosome.model import build

ARM = """
<link name="base">
  <inertial><origin xyz="0 0 0.05"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.02"/></inertial>
</link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="Upper-Arm"/>
  <origin xyz="0.01 0.02 0.12" rpy="0.3 -0.4 0.5"/><axis xyz="0.6 0 0.8"/>
  <limit lower="-1.5" upper="1.5" effort="30" velocity="2"/><dynamics damping="0.1"/></joint>
<link name="Upper-Arm">
  <inertial><origin xyz="0.02 0.01 0.15" rpy="0.2 0.1 -0.3"/><mass value="1.5"/>
    <inertia ixx="0.02" ixy="0.001" ixz="-0.002" iyy="0.018" iyz="0.0015" izz="0.004"/></inertial>
  <collision><origin xyz="0.02 0 0.15" rpy="0.1 0.2 0"/><geometry><box size="0.05 0.06 0.3"/></geometry></collision>
  <collision><origin xyz="0 0 0.3"/><geometry><sphere radius="0.04"/></geometry></collision>
</link>
<joint name="slide" type="prismatic"><parent link="Upper-Arm"/><child link="ram"/>
  <origin xyz="0 0.02 0.3" rpy="0 1.5707963267948966 0.2"/><axis xyz="0.1 0.2 0.9"/>
  <limit lower="0" upper="0.2" effort="50" velocity="0.1"/><dynamics damping="3"/></joint>
<link name="ram">
  <inertial><origin xyz="0 0 0.1" rpy="0 0.7 0"/><mass value="0.7"/>
    <inertia ixx="0.003" ixy="0.0002" ixz="0" iyy="0.0031" iyz="-0.0001" izz="0.0006"/></inertial>
  <collision><origin xyz="0 0.01 0.1" rpy="1 0.3 0.2"/><geometry><cylinder radius="0.02" length="0.2"/></geometry>
  </collision>
</link>
<joint name="wrist" type="continuous"><parent link="ram"/><child link="hand"/>
  <origin xyz="0 0 0.2" rpy="0 0 -0.7"/><axis xyz="0 1 1"/></joint>
<link name="hand">
  <inertial><origin xyz="0.01 0.02 0.03" rpy="0.1 0 0.2"/><mass value="0.2"/>
    <inertia ixx="0.0004" ixy="0.00003" ixz="0" iyy="0.0005" iyz="0.00002" izz="0.0006"/></inertial>
</link>
<joint name="grip" type="fixed"><parent link="hand"/><child link="tool"/>
  <origin xyz="0.05 0 0.02" rpy="0.4 0 0.9"/></joint>
<link name="tool">
  <inertial><origin xyz="0.01 0 0.02" rpy="0 0 0.3"/><mass value="0.4"/>
    <inertia ixx="0.0004" ixy="0.00003" ixz="0" iyy="0.0005" iyz="0" izz="0.0006"/></inertial>
</link>
<joint name="grip_two" type="fixed"><parent link="hand"/><child link="tool_two"/><origin xyz="-0.05 0.01 0.02"/></joint>
<link name="tool_two">
  <inertial><mass value="0.3"/><inertia ixx="0.0004" ixy="0" ixz="0" iyy="0.0005" iyz="0" izz="0.0006"/></inertial>
  <collision><geometry><sphere radius="0.03"/></geometry></collision>
</link>
"""
HELD = f'<robot name="arm">{ARM}</robot>'
ADRIFT = f"""<robot name="adrift"><link name="world"/>
<joint name="free" type="floating"><parent link="world"/><child link="base"/>
  <origin xyz="0.1 0.2 0.3" rpy="0.5 0.2 -0.4"/></joint>{ARM}</robot>"""
DENSITY, GRAVITY = 1000.0, 9.80665


def balance(robot, q, v):
    """Mass matrix, bias and accelerations."""
    x = State(q, v, robot.initial().z)
    M, h = robot.mass_bias(jnp.zeros(()), x)
    return M, h, robot.rates(jnp.zeros(()), x).v


def theirs(model, q, v):
    """The same by MuJoCo, with the buoyancy of its geometries."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    h = data.qfrc_bias - data.qfrc_passive
    volume = {  # of MuJoCo's half sizes
        int(mujoco.mjtGeom.mjGEOM_BOX): lambda s: 8 * s[0] * s[1] * s[2],
        int(mujoco.mjtGeom.mjGEOM_SPHERE): lambda s: 4 / 3 * np.pi * s[0] ** 3,
        int(mujoco.mjtGeom.mjGEOM_CYLINDER): lambda s: 2 * np.pi * s[0] ** 2 * s[1],
    }
    for geom in range(model.ngeom):
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, data.geom_xpos[geom], model.geom_bodyid[geom])
        h = h - DENSITY * GRAVITY * volume[int(model.geom_type[geom])](model.geom_size[geom]) * jacobian[2]
    return M, h, np.linalg.solve(M, -h)


@pytest.fixture(scope="module", params=[HELD, ADRIFT], ids=["held", "adrift"])
def both(request, tmp_path_factory):
    file = tmp_path_factory.mktemp("urdf") / "arm.urdf"
    file.write_text(request.param)
    model = mujoco.MjModel.from_xml_path(str(file))
    model.opt.gravity[:] = 0, 0, -GRAVITY
    robot = build(import_urdf(file).description)
    assert model.ngeom == 4
    return robot, jax.jit(lambda q, v: balance(robot, q, v)), model


@pytest.mark.parametrize("moving", [False, True])
def test_mass_gravity_buoyancy_and_accelerations_are_those_of_mujoco(both, moving):
    robot, ours, model = both
    rng = np.random.default_rng(3)
    for _ in range(3):
        q, v = rng.normal(size=robot.initial().q.size), rng.normal(size=model.nv) * moving
        qpos, turn, turning = q, np.eye(model.nv), np.zeros(model.nv)
        if model.nq > model.nv:
            qpos, turn, turning = as_mujoco_counts(q, v)
        M, h, a = theirs(model, qpos, turn @ v)
        assert np.ptp(h) > 1
        mine = ours(jnp.asarray(q), jnp.asarray(v))
        np.testing.assert_allclose(mine[0], turn.T @ M @ turn, rtol=1e-10, atol=1e-11)
        np.testing.assert_allclose(mine[1], turn.T @ (h + M @ turning), rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(mine[2], turn.T @ (a - turning), rtol=1e-9, atol=1e-9)


def as_mujoco_counts(q, v):
    """Coordinates of a robot that floats, the matrix from our velocities to MuJoCo's, and its rate times v.

    Ours are the pose from where the joint sits, and the twist (angular, linear) in the body; MuJoCo's are the pose in
    the world, the velocity in the world and the angular velocity in the body.
    """
    q[3:7] /= np.linalg.norm(q[3:7])
    first = Rotation.from_euler("xyz", [0.5, 0.2, -0.4])
    now = first * Rotation.from_quat(q[3:7], scalar_first=True)
    place = np.array([0.1, 0.2, 0.3]) + first.apply(q[:3])
    turn, turning = np.eye(v.size), np.zeros(v.size)
    turn[:6, :6] = np.block([[np.zeros((3, 3)), now.as_matrix()], [np.eye(3), np.zeros((3, 3))]])
    turning[:3] = now.apply(np.cross(v[:3], v[3:6]))
    return np.concatenate([place, now.as_quat(scalar_first=True), q[7:]]), turn, turning

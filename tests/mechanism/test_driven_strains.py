"""Strains of rods that motors drive: closed forms, the same shape by an ideal motion, momentum, energy, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.evaluations import equations
from scipy.integrate import cumulative_simpson, simpson

from nectosome.description import parse_robot, with_values
from nectosome.model import bind, build
from nectosome.solve import forces, reading, simulate, static

E, H, W, L, ETA = 2e6, 4e-3, 20e-3, 0.2, 3e3  # Pa, m, m, m, Pa s
I = W * H**3 / 12
RATIO, K, R, J, U = 2.0, 0.03, 3.0, 1e-5, 2.0  # 1, N m/A, ohm, kg m2, V
MOTOR = f"torque_constant: {K} N m/A, resistance: {R} ohm, inertia: {J} kg m2"
VOLTS = f"motor: {{{MOTOR}, voltage: {{kind: constant, value: {U} V}}}}"
BENCH = f"""
name: bench
water: {{gravity: 0 m/s2}}
body:
  kind: rod
  section: rectangle
  width: {H} m
  height: {W} m
  length: {L} m
  young: {E} Pa
  density: DENSITY
  damping: {ETA} Pa s
  points: 4
  drive: {{bending_z: {{ratio: {RATIO}, DRIVE}}}}
"""
STIFFNESS, VISCOSITY = E * I * RATIO**2 / L, 3 * ETA * I * RATIO**2 / L  # N m/rad, N m s/rad


def bench(drive=VOLTS, density="1000 kg/m3"):
    return parse_robot(BENCH.replace("DRIVE", drive).replace("DENSITY", density))


def test_a_motor_bends_a_rod_until_its_stall_torque_is_that_of_the_curvature():
    """K U/R = E I ratio^2/L theta, at rest and at the end of a motion, where the rod is an arc."""
    wanted = K * U / R / STIFFNESS
    at_rest = static(bench())
    assert reading(at_rest, "body.bending_z.angle")[0] == pytest.approx(wanted, rel=1e-10)
    assert reading(at_rest, "motor_torque.body.bending_z.angle")[0] == pytest.approx(K * U / R, rel=1e-12)
    run = simulate(bench(), 3.0, samples=4)
    assert reading(run, "body.bending_z.angle")[-1] == pytest.approx(wanted, rel=1e-6)
    curvature = RATIO * wanted / L
    assert reading(run, "body.tip.position.x")[-1] == pytest.approx(np.sin(RATIO * wanted) / curvature, rel=1e-6)
    strain = run.to_dataset()["bending_strain"].values[-1]
    np.testing.assert_allclose(strain[:, 0], -curvature * H / 2, rtol=1e-6)


def test_a_step_of_the_voltage_moves_a_light_rod_as_its_linear_equation_says():
    """J theta'' + (K^2/R + D) theta' + k theta = K U/R, with the viscosity D of the rod, and next to no mass of it."""
    run = simulate(bench(density="1e-6 kg/m3"), 0.3, samples=31, rtol=1e-9, atol=1e-11)
    time = np.linspace(0.0, 0.3, 31)
    poles = np.roots([J, K**2 / R + VISCOSITY, STIFFNESS])
    parts = np.linalg.solve([[1, 1], poles], [-1, 0])
    wanted = K * U / R / STIFFNESS * (1 + np.real(parts @ np.exp(np.outer(poles, time))))
    np.testing.assert_allclose(reading(run, "body.bending_z.angle"), wanted, atol=1e-6 * wanted.max())
    current = (U - K * reading(run, "body.bending_z.angle.rate")) / R
    np.testing.assert_allclose(reading(run, "current.body.bending_z.angle"), current, rtol=1e-12)


SERVO = "motion: {kind: sine, amplitude: 20 deg, frequency: 1 Hz, phase: 30 deg}"
FULL = 0.2  # rad


def test_a_servo_holds_a_rod_where_its_torque_is_that_of_the_curvature():
    """K U/R (theta_m - theta)/e_f = E I ratio^2/L theta; a limit sets in over 0.5 %, which is 1e-5 of a small error."""
    asked, gain = np.radians(10.0), K * 12.0 / R / FULL
    held = static(bench(f"{SERVO}, servo: {{{MOTOR}, supply: 12 V, full_voltage_at: {FULL} rad}}"))
    start = np.asarray(held.value.system.initial().q)
    np.testing.assert_allclose(start, [asked], rtol=1e-12)  # where its motion starts
    assert float(held.value.system.body_length) == pytest.approx(L, rel=1e-12)  # of the rod unbent
    assert reading(held, "body.bending_z.angle")[0] == pytest.approx(asked * gain / (gain + STIFFNESS), rel=2e-5)


def test_each_strain_of_a_rod_has_its_own_motor_and_its_own_shape(described):
    """The energy of the shape e is E I ratio^2/(2 L) int e^2 ds theta^2; torsion has G J instead of E I."""
    text = BENCH.replace("DENSITY", "1 g/cm3").replace("section: rectangle", "section: ellipse")
    more = f"bending_y: {{ratio: -0.5, envelope: [0, 1, 0.4], {VOLTS}}}, torsion: {{ratio: 3, {VOLTS}}}"
    robot = described(text.replace("DRIVE}", f"envelope: [1, 0.2], {VOLTS}}}, {more}"))
    assert robot.coordinate_names == ("body.torsion.angle", "body.bending_y.angle", "body.bending_z.angle")
    a, b = H / 2, W / 2
    twisted = E / 3 * np.pi * a**3 * b**3 / (a**2 + b**2) * 3**2 / L  # poisson 0.5
    about_y = E * np.pi / 4 * a * b**3 * 0.5**2 / L * (1 / 6 + (1 + 0.4 + 0.4**2) / 6)
    about_z = E * np.pi / 4 * b * a**3 * RATIO**2 / L * (1 + 0.2 + 0.2**2) / 3
    found = np.asarray(robot.tree.one(0).body.stiffness)
    np.testing.assert_allclose(found, np.diag([twisted, about_y, about_z]), rtol=1e-10, atol=1e-12)
    held = static(robot)
    angles = [float(reading(held, name)[0]) for name in robot.coordinate_names]
    np.testing.assert_allclose(angles, K * U / R / np.array([twisted, about_y, about_z]), rtol=1e-9)


def test_a_tendon_inside_turns_the_shaft():
    """T d ratio int e ds = E I ratio^2/L int e^2 ds theta without a voltage; the shape has a kink."""
    shape = f"envelope: [0, 1, 0.4], {VOLTS.replace(f'{U} V', '0 V')}"
    cord = "\n  loads: {pull: {kind: tendon, place: [1 mm, 0 mm], tension: {kind: constant, value: 0.2 N}}}\n"
    text = BENCH.replace("DENSITY", "1 g/cm3").replace("DRIVE", shape)
    pulled = static(parse_robot(text.rstrip() + cord))
    wanted = 0.2 * 1e-3 * RATIO * 0.6 / (STIFFNESS * (0.5 * 1 + 0.5 * (1 + 0.4 + 0.4**2)) / 3)
    assert reading(pulled, "body.bending_z.angle")[0] == pytest.approx(wanted, rel=1e-10)


def test_kinks_of_an_envelope_keep_the_order_of_the_shape(described):
    """Twice the points leave a tenth of the error or less, as without a kink."""
    ends = []
    for points in (8, 16, 64):
        shape = f"envelope: [0, 1, 0.3], {VOLTS}"
        robot = described(
            BENCH.replace("DENSITY", "1 g/cm3").replace("DRIVE", shape).replace("points: 4", f"points: {points}")
        )
        ends.append(np.asarray(jax.jit(lambda robot: robot.tree.shape(jnp.array([1.2])).position[-1])(robot)))
    coarse, fine = (np.linalg.norm(end - ends[-1]) for end in ends[:2])
    assert fine < 0.1 * coarse < 1e-5 * L


SWIMMER = """
name: swimmer
water: {gravity: 0 m/s2, density: 1000 kg/m3}
body:
  kind: rigid
  shape: box
  length: 0.2 m
  width: 60 mm
  height: 80 mm
  mass: 0.9 kg
  joint: {kind: free}
  loads:
    water: {kind: given_added_mass, mass: [0.2 kg, 0.6 kg, 0.9 kg], inertia: [1e-4 kg m2, 2e-3 kg m2, 2e-3 kg m2]}
limbs:
  fin:
    kind: rod
    at: root
    rotation: [0 deg, 20 deg, 180 deg]
    section: rectangle
    width: 6 mm
    height: 50 mm
    tip_width: 3 mm
    length: 0.2 m
    young: 0.5 MPa
    density: 1100 kg/m3
    damping: 300 Pa s
    points: 5
    STRAINS
    loads: {drag: {kind: drag, normal: DRAG}, water: {kind: added_mass, normal: 1}}
"""
SHAPE = "envelope: [1, 0.3]"


def swimmer(strains, drag="1.5"):
    return parse_robot(SWIMMER.replace("STRAINS", strains).replace("DRAG", drag))


def driven(drive, drag="1.5"):
    return swimmer(f"strains: {{torsion: 0}}\n    drive: {{bending_z: {{ratio: {RATIO}, {SHAPE}, {drive}}}}}", drag)


def test_a_shape_takes_the_force_that_an_ideal_motion_of_the_same_shape_takes():
    """Torque = sum of reactions along the Legendre coefficients of ratio e(s), e = 0.65 P_0 - 0.35 P_1, in water."""
    amplitude, t, w = 0.4, 0.13, 2 * np.pi * 1.5
    wave = f"{{kind: wave, amplitude: {RATIO * amplitude / 0.2} 1/m, frequency: 1.5 Hz, phase: 0.3 rad, {SHAPE}}}"
    made = forces(swimmer(f"strains: {{torsion: 0, bending_z: 1}}\n    motion: {{bending_z: {wave}}}"), time=t)
    turn = w * t + 0.3
    values = amplitude * np.array([np.sin(turn), w * np.cos(turn), -(w**2) * np.sin(turn)])
    still = driven("motor: {torque_constant: 30 mN m/A, resistance: 3 ohm, voltage: {kind: constant, value: 0 V}}")
    q, v, a = ({"fin.bending_z.angle": float(x)} for x in values)
    found = forces(still, q, v, a, time=t)
    np.testing.assert_allclose(found["position"], made["position"], atol=1e-12)
    # the torque of the motor is among the forces already
    torque = found["motor_torque"].rename(motor="coordinate").reindex(coordinate=found["coordinate"], fill_value=0.0)
    needed = found["missing_force"] + torque
    free = [str(name) for name in made["coordinate"].values]
    np.testing.assert_allclose(needed.sel(coordinate=free), made["missing_force"], rtol=1e-9, atol=1e-12)
    torque = RATIO * (made["reaction"].values @ [0.65, -0.35])
    assert abs(torque) > 1e-3
    assert float(needed.sel(coordinate="fin.bending_z.angle")) == pytest.approx(torque, rel=1e-9)


@pytest.mark.slow
def test_a_stiffer_servo_comes_to_the_ideal_motion():
    """What its path and its torque lack is of first order in the error at full voltage: half of it, half of them."""
    motion = "motion: {kind: sine, amplitude: 20 deg, frequency: 1 Hz, ramp: 0.5 s}"
    loop = f"torque_constant: {K} N m/A, resistance: {R} ohm, inertia: 1e-8 kg m2, supply: 12 V"
    wave = f"kind: wave, amplitude: {RATIO * np.radians(20.0) / 0.2} 1/m, frequency: 1 Hz, ramp: 0.5 s, {SHAPE}"
    ideal = swimmer(f"strains: {{torsion: 0, bending_z: 1}}\n    motion: {{bending_z: {{{wave}}}}}")
    names = ("fin.tip.position.y", "body.position.y", "body.heading")
    settings = {"samples": 31, "rtol": 1e-8, "atol": 1e-10}
    made = simulate(ideal, 0.75, **settings)
    torque = RATIO * made.to_dataset()["reaction"].values @ [0.65, -0.35]
    path, size = np.stack([reading(made, name) for name in names]), np.abs(torque).max()
    errors = []
    for full in (0.02, 0.01, 0.005):
        run = simulate(driven(f"{motion}, servo: {{{loop}, full_voltage_at: {full} rad}}"), 0.75, **settings)
        given = run.to_dataset()["motor_torque"].values[:, 0]
        off = np.stack([reading(run, name) for name in names]) - path
        errors.append([np.abs(off).max() / np.abs(path).max(), np.abs(given - torque).max() / size])
    halved = np.array(errors)[:-1] / np.array(errors)[1:]
    assert np.all((halved > 1.8) & (halved < 2.2)), halved
    assert np.max(errors[-1]) < 0.01


def test_a_free_swimmer_keeps_momentum_without_drag():
    """From rest the momentum of body, fin and carried water stays 0 to 1e-8; in vacuum the angular momentum too."""
    run = simulate(driven(VOLTS, "1e-30"), 0.3, samples=13, rtol=1e-9, atol=1e-11).to_dataset()
    total = run["momentum"] + run["water_momentum"]
    assert np.abs(run["momentum"].values).max() > 1e-3
    np.testing.assert_allclose(total, 0.0, atol=1e-8 * np.abs(run["momentum"].values).max())
    assert float(run["momentum_balance"].max()) < 1e-12
    water = {"water.density": 1e-9, "limbs.fin.loads.water.normal": 1e-30}
    water |= {f"body.loads.water.{name}.{i}": 1e-30 for name in ("mass", "inertia") for i in range(3)}
    empty = simulate(with_values(driven(VOLTS, "1e-30"), water), 0.3, samples=13, rtol=1e-9, atol=1e-11).to_dataset()
    moving = empty["angular_momentum"].values
    np.testing.assert_allclose(moving, 0.0, atol=1e-8 * 2 * U * K / R * 0.3)  # of the torque's own impulse
    assert float(abs(empty["q"].sel(coordinate="fin.bending_z.angle")).max()) > 0.1


def test_the_account_of_energy_of_a_swimmer_is_closed():
    """Electrical = mechanical + heat; mechanical = kinetic, water's, elastic, and what drag and viscosity take."""
    run = simulate(driven(VOLTS), 0.4, samples=161, rtol=1e-9, atol=1e-11).to_dataset()
    assert float(run["power_balance"].max()) < 1e-12
    given = (run["motor_torque"] * run["motor_rate"]).sum("motor")
    heat, electrical = run["motor_heat"].sum("motor"), run["electrical_power"].sum("motor")
    np.testing.assert_allclose(electrical, given + heat, rtol=1e-12)
    time, taken = run["time"].values, run["load_power"].sel(load=["drag", "viscous"]).sum(["load", "part"])
    np.testing.assert_allclose(run["load_power"].sel(load="drive").sum("part"), given, rtol=1e-12)
    stored = run["energy"].sum("form").values
    assert all(run["energy"].isel(time=-1).values > 0)
    # the first tenth has the jerk of the start, which samples do not resolve
    late = slice(40, None)
    work = cumulative_simpson((given + taken).values[late], x=time[late], initial=0)
    scale = simpson(np.abs(given.values[late]), x=time[late])
    np.testing.assert_allclose(stored[late] - stored[late][0], work, atol=1e-5 * scale)


PATHS = (
    "limbs.fin.drive.bending_z.ratio",
    "limbs.fin.drive.bending_z.envelope.1",
    "limbs.fin.drive.bending_z.motor.gear_ratio",
    "limbs.fin.length",
)


def test_derivatives_are_those_of_differences(some_state):
    """Of the residual, by the shape, the gear and the length."""
    described = driven(VOLTS.replace("inertia", "gear_ratio: 1.5, inertia"))
    theta, made = bind(described, PATHS)
    x, a = some_state(build(described), 1, 0.1)
    residual = jax.jit(lambda theta: made(theta).residual(jnp.asarray(0.3), x, a))
    slopes = np.asarray(jax.jit(jax.jacfwd(residual))(theta))
    for k in range(len(PATHS)):

        def at(step, k=k):
            h = step * float(theta[k]) * np.eye(len(PATHS))[k]
            return (np.asarray(residual(theta + h)) - np.asarray(residual(theta - h))) / (2 * step * float(theta[k]))

        wanted = (4 * at(5e-4) - at(1e-3)) / 3
        assert np.abs(wanted).max() > 1e-6, PATHS[k]
        np.testing.assert_allclose(slopes[:, k], wanted, atol=1e-7 * np.abs(wanted).max(), err_msg=PATHS[k])


def test_a_copy_of_a_driven_fin_adds_no_equation():
    """Nor does a second driven strain add more than its column."""

    def count(copies):
        repeated = f"repeat: {{count: {copies}, around: x}}\n    drive: {{bending_z: {{ratio: 2, {VOLTS}}}}}"
        robot = build(swimmer(repeated))
        x = robot.initial()
        return equations(jax.make_jaxpr(lambda x, a: robot.residual(jnp.zeros(()), x, a))(x, x.v).jaxpr)

    assert count(2) == count(3) == count(8) > 100


SIDES = "offset: [0 m, 30 mm, 0 m]\n    repeat: {mirror: y}\n    drive: {bending_z: {ratio: 2, VOLTS}}"


def test_the_image_of_a_driven_fin_is_driven_as_its_image():
    described = swimmer(SIDES.replace("VOLTS", VOLTS))
    assert [described.limbs[f"fin{k}"].drive.bending_z.ratio for k in (1, 2)] == [2.0, -2.0]
    up = swimmer(SIDES.replace("VOLTS", VOLTS).replace("bending_z", "bending_y"))
    assert [up.limbs[f"fin{k}"].drive.bending_y.ratio for k in (1, 2)] == [2.0, 2.0]


@pytest.mark.slow
def test_the_image_of_a_driven_fin_moves_as_its_image():
    """Two fins on the sides, one the mirror of the other: equal voltages leave the body on its way."""
    run = simulate(swimmer(SIDES.replace("VOLTS", VOLTS)), 0.2, samples=3, rtol=1e-8, atol=1e-10)
    left, right = (np.array([reading(run, f"fin{k}.tip.position.{axis}")[-1] for axis in "xyz"]) for k in (1, 2))
    np.testing.assert_allclose(left * [1, -1, 1], right, atol=1e-9)
    assert abs(left[1] - 0.03) > 5e-3
    assert abs(reading(run, "body.position.y")[-1]) < 1e-10 < abs(reading(run, "body.position.x")[-1])


def test_copies_of_a_servo_run_ahead():
    loop = f"{SERVO}, servo: {{{MOTOR}, supply: 12 V, full_voltage_at: {FULL} rad}}"
    each = swimmer(f"repeat: {{count: 2, around: x, phase: 90 deg}}\n    drive: {{bending_z: {{ratio: 2, {loop}}}}}")
    phases = [each.limbs[f"fin{k}"].drive.bending_z.motion.phase for k in (1, 2)]
    np.testing.assert_allclose(phases, np.radians([30, 120]), rtol=1e-12)
    assert list(each.powered) == ["fin1.bending_z.angle", "fin2.bending_z.angle"]
    assert each.powered["fin2.bending_z.angle"].path == "limbs.fin2.drive.bending_z.servo"

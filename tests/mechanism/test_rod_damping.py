"""Damping of a rod's material: what it means, and the ways to give it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import check_numbers, dump_robot, parse_robot, with_values
from nectosome.description.robot_file import apply_settings
from nectosome.loads.rod_loads import relaxation_of
from nectosome.mechanism.diagnose import driving, load_names
from nectosome.model import build
from nectosome.solve import modes, simulate, static
from nectosome.units import InputError

BEAM = """
name: beam
water: {gravity: 0 m/s2}
body:
  kind: rod
  section: rectangle
  width: 20 mm
  height: 8 mm
  length: 0.3 m
  young: 3 MPa
  density: 1000 kg/m3
  damping: DAMPING
  strains: {torsion: 1, bending_y: 3}
  joint: {kind: fixed}
"""
LOSSES = "{loss_factor: 0.11, between: [1 Hz, 20 Hz]}"
WAYS = {
    "4 kPa s": 4e3,
    "{uniaxial: 12 kPa s}": 4e3,
    "{loss_factor: 0.2, frequency: 5 Hz}": 0.2 * 3e6 / (3 * 2 * np.pi * 5),
    "{loss_modulus: 0.6 MPa, frequency: 5 Hz}": 0.6e6 / (3 * 2 * np.pi * 5),
}


@pytest.mark.parametrize(("way", "shear"), WAYS.items())
def test_bending_loses_by_three_times_the_shear_viscosity(way, shear):
    """Of q = a sin(w t): loss factor = lost in a cycle / (2 pi stored) = w D / K, 3 eta w / E in bending, eta w / G in
    torsion; that of a test in bending comes back at its frequency."""
    robot = build(parse_robot(BEAM.replace("DAMPING", way)))
    rod = robot.tree.rods[0].things
    K, D = (np.diag(np.asarray(x).reshape(-1, 6, 6)[0]) for x in (rod.stiffness, rod.damping))
    w, twist = 2 * np.pi * 5, [name.startswith("torsion") for name in robot.coordinate_names]
    lost = np.where(twist, shear * w / 1e6, 3 * shear * w / 3e6)
    np.testing.assert_allclose(w * D / K, lost, rtol=1e-9)
    if "factor" in way or "modulus" in way:
        np.testing.assert_allclose((w * D / K)[~np.array(twist)], 0.2, rtol=1e-9)


def test_a_bending_mode_decays_by_its_uniaxial_viscosity():
    """Damping ratio eta_E w / (2 E) at the frequency w of each mode, the first 3.516 sqrt(E I / rho A) / L^2."""
    text = BEAM.replace("DAMPING", "{uniaxial: 9 kPa s}").replace("torsion: 1, ", "")
    swinging = modes(parse_robot(text))
    w = np.abs(swinging.eigenvalue)
    assert w[0] == pytest.approx(3.516 / 0.3**2 * np.sqrt(3e6 / 1000 / 12) * 0.008, rel=2e-3)
    np.testing.assert_allclose(swinging.damping_ratio[:2], 9e3 * w[:2] / (2 * 3e6), rtol=1e-6)


@pytest.mark.parametrize(("factor", "within"), [(0.01, 0.02), (0.11, 0.025), (0.3, 0.045)])
@pytest.mark.parametrize("band", [(0.3, 30.0), (1.0, 10.0), (3.0, 5.0)])
def test_the_loss_factor_of_branches_is_constant(factor, within, band):
    share, time = map(np.asarray, relaxation_of(*map(jnp.asarray, (factor, *band))))
    assert np.all(share > 0)
    x = 2j * np.pi * np.geomspace(*band, 50)[:, None] * time
    modulus = 1 + (x / (1 + x)) @ share
    np.testing.assert_allclose(modulus.imag / modulus.real, factor, rtol=within)


def relaxing(length: float, damping: str = LOSSES):
    text = BEAM.replace("DAMPING", damping).replace("torsion: 1, bending_y: 3", "bending_y: 1")
    return parse_robot(text.replace("length: 0.3 m", f"length: {length} m"))


@pytest.mark.parametrize("length", [0.3, 0.2])
def test_a_beam_of_constant_loss_factor_has_half_of_it_as_damping_ratio(length):
    """Of each mode s^2 + w^2 (1 + sum g s tau/(1 + s tau)) = 0, with the frequency w of the beam without losses."""
    w = np.abs(modes(relaxing(length, "0 Pa s")).eigenvalue)
    found = np.asarray(modes(relaxing(length)).eigenvalue)
    share, time = map(np.asarray, relaxation_of(*map(jnp.asarray, (0.11, 1.0, 20.0))))
    swinging = found[found.imag > 0]
    swinging = swinging[np.argsort(swinging.imag)]
    for s, own in zip(swinging, np.sort(w), strict=True):
        x = s * time
        assert abs(s**2 + own**2 * (1 + np.sum(share * x / (1 + x)))) < 1e-8 * own**2
    first = swinging[0]
    assert -first.real / abs(first) == pytest.approx(0.11 / 2, rel=0.05)


def test_a_beam_that_relaxes_hangs_as_one_without_losses_and_gains_nothing():
    """Power of the force: what the branches store, less what they turn to heat."""
    heavy = {name: static(with_values(relaxing(0.3, name), {"water.gravity": 9.81})) for name in ("0 Pa s", LOSSES)}
    first, second = (run.state.q for run in heavy.values())
    np.testing.assert_allclose(second, first, rtol=1e-8)
    robot = build(relaxing(0.3, LOSSES))
    assert not np.any(driving(robot)[load_names(robot).index("viscous")])
    load = robot.load_groups.in_rods[0].load
    load = jax.tree.map(lambda x: x[0], load)
    rng = np.random.default_rng(1)
    q, v = jnp.asarray(rng.normal(size=(2, 2)))
    z = jnp.asarray(rng.normal(size=(4, 2)))
    force, rate = load.at_state(jnp.zeros(()), q, v, z)
    K, g, tau = (np.asarray(x) for x in (load.stiffness, load.share, load.time))
    each = np.einsum("ki,ij,kj->k", q - z, K, q - z)
    stored = np.einsum("k,ki,ij,kj->", g, q - z, K, v - np.asarray(rate))
    assert float(force @ v) == pytest.approx(-stored - np.sum(g / tau * each), rel=1e-12)


def test_a_beam_let_go_from_a_shape_began_relaxed():
    """Its branches have yielded to the shape in which it starts, so that it is not stiffer at first; its account."""
    bent = apply_settings(relaxing(0.3, LOSSES), ["body.start.bending_y=2 1/m"])
    robot = build(bent)
    np.testing.assert_allclose(robot.initial().z[0][0, :, 0], robot.initial().q[0], rtol=1e-12)
    wave = "{kind: wave, amplitude: 0 1/m, frequency: 1 Hz, offset: 3 1/m}"
    led = build(apply_settings(relaxing(0.3, LOSSES), [f"body.motion.bending_y={wave}"]))
    assert float(led.initial().z[0][0, 0, 0]) == pytest.approx(3 * 0.3, rel=1e-12)
    run = simulate(bent, 0.5, samples=21).to_dataset()
    assert float(run["power_balance"].max()) < 1e-6
    assert float(run["load_power"].sel(load="viscous").sum()) < 0


def test_losses_are_written_back_and_set():
    """A group of fields comes back as given, has paths of its own, and may replace a number and be replaced by one."""
    robot = parse_robot(BEAM.replace("DAMPING", "{loss_factor: 0.2, frequency: 5 Hz}"))
    assert parse_robot(dump_robot(robot)) == robot
    double = apply_settings(robot, ["body.damping.loss_factor=0.4"])
    assert double.body.shear_viscosities[0][1] == pytest.approx(2 * robot.body.shear_viscosities[0][1])
    number = apply_settings(robot, ["body.damping=4 kPa s"])
    assert number.body.shear_viscosities[0][1] == 4e3
    assert apply_settings(number, ["body.damping={uniaxial: 9 kPa s}"]).body.shear_viscosities[0][1] == 3e3
    stiffer = apply_settings(robot, ["body.young=6 MPa"])  # the loss factor stays
    assert stiffer.body.shear_viscosities[0][1] == pytest.approx(2 * robot.body.shear_viscosities[0][1])


def test_numbers_put_in_that_make_branches_gain_are_refused():
    with pytest.raises(InputError, match=r"0\.5 over a band is more than 0\.3") as told:
        check_numbers(with_values(relaxing(0.3), {"body.damping.loss_factor": 0.5}))
    assert told.value.field == "body.damping.loss_factor"


@pytest.mark.parametrize(
    ("damping", "field", "says"),
    [
        ("{}", "damping.uniaxial", "is missing"),
        ("{uniaxial: 9 kPa s, loss_factor: 0.1}", "damping.loss_factor", "Leave one of the two out"),
        ("{loss_modulus: 2 kPa}", "damping.frequency", "is missing. Give the frequency at which the loss_modulus"),
        ("{loss_factor: 0.4}", "damping.loss_factor", "0.4 over a band is more than 0.3"),
        ("{loss_factor: 0.1, between: [5 Hz, 1 Hz]}", "damping.between", "larger than the first, 100 times"),
        ("{loss_factor: 0.1, between: [1 Hz, 200 Hz]}", "damping.between", "larger than the first, 100 times"),
        ("{loss_factor: 0.1, between: [1 Hz, 9 Hz], frequency: 2 Hz}", "damping.between", "without a frequency"),
        ("{uniaxial: 9 kPa s, frequency: 2 Hz}", "damping.frequency", "goes with"),
        ("{loss_modulus: -2 kPa, frequency: 2 Hz}", "damping.loss_modulus", "at least 0 Pa"),
        ("{uniaxal: 9 kPa s}", "damping.uniaxal", "uniaxial"),
        ("9 kPa", "damping", "Pa s"),
        ("[9 kPa s]", "damping", "a list is no quantity"),
    ],
)
def test_a_wrong_damping_is_refused(damping, field, says):
    with pytest.raises(InputError, match=says) as told:
        parse_robot(BEAM.replace("DAMPING", damping))
    assert told.value.field == f"body.{field}"

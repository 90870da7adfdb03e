"""Numbers of the flow about loads against closed forms, and warnings where a model is left."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import LoadDescription, parse_robot
from nectosome.description.ranges import NUMBERS
from nectosome.model import bind, build
from nectosome.solve import cycle_means, flow_rows, mean_data, out_of_range, simulate, steady

U, A, F, H, CHORD, MU = 0.4, 0.05, 0.8, 0.12, 0.1, 1.0016e-3  # m/s, m, Hz, m, m, Pa s
PATHS = ("limbs.plate.joint.motion.amplitude", "limbs.plate.joint.motion.frequency")
QUADRATURE = 1e-6  # of the 64 points of a beat
W = 2 * np.pi * F * A  # largest velocity across [m/s]
# a plate in a stream along x goes to and fro along y
PLATE = f"""
name: plate
water: {{density: 1000 kg/m3, gravity: 0 m/s2, current: [{U} m/s, 0 m/s, 0 m/s]}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  joint: {{kind: prismatic, axis: z, motion: {{kind: sine, amplitude: 0 m, frequency: {F} Hz}}}}
  loads: {{hull: {{kind: lumped_drag, drag_area: [0.01 m2, 0.04 m2, 0 m2]}}}}
limbs:
  plate:
    kind: rigid
    shape: box
    length: {CHORD} m
    width: 1 mm
    height: {H} m
    mass: 0.1 kg
    joint: {{kind: prismatic, axis: y, motion: {{kind: sine, amplitude: {A} m, frequency: {F} Hz}}}}
    loads:
      drag: {{kind: plate_drag, normal: 1.2}}
      skin: {{kind: skin_friction, length: 0.7 m}}
      foil: {{kind: foil, span_along: z, ahead: -x, chord: {CHORD} m, stall: 15 deg}}
      wake: {{kind: trailing_edge}}
"""


def numbers(text: str, periods: float = 2, samples: int = 17) -> dict[str, dict[str, float]]:
    """Those of each load on the plate, of a simulation of so many beats."""
    data = simulate(parse_robot(text), periods / F, samples=samples).to_dataset()
    found = data["flow_number"].sel(part="plate")
    return {
        load: dict(zip(NUMBERS, found.sel(load=load).values, strict=True)) for load in ("drag", "skin", "foil", "wake")
    }


def test_numbers_of_a_plate_that_goes_to_and_fro_in_a_stream_have_closed_forms():
    """KC = 2 pi a/h, k = omega c/2U, the largest Re by each load's own length; beyond stall where |w| > u tan alpha.

    Whatever the samples, and where the last beat begins.
    """
    found = numbers(PLATE)
    for samples in (5, 201):
        for load, values in numbers(PLATE, samples=samples).items():
            assert values == pytest.approx(found[load], rel=1e-12, nan_ok=True)
    for load, values in numbers(PLATE, periods=2.37).items():
        assert values == pytest.approx(found[load], rel=2 * QUADRATURE, abs=2 / 64, nan_ok=True)
    rho = 1000.0
    assert found["drag"]["keulegan_carpenter"] == pytest.approx(2 * np.pi * A / H, rel=QUADRATURE)
    assert found["drag"]["reynolds"] == pytest.approx(rho * W * H / MU, rel=QUADRATURE)
    assert found["skin"]["reynolds"] == pytest.approx(rho * U * 0.7 / MU, rel=1e-9)
    assert found["foil"]["reynolds"] == pytest.approx(rho * np.hypot(U, W) * CHORD / MU, rel=QUADRATURE)
    assert found["foil"]["reduced_frequency"] == pytest.approx(2 * np.pi * F * CHORD / (2 * U), rel=QUADRATURE)
    assert found["wake"]["reduced_frequency"] == pytest.approx(2 * np.pi * F * H / (2 * U), rel=QUADRATURE)
    assert found["foil"]["aspect_ratio"] == pytest.approx(H / CHORD, rel=1e-12)
    stalled = 1 - 2 / np.pi * np.arcsin(np.tan(np.deg2rad(15)) * U / W)
    assert found["foil"]["stalled"] == pytest.approx(stalled, abs=2 / 64)  # four edges of half a point each
    assert np.isnan(found["skin"]["keulegan_carpenter"]) and np.isnan(found["wake"]["reynolds"])


def test_the_numbers_of_a_cycle_are_those_of_its_run_and_differentiable():
    """d KC/d a = 2 pi/h, d k/d f = pi c/U, d Re/d f = rho 2 pi a h/mu, by the period of the cycle."""
    theta, made = bind(parse_robot(PLATE), PATHS)

    def of_cycle(theta):
        robot = made(theta)
        none = jnp.zeros((129, 0))
        times = jnp.linspace(0.0, 1.0, 129) / theta[1]
        z = jax.tree.map(lambda x: jnp.broadcast_to(x, (129, *x.shape)), robot.initial().z)
        means = cycle_means(robot, times, State(none, none, z))
        drag, foil = (names.index(name) for name in ("drag", "foil"))
        every = [*NUMBERS]
        kc, re = (means.flow_number[every.index(n), drag, 1] for n in ("keulegan_carpenter", "reynolds"))
        return jnp.stack([kc, means.flow_number[every.index("reduced_frequency"), foil, 1], re])

    names = list(mean_names())
    found, slopes = jax.jit(lambda x: (of_cycle(x), jax.jacfwd(of_cycle)(x)))(theta)
    one = numbers(PLATE)
    expected = one["drag"]["keulegan_carpenter"], one["foil"]["reduced_frequency"], one["drag"]["reynolds"]
    np.testing.assert_allclose(found, expected, rtol=QUADRATURE)
    of_reynolds = 1000 * 2 * np.pi * H / MU * np.array([F, A])
    np.testing.assert_allclose(slopes[0], [2 * np.pi / H, 0.0], rtol=QUADRATURE, atol=1e-9)
    np.testing.assert_allclose(slopes[1], [0.0, np.pi * CHORD / U], rtol=QUADRATURE, atol=1e-12)
    np.testing.assert_allclose(slopes[2], of_reynolds, rtol=1e-9)


def mean_names():
    from nectosome.mechanism import load_names

    return load_names(build(parse_robot(PLATE)))


def test_the_numbers_of_a_load_are_by_its_own_frequency_not_by_that_of_the_whole_robot():
    """A body that goes up and down a third slower makes the beat three times as long, and changes nothing across.

    With a third of the points of a beat.
    """
    slow = f"amplitude: 0 m, frequency: {F} Hz"
    other = PLATE.replace(slow, f"amplitude: 1e-9 m, frequency: {2 * F / 3} Hz")
    assert other != PLATE
    found = numbers(other, periods=6)
    assert found["drag"]["keulegan_carpenter"] == pytest.approx(2 * np.pi * A / H, rel=1e-5)
    assert found["foil"]["reduced_frequency"] == pytest.approx(np.pi * F * CHORD / U, rel=1e-5)


def test_a_foil_at_rest_has_no_end_of_its_reduced_frequency_and_what_rests_has_no_number():
    found = numbers(PLATE.replace(f"current: [{U} m/s", "current: [0 m/s"))
    assert found["foil"]["reduced_frequency"] == math.inf and found["foil"]["stalled"] == pytest.approx(1.0, abs=2 / 64)
    assert np.isnan(found["skin"]["reynolds"])
    still = numbers(
        PLATE.replace(f"current: [{U} m/s", "current: [0 m/s").replace(f"amplitude: {A} m", "amplitude: 0 m")
    )
    assert np.isnan([still["drag"][key] for key in ("reynolds", "keulegan_carpenter")]).all()


def test_what_goes_evenly_has_a_reynolds_number_alone():
    """A steady ball: the root of the largest drag area, v = sqrt(2 F/(rho A)); no period, no Keulegan-Carpenter."""
    text = """
name: ball
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: spheroid
  length: 40 mm
  radius: 20 mm
  mass: 0.1 kg
  joint: {kind: prismatic, axis: x, force: {kind: constant, value: 0.5 N}}
  loads: {drag: {kind: lumped_drag, drag_area: [1e-3 m2, 4e-3 m2, 4e-3 m2]}}
"""
    found = steady(parse_robot(text)).to_dataset()["flow_number"].sel(load="drag", part="body")
    speed = np.sqrt(2 * 0.5 / (1000 * 1e-3))
    assert float(found.sel(number="reynolds")) == pytest.approx(1000 * speed * np.sqrt(4e-3) / MU, rel=1e-8)
    assert np.isnan(found.sel(number=[n for n in NUMBERS if n != "reynolds"])).all()


# a part for each load that has ranges
EVERY = parse_robot("""
name: every
body:
  kind: rigid
  shape: cylinder
  length: 0.2 m
  radius: 10 mm
  mass: 1 kg
  loads:
    drag: {kind: drag, normal: 1}
    lump: {kind: lumped_drag, drag_area: [1 cm2, 1 cm2, 1 cm2]}
    slow: {kind: stokes_drag, coefficients: gray_hancock, wavelength: 0.2 m}
limbs:
  plate:
    kind: rigid
    shape: box
    length: 0.1 m
    width: 1 mm
    height: 0.1 m
    mass: 0.1 kg
    loads:
      cross: {kind: plate_drag, normal: 1, start_up: none}
      starts: {kind: plate_drag, normal: 1, start_up: {}}
      skin: {kind: skin_friction}
      fin: {kind: foil, span_along: z, ahead: x, chord: 0.1 m}
      wake: {kind: trailing_edge}
  bar: {kind: rigid, shape: cylinder, length: 0.1 m, radius: 1 mm, mass: 1 g, repeat: {count: 3, around: x}}
webs:
  bell: {between: bar, thickness: 1 mm, young: 1 kPa, density: 1 g/cm3, loads: {jet: {kind: bell_jet}}}
""")
LOADS = {name: (part, load) for part, limb in EVERY.carriers.items() for name, load in limb.loads.items()}
ENDS = [
    pytest.param(name, one.number, end, way, id=f"{load.kind}-{one.number}-{end:g}")
    for name, (_, load) in LOADS.items()
    for one in load.own_ranges
    for end, way in ((one.low, -1), (one.high, 1))
    if 0 < end < math.inf
]


def arrays(**given: float) -> dict[str, np.ndarray]:
    """Of a run in which every load gives as much power, and has no number but those given, as `fin_stalled`."""
    parts = ["body", "plate", "bell"]
    values = np.full((len(NUMBERS), len(LOADS), len(parts)), np.nan)
    for key, value in given.items():
        load, _, number = key.partition("_")
        values[[*NUMBERS].index(number), [*LOADS].index(load), parts.index(LOADS[load][0])] = value
    of_loads = {
        "load_power": np.full((len(LOADS), len(parts)), -1.0),
        "load_force": np.zeros((len(LOADS), len(parts), 3)),
    }
    return {"load": np.array([*LOADS]), "part": np.array(parts), "flow_number": values, **of_loads}


def test_every_load_with_ranges_is_there():
    def below(kind: type) -> set[type]:
        return {kind}.union(*map(below, kind.__subclasses__()))

    assert {kind for kind in below(LoadDescription) if kind.ranges} == {type(load) for _, load in LOADS.values()}
    every = {one for _, load in LOADS.values() for one in type(load).ranges}
    assert every == {one for _, load in LOADS.values() for one in load.own_ranges}


@pytest.mark.parametrize(("name", "number", "end", "way"), ENDS)
def test_a_warning_comes_at_the_end_of_a_range_and_not_within(name, number, end, way):
    within, beyond = (arrays(**{f"{name}_{number}": end * 1.02 ** (side * way)}) for side in (-1, 1))
    assert out_of_range(within, EVERY) == []
    (said,) = out_of_range(beyond, EVERY)
    assert said.startswith(f"{name} on {LOADS[name][0]}: the {NUMBERS[number]} is ") and "made for" in said


def test_what_has_hardly_any_power_and_force_is_not_warned_of():
    """In a current what stays has no power."""
    found = arrays(drag_reynolds=20.0, lump_reynolds=20.0)
    found["load_power"][0, 0] = -0.009
    found["load_force"][:2, 0, 0] = 0.009, 1.0
    (said,) = out_of_range(found, EVERY)
    assert said == (
        "lump on body: the Reynolds number is 20, its model is made for at least 100: the coefficient of a slower flow "
        "is larger, and not constant; below 0.1 a rod or a cylinder takes stokes_drag"
    )
    found["load_force"][0, 0, 0] = 0.011
    assert len(out_of_range(found, EVERY)) == 2


def test_an_infinite_reduced_frequency_is_told_as_such():
    (said,) = out_of_range(arrays(fin_reduced_frequency=math.inf), EVERY)
    assert "the reduced frequency is infinite, its model is made for up to 2: " in said


def test_loads_of_one_name_are_told_together_where_there_are_many():
    """Fourteen fins alike: one row with the largest number, one warning with the one farthest out."""
    fin = """
  fin{k}: {{kind: rigid, shape: box, length: 0.1 m, width: 1 mm, height: 0.1 m, mass: 0.1 kg,
    loads: {{drag: {{kind: plate_drag, normal: 1}}}}}}"""
    body = "name: many\nbody: {kind: rigid, shape: point, mass: 1 kg}\nlimbs:"
    many = parse_robot(body + "".join(fin.format(k=k) for k in range(14)))
    parts = [*many.parts]
    values = np.full((len(NUMBERS), 1, len(parts)), np.nan)
    values[0, 0, 1:] = 10.0 + np.arange(14)
    found = {"load": np.array(["drag"]), "part": np.array(parts), "flow_number": values}
    found |= {"load_power": np.ones((1, len(parts))), "load_force": np.zeros((1, len(parts), 3))}
    (row,) = flow_rows(found, many)
    assert (row.name, row.where, row.length, row.numbers["reynolds"]) == ("drag", "14 parts", "height", 23.0)
    (said,) = out_of_range(found, many)
    assert said.startswith("drag on fin0 and 13 other parts: the Reynolds number is 10, ")
    values[0, 0, 1:] = 10.0 * (1 - 1e-12 * np.arange(14))  # alike but for rounding: the first one, whatever that is
    assert out_of_range(found, many)[0].startswith("drag on fin0 and 13 other parts: the Reynolds number is 10, ")


def test_a_robot_without_such_loads_has_no_numbers():
    text = PLATE[: PLATE.index("    loads:\n")].replace("  loads: {hull", "  about: {hull")
    text = "\n".join(line for line in text.splitlines() if "about" not in line)
    robot = build(parse_robot(text))
    data = simulate(robot, 1 / F).to_dataset()
    assert not {"flow_number", "number"} & set(data.variables)
    none = jnp.zeros((17, 0))
    means = jax.jit(cycle_means)(robot, np.linspace(0.0, 1 / F, 17), State(none, none, robot.initial().z))
    assert "flow_number" not in mean_data(robot, means)[0]

"""What every controller promises; a new controller without an example here fails."""

import importlib
import inspect
import pkgutil

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome import controllers as ct
from nectosome.controllers import ActuatorLimits, Controller
from nectosome.units import InputError

from .simple_loops import DT, UNLIMITED, actuator, around, commands, model, of

COUNT, LONGER = 60, 110
REFERENCE = ct.eased(ct.wave("sine", 5.0, DT, amplitude=0.8, frequency=1.5), 0.3, DT)[:COUNT] + 0.1
STEP = np.where(np.arange(200) < 20, 0.0, 0.6)


def reach(u):
    return ActuatorLimits(*of(-1.5 * u, 1.6 * u, 20.0 * u))


def pid(u, y, within=None):
    return ct.pid_of(np.array([0.3, 5.0, 0.005]) * u / y, 0.03, within or reach(u))


def learned(u, y, count, within=None):
    feed = 0.5 * u * np.sin(0.1 * np.arange(count)) * (np.arange(count) < COUNT)
    return ct.Learned(pid(u, y, within), jnp.asarray(feed))


def scheduled(u, y, count, within=None):
    gains = jnp.array([[0.2, 4.0, 0.002], [0.4, 6.0, 0.005], [0.3, 8.0, 0.001]]) * u / y
    return ct.GainSchedule(*of([0.5, 2.0, 5.0]), gains, *of(0.03), within or reach(u))


EXAMPLES = {
    "BeatAveraged": lambda u, y, count, within=None: ct.BeatAveraged(pid(u, y, within), 0.21 / DT),
    "PID": lambda u, y, count, within=None: pid(u, y, within),
    "GainSchedule": scheduled,
    "Feedforward": lambda u, y, count, within=None: ct.Feedforward(pid(u, y, within), model(u, y), 0.08),
    "FunctionController": lambda u, y, count, within=None: ct.FunctionController(
        lambda t, r, m: (20.0 * (r - m) / y + jnp.sin(t)) * u
    ),
    "Learned": learned,
    "Learner": lambda u, y, count, within=None: ct.Learner(
        ct.Feedforward(pid(u, y, within), model(u, y), 0.08), 0.1, 0.5
    ),
    "LimitedController": lambda u, y, count, within=None: ct.LimitedController(
        pid(u, y, reach(2 * u)), within or reach(u)
    ),
    "Predictive": lambda u, y, count, within=None: ct.Predictive(
        model(u, y), within or reach(u), 20, 0.1, 0.01 * y, 0.01 * y, 0.08
    ),
    "Relay": lambda u, y, count, within=None: ct.Relay(*of(1.2 * u, 0.05 * y)),
    "VariableGainPI": lambda u, y, count, within=None: ct.VariableGainPI(
        *of(0.1 * u / y, 4.0 * u / y, 2.0, 0.5 * y), within or reach(u)
    ),
}


every = pytest.mark.parametrize("name", EXAMPLES)
FREE = "FunctionController", "Relay"  # of any number, or of two commands only
limited = pytest.mark.parametrize("name", [one for one in EXAMPLES if one not in FREE])
smooth = pytest.mark.parametrize("name", [one for one in EXAMPLES if one not in ("Predictive", *FREE)])


def example(name, u=1.0, y=1.0, count=COUNT, within=None) -> Controller:
    return EXAMPLES[name](u, y, count, within)


def disturbed(size=0.7):
    """Measurements that nothing predicts, at times far from the reference."""
    return np.random.default_rng(3).normal(scale=size, size=LONGER)


def test_each_controller_has_an_example():
    for module in pkgutil.iter_modules(ct.__path__):
        importlib.import_module(f"nectosome.controllers.{module.name}")
    kinds, found = [Controller], set()
    while kinds:
        more = [kind for kind in kinds.pop().__subclasses__() if kind.__module__.startswith("nectosome.")]
        kinds += more
        found |= {kind.__name__ for kind in more if not inspect.isabstract(kind)}
    assert {name for name in found if not name.startswith("_")} == set(EXAMPLES)


@every
def test_no_command_depends_on_later_measurements_and_it_may_stop_and_go_on(name):
    """Stepped one sample at a time, as on a rig, it gives what it gives in a scan, up to where measurements differ."""
    regulator, y = example(name).planned(REFERENCE, DT), disturbed()
    step, state, found = eqx.filter_jit(regulator.step), regulator.initial(0.0, 0.0), []
    for x in y[:30]:
        state, command = step(state, jnp.asarray(x))
        found.append(float(command))
    np.testing.assert_allclose(found, commands(regulator, y)[:30], rtol=1e-9, atol=1e-9)
    other = np.concatenate([y[:30], -y[30:]])
    both = [np.asarray(commands(regulator, one)) for one in (y, other)]
    np.testing.assert_array_equal(both[0][:30], both[1][:30])
    assert not np.array_equal(both[0][30:], both[1][30:])


@limited
@pytest.mark.parametrize("size", [0.1, 5.0])
def test_commands_stay_within_reach(name, size):
    u = np.asarray(commands(example(name).planned(REFERENCE, DT), disturbed(size)))
    within = reach(1.0)
    assert np.all((u >= within.low - 1e-9) & (u <= within.high + 1e-9))
    assert np.abs(np.diff(u, prepend=0.0)).max() <= float(within.slew) * DT * (1 + 1e-9)
    if size > 1:
        assert np.ptp(u) > 1.0  # the limits were met


@limited
def test_it_takes_over_a_held_command_without_a_bump(name):
    """The output is where it should be and stays there: so does the command."""
    still = np.full(LONGER, 0.4)
    controller = example(name) if name != "Learned" else ct.Learned(pid(1.0, 1.0), jnp.full(COUNT, 0.3))
    found = commands(controller.planned(still[:COUNT], DT), still, 0.55, 0.4)
    np.testing.assert_allclose(found, 0.55, rtol=1e-9)


@every
def test_the_last_value_of_the_reference_is_held_after_its_end(name):
    """Sample by sample as along a reference that was made longer; it ends while it moves."""
    longer = np.pad(REFERENCE, (0, LONGER - COUNT), mode="edge")
    if name == "Learned":
        feed = jnp.pad(example(name).feedforward, (0, LONGER - COUNT), mode="edge")
        held = ct.Learned(pid(1.0, 1.0), feed).planned(longer, DT)
    else:
        held = example(name).planned(longer, DT)
    found = commands(example(name).planned(REFERENCE, DT), disturbed(0.1))
    np.testing.assert_allclose(found, commands(held, disturbed(0.1)), rtol=1e-9, atol=1e-9)


@smooth
def test_slopes_by_its_numbers_are_those_of_differences(name):
    """Of the outputs of a loop, by all numbers of the controller at once."""
    loop, controller = around(actuator(), substeps=1), example(name)
    weights = np.random.default_rng(4).normal(size=COUNT)

    @eqx.filter_jit
    def outcome(controller):
        return jnp.sum(weights * loop.run(controller, REFERENCE).output)

    way = np.random.default_rng(5)
    ways = jax.tree.map(lambda x: x * way.uniform(0.5, 1.5, jnp.shape(x)), controller)
    slope = float(jax.jvp(outcome, (controller,), (ways,))[1])
    h = 1e-6
    ends = [float(outcome(jax.tree.map(lambda x, w, s=s: x + s * h * w, controller, ways))) for s in (1, -1)]
    assert np.isfinite(slope)
    assert abs(slope) > 1e-3
    assert slope == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-5)


@limited
def test_it_brings_an_actuator_to_a_step(name):
    """Its hysteresis, delay and second order: to within 1 % after 1.6 s; what was learned for another one, too."""
    track = around(actuator(), substeps=1).run(example(name, count=len(STEP)), STEP)
    assert np.abs(np.asarray(track.output)[-20:] - 0.6).max() < 0.006


@every
@pytest.mark.parametrize(("u", "y"), [(1e5, 1e-3), (1e-5, 1e3)], ids=["bar and m to Pa and mm", "Pa to bar, m to mm"])
def test_units_do_not_matter(name, u, y):
    plain = commands(example(name).planned(REFERENCE, DT), disturbed())
    scaled = commands(example(name, u, y).planned(y * REFERENCE, DT), y * disturbed())
    np.testing.assert_allclose(np.asarray(scaled) / u, plain, rtol=1e-6, atol=1e-6)


@limited
def test_without_limits_it_is_as_with_limits_that_are_not_met(name):
    wide = ActuatorLimits(*of(-50.0, 50.0, 1e4))
    found = commands(example(name, within=wide).planned(REFERENCE, DT), np.full(LONGER, 0.1))
    assert np.ptp(found) > 0.5
    if name == "Predictive":
        with pytest.raises(InputError, match="low and high, are needed"):
            example(name, within=UNLIMITED).planned(REFERENCE, DT)
        free = example(name, within=ActuatorLimits(*of(-50.0, 50.0, np.inf)))
    else:
        free = example(name, within=UNLIMITED)
    np.testing.assert_allclose(commands(free.planned(REFERENCE, DT), np.full(LONGER, 0.1)), found, rtol=1e-9)

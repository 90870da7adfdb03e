"""A bench: rehearsals on the model of the fishtail of the paper, and experiments on a simulated rig of it."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.controllers import PIDGains, eased, wave
from nectosome.drives import Chain, respond
from nectosome.identification.hysteresis.files import HysteresisFit, saved_model
from nectosome.identification.hysteresis.fit import Identified, fit_hysteresis
from nectosome.identification.hysteresis.trials import PressureTrial
from nectosome.rigs import Bench, SimulatedRig, actuator_bench
from nectosome.rigs.actuator_bench import actuator_loop
from nectosome.units import InputError
from nectosome_studies.fishtail import plant
from nectosome_studies.fishtail.plant import NOISE, recorded

from .faulty import simulated
from .tail import BAR, COMMAND, DT, GAINS, LIMITS, MEASURED, MM, tail

SHORT = eased(wave("sine", 7.5, DT, amplitude=8 * MM, frequency=0.4), 2.5, DT)


def rig(model: Identified) -> SimulatedRig:
    loop = actuator_loop(model, COMMAND, MEASURED, DT)
    return SimulatedRig(loop.plant, loop.sensor, dt=DT / loop.substeps)


def bench(controller=None, gains=GAINS, reference=SHORT) -> Bench:
    return actuator_bench(rig(tail()), LIMITS, DT, reference, controller, gains, tail())


def test_a_bench_runs_and_scores_an_experiment(tmp_path):
    one = bench()
    (rehearsed,) = one.rehearse()
    (run,) = one.runs([tmp_path / "run.nc"])
    assert run.status == "finished"
    errors = one.errors(run)
    assert errors["true"][0] < 0.2 < errors["measured"][0] < 0.5
    assert run.data.sizes["time"] == rehearsed.sizes["time"] == len(SHORT)


@pytest.mark.parametrize(("controller", "most"), [("pid", 15.0), ("ff-pid", 1.0)])
def test_gains_are_found_by_a_relay_experiment_on_the_model(controller, most, tmp_path):
    """Stable at small and large commands; alone they lag behind a sine of 0.4 Hz, beside the inverse they do not."""
    one = bench(controller, None)
    one.rehearse()
    (run,) = one.runs([tmp_path / "run.nc"])
    assert run.status == "finished"
    assert one.errors(run)["true"][0] < most


def test_gains_by_frequency_are_found_along_sines(tmp_path):
    """From the lowest to the highest frequency of a chirp's half periods; of a sine that of its own."""
    law = (
        bench("scheduled", None, wave("chirp", 7.5, DT, amplitude=4 * MM, frequency=0.2, to=0.8))
        .loops["pressure"]
        .controller
    )
    low, _, high = np.asarray(law.frequencies)
    assert 0.2 <= low < 0.3 and 0.6 < high <= 0.8
    one = bench("scheduled", None, wave("sine", 7.5, DT, amplitude=8 * MM, frequency=0.4))
    np.testing.assert_allclose(one.loops["pressure"].controller.frequencies, [0.4], rtol=0.01)
    one.rehearse()
    (run,) = one.runs([tmp_path / "run.nc"])
    assert run.status == "finished"


def test_learning_goes_on_from_run_to_run(tmp_path):
    """On a tail with a gain a fifth higher than that of the model."""
    one = bench("ilc")
    loop = actuator_loop(tail(), COMMAND, MEASURED, DT)
    *before, dynamics = loop.plant.blocks
    higher = eqx.tree_at(lambda block: block.numerator, dynamics, 1.2 * dynamics.numerator)
    other = replace(one, rig=SimulatedRig(Chain((*before, higher)), loop.sensor, dt=DT / loop.substeps))
    first, *_, last = (other.errors(run)["true"][0] for run in other.runs([tmp_path / f"{k}.nc" for k in range(4)]))
    assert last < 0.3 * first


@pytest.mark.slow
def test_a_bench_of_an_identified_actuator_uses_its_inverse(tmp_path):
    """Another actuator, half as stiff: identified, saved, and controlled by its own inverse."""
    trials = []
    for f in (0.5, 1.0):
        one = recorded(f, limit=False)
        trials.append(PressureTrial(one.name, one.dt, one.pressure, 2 * one.displacement))
    found = fit_hysteresis(trials)
    read = saved_model(HysteresisFit(found, tuple(trials)).to_dataset())
    np.testing.assert_array_equal(read.slopes, found.slopes)
    own = actuator_bench(rig(read), LIMITS, DT, SHORT, "mpc", GAINS, read)
    (run,) = own.runs([tmp_path / "run.nc"])
    assert own.errors(run)["true"][0] < 0.5
    with pytest.raises(InputError, match=r"this is not a model that .* wrote: it has no value"):
        saved_model(run.data)


@pytest.mark.parametrize(
    ("controller", "gains", "reference", "why"),
    [
        ("pid", (0.05, 5.0, 0.001), SHORT, "is unstable for commands of 6 kPa"),
        ("ff-pid", (0.00523, 0.866, 0.00489), 5 * SHORT, "possible up to an amplitude of"),
        ("mpc", (0.00523, 0.866, 0.00489), wave("sine", 2.0, DT, amplitude=10 * MM, frequency=3.0), "it needs"),
        ("pid", (0.0, 0.01, 0.0), SHORT, "on the model it would end"),
    ],
)
def test_what_cannot_work_does_not_begin(controller, gains, reference, why):
    with pytest.raises(InputError, match=why):
        bench(controller, PIDGains(np.array([gains]) * BAR / MM), reference).rehearse()


def test_without_a_model_gains_are_needed_and_nothing_is_rehearsed(tmp_path):
    gains = PIDGains(np.array([[2.8e6, 8.4e7, 0.0]]))
    assert actuator_bench(simulated(), LIMITS, 0.01, 100 * SHORT, gains=gains).rehearse() == []
    free = actuator_bench(simulated(), LIMITS, 0.01, SHORT[:100], gains=gains)
    (run,) = free.runs([tmp_path / "run.nc"])
    assert run.status == "finished"
    with pytest.raises(InputError, match="gains: without a model"):
        actuator_bench(simulated(), LIMITS, 0.01, SHORT)
    with pytest.raises(InputError, match="model: mpc needs a model"):
        actuator_bench(simulated(), LIMITS, 0.01, SHORT, "mpc", GAINS)


def test_a_model_of_other_units_is_refused():
    servo = simulated()
    servo.commands, servo.measurements = {"pressure": "rad"}, {"displacement": "rad"}
    with pytest.raises(InputError, match="from Pa to m; the rig takes rad and measures rad"):
        actuator_bench(servo, LIMITS, DT, SHORT, model=tail())


def test_the_model_of_a_rig_has_its_delay_its_limits_and_its_sensor():
    """Its command acts a sample later; a fitted slew limit below that of the rig counts."""
    slow = tail()._replace(theta=tail().theta | {"slew": 1e5})
    loop = actuator_loop(slow, COMMAND, MEASURED, DT)
    delay, within, slew, *_ = loop.plant.blocks
    assert (float(delay.delay), float(within.high), float(slew.rate)) == (DT, plant.LARGEST, 1e5)
    assert float(loop.sensor.noise) == NOISE
    assert float(actuator_loop(tail()._replace(noise=0.0), COMMAND, MEASURED, DT).sensor.noise) == pytest.approx(5e-6)
    assert jnp.isclose(loop.sensor.low, -25 * MM)


@pytest.mark.parametrize(
    "dead_time", [0.0, 13.5e-3, *(pytest.param(x, marks=pytest.mark.slow) for x in (1e-3, DT, 0.1))]
)
def test_a_dead_time_that_was_fitted_is_the_whole_delay_of_the_rig(dead_time):
    """No sample is added to it; a predictive controller takes the nearest whole samples."""
    late = tail()._replace(theta=tail().theta | {"dead_time": dead_time})
    loop = actuator_loop(late, COMMAND, MEASURED, DT)
    assert float(loop.plant.blocks[0].delay) == dead_time
    step = respond(loop.plant, np.full(200, 1e4), DT / loop.substeps)
    still = np.flatnonzero(np.abs(step) > 1e-9)[0]
    assert np.isfinite(step).all() and still == round(dead_time / DT * loop.substeps) + 1  # a slew limit acts within
    for controller in ("ff-pid", "mpc"):
        known = actuator_bench(rig(late), LIMITS, DT, SHORT, controller, GAINS.times(0.02), late)
        law = known.loops["pressure"].controller
        assert controller == "mpc" or float(law.model.delay) == dead_time
    assert float(law.model.delay) == pytest.approx(np.round(dead_time / DT) * DT)


def test_a_feedforward_knows_the_dead_time_of_its_model(tmp_path):
    """On a tail that is late by 2.7 samples, hardly with a PID: a sample makes 0.44 % of the range (rms)."""
    late = [tail()._replace(theta=tail().theta | {"dead_time": k * DT}) for k in (2.7, 3.7)]
    found = []
    for model in (*late, tail()):
        one = actuator_bench(rig(late[0]), LIMITS, DT, SHORT, "ff-pid", GAINS.times(0.02), model)
        (run,) = one.runs([tmp_path / f"{len(found)}.nc"])
        found.append(one.errors(run)["true"][0])
    assert found[0] < 0.3 and min(found[1:]) > 3 * found[0]

"""A controller on a robot in one call: what it takes, what it gives back, and where it is cancelled."""

from itertools import pairwise

import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.controllers import ActuatorLimits, Controller, FunctionController, control, eased, pid_of, wave
from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.units import InputError

ROBOT = parse_robot(SLIDE)
DT = 0.05
COMMON = {"command": "push=-2..2N", "measure": "body.position"}


def test_gains_are_found_detuned_and_tracked_in_one_call():
    result = control(ROBOT, **COMMON, reference="10cm", time="8s")
    assert result.status == Status.SOLVED
    assert result.law is not None and result.law.gains.experiment is not None
    assert result.record.output[-1] == pytest.approx(0.1, abs=2e-3)
    assert result.missed() == ""
    data = result.to_dataset()
    assert data.sizes["sample"] == 161 and data.attrs["measured"] == "body.position"
    assert '"command": "push=-2..2N"' in data.attrs["provenance"]


def test_text_and_numbers_a_description_and_a_built_robot_are_the_same():
    given = {"gains": "20,30,10", "rate": "10Hz", "delay": "100ms", "reference": "0.1m", "time": "2s"}
    si = {"gains": (20, 30, 10), "rate": 10.0, "delay": 0.1, "reference": 0.1, "time": 2.0}
    runs = [
        control(ROBOT, **COMMON, **given).record,
        control(build(ROBOT), **COMMON, **si).record,
        control(ROBOT, **COMMON, **(si | {"reference": np.full(21, 0.1), "time": None})).record,
    ]
    for run in runs[1:]:
        np.testing.assert_array_equal(run.output, runs[0].output)
    heavy = control(ROBOT, settings="m=4kg", **COMMON, **given).record
    assert np.abs(heavy.output - runs[0].output).max() > 1e-3


def test_a_run_that_is_cancelled_while_gains_are_found_has_no_samples():
    result = control(ROBOT, **COMMON, reference="10cm", progress=lambda what, share: False)
    assert result.law is None and result.status == Status.CANCELLED
    assert result.record.time.size == 0 and result.missed() == ""
    with pytest.raises(InputError, match="nothing to save"):
        result.to_dataset()


ALONG = eased(wave("sine", 7.5, DT, amplitude=0.05, frequency=0.4), 2.0, DT)
"""It begins and ends at rest, within what a push of 2 N can do."""


def along(controller, **options):
    return control(ROBOT, **COMMON, reference=ALONG, gains=(20, 30, 10), controller=controller, **options)


@pytest.mark.parametrize("controller", ["ff-pid", "mpc"])
def test_what_knows_a_linear_robot_tracks_ten_times_better_than_a_pid(controller):
    """A mass on a spring and a damper is linear, so that nothing is left but sampling and smoothing."""
    known = along(controller)
    assert known.status == Status.SOLVED
    assert known.law is not None and known.law.model is not None and known.law.model.explained > 0.999999
    assert known.errors[0] < 0.1 * along("pid").errors[0]


def test_learning_reduces_the_error_of_each_round():
    """Of a measurement with noise, other in each round; the record is that of the last."""
    result = along("ilc", rounds=4, noise=1e-5)
    assert len(result.errors) == 4 and result.law is not None
    assert all(later < before for before, later in pairwise(result.errors))
    run = result.record
    assert result.errors[-1] == pytest.approx(np.sqrt(np.mean((run.output - ALONG) ** 2)), rel=1e-12)


def test_gains_by_frequency_are_found_along_sines_and_given_back():
    """Along a chirp, from its lowest to its highest frequency; given as text they do the same to 0.2 %, as written."""
    chirp = {"reference": "chirp", "amplitude": "2 cm", "frequency": "0.2 Hz", "to": "0.6 Hz", "time": "8 s"}
    found = control(ROBOT, **COMMON, **chirp, controller="scheduled")
    assert found.law is not None
    frequencies, rows = found.law.gains.gains.table
    assert len(frequencies) == len(rows) == 3 and 0.2 <= frequencies[0] < frequencies[2] < 0.65
    text = found.task.gains_text(found.law.gains)
    again = control(ROBOT, **COMMON, **chirp, controller="scheduled", gains=text)
    np.testing.assert_allclose(again.record.output, found.record.output, atol=2e-3 * 0.02)


@pytest.mark.parametrize("controller", ["ff-pid", "ilc", "mpc"])
def test_a_constant_reference_is_reached_by_what_knows_the_robot(controller):
    result = control(ROBOT, **COMMON, reference="10cm", time="8s", controller=controller, gains="0.8,0.5,0.1")
    assert result.status == Status.SOLVED and result.missed() == ""
    assert result.record.output[-1] == pytest.approx(0.1, abs=2e-3)
    assert (result.record.reference == 0.1).all()


def test_a_function_and_a_controller_of_ones_own_are_limited_to_the_range_of_the_command():
    """u = 20 e, as the PID of that gain, saturated at 2 N."""
    common = {**COMMON, "reference": "30cm", "time": "2s"}
    function = control(ROBOT, **common, controller=lambda t, r, y: 20.0 * (r - y))
    own = control(ROBOT, **common, controller=pid_of([20.0, 0.0, 0.0], 0.0, ActuatorLimits(-9.0, 9.0)))
    assert function.law is not None and function.law.gains is None and "gains" not in function.settings
    error = 0.3 - function.record.measured
    np.testing.assert_allclose(function.record.command, np.clip(20.0 * error, -2.0, 2.0), atol=1e-12)
    np.testing.assert_allclose(own.record.command, function.record.command, atol=1e-12)


def test_a_controller_with_a_name_is_known_by_it():
    class Steady(Controller):
        name = "steady"

        @classmethod
        def from_loop(cls, loop):
            return FunctionController(lambda t, r, y: loop.gains.row[0] * r)

        def planned(self, reference, dt):
            raise NotImplementedError

    run = control(ROBOT, **COMMON, reference="10cm", time="1s", gains=(0.05, 1, 0), controller="steady").record
    np.testing.assert_allclose(run.command, 0.5)
    Steady.name = ""  # so that it is none for the tests to come


@pytest.mark.parametrize(("controller", "message"), [
    (lambda t, r: r, "is no function of time, reference and measurement that JAX can trace"),
    (lambda t, r, y: 1.0 if r > y else -1.0, "is no function of time, reference and measurement that JAX can trace"),
    (lambda t, r, y: (r, y), "it returns"),
    (FunctionController, "is the class FunctionController: make one"),
    (3.0, "is a float. A name (pid, scheduled, ff-pid, ilc, mpc"),
])  # fmt: skip
def test_what_is_no_controller_gets_a_sentence(controller, message):
    with pytest.raises(InputError) as told:
        control(ROBOT, **COMMON, reference="10cm", controller=controller)
    assert told.value.field == "controller" and message in told.value.message


@pytest.mark.parametrize(("changed", "field"), [
    ({"gains": "1,2,0", "controller": lambda t, r, y: r}, "gains"),
    ({"reference": "10deg"}, "reference"),
    ({"reference": "sine"}, "amplitude"),
    ({"gains": "1,-2,0"}, "gains"),
    ({"gains": "1Hz: 1,2,0"}, "gains"),
    ({"gains": "1,2,0", "controller": "scheduled"}, "gains"),
    ({"controller": "scheduled"}, "controller"),
    ({"controller": "mpcc"}, "controller"),
    ({"rounds": 3}, "rounds"),
    ({"controller": "ilc", "rounds": 0}, "rounds"),
    ({"rate": "5s"}, "rate"),
    ({"rate": 1e6}, "rate"),
    ({"time": -1.0}, "time"),
    ({"noise": "-1mm"}, "noise"),
    ({"delay": "1mm"}, "delay"),
    ({"measure": "depht"}, "measure"),
    ({"command": "pull=-1..1N"}, "command"),
    ({"mean": True}, "mean"),
])  # fmt: skip
def test_an_error_names_the_argument(changed, field):
    with pytest.raises(InputError) as told:
        control(ROBOT, **({**COMMON, "reference": "10cm"} | changed))
    assert told.value.field == field

"""Controllers side by side: what each gives alone, with gains and a model found once; refused, poor, cancelled."""

import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.controllers import compare, control, eased, linear_model, robot_control, wave
from nectosome.description import parse_robot
from nectosome.io import load_dataset, save_dataset
from nectosome.units import InputError

ROBOT = parse_robot(SLIDE)
DT = 0.05
COMMON = {"command": "push=-2..2N", "measure": "body.position"}
ALONG = COMMON | {"reference": eased(wave("sine", 5.0, DT, amplitude=0.05, frequency=0.4), 2.0, DT)}
GIVEN = ALONG | {"gains": (100, 80, 10)}
STEP = COMMON | {"reference": "10cm", "time": "4s"}


def test_controllers_of_ones_own_stand_beside_those_with_names():
    """u = 20 e beside a PID without its other gains, and one that does nothing, which is poor."""
    each = {"own": lambda t, r, y: 20.0 * (r - y), "idle": lambda t, r, y: 0.0 * r, "pid": "pid"}
    own, idle, pid = compare(ROBOT, controllers=each, **(ALONG | {"gains": (20, 0, 0)})).scores
    assert own.rms_error == pytest.approx(pid.rms_error, rel=1e-9)
    assert idle.outcome == "poor" and "Larger --gains, or ff-pid, mpc or ilc, may do better" in idle.cause
    assert (idle.effort, idle.change, idle.at_limits) == (0.0, 0.0, 0.0)


def test_one_that_is_refused_says_why_and_the_others_stand(monkeypatch):
    """A share that rounds to the needed one has the digits that tell them apart. It is computed once."""
    real, runs = linear_model.fit_linear, []

    def rough(*args):
        runs.append(args)
        return real(*args)._replace(explained=0.79996)

    monkeypatch.setattr(linear_model, "fit_linear", rough)
    pid, *others = compare(ROBOT, controllers=("pid", "ff-pid", "mpc"), **GIVEN).scores
    assert pid.outcome == "tracks" and len(runs) == 1
    for one in others:
        assert one.outcome == "refused" and one.result is None and np.isnan(one.rms_error)
        assert one.cause.startswith("a linear model explains 79.996 % of what push does to body.position; 80 % are")
        assert "a smaller range of --command or another --rate" in one.cause


@pytest.mark.parametrize(("names", "along", "gains"), [("pid,ff-pid", ALONG, 1), ("ff-pid,mpc", GIVEN, 0)])
def test_gains_and_the_model_are_found_once_for_all(monkeypatch, names, along, gains):
    found = {"find_gains": 0, "robot_model": 0}
    for name in found:
        real = getattr(robot_control, name)

        def counted(*args, real=real, name=name, **options):
            found[name] += 1
            return real(*args, **options)

        monkeypatch.setattr(robot_control, name, counted)
    compared = compare(ROBOT, controllers=names.split(","), **along)
    assert {score.outcome for score in compared.scores} == {"tracks"}
    assert found == {"find_gains": gains, "robot_model": 1}


def test_a_comparison_is_written_and_read_with_a_controller_dimension(tmp_path):
    """A constant reference has no frequency for `scheduled`, whose rows are NaN; a table has a column for each."""
    compared = compare(ROBOT, controllers="pid,scheduled", **STEP)
    save_dataset(compared, tmp_path / "both.nc")
    data = load_dataset(tmp_path / "both.nc")
    assert data["controller"].values.tolist() == ["pid", "scheduled"]
    assert data["outcome"].values.tolist() == ["tracks", "refused"]
    assert "has no frequency" in str(data["cause"].values[1])
    np.testing.assert_array_equal(data["output"].sel(controller="pid"), compared.scores[0].result.record.output)
    assert np.isnan(data["command"].sel(controller="scheduled")).all()
    assert (data["reference"] == 0.1).all() and data["reference"].dims == ("sample",)
    assert '"controller": "pid,scheduled"' in data.attrs["provenance"]
    save_dataset(compared, tmp_path / "both.csv")
    head = (tmp_path / "both.csv").read_text().splitlines()[0]
    assert head == "sample (s),reference (m),output pid (m),measured pid (m),command pid (N)"


def test_progress_names_the_controller_and_cancels_all():
    told = []

    def go_on(what, share):
        told.append((what, share))
        return not what.startswith("scheduled, simulating")

    chirp = {"reference": "sine", "amplitude": "5cm", "frequency": "0.4Hz"}
    compared = compare(ROBOT, controllers="pid,scheduled,mpc", progress=go_on, **COMMON, **chirp)
    assert compared.cancelled == "scheduled"
    assert [score.name for score in compared.scores] == ["pid"]
    assert {what.partition(",")[0] for what, _ in told} == {"pid", "scheduled"}
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[-1] < 2 / 3


@pytest.fixture(scope="module")
def compared():
    return compare(ROBOT, controllers="pid, ff-pid,ilc,mpc", rounds=2, noise="0.1mm", **GIVEN)


@pytest.mark.parametrize("name", ["pid", "ff-pid", "ilc", "mpc"])
def test_a_row_is_that_of_the_controller_alone(compared, name):
    (score,) = (one for one in compared.scores if one.name == name)
    rounds = {"rounds": 2} if name == "ilc" else {}
    alone = control(ROBOT, controller=name, noise="0.1mm", **rounds, **GIVEN)
    run = alone.record
    np.testing.assert_array_equal(score.result.record.output, run.output)
    assert score.rms_error == alone.errors[-1]
    assert score.largest_error == np.abs(run.output - run.reference).max()
    assert score.effort == pytest.approx(np.sqrt(np.mean(run.command**2)), rel=1e-12)
    assert score.change == pytest.approx(np.sqrt(np.mean(np.diff(run.command) ** 2)), rel=1e-12)
    assert score.at_limits == np.mean(np.abs(run.command) == 2.0)
    assert (score.outcome, score.cause) == (("poor", alone.missed()) if alone.missed() else ("tracks", ""))


def test_the_best_one_tracks_with_the_least_error(compared):
    assert compared.best is not None
    assert compared.best.rms_error == min(score.rms_error for score in compared.scores)


@pytest.mark.parametrize(("changed", "field", "message"), [
    ({"controllers": "pid,mpcc"}, "controller", '"mpcc" is not known: pid, scheduled, ff-pid, ilc, mpc'),
    ({"controllers": "pid,mpc,pid"}, "controller", '"pid" stands twice. Each of pid, scheduled, ff-pid, ilc, mpc'),
    ({"controllers": "pid,"}, "controller", '"" is not known: pid'),
    ({"controllers": []}, "controller", "names none of pid"),
    ({"controllers": {}}, "controller", "names none of pid"),
    ({"controllers": {"own": 3.0}}, "controller", "is a float. A name (pid"),
    ({"controllers": "pid,scheduled", "gains": "1,2,0"}, "gains", "are rows by frequency for scheduled"),
    ({"controllers": "pid,mpc", "gains": "1Hz: 1,2,0"}, "gains", "gains by frequency belong to a scheduled PID"),
    ({"controllers": "pid,mpc", "rounds": 3}, "rounds", "are those of ilc"),
    ({"controllers": "pid,ilc", "rounds": 0}, "rounds", "are those of ilc, at least 1"),
    ({"controllers": "pid,mpc", "rate": "1MHz"}, "rate", "samples"),
    ({"controllers": "pid,mpc", "measure": "depht"}, "measure", "depht"),
])  # fmt: skip
def test_a_mistake_is_one_of_all_before_anything_is_simulated(changed, field, message):
    with pytest.raises(InputError) as told:
        compare(ROBOT, **(STEP | changed))
    assert told.value.field == field and message in told.value.message

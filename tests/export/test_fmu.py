"""A robot as an FMU, run by FMPy, an independent importer: the same numbers as those of the robot itself."""

import tempfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from tests.small_robots import SLIDE

from nectosome.description import parse_robot
from nectosome.export.fmu import HeldRobot, write_fmu
from nectosome.solve import simulate
from nectosome.units import InputError

READINGS = ["body.position.x", "body.velocity.x"]


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    path = tmp_path_factory.mktemp("fmu") / "slide.fmu"
    write_fmu(parse_robot(SLIDE), ["push"], READINGS, 0.05, path)
    return path


def test_it_is_a_valid_fmu_with_commands_in_and_readings_out(fmu):
    found = fmpy.read_model_description(str(fmu), validate=True)
    assert (found.fmiVersion, found.modelName) == ("2.0", "slide")
    assert {v.name: (v.causality, v.description) for v in found.modelVariables} == {
        "push": ("input", "N"),
        "solver.rtol": ("parameter", None),
        "solver.atol": ("parameter", None),
        "body.position.x": ("output", "m"),
        "body.velocity.x": ("output", "m/s"),
    }
    assert found.defaultExperiment.stepSize == "0.05"
    assert not found.coSimulation.canHandleVariableCommunicationStepSize


def test_its_motion_is_that_of_the_robot(fmu):
    """A mass on a spring and a damper, pushed by 3 N from rest: as simulate has it, and as its closed form."""
    push = np.array([(0.0, 3.0), (2.0, 3.0)], dtype=[("time", float), ("push", float)])
    found = fmpy.simulate_fmu(
        str(fmu),
        stop_time=2.0,
        step_size=0.05,
        output_interval=0.1,
        input=push,
        output=READINGS,
        start_values={"push": 3.0, "solver.rtol": 1e-7, "solver.atol": 1e-9},
    )
    run = simulate(parse_robot(SLIDE), 2.0, settings=["push=3N"], samples=21, rtol=1e-8)
    ours = run.diagnosis()
    place, speed = np.asarray(ours.position)[:, 0, 0], np.asarray(ours.velocity)[:, 0, 0]
    assert np.ptp(place) > 0.5
    np.testing.assert_allclose(found["body.position.x"], place, atol=1e-4)
    np.testing.assert_allclose(found["body.velocity.x"], speed, atol=3e-4)
    t, m, k, c = found["time"], 2.0, 5.0, 4.0
    d, w = c / (2 * m), np.sqrt(k / m - (c / (2 * m)) ** 2)
    exact = 3 / k * (1 - np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t)))
    np.testing.assert_allclose(found["body.position.x"], exact, atol=1e-6)


def test_commands_change_between_steps():
    robot = HeldRobot(parse_robot(SLIDE), ["push"], READINGS, 0.05)
    assert robot.advance(0.0, 0.1) == ""
    assert robot.readings["body.position.x"] == 0.0
    robot.commands["push"] = 1.0
    assert robot.advance(0.1, 0.05) == ""
    assert robot.readings["body.velocity.x"] == pytest.approx(0.05 / 2, rel=0.1)


def pushed(dt: float, **tolerances: float) -> float:
    """Place after 1 s of a push of 3 N from rest."""
    robot = HeldRobot(parse_robot(SLIDE), ["push"], READINGS, dt)
    robot.commands["push"] = 3.0
    robot.tolerances |= {f"solver.{name}": value for name, value in tolerances.items()}
    assert robot.advance(0.0, 1.0) == ""
    return robot.readings["body.position.x"]


def test_smaller_tolerances_make_the_step_of_an_fmu_not_matter():
    """Against the closed form: 3/k (1 - e^(-d t) (cos w t + d/w sin w t))."""
    m, k, c = 2.0, 5.0, 4.0
    d, w = c / (2 * m), np.sqrt(k / m - (c / (2 * m)) ** 2)
    exact = 3 / k * (1 - np.exp(-d) * (np.cos(w) + d / w * np.sin(w)))
    for dt in (0.05, 0.5):
        assert pushed(dt, rtol=1e-8, atol=1e-10) == pytest.approx(exact, rel=2e-7)
    assert abs(pushed(0.5) - exact) > 1e-6 * exact
    robot = HeldRobot(parse_robot(SLIDE), ["push"], READINGS, 0.05, rtol=2.0)
    assert robot.advance(0.0, 0.05) == "solver.rtol is 2: it must be more than 0 and less than 1"


def test_a_step_that_does_not_fit_is_told():
    robot = HeldRobot(parse_robot(SLIDE), ["push"], READINGS, 0.05)
    assert robot.advance(0.0, 0.07) == "a step of 0.07 s is no whole number of 0.05 s, the step of this FMU"
    assert robot.advance(1.0, 0.05) == "it is at 0 s, not at 1 s: it begins at 0 s and does not go back"


def test_a_step_that_fails_ends_the_simulation_with_its_reason(fmu, tmp_path, monkeypatch, capfd):
    """With the defaults of FMPy, which shows no log and goes on after a step that is discarded."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # FMPy leaves its folder there
    with pytest.raises(FMICallException, match="fmi2DoStep failed"):
        fmpy.simulate_fmu(str(fmu), stop_time=0.3, output_interval=0.07)
    assert capfd.readouterr().err == "slide: a step of 0.07 s is no whole number of 0.05 s, the step of this FMU\n"


def test_a_full_folder_for_temporary_files_is_told(tmp_path):
    """A limit of 100 kB a file; the libraries of an FMU alone are larger."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        with pytest.raises(InputError, match=r"in the folder for temporary files: File too large\. Free space there"):
            write_fmu(parse_robot(SLIDE), ["push"], READINGS, 0.05, tmp_path / "a.fmu")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [*tmp_path.iterdir()] == []


def test_unknown_names_are_told(tmp_path):
    for commands, readings in ((["pull"], READINGS), (["push"], ["body.nothing"])):
        with pytest.raises(InputError):
            write_fmu(parse_robot(SLIDE), commands, readings, 0.05, tmp_path / "a.fmu")
    assert [*tmp_path.iterdir()] == []

"""What the commands print and write when all goes well, and when a run is cut short."""

import errno
import functools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from nectosome import solve, view
from nectosome.io import load_dataset
from nectosome.robots import names
from nectosome.robots.shipped import file_of

WEIGHT = 4 / 3 * np.pi * 0.02**3 * 1200 * 9.80665  # of the ball [N]
SPEED = np.sqrt(WEIGHT / 6 / (0.5 * 1000 * 1.2e-3))  # where drag carries what buoyancy leaves of it [m/s]


def rows(page: str) -> dict[str, list[str]]:
    """The columns of each row of a page, by the row's name."""
    return {line.split("  ")[0]: line.split() for line in page.splitlines() if line}


def test_a_ball_sinks_at_the_speed_where_drag_carries_its_weight(nectosome, ball_run):
    """V = sqrt((rho_s - rho_w) g 4/3 pi r^3 / (rho_w/2 CdA)) = 0.33097 m/s; the weight gives m g V."""
    answer = nectosome("show", str(ball_run))
    assert (answer.code, answer.err) == (0, "")
    page = rows(answer.out)
    assert page["body"] == ["body", "z", "size"]  # it slides along z
    assert float(page["velocity at the end"][-3]) == pytest.approx(-SPEED, rel=1e-3)
    assert float(page["mean velocity"][-2]) == pytest.approx(SPEED, rel=1e-3)
    assert float(page["weight"][1]) == pytest.approx(WEIGHT * SPEED, rel=1e-3)
    assert float(page["drag"][1]) == pytest.approx(-WEIGHT / 6 * SPEED, rel=1e-3)
    assert float(page["position at the end"][-2]) < -0.5
    assert "SOLVED, solved" in answer.out


def test_a_robot_that_goes_backwards_swims_tail_first(nectosome, ball):
    """The ball sinks along -z; the speed along its forward axis is that of the end, with its sign."""
    said, text = [], ball.read_text()
    for forward in ("z", "-z", "x"):
        ball.write_text(text.replace("body:", f"forward: {forward}\nbody:"))
        said.append(nectosome("simulate", str(ball), "--time", "2s", "--samples", "21").out)
    up, down, across = said
    assert "it swims tail first: forward speed -0.33" in up.replace("\n ", "")
    assert "tail first" not in down + across
    assert rows(up)["body"] == rows(down)["body"] == ["body", "z", "size", "forward"]
    assert [float(rows(page)["velocity at the end"][-2]) for page in (up, down)] == pytest.approx(
        [-SPEED, SPEED], rel=1e-3
    )
    assert rows(across)["body"] == ["body", "z", "size"]


def test_each_load_on_each_part_and_the_energy_of_parts_are_told_on_request(nectosome, ball_run):
    answer = nectosome("show", str(ball_run), "--loads")
    page = rows(answer.out.partition("\nregime")[0])
    assert page["load on part"] == ["load", "on", "part", "z", "power", "energy"]
    assert float(page["weight on body"][3]) == pytest.approx(-WEIGHT, rel=1e-3)
    assert float(page["drag on body"][3]) == pytest.approx(WEIGHT / 6, rel=1e-3)
    power, energy = float(page["weight on body"][5]), float(page["weight on body"][7])
    tenth = 0.1 * float(load_dataset(ball_run)["time"][-1])
    assert (power, energy) == pytest.approx((WEIGHT * SPEED, WEIGHT * SPEED * tenth), rel=1e-3)
    assert float(page["body"][1]) == pytest.approx(WEIGHT / 9.80665 * SPEED**2 / 2, rel=1e-3)  # the table's only row
    refused = nectosome("show", "eel", "--loads")
    assert (refused.code, refused.out) == (2, "")
    assert refused.err.startswith("--loads: is for a saved run.")


def test_a_saved_run_shows_what_was_printed_and_where_it_comes_from(nectosome, ball):
    argv = (
        "--time",
        "2s",
        "--samples",
        "21",
        "--save",
        "run.nc",
        "--set",
        "body.density=1100 kg/m3",
        "--set",
        "name=cork",
    )
    done = nectosome("simulate", str(ball), *argv)
    assert (done.code, done.err) == (0, "")
    shown = nectosome("show", "run.nc")
    assert (shown.code, shown.err) == (0, "")
    summary, written, _ = done.out.rpartition("written: run.nc\n")
    assert written
    assert shown.out.startswith(summary)
    assert "cork: simulation, 2 s" in done.out
    assert "body.density=1100 kg/m3" in " ".join(shown.out.split())
    dataset = load_dataset("run.nc")
    assert dataset.sizes["time"] == 21
    settings = json.loads(dataset.attrs["provenance"])["settings"]
    assert settings["time"] == 2.0
    assert settings["method"] == "auto"


def test_the_reaction_of_a_driven_joint_is_told_in_its_unit(nectosome, ball_run, tmp_path):
    dataset = load_dataset(ball_run)
    n = dataset.sizes["time"]
    dataset = dataset.drop_dims("prescribed")
    dataset = dataset.assign_coords(prescribed=["arm.angle", "slide.position"])
    for name in ("reaction", "reaction_power"):
        dataset[name] = (("time", "prescribed"), np.tile([2.5, 4.0], (n, 1)))
    dataset.to_netcdf(tmp_path / "driven.nc", engine="h5netcdf")
    page = rows(nectosome("show", "driven.nc").out)
    assert page["slide.position"] == ["slide.position", "4", "4", "W"]  # the later row, of powers
    assert "2.5 N m" in nectosome("show", "driven.nc").out


def test_a_run_that_gives_up_says_why(nectosome, ball, monkeypatch):
    monkeypatch.setattr(solve, "simulate", functools.partial(solve.simulate, max_steps=2))
    answer = nectosome("simulate", str(ball), "--time", "2s", "--samples", "21", "--save", "run.nc")
    assert answer.code == 1
    assert answer.err.startswith("ball: failed: more time steps than allowed, at ")
    assert "STEP_LIMIT" in answer.out
    assert load_dataset("run.nc").attrs["status"] == "STEP_LIMIT"


@pytest.mark.parametrize("save", [True, False])
def test_ctrl_c_keeps_the_part_done(nectosome, ball, monkeypatch, save):
    real = solve.simulate
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background starts deaf to it

    def interrupted(*args, progress, **options):
        def press(share: float) -> bool:
            if share > 0.4:
                os.kill(os.getpid(), signal.SIGINT)
                deadline = time.monotonic() + 10
                while progress(share) and time.monotonic() < deadline:
                    time.sleep(0.01)
            return progress(share)

        return real(*args, progress=press, **options)

    monkeypatch.setattr(solve, "simulate", interrupted)
    option = ("--save", "run.nc") if save else ()
    answer = nectosome("simulate", str(ball), "--time", "2s", "--samples", "21", *option)
    assert answer.code == 130
    stopping, cancelled = answer.err.splitlines()
    assert stopping == "stopping; Ctrl-C again stops at once."
    assert cancelled.startswith("cancelled at 0.9 s of 2 s.")
    assert Path("run.nc").exists() == save
    if save:
        assert load_dataset("run.nc")["time"].values[-1] == pytest.approx(0.9)
        assert "CANCELLED" in nectosome("show", "run.nc").out


def test_a_disk_that_fills_up_leaves_no_half_a_file(nectosome, ball, monkeypatch, tmp_path):
    def full(fd: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    answer = nectosome("simulate", str(ball), "--time", "2s", "--samples", "21", "--save", "run.nc")
    assert (answer.code, answer.err) == (2, "cannot write run.nc: No space left on device.\n")
    assert list(tmp_path.iterdir()) == [ball]


def test_a_disk_that_is_full_while_the_run_is_written_leaves_no_half_a_file(ball_run, tmp_path):
    code = (
        "import resource, sys; from nectosome.io import load_dataset, save_dataset\n"
        "from nectosome.units import InputError\n"
        "run = load_dataset(sys.argv[1])\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
        "try: save_dataset(run, 'run.nc')\n"
        "except InputError as error: print(error)"
    )
    argv = [sys.executable, "-c", code, str(ball_run)]
    done = subprocess.run(argv, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "cannot write run.nc: File too large.\n", "")
    assert list(tmp_path.iterdir()) == []


def test_output_that_cannot_be_written_is_an_error():
    argv = [Path(sys.executable).with_name("nectosome"), "schema"]
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(argv, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "cannot write the output: No space left on device.\n")


def test_show_draws_the_parts_of_a_robot(nectosome):
    answer = nectosome("show", "flagellum")
    assert (answer.code, answer.err) == (0, "")
    for text in (
        "4 parts",
        "13 degrees of freedom, 1 prescribed: shaft.angle",
        "0.7135 kg, displaces 0.6489 kg",
        "revolute, axis x",
        "omega        14.4 rad/s  limbs.shaft.joint.motion.rate",
        "young 7.4 MPa",
    ):
        assert text in answer.out
    assert "4 torsion, 4 bending_y, 4 bending_z" in " ".join(answer.out.replace("│", "").split())


@pytest.mark.parametrize(
    "robot",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name in ("krill", "ray")))  # of many parts
        for name in names()
        if not name.startswith(("flagell", "beetle"))
    ],
)
def test_robots_that_ship_are_shown(nectosome, robot):
    answer = nectosome("show", robot)
    assert answer.code == 0
    assert bool(answer.err) == ("as_printed" in answer.err) == robot.startswith("paddle")  # its hinges are as printed
    assert answer.out.startswith(robot.rstrip("0123456789"))
    assert [line for line in answer.out.splitlines() if len(line) > 80 or line != line.rstrip()] == []


@pytest.mark.parametrize(("columns", "width"), [(None, 80), ("120", 120), ("50", 50), ("0", 80), ("wide", 80)])
def test_text_is_as_wide_as_columns_say_and_80_where_nothing_does(nectosome, monkeypatch, columns, width):
    monkeypatch.setattr(sys, "__stdout__", None)  # no terminal, whoever runs this
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    answer = nectosome("show", "flagellum")
    assert width - 20 < max(map(len, answer.out.splitlines())) <= width


def test_a_name_that_is_nearly_a_robot_or_a_file_is_found(nectosome, ball):
    assert 'Did you mean "flagellum"?' in nectosome("show", "flagelum").err
    ball.rename("minnow.yaml")
    assert 'Did you mean "minnow.yaml"?' in nectosome("show", "minow").err


def test_show_hands_a_run_to_the_view(nectosome, ball_run, monkeypatch):
    drawn = []
    monkeypatch.setattr(view, "show_run", lambda dataset, path: drawn.append((dataset.attrs["title"], str(path))))
    assert nectosome("show", str(ball_run), "--plot", "page.html").code == 0
    assert drawn == [("ball: simulation", "page.html")]


def test_check_warns_of_what_no_material_has_and_goes_on(nectosome, tmp_path):
    (tmp_path / "light.yaml").write_text(
        "name: a\nwater: {density: 1.02 kg/m3}\nbody: {kind: rigid, shape: point, mass: 1 kg}\n"
    )
    answer = nectosome("check", str(tmp_path / "light.yaml"))
    assert answer.code == 0
    assert "light.yaml, water.density: 1.02 kg/m3 is far outside of water" in answer.err
    assert "(950 kg/m3 to 1300 kg/m3). Check the value and its unit." in answer.err


def test_check_says_what_a_file_describes(nectosome, ball):
    answer = nectosome("check", "ball.yaml")
    assert (answer.code, answer.out, answer.err) == (0, "ball.yaml: ok, 1 part, 1 degree of freedom, 0.04021 kg\n", "")


def test_check_takes_a_wheel_without_a_mass_where_a_rotor_gives_it_an_inertia(nectosome, tmp_path):
    motor = "{model: XC330-M288-T, voltage: {kind: constant, value: 5 V}INERTIA}"
    wheel = f"{{kind: rigid, shape: point, mass: 0 kg, joint: {{kind: revolute, axis: x, motor: {motor}}}}}"
    text = f"name: a\nbody: {{kind: rigid, shape: point, mass: 1 kg}}\nlimbs:\n  wheel: {wheel}\n"
    for inertia, code in ((", inertia: 1e-4 kg m2", 0), ("", 2)):
        (tmp_path / "wheel.yaml").write_text(text.replace("INERTIA", inertia))
        answer = nectosome("check", str(tmp_path / "wheel.yaml"))
        assert answer.code == code
    assert "limbs.wheel.mass" in answer.err and "or be moved by a motor with an inertia." in answer.err


def test_check_judges_a_file_with_settings(nectosome, ball):
    """Half the density, half the mass; what a setting makes implausible is told, what it makes wrong is refused."""
    light = nectosome("check", "ball.yaml", "--set", "body.density=600 kg/m3")
    assert (light.code, light.out) == (0, "ball.yaml: ok, 1 part, 1 degree of freedom, 0.02011 kg\n")
    told = nectosome("check", "ball.yaml", "--set", "body.density=1.2 kg/m3")
    assert (told.code, "ball.yaml, body.density: 1.2 kg/m3 is far outside" in told.err) == (0, True)
    refused = nectosome("check", "ball.yaml", "--set", "body.density=-1 kg/m3")
    assert (refused.code, refused.err.startswith("body.density: ")) == (2, True)


def test_schema_is_json(nectosome):
    assert "body" in json.loads(nectosome("schema").out)["properties"]


@pytest.mark.parametrize("argv", [("--help",), ("--version",), ("simulate", "--help"), ("reproduce", "-h"), ()])
def test_help_and_version(nectosome, argv):
    answer = nectosome(*argv)
    assert (answer.code, answer.err) == (0, "")
    assert "nectosome" in answer.out


def test_help_of_no_command_imports_what_is_heavy():
    code = """
import contextlib, io, sys
from nectosome.cli.app import app, main
with contextlib.redirect_stdout(io.StringIO()):
    for words in ((), *([name] for name in app if not name.startswith("-"))):
        assert main([*words, "--help"]) == 0, words
rooms = {f"nectosome.{room}" for room in ("description", "robots", "model", "mechanism", "solve", "designs")}
others = {"numpy", "jax", "pydantic", "xarray", "scipy", "matplotlib", "plotly", "pint", "h5py", "equinox", "dask"}
print((rooms | others) & {*sys.modules} or "nothing", len([*app]) > 20)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "nothing True\n"


def test_an_interrupt_while_the_commands_are_loaded_is_a_sentence():
    code = """
import sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == "nectosome.cli.sweep":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupt())
from nectosome.__main__ import run
run()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "cancelled.\n")


def test_check_imports_no_solver():
    code = """
import sys
from nectosome.cli.app import main
assert main(["check", sys.argv[1]]) == 0
print([room for room in ("solve", "designs", "search") if f"nectosome.{room}" in sys.modules])
"""
    command = [sys.executable, "-c", code, str(file_of("paddle"))]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.endswith("\n[]\n")

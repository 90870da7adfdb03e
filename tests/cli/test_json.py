"""`--json`: every command has it, and prints one JSON object with it, whatever happens."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.small_robots import SHAKEN

from nectosome.io import load_dataset

from .test_commands import SPEED, WEIGHT
from .test_spellings import COMMANDS, arguments
from .test_sweep import ARM

WITHOUT = {
    "studio": "it runs until it is stopped, and prints where it listens",
    "schema": "it prints JSON in any case",
}
KEYS = {
    "command", "exit_code", "title", "status", "status_reason", "settings", "made_with", "values", "tables", "notes",
    "warnings", "files", "error",
}  # fmt: skip
EXAMPLES = Path(__file__).parents[2] / "examples"


def numbers(found: Any) -> Iterator[dict[str, Any]]:
    """Every number with a unit."""
    if isinstance(found, dict) and "unit" in found:
        yield found
    elif isinstance(found, dict | list):
        for one in found.values() if isinstance(found, dict) else found:
            yield from numbers(one)


@pytest.fixture
def printed(nectosome):
    """Run a command with --json, and return the object that it printed, which is as promised."""

    def run(*argv: str, code: int = 0) -> dict[str, Any]:
        answer = nectosome(*argv, "--json")
        found = json.loads(answer.out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
        assert found.keys() - {"parts"} == KEYS
        assert (answer.code, found["exit_code"], found["error"] is None) == (code, code, code == 0), answer.err
        for one in numbers([found["values"], found["tables"]]):
            assert one["value"] is None or isinstance(one["value"], int | float)
            assert one["unit"] and (one["value"] is not None or one["reason"])
        return found

    return run


def test_every_command_has_it_or_a_reason():
    without = {name for name, command in COMMANDS.items() if not any("--json" in a.names for a in arguments(command))}
    assert without == WITHOUT.keys()


def test_a_simulation_is_told_in_si_units_with_its_settings_and_files(printed, ball):
    found = printed("simulate", str(ball), "--time", "2s", "--samples", "21", "--save", "run.nc", "--loads")
    assert (found["command"], found["title"], found["status"]) == ("simulate", "ball: simulation, 2 s", "SOLVED")
    assert (found["files"], found["settings"]["time"]) == (["run.nc"], 2.0)
    tables, data = found["tables"], load_dataset("run.nc")
    end = tables["body"]["velocity_end"]["z"]
    assert end == {"value": float(data["velocity"][-1, 0, 2]), "unit": "m/s"}
    assert end["value"] == pytest.approx(-SPEED, rel=1e-3)
    assert tables["body"]["position_end"].keys() == {"x", "y", "z"}
    assert tables["power"]["weight"]["mean"]["value"] == pytest.approx(WEIGHT * SPEED, rel=1e-3)
    assert tables["load_force"]["weight on body"]["z"]["value"] == pytest.approx(-WEIGHT, rel=1e-6)
    assert found["values"]["time"] == {"value": 2.0, "unit": "s"}
    assert found["values"]["steps"]["value"] == float(data.attrs["steps"])
    again = printed("show", "run.nc", "--loads")
    assert (again["tables"], again["settings"]) == (tables, found["settings"])


def test_nothing_else_goes_to_stdout_and_sentences_to_stderr(nectosome, ball):
    answer = nectosome("new", "tail", "mine.yaml", "--json")
    assert json.loads(answer.out)["files"] == ["mine.yaml"]
    assert answer.err.startswith("wrote mine.yaml. ")


def test_commands_that_are_quick_tell_what_they_show(printed, ball, ball_run):
    parts = printed("show", "flagellum")["tables"]
    assert parts["parts"]["shaft"]["mass"] == {"value": 0.059, "unit": "kg"}
    assert parts["aliases"]["omega"]["value"] == {"value": 14.4, "unit": "rad/s"}
    assert printed("check", str(ball))["values"]["degrees_of_freedom"]["value"] == 1
    assert "ring" in printed("new")["tables"]["robots"]
    film = printed("render", str(ball_run), "--save", "a.png", "--size", "160x128")
    assert film["files"] == ["a.png"]
    read = printed("measure", str(EXAMPLES / "fin_recordings" / "slow.csv"))["parts"][0]
    assert read["tables"]["quantities"]["torque"]["maximum"] == {"value": 0.12, "unit": "N m"}
    surge = printed(
        "identify", "surge", "--campaign", str(EXAMPLES / "swim_recordings" / "campaign.yaml"), "--mass", "0.755kg"
    )
    assert surge["tables"]["parameters"]["drag"]["value"]["unit"] == "kg/m"
    assert surge["warnings"]


def test_a_sweep_and_a_cycle_are_told(printed):
    Path("arm.yaml").write_text(ARM)
    found = printed("sweep", "arm.yaml", "--over", "M=10,20mN m", "--over", "f=1,2Hz")
    assert found["tables"]["means"]["power"]["highest_at"] == "M=20 mN m, f=1 Hz"
    Path("shaken.yaml").write_text(SHAKEN.replace("position: 1e-3 rad, ", ""))
    found = printed("periodic", "shaken.yaml", "--set", "f=1.4 Hz")
    reaction = found["tables"]["driven_joints"]["body.position"]["reaction"]
    assert reaction["value"] == pytest.approx(2 * 9.81, rel=1e-3)
    assert found["values"]["period"] == {"value": pytest.approx(1 / 1.4), "unit": "s"}
    assert found["tables"]["power"]["sum"]["mean"]["value"] != 0  # as it was computed


def test_a_failure_is_told_with_its_status(printed, ball):
    found = printed("static", str(ball), code=1)
    assert (found["status"], found["tables"]) == ("NO_EQUILIBRIUM", {})
    assert found["error"]["message"].startswith("ball: nothing holds body.position")


def test_a_mistake_names_file_line_and_field(printed, nectosome, ball):
    ball.write_text(ball.read_text().replace("radius: 20 mm", "radius: 20 kg"))
    error = printed("simulate", "ball.yaml", code=2)["error"]
    assert (error["file"], error["line"], error["field"]) == ("ball.yaml", 6, "body.radius")
    assert error["message"].startswith('"20 kg" is a mass.')
    text = nectosome("simulate", "ball.yaml")
    assert (text.out, text.err) == ("", f"ball.yaml, line 6, body.radius: {error['message']}\n")
    assert printed("simulate", "ball.yaml", "--tiem", "2s", code=2)["error"]["field"] is None
    assert printed("simulate", code=2)["command"] == "simulate"


def test_what_is_not_defined_is_null(printed, ball_run):
    run = load_dataset(ball_run)
    run["power_balance"] = run["power_balance"].copy(data=np.full(run.sizes["time"], np.nan))
    run.to_netcdf("odd.nc", engine="h5netcdf")
    balance = printed("show", "odd.nc")["values"]["power_balance"]
    assert balance == {"value": None, "unit": "1", "reason": "not defined"}


def test_help_is_help(nectosome):
    answer = nectosome("simulate", "--json", "--help")
    assert (answer.code, answer.out.startswith("Usage:")) == (0, True)

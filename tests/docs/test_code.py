"""Code in the pages runs, robots and sheets in them are read, and commands in them are as the command line has them.

The files that a page speaks of are made here, synthetic ones. Tutorials are followed step by step in a test of their
own, and so is the page on rigs.
"""

import re
import shlex
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.docs.calls import wrong_in
from tests.synthetic_campaign import write_campaign, write_grid
from tests.vision.video.scenes import paddle

import nectosome as ns
from nectosome.cli.app import app
from nectosome.core import current_of
from nectosome.description import load_robot
from nectosome.measure import load_sheet
from nectosome.vision import video
from nectosome_studies.track.render import write_clip

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
EVERY = {str(path.relative_to(DOCS)): path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md")}
EVERY["README.md"] = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {
    Path(name).stem: text for name, text in EVERY.items() if name.split("/")[0] in ("index.md", "README.md", "how-to")
}
ROOMS = sorted(path.stem for path in (DOCS / "reference" / "python").glob("*.md"))  # and "index"
DEAR = {"designs", "export", "gym", "index", "mechanism", "model", "solve"}  # examples of rooms that compile much
COMMANDS = sorted(
    {
        line[2:]
        for page in EVERY.values()
        for line in re.findall(r"^\$ nectosome .*", page.replace("\\\n", ""), re.MULTILINE)
    }
)


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGES[page], re.DOTALL)


def runs(page: str, k: int, names: dict[str, object] | None = None) -> None:
    exec(compile(blocks(page, "python")[k], f"{page}.md", "exec"), {} if names is None else names)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with the examples beside."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    return tmp_path


def test_every_block_of_python_is_run_by_a_test():
    """A new one needs a test here (or beside the page of rigs, which has its own)."""
    assert {page: len(blocks(page, "python")) for page in PAGES if blocks(page, "python")} == {
        "control": 4, "fish-from-video": 1, "identify": 4, "index": 1, "learn": 1, "measure": 3, "own-load": 1,
        "rigs": 2, "sea": 1, "sim-to-real": 1, "track": 1,
    }  # fmt: skip


@pytest.mark.parametrize("page", [name for name, text in EVERY.items() if "```python" in text])
def test_code_of_a_page_calls_what_there_is(page: str):
    """Also of what only the slow tests run."""
    code = re.findall(r"```python(?: [^\n]*)?\n(.*?)```", EVERY[page], re.DOTALL)
    assert [wrong for block in code for wrong in wrong_in(block)] == []


def test_the_table_of_a_flow_is_read_as_the_page_says(folder: Path):
    runs("sea", 0)
    (folder / "jet.yaml").write_text(
        f"name: jet\n{blocks('sea', 'yaml')[1]}body: {{kind: rigid, shape: point, mass: 1 kg}}\n"
    )
    jet = current_of(load_robot(folder / "jet.yaml").water)
    assert jet is not None
    found = jax.jit(lambda x: jet(jnp.zeros(()), x))(jnp.array([0.5, 3.0, -0.2]))
    np.testing.assert_allclose(found, [1.5 * 0.2 * 0.5, 0.0, 0.0], rtol=1e-12)


def test_the_swim_of_the_first_page(folder: Path, capsys: pytest.CaptureFixture[str]):
    runs("index", 0)
    assert float(capsys.readouterr().out) == pytest.approx(-0.68, abs=0.03)


@pytest.mark.slow
def test_a_policy_by_hand_holds_the_heading(capsys: pytest.CaptureFixture[str]):
    runs("learn", 0)
    (said,) = re.findall(r"It prints `(.*?)`", PAGES["learn"])
    assert capsys.readouterr().out.strip() == said


@pytest.mark.parametrize("room", [pytest.param(room, marks=pytest.mark.slow if room in DEAR else ()) for room in ROOMS])
def test_the_example_of_a_room_prints_what_is_said(room: str, folder: Path, capsys: pytest.CaptureFixture[str]):
    page = EVERY[f"reference/python/{room}.md"]
    code, said = re.search(r"```python\n(.*?)```\n.*?```text\n(.*?)```", page, re.DOTALL).groups()  # type: ignore[union-attr]
    exec(compile(code, f"{room}.md", "exec"), {})
    assert capsys.readouterr().out.split() == said.split()


def test_a_recording_that_ships_is_read():
    (code,) = re.findall(r"```python\n(.*?)```", EVERY["evidence/data.md"], re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(code, "data.md", "exec"), names)
    assert names["run"]["force"].attrs["units"] == "N"  # type: ignore[index]


@pytest.mark.parametrize("k", [pytest.param(0, marks=pytest.mark.slow), 1, 2])
def test_the_examples_of_identification_print_what_is_said(folder: Path, capsys: pytest.CaptureFixture[str], k: int):
    runs("identify", k)
    said = re.findall(r"It prints `(.*?)`", PAGES["identify"])
    assert capsys.readouterr().out.strip() == said[k]


@pytest.mark.slow
def test_the_walks_of_identification(folder: Path, capsys: pytest.CaptureFixture[str]):
    runs("identify", 3)
    assert capsys.readouterr().out.strip()


def test_recordings_are_measured(folder: Path):
    t = np.arange(0.0, 8.0, 1e-3)
    rows = np.transpose([t, 2.0 + np.sin(2 * np.pi * 1.1 * t)])
    np.savetxt("run_1.csv", rows, delimiter=",", header="t,force", comments="")
    (folder / "sheet.yaml").write_text("time: {column: t, unit: s}\ncolumns: {force: {column: force, unit: N}}\n")
    (folder / "campaign.yaml").write_text(
        "time: {column: t, unit: s}\ncolumns: {force: {column: force, unit: N}}\n"
        "recordings: [{file: run_1.csv, conditions: {f: 1.1 Hz}}]\n"
    )
    names: dict[str, object] = {}
    for k in range(3):
        runs("measure", k, names)
    assert float(names["numbers"]["force_amplitude"]) == pytest.approx(1.0, rel=1e-3)  # type: ignore[index]


def test_a_grid_is_corrected(folder: Path, capsys: pytest.CaptureFixture[str]):
    write_grid(folder / "grid.nc")
    write_campaign(folder)
    runs("sim-to-real", 0)
    assert len(capsys.readouterr().out.splitlines()) == 4  # errors, and three experiments


def test_a_video_is_tracked(folder: Path):
    """Four segments over five frames, of a camera that is twice as near as the page's."""
    scene = paddle(px_per_cm=10.0, size=(640, 640))
    write_clip(folder / "paddle.mp4", (scene.frame(k / 30) for k in range(5)), 30, quality=5)
    (folder / "track.yaml").write_text(blocks("track", "yaml")[0].replace("2 mm", "1 mm"))
    names: dict[str, object] = {}
    runs("track", 0, names)
    tracked = names["tracked"]
    assert dict(tracked.sizes)["time"] == 5  # type: ignore[attr-defined]
    assert not tracked["reason"].values.any()  # type: ignore[index]


@pytest.mark.slow
def test_an_own_load_takes_power_out(folder: Path, capsys: pytest.CaptureFixture[str]):
    (swimmer,) = re.findall(r'title="swimmer.yaml"\n(.*?)```', EVERY["tutorials/model.md"], re.DOTALL)
    (folder / "swimmer.yaml").write_text(swimmer)
    runs("own-load", 0)
    assert f"`{capsys.readouterr().out.strip()}`" in PAGES["own-load"]


def test_a_wave_is_found_from_the_angles_of_bands(folder: Path, capsys: pytest.CaptureFixture[str]):
    """Four straight bands of 5 cm along a fish whose midline is a wave of 19 cm at 2 Hz."""
    t, ends = np.arange(0.0, 3.0, 1 / 60), np.linspace(0.0, 0.2, 5)
    amplitude = 0.2 * (0.02 - 0.08 * ends / 0.2 + 0.16 * (ends / 0.2) ** 2)
    y = amplitude * np.sin(2 * np.pi * (2.0 * t[:, None] - ends / 0.19))
    angles = np.diff(np.arctan2(np.diff(y), 0.05))
    head = "time (s)," + ",".join(f"joint_angle {k} (rad)" for k in range(3))
    np.savetxt("angles.csv", np.column_stack([t, angles]), delimiter=",", header=head, comments="")
    (code,) = re.findall(r'```python title="wave.py"\n(.*?)```', PAGES["fish-from-video"], re.DOTALL)
    exec(compile(code, "wave.py", "exec"), {})
    said = capsys.readouterr().out
    assert "frequency: 2.000 Hz" in said
    assert float(re.search(r"wavelength: ([\d.]+) mm", said)[1]) == pytest.approx(190, rel=0.05)  # type: ignore[index]


@pytest.mark.slow
def test_a_swimmer_beside_its_video(folder: Path, capsys: pytest.CaptureFixture[str]):
    found = ns.periodic("catshark")
    ns.save_dataset(found.to_dataset(), "cycle.nc")
    runs("fish-from-video", 0)
    speed, beat, strouhal = (float(x) for x in re.findall(r"\d+\.\d+", capsys.readouterr().out))
    assert speed == pytest.approx(float(found.means().speed), rel=5e-3)
    assert strouhal == pytest.approx(1e-3 * beat / float(found.value.time[-1]) / speed, rel=5e-3)


def test_a_loop_of_control(folder: Path, capsys: pytest.CaptureFixture[str]):
    runs("control", 3)
    assert 0 < float(capsys.readouterr().out.split()[0]) < 1e-3  # m


@pytest.mark.slow
@pytest.mark.parametrize("k", [0, 1, 2])
def test_a_robot_under_control(folder: Path, capsys: pytest.CaptureFixture[str], k: int):
    runs("control", k)
    assert capsys.readouterr().out


@pytest.mark.parametrize(
    ("page", "k", "name"), [("index", 0, "ball"), ("drives", 1, "soft fin on a rail"), ("soft-plates", 0, "fin")]
)
def test_robots_of_pages_are_read(page: str, k: int, name: str, tmp_path: Path):
    (tmp_path / "robot.yaml").write_text(blocks(page, "yaml")[k])
    assert load_robot(tmp_path / "robot.yaml").name == name


@pytest.mark.parametrize(
    ("page", "k", "read"),
    [("measure", 0, load_sheet), ("track", 0, video.load_sheet)],
)
def test_sheets_are_read(page: str, k: int, read: Callable[[Path], object], tmp_path: Path):
    (tmp_path / "sheet.yaml").write_text(blocks(page, "yaml")[k])
    read(tmp_path / "sheet.yaml")


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_have_the_options_that_pages_show(command: str):
    words = shlex.split(command.partition(" > ")[0], comments=True)
    app.parse_args(words[1:], print_error=False, exit_on_error=False)

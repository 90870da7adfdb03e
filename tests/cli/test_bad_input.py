"""Hundreds of wrong inputs, generated: each ends with exit code 2 and one sentence, and leaves no file behind."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests.small_robots import BALL

import nectosome.robots as nectosome_robots
from nectosome.description import apply_settings, load_robot, numeric_paths
from nectosome.robots.shipped import file_of

from .answers import check_wrong, faults

FLAGELLUM = load_robot(file_of("flagellum"))
COMMANDS = (
    "reproduce",
    "simulate",
    "static",
    "steady",
    "periodic",
    "design",
    "show",
    "check",
    "schema",
    "measure",
    "new",
)
SOLVERS = ("simulate", "static", "steady", "periodic")
THERE = (("--save", "run.nc"), ("--save", "there.csv"), ("--plot", "there.html"))  # files that exist


def wrong_values() -> list[tuple[str, ...]]:
    """Every quantity of the flagellum, set to what is no number, not finite, of another kind or out of range."""
    cases = []
    for path, quantity in numeric_paths(FLAGELLUM).items():
        unit = quantity.unit
        other = "3 kg" if quantity.dimension != "mass" else "3 mm"
        values = ["nan", f"inf {unit}", f"1e999 {unit}", "banana", "3 parsec", other, f"3 {unit} {unit}/", "[1, 2]"]
        values += ["3"] if unit else []
        values += [f"-1 {unit}"] if quantity.minimum == 0 else []
        values += [f"0 {unit}"] if quantity.exclusive else []
        values += [f"{quantity.maximum + 1} {unit}"] if quantity.maximum is not None else []
        cases += [("simulate", "flagellum", "--set", f"{path}={value}") for value in values]
        cases.append(("simulate", "flagellum", "--set", f"{path}x=1 {unit}"))
    cases += [("simulate", "paddle", "--set", f"N={n}") for n in ("9", "-1", "1.5", "two", "nan", "3 m")]
    for alias in FLAGELLUM.aliases:
        cases += [("simulate", "flagellum", "--set", f"{alias}={value}") for value in ("nan", "3", "banana", "-1 cd")]
    settings = ("E", "E=", "=3MPa", "=", "", " ", "E 3MPa", "body=3", "limbs=", "limbs.filament.strains.torsion=-1")
    settings += ("limbs.filament.strains.torsion=1.5", "limbs.filament.points=1", "limbs.hook.on=nobody", "name=")
    settings += ("limbs.filament.strains.torsion={}", "limbs.shaft.joint={kind: glue}", "body.kind=[", "e=3MPa")
    cases += [("simulate", "flagellum", "--set", setting) for setting in settings]
    return cases


def wrong_options() -> list[tuple[str, ...]]:
    """Options that are missing, unknown, twice, out of range or of the wrong kind."""
    cases: list[tuple[str, ...]] = [("simulat",), ("--verbose",), ("-x",), ("nonsense", "flagellum"), ("",)]
    for command in COMMANDS:
        robot = ("flagellum",) if command in (*SOLVERS, "design", "show", "check") else ()
        cases += [(command, *robot, option) for option in ("--nonsense", "-q", "--tiem=3s", "--nonsense=3", "--no-set")]
        if robot:
            cases += [(command,), (command, *robot, "more"), (command, *robot, "two", "more")]
    cases += [("schema", "more"), ("show", "flagellum", "--plot"), ("show", "flagellum", "--plot", "page.txt")]
    cases += [("show", "flagellum", "--save", "page.nc"), ("simulat",), ("show", "flagelum"), ("show", "tunna")]
    times = (
        "",
        " ",
        "3",
        "0s",
        "-1s",
        "nan",
        "nan s",
        "inf s",
        "1e999 s",
        "3 m",
        "3 parsec",
        "three seconds",
        "s",
        "3 s s",
    )
    cases += [("simulate", "flagellum", "--time", time) for time in times]
    samples = ("", "0", "1", "-5", "1.5", "1e3", "nan", "many", "100001", "9" * 30, "0x10", "[3]", "3 s")
    cases += [("simulate", "flagellum", "--samples", number) for number in samples]
    tolerances = ("", "0", "1", "-1e-3", "nan", "inf", "1e999", "small", "1e-3 m", "[1e-3]", "1e-400", "2")
    cases += [("simulate", "flagellum", "--rtol", number) for number in tolerances]
    cases += [
        ("simulate", "flagellum", "--method", method) for method in ("", "euler", "Auto ", "3", "implicit,explicit")
    ]
    for option in ("--time", "--samples", "--rtol", "--method", "--set", "--save"):
        cases.append(("simulate", "flagellum", option))
    cases += [("simulate", "flagellum", "--time", "1s", "--time", "2s"), ("simulate", "flagellum", "--time=")]
    targets = (
        "",
        ".",
        "/",
        "folder.nc",
        "nowhere/run.nc",
        "ball.yaml/run.nc",
        "run",
        "run.html",
        "ball.yaml",
        "a" * 300,
    )
    targets += ("a" * 253 + ".nc", "/dev/full", "/dev/null", "/proc/run.nc", "bad\0name.nc", "pipe.nc")
    cases += [(command, "ball.yaml", "--save", target) for command in SOLVERS for target in targets]
    pages = ("", ".", "folder.html", "nowhere/page.html", "page.nc", "ball.yaml", "page", "/proc/page.html")
    cases += [("show", "run.nc", "--plot", page) for page in pages]
    cases += [(command, "ball.yaml", "--plot", page) for command in SOLVERS for page in pages]
    cases += [(command, "ball.yaml", option, name) for command in SOLVERS for option, name in THERE]
    cases += [("show", "run.nc", "--plot", "there.html"), ("render", "run.nc", "--save", "there.png")]
    cases += [("new", "tail", "ball.yaml"), ("measure", "there.csv", "--save", "there.csv")]
    cases += [("reproduce", name) for name in ("nonsense", "", "--all", "FLAGELLUM", "flagellum,flagellum")]
    cases += [
        ("reproduce", "flagellum", name)
        for name in ("nonsense", "--out", "--jason", "--force=", "--quik", "--quick=maybe")
    ]
    cases += [
        ("reproduce", "--out", folder) for folder in ("ball.yaml", "ball.yaml/out", "/proc/out", "bad\0name", "a" * 300)
    ]
    cases += [("reproduce", "--out", "made"), ("reproduce", "--jason", "a.json")]
    return cases


def wrong_robots() -> list[tuple[str, ...]]:
    """Robots and files that are not there or damaged, given to every command that reads one."""
    robots = [
        "flagelum",
        "",
        ".",
        "/",
        "folder",
        "nowhere.yaml",
        "nowhere/ball.yaml",
        "bad\nname",
        "bad\0name",
    ]
    robots += ["flagella0", "paddle9", *(f"damaged/{name}" for name in damaged_files())]
    cases = [(command, robot) for robot in robots for command in (*SOLVERS, "design", "show", "check")]
    return [*cases, *((command, "run.nc") for command in (*SOLVERS, "design", "check"))]


def wrong_designs() -> list[tuple[str, ...]]:
    """Designs of what is not there, within what makes no sense, kept where nothing can be kept."""
    ball = ("design", "ball.yaml", "--vary", "body.density=1100..1300kg/m3")
    numbers = ("", "-1", "1.5", "nan", "inf", "1e3", "many", "9" * 5000, "0x10", "[3]", "3 s")
    cases: list[tuple[str, ...]] = [(*ball, "--starts", number) for number in (*numbers, "0", "100001")]
    cases += [(*ball, "--seed", number) for number in (*numbers, str(2**31))]
    cases += [(*ball, "--optimiser", name) for name in ("", "nsga2", "Gradient", "newton", "3")]
    cases += [
        (*ball, f"--{sense}", name) for sense in ("maximise", "minimise") for name in ("sped", "speed=3", "x" * 300)
    ]
    cases.append((*ball, "--maximise", "speed", "--minimise", "power"))
    cases += [(*ball, "--forward", name) for name in ("q", "--x", "xy", "1", "[1, 0, 0]")]
    ranges = (
        "",
        "=",
        "L",
        "body.density",
        "body.density=",
        "=1 m .. 2 m",
        "body.density=1100 kg/m3",
        "body=1 m .. 2 m",
    )
    ranges += (
        "body.density=1100..1300",
        "body.density=1100..1300:10kg",
        "body.density=1300 kg/m3 .. 1100 kg/m3",
        "body.density=1 kg .. 2 kg",
    )
    ranges += ("body.density=0 kg/m3 .. 9 kg/m3", "body.densty=1 kg/m3 .. 2 kg/m3", "body.length=0 m .. 1 m log")
    ranges += (
        "body.density=nan .. 3 kg/m3",
        "body.density=..",
        "body.density=1 kg/m3 .. 2 kg/m3 lg",
        "body.density=\n..\n",
    )
    cases += [("design", "ball.yaml", "--vary", text) for text in ranges]
    cases.append(("design", "ball.yaml"))
    fixed = (
        "",
        "body.density",
        "body.density=3",
        "body.densty=3 kg/m3",
        "body.density=1200 kg/m3",
        "body.density=-1 kg/m3",
    )
    cases += [(*ball, "--set", text) for text in (*fixed, "body.joint={kind: fixed}")]
    limits = ("", "torque", "torqe <= 1 N m", "torque < 1 N m", "torque <= 1", "torque <= nan N m", "torque <= 1 kg")
    limits += ("motor 1 N m", "motor 0 N m, 3 rad/s", "motor 1 N m, 3 s", "x" * 500, "torque <= 1 N m <= 2 N m")
    cases += [(*ball, "--keep", text) for text in limits]
    problems = ("", ".", "folder", "nowhere.yaml", "run.nc", "ball.yaml", "bad\0name", "pipe.nc/x")
    problems += ("problem_binary.yaml", "problem_empty.yaml", "problem_cut.yaml", "problem_foreign.yaml")
    cases += [("design", "ball.yaml", "--problem", file) for file in problems]
    cases += [
        (*ball, "--out", folder) for folder in ("ball.yaml", "ball.yaml/out", "/proc/out", "bad\0name", "a" * 300)
    ]
    cases += [(*ball, "--out", folder) for folder in ("held", "other", "starts")]
    folders = ("foreign", "cut", "wrong", "deep")
    cases += [(*ball, "--out", folder) for folder in folders]
    cases += [(*ball, "--write", file) for file in ("best.nc", "nowhere/best.yaml", "ball.yaml")]
    cases += [(*ball, "--save", file) for file in ("run.txt", "nowhere/run.nc")]
    cases += [("design",), ("design", "sinks.yaml")]
    options = (
        "optimiser",
        "starts",
        "seed",
        "maximise",
        "minimise",
        "vary",
        "set",
        "keep",
        "forward",
        "problem",
        "out",
    )
    return cases + [(*ball, f"--{option}") for option in options]


def wrong_steady() -> list[tuple[str, ...]]:
    """Settings and options of `steady`."""
    settings = (
        "",
        "E",
        "E=",
        "E=3",
        "E=3 kg",
        "E=nan",
        "omega=3 Pa",
        "nobody=3 m",
        "body=3",
        "limbs.filament.points=1",
    )
    cases: list[tuple[str, ...]] = [("steady", "flagellum", "--set", setting) for setting in settings]
    fixed = "body.joint={kind: fixed}"
    return [
        *cases,
        ("steady", "ball.yaml", "--set", fixed),
        ("steady", "flagellum", "--set"),
        ("steady", "flagellum", "--save"),
        ("steady", "flagellum", "--plot"),
    ]


def wrong_runs() -> list[tuple[str, ...]]:
    """Results files that are damaged or foreign."""
    names = (
        "cut10.nc",
        "cut1000.nc",
        "cuthalf.nc",
        "cutlast.nc",
        "zeros.nc",
        "head.nc",
        "text.nc",
        "empty.nc",
        "nowhere.nc",
    )
    foreign = ("foreign.nc", "nodata.nc", "noattributes.nc", "badprovenance.nc", "notime.nc", "strings.nc", "folder.nc")
    return [("show", name) for name in (*names, *foreign)]


def damaged_files() -> dict[str, bytes]:
    """Robot files with something wrong in them, by name."""
    ball = BALL.encode()
    files = {f"cut{n}.yaml": ball[:-n] for n in (2, 10, 20, 40, 60, 80, 100, 150, 200)}
    files |= {
        "empty.yaml": b"",
        "binary.yaml": bytes(range(256)),
        "zeros.yaml": b"\0" * 100,
        "latin.yaml": ball + b"# \xe9",
    }
    files |= {"list.yaml": b"- 1\n- 2\n", "number.yaml": b"3\n", "foreign.yaml": b"services:\n  web: {image: nginx}\n"}
    files |= {"tag.yaml": b"!!python/object/apply:os.system ['true']\n", "huge.yaml": ball + b"#" * 4_100_000}
    files |= {"twice.yaml": ball + b"name: ball\n", "tabs.yaml": b"name:\tball\n\tbody: 3\n", "word.yaml": b"ball\n"}
    changes = {
        "radius: 20 mm": (
            "-20 mm",
            "0 mm",
            "nan",
            "inf mm",
            "20",
            "20 kg",
            "twenty mm",
            "[20 mm]",
            "1e200 m",
            "1e-200 m",
            "",
        ),
        "density: 1200 kg/m3": ("-1200 kg/m3", "0 kg/m3", ".nan", "1200", "1200 mm", "{a: 1}", "1e400 kg/m3", "true"),
        "kind: rigid": ("soft", "", "[rigid]", "3"),
        "shape: spheroid": ("cube", "point", "box", ""),
        "axis: z": ("q", "[0, 0, 0]", "[1, 2]", "3", "[nan, 0, 1]"),
    }
    for line, values in changes.items():
        key = line.partition(":")[0]
        for i, value in enumerate(values):
            files[f"{key}{i}.yaml"] = BALL.replace(line, f"{key}: {value}").encode()
    return files


CASES = [*wrong_values(), *wrong_options(), *wrong_robots(), *wrong_steady(), *wrong_designs(), *wrong_runs()]


@pytest.fixture(scope="module")
def bench(tmp_path_factory, ball_run):
    """A folder with a good robot, a good run, and everything damaged."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "ball.yaml").write_text(BALL)
    for name in ("folder", "damaged", "folder.nc", "folder.html", "made"):
        (folder / name).mkdir()
    for name in ("there.html", "there.csv", "there.png", "made/scorecard.json"):
        (folder / name).write_text("time,x\n0,1\n1,2\n")
    os.mkfifo(folder / "pipe.nc")
    for name, content in damaged_files().items():
        (folder / "damaged" / name).write_bytes(content)
    fill_design_folders(folder)
    run = ball_run.read_bytes()
    cuts = {"cut10": run[:10], "cut1000": run[:1000], "cuthalf": run[: len(run) // 2], "cutlast": run[:-100]}
    cuts |= {"zeros": bytes(len(run)), "head": bytes(64) + run[64:], "text": BALL.encode(), "empty": b""}
    for name, content in {**cuts, "run": run}.items():
        (folder / f"{name}.nc").write_bytes(content)
    good = xr.load_dataset(ball_run, engine="h5netcdf")
    foreign = {
        "foreign": xr.Dataset({"temperature": ("depth", np.arange(5.0))}),
        "nodata": good.drop_vars("load_power"),
        "noattributes": good.drop_attrs(),
        "badprovenance": good.assign_attrs(provenance="{"),
        "notime": good.isel(time=slice(0, 0)),
        "strings": good.assign(energy=good["energy"].astype(str)),
    }
    for name, dataset in foreign.items():
        dataset.to_netcdf(folder / f"{name}.nc", engine="h5netcdf")
    return folder


def fill_design_folders(folder: Path) -> None:
    """Problem files and folders of designs, damaged, foreign, and one that is in use."""
    good = b"vary: {body.density: 1100..1300 kg/m3}\nforward: -z\n"
    files = {
        "binary": bytes(range(256)),
        "empty": b"",
        "cut": good[:-20],
        "foreign": b"services: {web: {image: nginx}}\n",
    }
    for name, content in files.items():
        (folder / f"problem_{name}.yaml").write_bytes(content)
    (folder / "sinks.yaml").write_text(BALL)
    (folder / "sinks.design.yaml").write_text("vary: {body.densty: 1100..1300 kg/m3}\n")
    known = ("task", "names", "constraint_names", "tolerance", "seed", "draws", "starts")
    other = dict.fromkeys(known, 1) | {"format": 2, "about": {}, "optimiser": {"name": "gradient"}}
    text = json.dumps(other)
    designs = {"cut": text[:30], "foreign": "{}", "other": text, "deep": "[" * 100_000}
    designs["wrong"] = json.dumps(other | {"starts": "many", "optimiser": []})
    for name, content in designs.items():
        (folder / name).mkdir()
        (folder / name / "search.json").write_text(content)
    for name in ("other", "held", "starts"):
        (folder / name).mkdir(exist_ok=True)
        (folder / name / "lock").write_text("1")
    for name in ("other", "starts"):
        (folder / name / "start_0000.jsonl").write_text("{}")


@pytest.fixture(scope="module", autouse=True)
def in_use(bench):
    """Another process has the folder `held`."""
    code = "import fcntl, sys; f = open(sys.argv[1], 'a+'); fcntl.flock(f, 2); print(flush=True); sys.stdin.read()"
    argv = [sys.executable, "-c", code, str(bench / "held" / "lock")]
    with subprocess.Popen(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        yield
        other.kill()


def test_there_are_hundreds_of_cases():
    assert len(set(CASES)) > 900


@pytest.mark.parametrize("part", [0, 3, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2, 4, 5, 6, 7))])
def test_wrong_input_is_answered_with_one_sentence_and_exit_code_2(nectosome, bench, monkeypatch, part):
    monkeypatch.chdir(bench)
    describe = nectosome_robots.describe

    def known(name, settings=()):
        return apply_settings(FLAGELLUM, settings) if name == "flagellum" else describe(name, settings)

    monkeypatch.setattr(nectosome_robots, "describe", known)
    check_wrong(nectosome, CASES[part::8], bench)


def test_a_name_too_long_for_a_file_is_told_as_any_other(nectosome):
    answer = nectosome("simulate", "x" * 5000)
    assert faults(answer.code, answer.err) == []


def test_the_installed_command_answers_the_same(tmp_path):
    """The entry point, in a process of its own."""
    command = Path(sys.executable).with_name("nectosome")
    argv = ("simulate", "flagellum", "--set", "E=7.4MP", "--save", "run.nc")
    done = subprocess.run([command, *argv], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert faults(done.returncode, done.stderr) == []
    assert done.stderr.startswith('E: "7.4MP" has no unit called MP.')
    assert list(tmp_path.iterdir()) == []

"""`control ROBOT`: what it prints, writes and refuses."""

import numpy as np
import pytest

from nectosome.io import load_dataset

from .answers import check_wrong

DIVER = """
name: diver
water: {density: 1000 kg/m3, surface: 0 m}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 2 L
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint:
    kind: prismatic
    axis: z
    position: -1 m
    stiffness: 1e-9 N/m # of a spring that is none
    damping: 1e-9 N s/m
    rest: -1 m
    force: {kind: constant, value: 0 N}
  loads: {drag: {kind: lumped_drag, drag_area: [0 m2, 0 m2, 0.2 m2]}}
aliases: {thrust: body.joint.force.value, volume: body.volume}
"""
ASKED = ("control", "diver.yaml", "--command", "thrust=-20..20N", "--measure", "depth", "--rate", "10Hz")


def asked(*changes: str) -> tuple[str, ...]:
    """The diver to 1.5 m, with options changed, added, or without a value."""
    options: dict[str, tuple[str, ...]] = {}
    for one in (*ASKED[2:], "--reference", "1.5m", *changes):
        if one.startswith("--"):
            name, _, value = one.partition("=")
            options[name] = (one,) if value else (name,)
            last = name
        else:
            options[last] = (last, one)
    return (*ASKED[:2], *(x for words in options.values() for x in words))


@pytest.fixture
def diver(tmp_path):
    (tmp_path / "diver.yaml").write_text(DIVER)


def test_a_diver_finds_gains_and_goes_down(nectosome, diver, tmp_path):
    """Thrust up makes depth less: the gains are below nothing."""
    answer = nectosome(*ASKED, "--reference", "1.5m", "--time", "20s", "--save", "run.nc", "--plot", "run.html")
    assert (answer.code, answer.err) == (0, "")
    for words in ("diver: depth by thrust, 20 s", "gains: -", "(N/m, N/(m s), N s/m), from a relay", "overshoot"):
        assert words in answer.out
    run = load_dataset(tmp_path / "run.nc")
    assert run.attrs["measured"] == "depth"
    np.testing.assert_allclose(run["output"].values[-20:], 1.5, atol=1e-3)
    np.testing.assert_allclose(run["reading"].values, -run["position"].sel(axis="z").values[:, 0], atol=1e-12)
    assert np.abs(run["command"].values).max() <= 20
    assert "depth by thrust" in (tmp_path / "run.html").read_text()


def test_nothing_is_overwritten_without_force_and_a_table_has_the_samples(nectosome, diver, tmp_path):
    (tmp_path / "run.csv").write_text("mine")
    short = ("--gains=-40,-2,-60", "--time", "2s", "--save", "run.csv")
    check_wrong(nectosome, [asked(*short)], tmp_path)
    assert nectosome(*asked(*short), "--force").code == 0
    rows = (tmp_path / "run.csv").read_text().splitlines()
    assert rows[0] == "sample (s),reference (m),output (m),measured (m),command (N)" and len(rows) == 22


def test_gains_are_in_the_units_in_which_command_and_reference_are_written(nectosome, diver):
    runs = []
    for command, reference, gains in (("-20..20N", "120cm", "-1,0,-0.5"), ("-0.02..0.02kN", "1.2m", "-0.1,0,-0.05")):
        units = ("--command", f"thrust={command}", "--reference", reference, f"--gains={gains}")
        answer = nectosome(*asked(*units, "--time", "4s", "--save", "run.nc"), "--force")
        assert (answer.code, answer.err) == (0, "")
        runs.append(load_dataset("run.nc")["output"].values)
    np.testing.assert_allclose(runs[0], runs[1], atol=1e-9)


def test_a_reference_that_is_not_reached_yet_is_not_out_of_reach(nectosome, diver):
    """1 N lets it sink at 0.1 m/s at most: 8 m take longer than 5 s."""
    few = ("--command", "thrust=-1..1N", "--time", "5s")
    slow = nectosome(*asked(*few, "--reference", "9m", "--gains=-10,0,0"))
    assert slow.code == 1
    assert slow.err.startswith(
        "diver: 9 m is not reached yet: thrust is at -1 N, the end of its range, and depth is 1."
    )
    assert "approaches it. Give it more time." in slow.err
    other = nectosome(*asked(*few, "--gains", "10,0,0"))
    assert other.code == 1
    assert "moved away from the reference" in other.err and "other sign" in other.err


def test_a_reference_out_of_reach_is_named(nectosome, diver, tmp_path):
    """Against a spring of 20 N/m, 1 N sinks it by 5 cm; it is damped, and at rest after a while."""
    spring = DIVER.replace("1e-9 N/m", "20 N/m").replace("1e-9 N s/m", "20 N s/m")
    (tmp_path / "sprung.yaml").write_text(spring)
    few = ("--command", "thrust=-1..1N", "--measure", "depth", "--reference", "2m", "--gains=-10,0,0", "--time", "20s")
    answer = nectosome("control", "sprung.yaml", *few)
    assert answer.code == 1
    told = "diver: the reference is out of reach: thrust is at -1 N, the end of its range, and depth is 1.05 m instead"
    assert answer.err.startswith(told)


def test_a_chirp_and_a_recording_are_references_too(nectosome, diver, tmp_path):
    gains = ("--gains=-40,-2,-60", "--save", "run.nc")
    chirp = ("--reference", "chirp", "--amplitude", "10cm", "--frequency", "0.05Hz", "--to", "0.2Hz", "--time", "10s")
    answer = nectosome(*ASKED, *chirp, *gains)
    assert (answer.code, answer.err) == (0, "")
    wanted = load_dataset("run.nc")["reference"].values
    assert wanted[0] == 1.0 and np.ptp(wanted) == pytest.approx(0.2, rel=0.05)
    (tmp_path / "dive.csv").write_text("time (s),depth (cm),pressure (bar)\n0,100,1\n4,120,1\n8,120,1\n")
    answer = nectosome(*ASKED, "--reference", "dive.csv", "--gains=-40,-2,-60", "--save", "dive.nc")
    assert (answer.code, answer.err) == (0, "")
    run = load_dataset("dive.nc")
    np.testing.assert_allclose(run["reference"].values[[0, 20, 40, 80]], [1.0, 1.1, 1.2, 1.2], atol=1e-12)
    assert run.sizes["sample"] == 81


def test_a_sine_is_followed_about_where_the_robot_starts(nectosome, diver):
    wave = ("--reference", "sine", "--amplitude", "20cm", "--frequency", "0.1Hz", "--gains=-40,-2,-60")
    answer = nectosome(*ASKED, *wave, "--time", "20s", "--noise", "1mm", "--delay", "50ms", "--save", "run.nc")
    assert (answer.code, answer.err) == (0, "")
    run = load_dataset("run.nc")
    assert run["reference"].values.max() == pytest.approx(1.2, abs=1e-3)
    assert np.std(run["measured"].values - run["output"].values) > 1e-3
    assert np.sqrt(np.mean((run["output"] - run["reference"]) ** 2)) < 0.06


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (("--command", "thrust=-0.2..0.2N"), "thrust is at an end of its range (-0.2 N and 0.2 N) in"),
        (
            ("--rate", "1Hz", "--frequency", "0.2Hz", "--gains=-2,0,-4"),
            "the reference has about 5 samples a cycle. Take a higher --rate.",
        ),
        (("--gains=-0.01,0,0",), "its command stays within its range. Larger --gains, or ff-pid, mpc or ilc"),
    ],
)
def test_a_sine_that_is_tracked_poorly_is_told_with_its_cause(nectosome, diver, options, why):
    """An error above half of what the reference varies by, 20 cm over root two, in the second half of the run."""
    wave = ("--reference", "sine", "--amplitude", "20cm", "--frequency", "0.1Hz", "--gains=-40,-2,-60", "--time", "30s")
    answer = nectosome(*asked(*wave, *options))
    assert answer.code == 1
    assert answer.err.startswith("diver: tracks poorly: depth is off by ")
    assert "(rms), and its reference varies by 1" in answer.err
    assert why in " ".join(answer.err.split())


def test_mistakes_are_told_and_nothing_is_written(nectosome, diver, tmp_path):
    check_wrong(
        nectosome,
        [
            asked("--command", "push=-20..20N"),
            asked("--command", "thrust=-20..20"),
            asked("--command", "thrust=-20..20mm"),
            asked("--command", "thrust=20..-20N"),
            asked("--command", "thrust=20N"),
            asked("--command", "thrust=5..20N"),
            asked("--command", "volume=-1..3L"),
            asked("--reference", "1.5"),
            asked("--reference", "30deg"),
            asked("--reference", "sinus"),
            asked("--reference", "sine", "--amplitude", "10cm"),
            asked("--reference", "triangle", "--amplitude=-10cm", "--frequency", "1Hz"),
            asked("--amplitude", "10cm"),
            asked("--column", "depth"),
            asked("--reference", "chirp", "--amplitude", "10cm", "--frequency", "1Hz"),
            asked("--reference", "gone.csv"),
            asked("--gains", "1,2"),
            asked("--gains", "1,-2,0"),
            asked("--gains", "0,0,0"),
            asked("--gains", "1N,2,0"),
            asked("--mean"),
            asked("--rate", "0Hz"),
            asked("--rate", "1MHz"),
            asked("--rate", "5s"),
            asked("--rate", "0.01Hz"),
            asked("--time=-1s"),
            asked("--noise", "1deg"),
            asked("--noise=-1mm"),
            asked("--delay", "1mm"),
            asked("--plot", "run.png"),
            asked("--measure", "deep"),
            ("control", "nobody", *ASKED[2:], "--reference", "1.5m"),
            ("control", "diver.yaml", "--measure", "depth", "--reference", "1.5m"),
            ("control", "eel", "--command", "f=0..3Hz", "--measure", "velocity.x", "--mean", "--reference", "-0.3m/s"),
        ],
        tmp_path,
    )


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (("--measure", "deep"), '--measure: "deep" is nothing that can be measured. Did you mean "depth"?'),
        (("--command", "thrust=5..20N"), "--command thrust: it starts at 0 N, outside of 5 N to 20 N."),
        (("--mean",), "--mean: there is no beat to average over: nothing of this robot is driven"),
    ],
)
def test_a_mistake_is_told_with_its_way_out(nectosome, diver, argv, message):
    answer = nectosome(*asked(*argv))
    assert answer.code == 2
    assert answer.err.startswith(message)


@pytest.mark.slow
def test_an_eel_turns_to_a_heading_and_holds_it(nectosome):
    """30 deg by bending more to one side, within 8 mN m, with the gains found: after 5 s within 5 %, then it stays."""
    turn = ("--command", "bias=-8..8mN m", "--measure", "heading", "--reference", "30deg", "--time", "20s", "--mean")
    answer = nectosome("control", "eel", *turn, "--save", "run.nc")
    assert (answer.code, answer.err) == (0, "")
    run = load_dataset("run.nc")
    degrees, time = np.degrees(run["output"].values), run["sample"].values
    assert np.abs(degrees[time > 5.0] - 30).max() < 1.5
    assert degrees.max() < 42
    np.testing.assert_allclose(degrees[time > 19], 30, atol=0.01)
    assert np.abs(run["command"].values).max() <= 8e-3
    assert np.ptp(np.degrees(run["reading"].values[run["time"].values > 10])) > 60  # the head goes to and fro
    path = run["position"].values[run["time"].values > 10, 0]
    beats = path[:: round(0.5 / np.diff(run["time"].values).mean())]
    course = beats[0] - beats[-1]  # it swims towards -x of its own
    assert np.degrees(np.arctan2(course[1], course[0])) == pytest.approx(30, abs=2)

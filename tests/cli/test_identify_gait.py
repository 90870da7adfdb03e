"""`identify gait`: what it refuses, and a small search that is written, and that goes on from its folder."""

import json
import sys
from contextlib import nullcontext

import numpy as np
import pytest
from tests.afar import Afar

from nectosome.io import load_dataset
from nectosome.search.executors.cluster import cluster

from .answers import check_wrong, contents, faults
from .conftest import BALL

GAIT = "amplitude: 7.4 mm, frequency: 1.98 Hz, speed: 40 mm/s, height: 127 mm"
GOOD = f"""\
about: two gaits
robot: poseidrone_crawl
vary:
  k: 100 N/m .. 300 N/m
  d_r: 0.5 .. 1.5
seconds: 2 s
window: 1 s
trials:
  - {{{GAIT}}}
  - {{{GAIT}, set: {{volume: 0.64 L}}}}
"""
REST = GOOD[GOOD.index("robot") :]
REST_OF = f"robot: {{}}\nvary: {{{{{{}}}}}}\ntrials: [{{{{{GAIT}}}}}]\n"
GIVEN = ("identify", "gait", "--target", "gaits.yaml")

# what is put in the place of a text of the good file, and what the answer begins with
CHANGES = {
    "no_robot": (
        "robot: poseidrone_crawl",
        "about_robot: 3",
        'line 2, about_robot: there is no field "about_robot" here.',
    ),
    "robot_gone": ("robot: poseidrone_crawl\n", "", "line 1, robot: is missing."),
    "robot": ("poseidrone_crawl", "poseidrome", 'line 2, robot: there is no robot called "poseidrome"'),
    "robot_file": ("poseidrone_crawl", "nowhere.yaml", "line 2, robot: "),
    "robot_bad_file": ("poseidrone_crawl", "bad_ball.yaml", "line 2, robot: "),
    "robot_list": ("poseidrone_crawl", "[poseidrone_crawl]", "line 2, robot: "),
    "no_legs": (REST, REST_OF.format("flagellum", "E: 1 MPa .. 2 MPa"), "line 2, robot: flagellum has no legs"),
    "no_legs_file": (
        REST,
        REST_OF.format("ball.yaml", "body.density: 1 kg/m3 .. 2 kg/m3"),
        "line 2, robot: ball has no legs",
    ),
    "field": (
        "seconds: 2 s",
        "secnds: 2 s",
        'line 6, secnds: there is no field "secnds" here. Did you mean "seconds"?',
    ),
    "no_range": ("0.5 .. 1.5", "0.5", "line 5, vary.d_r: "),
    "empty_range": ("0.5 .. 1.5", "1.5 .. 0.5", 'line 5, vary.d_r: "1.5 .. 0.5" is empty'),
    "bare_range": ("100 N/m .. 300 N/m", "100 .. 300", 'line 4, vary.k: "100" has no unit.'),
    "wrong_range": ("100 N/m .. 300 N/m", "100 N .. 300 N", "line 4, vary.k: "),
    "negative_range": ("100 N/m .. 300 N/m", "-100 N/m .. 300 N/m", "line 4, vary.k: "),
    "log_of_zero": ("0.5 .. 1.5", "0 .. 1.5 log", "line 5, vary.d_r: "),
    "unknown_name": (
        "d_r: 0.5",
        "d_s: 0.5",
        'line 5, vary.d_s: there is no quantity called "d_s" in poseidrone_crawl.',
    ),
    "no_quantity": ("d_r: 0.5", "body.kind: 0.5", 'line 5, vary.body.kind: there is no quantity called "body.kind"'),
    "switch": ("d_r: 0.5", "body.loads.front.pulls: 0.5", "line 5, vary.body.loads.front.pulls: there is no"),
    "nothing_unknown": (
        "  k: 100 N/m .. 300 N/m\n  d_r: 0.5 .. 1.5\n",
        "",
        "line 3, vary: an empty value does not fit here.",
    ),
    "twice": (
        "d_r: 0.5 .. 1.5",
        "body.loads.front.stiffness: 1 N/m .. 3 N/m",
        "line 5, body.loads.front.stiffness: is given twice: k stands for it too.",
    ),
    "twice_in_set": (
        "volume: 0.64 L",
        "body.loads.front.damping_ratio: 1",
        "body.loads.front.damping_ratio: is given twice: d_r stands for it too.",
    ),
    "known_too": ("volume: 0.64 L", "d_r: 1", "line 5, d_r: varies, and cannot be given too."),
    "bare_seconds": ("seconds: 2 s", "seconds: 2", 'line 6, seconds: "2" has no unit.'),
    "no_seconds": ("seconds: 2 s", "seconds: 0 s", "line 6, seconds: "),
    "minus_seconds": ("seconds: 2 s", "seconds: -2 s", "line 6, seconds: "),
    "endless": ("seconds: 2 s", "seconds: 1e9 s", 'line 6, seconds: "1e+09 s" is out of range'),
    "windows": ("window: 1 s", "window: 0.7 s", "line 7, window: is 0.7 s; the 2 s of a walk must be so many of them."),
    "short_window": ("window: 1 s", "window: 1e-6 s", "line 7, window: "),
    "uneven_window": ("window: 1 s", "window: 1.25 ms", "line 7, window: "),
    "error": ("window: 1 s", "error: 0", "line 7, error: "),
    "error_unit": ("window: 1 s", "error: 1 mm", "line 7, error: "),
    "feature": ("speed: 40 mm/s, height", "height", "line 9, trials.0.speed: is missing."),
    "feature_name": (
        "speed: 40 mm/s",
        "sped: 40 mm/s",
        'line 9, trials.0.sped: there is no field "sped" here. Did you mean "speed"?',
    ),
    "bare_feature": ("speed: 40 mm/s", "speed: 40", 'line 9, trials.0.speed: "40" has no unit.'),
    "feature_unit": ("speed: 40 mm/s", "speed: 40 mm", "line 9, trials.0.speed: "),
    "feature_zero": ("speed: 40 mm/s", "speed: 0 mm/s", "line 9, trials.0.speed: "),
    "feature_none": ("speed: 40 mm/s", "speed: ", "line 9, trials.0.speed: an empty value does not fit here."),
    "feature_nan": ("speed: 40 mm/s", "speed: nan mm/s", "line 9, trials.0.speed: "),
    "feature_list": ("speed: 40 mm/s", "speed: [40 mm/s]", "line 9, trials.0.speed: "),
    "set": ("{volume: 0.64 L}", "0.64 L", 'line 10, trials.1.set: "0.64 L" does not fit here.'),
    "set_name": ("volume: 0.64 L", "volum: 0.64 L", 'line 10, trials.1.set.volum: there is no quantity called "volum"'),
    "set_unit": ("volume: 0.64 L", "volume: 0.64 m", "line 10, trials.1.set.volume: "),
    "set_bare": ("volume: 0.64 L", "volume: 0.64", 'line 10, trials.1.set.volume: "0.64" has no unit.'),
    "set_minus": ("volume: 0.64 L", "volume: -0.64 L", "line 10, trials.1.set.volume: "),
    "key_twice": ("about: two gaits", "robot: poseidrone_crawl", 'line 2: "robot" occurs twice here'),
}
WHOLE = {
    "empty": "",
    "word": "gaits",
    "list": "- 1\n",
    "cut": GOOD[:60],
    "tag": "!!python/object/apply:os.system ['true']\n",
    "foreign": BALL,
    "trials_word": GOOD[: GOOD.index("  - ")].replace("trials:", "trials: none"),
    "trials_group": GOOD[: GOOD.index("  - ")] + f"  first: {{{GAIT}}}\n",
    "no_trials": GOOD[: GOOD.index("trials:")],
    "trial_word": GOOD[: GOOD.index("  - ")] + "  - fast\n",
    "unknown_word": "robot: poseidrone_crawl\nvary: k\ntrials: []\n",
}


@pytest.fixture
def gaits(tmp_path):
    """The good file, and a robot without legs."""
    (tmp_path / "gaits.yaml").write_text(GOOD)
    (tmp_path / "ball.yaml").write_text(BALL)
    (tmp_path / "bad_ball.yaml").write_text(BALL.replace("20 mm", "20 kg"))
    return tmp_path


def test_wrong_files_are_answered_with_file_line_and_field(nectosome, gaits):
    for name, (old, new, _) in CHANGES.items():
        assert old in GOOD
        (gaits / f"{name}.yaml").write_text(GOOD.replace(old, new, 1))
    before, wrong = contents(gaits), []
    for name, (*_, told) in CHANGES.items():
        answer = nectosome(*GIVEN[:3], f"{name}.yaml", "--out", "kept")
        found = faults(answer.code, answer.err)
        wrong += [(name, found, answer.err)] if found or not answer.err.startswith(f"{name}.yaml, {told}") else []
    assert wrong == []
    assert contents(gaits) == before


def test_wrong_commands_are_answered_in_a_sentence_and_nothing_is_written(nectosome, gaits):
    for name, text in WHOLE.items():
        (gaits / f"{name}.yaml").write_text(text)
    (gaits / "binary.yaml").write_bytes(bytes(range(256)))
    (gaits / "folder").mkdir()
    one = GOOD.replace("  d_r: 0.5 .. 1.5\n", "").replace(f"  - {{{GAIT}}}\n", "")
    (gaits / "one.yaml").write_text(one)
    files = (*(f"{name}.yaml" for name in WHOLE), "binary.yaml", "folder", "nowhere.yaml", "", "bad\0name")
    cases = [(*GIVEN[:3], file, "--out", "kept") for file in files]
    cases += [(*GIVEN, "--optimiser", name) for name in ("", "cma", "CMAES", "gradient")]
    cases.append((*GIVEN[:3], "one.yaml", "--optimiser", "nsga2", "--out", "kept"))
    cases += [(*GIVEN, "--evaluations", x) for x in ("0", "-1", "1.5", "many", "", "nan", "1e3")]
    cases += [(*GIVEN, "--seed", x) for x in ("-1", "1.5", "", "x")]
    cases += [(*GIVEN, "--goal", x) for x in ("-1", "nan", "inf", "", "1 m", "small")]
    cases += [(*GIVEN, "--out", x) for x in ("ball.yaml", "ball.yaml/kept", "/proc/kept", "bad\0name", "a" * 300)]
    cases += [(*GIVEN, "--save", x) for x in ("gait.txt", "nowhere/gait.nc", "folder")]
    cases += [(*GIVEN, "--plot", x) for x in ("gait.nc", "nowhere/gait.html", "folder")]
    cases += [GIVEN[:2], GIVEN[:3], (*GIVEN, "more"), (*GIVEN, "--walks", "3")]
    check_wrong(nectosome, cases, gaits)


def test_a_search_is_written_and_goes_on_where_it_ended(nectosome, gaits):
    asked = (*GIVEN, "--out", "kept", "--goal", "1e-9")
    first = nectosome(*asked, "--evaluations", "6", "--save", "six.nc", "--plot", "six.html")
    assert (first.code, first.err) == (0, "")
    six, journal = load_dataset(gaits / "six.nc"), (gaits / "kept" / "start_0000.jsonl").read_bytes()
    assert six.sizes["evaluation"] == 6
    more = nectosome(*asked, "--evaluations", "12", "--save", "more.nc")
    assert (more.code, more.err) == (0, "")
    found = load_dataset(gaits / "more.nc")
    assert found.sizes["evaluation"] == 12
    np.testing.assert_array_equal(found["discrepancy"][:6], six["discrepancy"])
    assert (gaits / "kept" / "start_0000.jsonl").read_bytes().startswith(journal)
    best = found["discrepancy"].min().item()
    off = (found["reached"] / found["target"] - 1).values
    assert (off**2).sum() == pytest.approx(best, rel=1e-9)
    assert np.all((found["low"] <= found["value"]) & (found["value"] <= found["high"]))
    assert abs(off[0] - off[1]).max() > 1e-3  # the second one has another volume
    assert json.loads(found.attrs["provenance"])["settings"]["evaluations"] == "12"
    for words in (
        "after 12 evaluations",
        "trial  feature",
        "\n2      ",
        "reached",
        "as good",
        "identifiable by the features",
        "written: more.nc",
    ):
        assert words in more.out
    page = (gaits / "six.html").read_text()
    for words in (
        "Identifiability by the features",
        "Search",
        "poseidrone_crawl, fitted to gaits of gaits.yaml by cmaes",
    ):
        assert words in page
    other = nectosome(*asked, "--evaluations", "12", "--seed", "2")
    assert other.code == 2
    assert "holds another seed (1, now 2)" in other.err


def test_a_front_between_trials_tells_the_least_sum_of_both(nectosome, gaits):
    answer = nectosome(*GIVEN, "--optimiser", "nsga2", "--evaluations", "1", "--save", "front.nc")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset(gaits / "front.nc")
    off = (found["reached"] / found["target"] - 1).values
    assert found["discrepancy"].min().item() == pytest.approx((off**2).sum(), rel=1e-9)


def test_a_cluster_that_is_lost_costs_what_was_in_flight(nectosome, gaits, monkeypatch):
    """Two batches a generation of six; it is lost in the second generation, and the same command goes on."""
    here = nectosome(*GIVEN, "--evaluations", "12", "--save", "here.nc")
    assert here.code == 0
    for most, code in ((3, 1), (100, 0)):
        with Afar(most=most) as executor:
            monkeypatch.setattr(sys.modules[cluster.__module__], "cluster", lambda _, own=executor: nullcontext(own))
            asked = (*GIVEN, "--evaluations", "12", "--out", "kept", "--save", "there.nc", "--cluster", "tcp://far:1")
            answer = nectosome(*asked)
        assert answer.code == code, answer.err
        if code:
            assert answer.err == (
                "the connection to the scheduler was lost. The same command goes on from what is in kept.\n"
            )
    names = ("value", "reached", "discrepancy", "position.z", "good_low", "good_high")
    ours, theirs = load_dataset(gaits / "here.nc"), load_dataset(gaits / "there.nc")
    for name in names:
        np.testing.assert_array_equal(theirs[name], ours[name])

"""`identify thruster` on a table: what it prints, writes and shows, and what it refuses."""

from tests.identification.test_thruster import HEAD, MAKER

from nectosome.io import load_dataset

ASKED = ("identify", "thruster", "t200.csv", "--diameter", "76mm")


def test_a_table_gives_the_fields_of_a_robot_file(nectosome, tmp_path):
    (tmp_path / "t200.csv").write_text(HEAD + MAKER["16"], encoding="utf-8")
    answer = nectosome(*ASKED, "--save", "t200.nc", "--plot", "t200.html")
    assert (answer.code, answer.err) == (0, "")
    for words in ("kind: thruster, diameter: 76 mm, thrust: 0.4", "torque_constant: 0.02", "dead_band: 0.075"):
        assert words in " ".join(answer.out.split())
    assert load_dataset(tmp_path / "t200.nc")["measured_thrust"].size == MAKER["16"].count("\n")
    assert "Table t200" in (tmp_path / "t200.html").read_text()


def test_what_is_wrong_is_told(nectosome, tmp_path):
    (tmp_path / "t200.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    cases = {
        ASKED: "t200.csv, command: is in no column",
        (*ASKED[:3], "--diameter", "76kg"): "--diameter",
        ("identify", "thruster", "nothing.csv", "--diameter", "76mm"): "nothing.csv",
    }
    for given, words in cases.items():
        answer = nectosome(*given)
        assert answer.code == 2
        assert words in " ".join(answer.err.split())
        assert "Traceback" not in answer.err

"""Values that no robot has: told before anything is computed, and nothing infinite passes for a result."""

import pytest
from tests.small_robots import SLIDE


@pytest.mark.parametrize(
    ("path", "value", "status", "said"),
    [
        ("body.joint.stiffness", "1e200 N/m", "NOT_FINITE", "slide: failed: the state is NaN or infinite"),
        ("body.joint.velocity", "1e200 m/s", "SOLVED", "powers or momenta are NaN or infinite: values are too large"),
    ],
)
def test_a_number_without_meaning_is_told_and_ends_with_code_1(nectosome, tmp_path, path, value, status, said):
    file = tmp_path / "slide.yaml"
    file.write_text(SLIDE.replace("stiffness: 5", "position: 0.1 m, velocity: 0 m/s, stiffness: 5"))
    answer = nectosome("simulate", str(file), "--time", "0.1s", "--samples", "5", "--set", f"{path}={value}")
    assert answer.code == 1
    assert status in answer.out
    assert f"{file}, {path}: " in answer.err
    assert "is far outside of" in answer.err
    assert said in " ".join(f"{answer.out} {answer.err}".split())
    assert "Traceback" not in answer.err
    assert "velocity at the end           0 " not in answer.out  # a large number beside an infinite one is no zero

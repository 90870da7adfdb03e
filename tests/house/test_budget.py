"""`make test` fails for a test above its budget of processor seconds."""

import math

import pytest
from tests.budget import alone, main

CASE = '<testcase classname="tests.a" name="{}"><properties><property name="{}" value="{}"/></properties></testcase>'


def test_a_test_above_the_budget_is_named(tmp_path, capsys):
    cases = [("dear", "processor_seconds", 5.01), ("cheap", "processor_seconds", 4.99), ("other", "colour", 9)]
    file = tmp_path / "tests.xml"
    file.write_text(f"<testsuites><testsuite>{''.join(CASE.format(*one) for one in cases)}</testsuite></testsuites>")
    with pytest.raises(SystemExit, match="1 of these tests take more than 5 processor seconds"):
        main(str(file), "5", again=lambda name: math.nan)  # it does not pass alone
    told = capsys.readouterr().out.splitlines()
    assert told == [
        "     5.0 s, alone nan s: tests.a::dear",
        "     5.0 s  tests.a::dear",
        "     5.0 s  tests.a::cheap",
        "      10 s  of the processor in 2 tests",
    ]
    main(str(file), "5.1")
    with pytest.raises(SystemExit):
        main(str(file), "5", again=lambda name: 5.005)
    main(str(file), "5", again={"tests.a::dear": 4.0}.__getitem__)  # the machine was busy


def test_a_test_runs_again_alone():
    here = "tests.house.test_budget::test_processor_seconds_of_a_test_are_written_down"
    assert 0 < alone(here) < 5


def test_processor_seconds_of_a_test_are_written_down(request):
    """In the report of its end, from which the JUnit file has them."""
    hook = request.config.hook.pytest_runtest_makereport
    call = pytest.CallInfo.from_call(lambda: sum(range(3_000_000)), "teardown")
    (name, seconds), *others = hook(item=request.node, call=call).user_properties
    assert (name, others) == ("processor_seconds", [])
    assert 0 < float(seconds) < 5

"""The dearest tests of a JUnit file by their processor seconds; one above the budget is a failure.

    python -m tests.budget out/tests.xml 5

Processor seconds of the test's process and its children, set-up included (`tests/conftest.py` writes them down): a busy
machine changes them less than the time on the wall, but has doubled and tripled them. So those above the budget run
again, alone and without programs that were kept, up to twice, and the smallest number counts.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

_SHOWN = 10
_AGAIN = 20  # tests at most that run again: of more it is not the machine


def seconds_of(text: str) -> dict[str, float]:
    """Processor seconds of each test, the dearest first."""
    found = {
        f"{case.get('classname')}::{case.get('name')}": float(one.get("value", "nan"))
        for case in ElementTree.fromstring(text).iter("testcase")
        for one in case.iter("property")
        if one.get("name") == "processor_seconds"
    }
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def alone(name: str) -> float:
    """Processor seconds of a test that runs alone, with an empty store of programs; NaN where it does not pass."""
    module, _, test = name.partition("::")
    with TemporaryDirectory() as folder:
        found = Path(folder) / "alone.xml"
        words = ["-q", f"--junitxml={found}", f"{module.replace('.', '/')}.py::{test}"]
        programs = {"NECTOSOME_CACHE": str(Path(folder) / "programs")}
        ran = subprocess.run(
            [sys.executable, "-m", "pytest", *words], env=os.environ | programs, capture_output=True, check=False
        )
        return (
            next(iter(seconds_of(found.read_text(encoding="utf-8")).values())) if ran.returncode == 0 else float("nan")
        )


def main(path: str, budget: str, again: Callable[[str], float] = alone) -> None:
    """Print the dearest tests and all seconds; exit with a sentence where tests are above the budget."""
    seconds = seconds_of(Path(path).read_text(encoding="utf-8"))
    above = [name for name, spent in seconds.items() if spent > float(budget)]
    if len(above) <= _AGAIN:
        quiet = {name: again(name) for name in above}
        quiet |= {name: min(spent, again(name)) for name, spent in quiet.items() if spent > float(budget)}
        for name, spent in quiet.items():
            print(f"{seconds[name]:8.1f} s, alone {spent:.1f} s: {name}")
        seconds |= {name: spent for name, spent in quiet.items() if spent < seconds[name]}
        seconds = dict(sorted(seconds.items(), key=lambda item: -item[1]))
        above = [name for name in above if seconds[name] > float(budget)]
    for name, spent in [*seconds.items()][: max(_SHOWN, len(above))]:
        print(f"{spent:8.1f} s  {name}")
    print(f"{sum(seconds.values()):8.0f} s  of the processor in {len(seconds)} tests")
    if above:
        sys.exit(
            f"{len(above)} of these tests take more than {budget} processor seconds. Make them smaller, or mark them "
            "slow and keep a cheap one beside them (CONTRIBUTING.md, The house)."
        )


if __name__ == "__main__":
    main(*sys.argv[1:])

"""The dearest tests of a JUnit file by their processor seconds; one above the budget is a failure.

    python -m tests.budget out/tests.xml 5

Processor seconds of the test's process and its children, set-up included (`tests/conftest.py` writes them down): a busy
machine changes them less than the time on the wall.
"""

import sys
from pathlib import Path
from xml.etree import ElementTree

_SHOWN = 10


def seconds_of(text: str) -> dict[str, float]:
    """Processor seconds of each test, the dearest first."""
    found = {
        f"{case.get('classname')}::{case.get('name')}": float(one.get("value", "nan"))
        for case in ElementTree.fromstring(text).iter("testcase")
        for one in case.iter("property")
        if one.get("name") == "processor_seconds"
    }
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def main(path: str, budget: str) -> None:
    """Print the dearest tests and all seconds; exit with a sentence where tests are above the budget."""
    seconds = seconds_of(Path(path).read_text(encoding="utf-8"))
    above = [name for name, spent in seconds.items() if spent > float(budget)]
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

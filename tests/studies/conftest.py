from types import SimpleNamespace

import pytest
from tests.made_up_runs import made_up_run

from nectosome_studies.flagellum import figures as flagellum


@pytest.fixture(scope="session")
def run():
    return made_up_run()


@pytest.fixture
def study():
    row = {"unit": "m/s", "printed": 0.68, "ours": 0.684, "error": 0.6, "tolerance": 1.0}
    row |= {"kind": "prediction", "source": "computed"}
    rows = [
        {
            **row,
            "id": "flagellum.speed.1",
            "quantity": "speed",
            "verdict": "match",
            "note": "a < b & <script>x</script>",
        },
        {**row, "id": "flagellum.speed.2", "quantity": "speed", "verdict": "", "kind": "own", "note": ""},
    ]
    rows[1] |= {"printed": None, "source": "", "error": None, "tolerance": None}
    designs = {f"row{k}": made_up_run(label=f"Design <{k}>", printed_speed=0.49) for k in range(1, 6)}
    runs = {
        **designs,
        "old_soft": made_up_run(0.3),
        "old_rigid": made_up_run(-0.1),
        **{f"order{k}": made_up_run(0.5 - 0.1 / (k + 1)) for k in range(6)},
        "flagella4": made_up_run(),
    }

    return SimpleNamespace(
        name="worm",
        title="Flagellum",
        about="A <soft> one.",
        rows=rows,
        runs=runs,
        seconds=3.2,
        data={},
        recorded=False,
        figures=flagellum.panels,
    )

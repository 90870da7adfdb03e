"""The table of the flow about loads and its warnings, printed, saved and shown again; what loads assume."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.solve.test_flow_numbers import CHORD, PLATE, QUADRATURE, A, F, H, U

from nectosome.io import load_dataset

RUN = "simulate", "plate.yaml", "--time", f"{2 / F} s", "--samples", "17"
OIL = "--set", "water.viscosity=5 Pa s"
SAID = "warning: drag on plate: the Reynolds number is 6, its model is made for at least 100"


def flat(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture
def plate(nectosome):
    text = PLATE.replace("stall: 15 deg", "stall: 60 deg").replace("normal: 1.2}", f"normal: 1.2, amplitude: {A} m}}")
    Path("plate.yaml").write_text(text)
    return nectosome


def test_a_run_prints_its_numbers_and_warns_where_a_model_is_left_and_is_done_all_the_same(plate):
    water, oil = plate(*RUN), plate(*RUN, *OIL, "--save", "oil.nc", "--plot", "oil.html")
    assert (water.code, oil.code) == (0, 0)
    reynolds, kc, k = 1000 * 2 * np.pi * F * A * H / 1.0016e-3, 2 * np.pi * A / H, np.pi * F * CHORD / U
    table = flat(water.out).partition("regime Re of its KC k beyond stall ")[2]
    assert f"drag on plate {reynolds:.4g} height {kc:.4g} " in table
    assert f"chord {2 * np.pi * A / CHORD:.4g} {k:.4g} " in table and f"wake on plate {np.pi * F * H / U:.4g} " in table
    assert "\nRe: Reynolds number; KC: Keulegan-Carpenter number; k: reduced frequency\n" in water.out
    assert "by shape and place" not in water.out  # a fin, which has a foil
    assert "warning" not in water.out and SAID in flat(oil.out)
    shown = plate("show", "oil.nc")
    lines = oil.out.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("regime"))
    assert "\n".join(lines[first : first + 5]) in shown.out and SAID in flat(shown.out)
    assert max(map(len, lines)) <= 80
    page = Path("oil.html").read_text()
    assert "Warning: drag on plate: the Reynolds number is 6" in page and "Keulegan-Carpenter number" in page
    again = load_dataset("oil.nc")["flow_number"].sel(load="drag", part="plate", number="keulegan_carpenter")
    assert float(again) == pytest.approx(kc, rel=QUADRATURE)


def test_a_cycle_has_them_too_and_json_as_computed(plate):
    answer = plate("periodic", "plate.yaml", *OIL, "--json")
    found = json.loads(answer.out)
    hull, drag, skin = found["warnings"]
    assert hull.startswith("hull on body: the Reynolds number is 16, its model is made for at least 100: ")
    assert answer.code == 0 and f"warning: {drag}".startswith(SAID)
    assert skin.startswith("skin on plate: the Reynolds number is 56, its model is made for 1000 to 1e9: ")
    drag = found["tables"]["regime"]["drag on plate"]
    assert drag["keulegan_carpenter"]["value"] == pytest.approx(2 * np.pi * A / H, rel=QUADRATURE)
    assert drag["length"] == "height" and drag["reduced_frequency"]["value"] is None


def test_show_tells_what_loads_assume_with_its_source_and_not_what_is_given(plate):
    """The stall angle and all coefficients of a drag are in the file; lift and added mass come of the aspect ratio."""
    found = json.loads(plate("show", "plate.yaml", "--json").out)["tables"]["assumed"]
    foil = {row["what"]: row for row in found if row["of"] == "foil on plate"}
    assert foil["aspect ratio"]["value"]["value"] == pytest.approx(H / CHORD, rel=1e-12)
    slope = 2 * np.pi * (H / CHORD) / (2 + np.hypot(H / CHORD, 2))
    assert foil["lift slope per rad"]["value"]["value"] == pytest.approx(slope, rel=1e-9)
    assert foil["lift slope per rad"]["source"] == "Helmbold 1942" and "stall" not in foil
    assert not [row for row in found if row["of"].startswith(("drag", "hull"))]
    printed = plate("show", "plate.yaml").out
    assert "assumed" in printed and max(map(len, printed.splitlines())) <= 80


def test_what_is_open_is_told_once_for_parts_alike(plate):
    text = PLATE.replace(", stall: 15 deg", "") + PLATE.partition("limbs:\n")[2].replace("  plate:", "  other:", 1)
    Path("plate.yaml").write_text(text)
    found = json.loads(plate("show", "plate.yaml", "--json").out)["tables"]["assumed"]
    assert [row["of"] for row in found if row["what"] == "stall"] == ["foil on plate"]
    assert [row["of"] for row in found if row["what"] == "aspect ratio"] == ["foil on 2 parts"]
    (stall,) = (row["value"] for row in found if row["what"] == "stall")
    assert stall == {"value": pytest.approx(np.deg2rad(15)), "unit": "rad"}

"""Coefficients and defaults of the water, as they were when the measured robots were computed.

`frozen_water.toml` holds them. None may change because of how a robot comes out: a change needs a published law or
experiment of its own, a new line here, and then all measured robots computed anew.
"""

import math
import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from tests.loads.test_foil import PASSING, RHO, SPAN, B, foil, steady

from nectosome.description.drag import PlateDragLoad, StartUp
from nectosome.description.foil_planform import FoilLoad
from nectosome.description.loads import (
    AddedMassLoad,
    DragLoad,
    LumpedDragLoad,
    NearFloorLoad,
    SkinFrictionLoad,
    TrailingEdgeLoad,
)
from nectosome.loads import added_mass, drag, foil_theory

FROZEN = tomllib.loads(Path(__file__).with_name("frozen_water.toml").read_text(encoding="utf-8"))
RATIOS = jnp.array([0.5, 1.0, 2.0, 4.0])  # aspect ratios


def _normal_force(degrees: float, settled: bool) -> float:
    """Coefficient of an endless foil that stalls at 15 deg."""
    load, (u, w) = foil(aspect_ratio=1e6, stall=math.radians(15)), (math.cos(x := math.radians(degrees)), math.sin(x))
    if settled:
        return -float(steady(load, u, w)[4])
    return -float(PASSING(load, u, w, load.initial())[0][0, 4]) / (0.5 * RHO * 2 * B * SPAN)


LAWS = {
    "foil lift share": foil_theory.lift_share(RATIOS),
    "foil suction gain": [foil_theory.suction_gain(a) for a in RATIOS],
    "foil lag shares": [foil_theory.lag_numbers(a)[0] for a in RATIOS],
    "foil lag rates": [foil_theory.lag_numbers(a)[1] for a in RATIOS],
    "normal force of a foil at 10, 30, 60, 90 deg, at once and once it is settled": [
        [_normal_force(degrees, settled) for degrees in (10.0, 30.0, 60.0, 90.0)] for settled in (False, True)
    ],
    "added mass of strips of a plate": foil_theory.plate_strip_share(RATIOS),
    "added mass of plates": [foil_theory.plate_added_mass_share(a) for a in RATIOS],
    "drag across plates": [foil_theory.broadside_drag(a) for a in RATIOS],
    "form factor at thickness over chord of 0.06, 0.12, 0.2": foil_theory.form_factor(jnp.array([0.06, 0.12, 0.2])),
    "drag of oscillating plates at KC of 1, 5, 20": drag.oscillating_drag(jnp.array([1.0, 5.0, 20.0])),
    "friction at Reynolds numbers of 1e3, 1e5, 1e7": drag.friction_coefficient(jnp.array([1e3, 1e5, 1e7])),
    "added mass of waves at half height over thickness of 1, 3": added_mass.wave_share(
        jnp.array([1.0, 3.0]), jnp.ones(2)
    ),
    "added mass of spheroids at length over width of 2, 3": [
        jnp.stack(added_mass.lamb_coefficients(jnp.asarray(a))) for a in (2.0, 3.0)
    ],
}
LOADS = (
    AddedMassLoad,
    DragLoad,
    FoilLoad,
    LumpedDragLoad,
    NearFloorLoad,
    PlateDragLoad,
    SkinFrictionLoad,
    StartUp,
    TrailingEdgeLoad,
)


@pytest.mark.parametrize("law", LAWS)
def test_laws_are_those_that_were_frozen(law):
    assert np.ravel(jnp.asarray(LAWS[law])).tolist() == pytest.approx(FROZEN["laws"][law], rel=1e-9)


def test_what_files_may_leave_out_is_what_was_frozen():
    """Defaults of the loads' fields; a field without one says "none" where its load decides."""
    found = {}
    for load in LOADS:
        for name, field in load.model_fields.items():
            if name != "kind" and not field.is_required():
                found[f"{load.__name__}.{name}"] = "none" if field.default is None else field.default
    assert {key: list(x) if isinstance(x, tuple) else x for key, x in found.items()} == FROZEN["defaults"]

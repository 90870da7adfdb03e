"""Runs of no robot, for tests of figures and pages."""

import base64
import json

import numpy as np
import xarray as xr
import zstandard

OMEGA, LENGTH, RADIUS, TIP = 14.4, 0.3, 0.0125, 0.002


def made_up_run(speed=0.5, **attributes):
    """A canister at constant speed towards -x with a straight tapered rod that turns about x; no physics."""
    time = np.linspace(0, 1, 41)
    x = np.array([0.0425, 0.0, 0.03, 0.15, 0.27, LENGTH])
    half = np.array([0.04, *np.interp(x[1:], [0, LENGTH], [RADIUS, TIP])])
    weight = np.array([0, 0, 0.083, 0.133, 0.083, 0])
    n, t, names = len(x), len(time), ["body", *["filament"] * 5]
    place = np.stack([np.array([0.0425, *(0.085 + x[1:])]), *np.zeros((2, n))], axis=-1)
    position = place - speed * time[:, None, None] * np.array([1.0, 0, 0])
    c, s, one, zero = np.cos(OMEGA * time), np.sin(OMEGA * time), np.ones(t), np.zeros(t)
    turn = np.stack([one, zero, zero, zero, c, -s, zero, s, c], axis=-1).reshape(t, 1, 3, 3)
    rotation = np.where(np.array(names)[:, None, None] == "body", np.eye(3), turn)
    line = np.where(weight[:, None] > 0, np.array([-2.0, 0, 0]), np.nan)  # 2 N/m of thrust
    force = np.zeros((t, 1, 2, 3))
    force[:, 0, 1, 0] = -2 * weight.sum()
    return xr.Dataset(
        {
            "position": (("time", "station", "axis"), position),
            "rotation": (("time", "station", "row", "axis"), rotation),
            "velocity": (("time", "part", "axis"), np.broadcast_to([-speed, 0, 0], (t, 2, 3))),
            "load_force": (("time", "load", "part", "axis"), force),
            "load_power": (("time", "load", "part"), np.full((t, 1, 2), -0.72)),
            "line_force": (("time", "load", "station", "axis"), np.broadcast_to(line, (t, 1, n, 3))),
            "reaction": (("time", "prescribed"), np.full((t, 1), 0.1)),
            "reaction_power": (("time", "prescribed"), np.full((t, 1), 0.1 * OMEGA)),
            "energy": (("time", "form"), np.ones((t, 3))),
            "power_balance": (("time",), np.full(t, 1e-15)),
            "station_x": (("station",), x),
            "station_weight": (("station",), weight),
            "half_width": (("station", "across"), np.stack([half, half], axis=-1)),
        },
        coords={
            "time": time,
            "station_part": ("station", names),
            "part": ["body", "filament"],
            "load": ["drag"],
            "prescribed": ["shaft.angle"],
            "form": ["kinetic", "water", "elastic"],
            "axis": ["x", "y", "z"],
        },
        attrs={"title": "made up", "status": "SOLVED", "provenance": json.dumps({"nectosome": "0"}), **attributes},
    )


def unpacked(recording):
    """What viser's player reads from a recorded scene: messages and arrays."""
    return zstandard.ZstdDecompressor().decompressobj().decompress(base64.b64decode(recording, validate=True)[8:])

"""Beats that are replayed: the wing that was measured, foils that heave and pitch, the tail fin of the tuna."""

from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pandas as pd
from scipy.special import hankel2

from nectosome.description import Rigid
from nectosome.description.foil_planform import FoilLoad
from nectosome.robots import describe
from nectosome.solve import periodic

from .flapping import PHASES, FoilBeat, Planform, harmonic
from .wing import wing

TUNA = "tuna_fin.csv"


def heaving_and_pitching() -> FoilBeat:
    r"""A rectangle of A = 4 at a reduced frequency $\omega b/U$ of 0.4: heaves by half a chord, pitches by 12 deg.

    The pitch, about the quarter chord, goes with the speed of the heave, so that the angle of attack is about 10 deg.
    """
    speed, chord, span = 0.5, 0.1, 0.4
    turn = 2 * np.pi * np.arange(PHASES) / PHASES
    return FoilBeat(
        rectangle(span, chord),
        speed,
        0.4 * speed / (np.pi * chord),
        "pitch",
        np.deg2rad(12.0) * np.cos(turn),
        0.5 * chord * np.sin(turn),
        np.zeros(PHASES),
        1000.0,
        1.0016e-3,
        hinge=0.25 * chord,
    )


def long_foil() -> FoilBeat:
    """A rectangle of A = 80 that heaves a little at a reduced frequency of 0.4: plane flow about its middle."""
    still = np.zeros(PHASES)
    beat = heaving_and_pitching()
    return replace(beat, planform=rectangle(8.0, 0.1), angle=still, heave=0.1 * beat.heave)


def theodorsen_heave(beat: FoilBeat) -> complex:
    r"""First harmonic of the lift per span [N/m] of a thin foil that heaves: $-\pi\rho b^2 \ddot z - 2\pi\rho U b\,
    C(k)\,\dot z$ (Theodorsen 1935)."""
    b, omega = 0.5 * float(beat.planform.trailing[0]), 2 * np.pi * beat.frequency
    k = omega * b / beat.speed
    lag = hankel2(1, k) / (hankel2(1, k) + 1j * hankel2(0, k))
    climb = 1j * omega * harmonic(beat.heave)
    return complex(-np.pi * beat.density * b * climb * (b * 1j * omega + 2 * beat.speed * lag))


def tuna_fin() -> FoilBeat:
    """The tail fin of the gallery's tuna, as it moves over a beat of a saved periodic swim."""
    with files("nectosome_studies").joinpath("vortex", TUNA).open(encoding="utf-8") as file:
        head = dict(word.split("=") for word in file.readline().removeprefix("#").split())
        curves = pd.read_csv(file)
    return _fin(
        float(head["speed_m_s"]), float(head["frequency_Hz"]), *(curves[name].to_numpy() for name in _COLUMNS[1:])
    )


def swum_tuna() -> tuple[str, FoilBeat]:
    """What `tuna_fin` reads, made anew: the file's text, and the beat."""
    fin = describe("tuna").parts["fin"]
    assert isinstance(fin, Rigid) and fin.length is not None
    run = periodic("tuna", samples=2 * _SAMPLES + 1).to_dataset({})
    k = int(np.flatnonzero(run["station_part"].values == "fin")[0])
    place, ahead = run["position"].values[:, k, :2], -run["rotation"].values[:, k, :2, 0]
    place = place + 0.5 * fin.length * ahead  # its hinge, at the leading edge
    period = float(run.attrs["period"])
    way = (place[-1] - place[0]) / period
    speed = float(np.hypot(*way))
    track = (place - way * run["time"].values[:, None]) @ np.array([way, [-way[1], way[0]]]).T / speed
    pitch = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0])) - np.arctan2(way[1], way[0])
    curves = np.column_stack([track - track[:-1].mean(axis=0), pitch])[:-1:2]
    rows = [",".join(_COLUMNS), *(f"{i / len(curves):g},{a:.7f},{b:.7f},{c:.7f}" for i, (a, b, c) in enumerate(curves))]
    text = "\n".join([f"# speed_m_s={speed:.6f} frequency_Hz={1 / period:.6f}", *rows, ""])
    return text, _fin(speed, 1 / period, *curves.T)


_COLUMNS = ("phase", "surge_m", "heave_m", "pitch_rad")
_SAMPLES = 64


def _fin(speed: float, frequency: float, surge: np.ndarray, heave: np.ndarray, pitch: np.ndarray) -> FoilBeat:
    """A beat of the fin that stands in the tuna's file."""
    robot = describe("tuna")
    fin, load = robot.parts["fin"], robot.parts["fin"].loads["foil"]
    assert isinstance(fin, Rigid) and fin.height is not None and isinstance(load, FoilLoad)
    return FoilBeat(
        rectangle(fin.height, load.mean_chord),
        speed,
        frequency,
        "pitch",
        pitch,
        heave,
        surge,
        robot.water.density,
        robot.water.viscosity,
        thickness=load.thickness,
    )


def rectangle(span: float, chord: float) -> Planform:
    """Rectangular planform."""
    return Planform(np.array([0.0, span]), np.zeros(2), np.full(2, chord))


CASES: dict[str, tuple[str, Callable[[], FoilBeat]]] = {
    "wing": ("flapping wing of Yeo, Atkins and Shyy", wing),
    "heave-pitch": ("foil of A = 4 that heaves and pitches", heaving_and_pitching),
    "long": ("long foil that heaves", long_foil),
    "tuna": ("tail fin of the gallery's tuna", tuna_fin),
}

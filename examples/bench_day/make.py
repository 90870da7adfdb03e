"""Make the files of a day at the bench, all synthetic: a chain of stiff links in water, and the devices that saw it.

    python make.py FOLDER

The chain is no part of nectosome: links of one length on springs and dampers, Kirchhoff's added mass and quadratic drag
of each link, in the plane, by Lagrange's equations. What is true stands in `TRUE`; each run has numbers of its own
around that, as a bench has. Each device has a clock, noise and faults of its own.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

LINKS, LENGTH, THICKNESS, HEIGHT, DENSITY, WATER = 16, 0.12, 8e-3, 60e-3, 1070.0, 1000.0  # m, kg/m3


class Fin(NamedTuple):
    """Young's modulus [Pa], viscosity in shear [Pa s], coefficients of drag and of added mass."""

    young: float
    viscosity: float
    drag: float
    added: float


TRUE = Fin(1.15e6, 3e3, 1.75, 0.9)
BETWEEN_RUNS = Fin(0.01, 0.0, 0.03, 0.0)  # standard deviations, as shares
BEGIN, RAMP, END, STOP = 1.5, 1.0, 5.5, 10.2  # s
CELL_LATE, CAMERA_LATE = 11e-3, 4e-3  # s


def servo(t, amplitude, frequency):
    """Angle of the clamp [rad] and its rate: a sine that begins and ends smoothly."""
    up, down = np.clip((t - BEGIN) / RAMP, 0, 1), np.clip((END + RAMP - t) / RAMP, 0, 1)
    share, by = 1.0, 0.0
    for x, sign in ((up, 1), (down, -1)):
        s, ds = x**3 * (10 - 15 * x + 6 * x**2), sign * 30 * x**2 * (1 - x) ** 2 / RAMP
        share, by = share * s, by * s + share * ds
    w = 2 * np.pi * frequency
    wave, rate = np.sin(w * (t - BEGIN)), w * np.cos(w * (t - BEGIN))
    return amplitude * share * wave, amplitude * (share * rate + by * wave)


class Chain:
    """A fin of links, clamped to the servo's axis at the origin; angles of the links against the x axis."""

    def __init__(self, fin, amplitude, frequency):
        self.fin, self.given = fin, (amplitude, frequency)
        self.l = LENGTH / LINKS
        self.mass = DENSITY * THICKNESS * HEIGHT * self.l
        self.added = fin.added * WATER * np.pi * (HEIGHT / 2) ** 2 * self.l
        second = HEIGHT * THICKNESS**3 / 12  # moment of area
        self.spring = fin.young * second / self.l * np.r_[2.0, np.ones(LINKS - 1)]  # the clamp is half a link away
        self.damper = 3 * fin.viscosity * second / self.l * np.r_[2.0, np.ones(LINKS - 1)]
        self.inertia = (self.mass + self.added) * self.l**2 / 12 + self.mass * THICKNESS**2 / 12
        self.reach = self.l * (np.tri(LINKS, k=-1) + 0.5 * np.eye(LINKS))  # of turning links to the middles

    def parts(self, t, state):
        """Accelerations of the links, and the force that the chain gives to its clamp [N]."""
        angle, rate = state[:LINKS], state[LINKS:]
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        J = self.reach[:, :, None] * across  # middle, link, axis
        v = np.einsum("kja,j->ka", J, rate)
        turned = -np.einsum("kj,ja,j->ka", self.reach, along, rate**2)  # acceleration at even rates
        vn, vt = np.sum(v * across, axis=1), np.sum(v * along, axis=1)
        # impulse of the water P = a vn n: its rate but for the accelerations of the links
        swept = (
            (np.sum(turned * across, axis=1) - rate * vt)[:, None] * across - (rate * vn)[:, None] * along
        ) * self.added
        pull, turn = np.zeros((LINKS, 2)), np.zeros(LINKS)
        for s in 0.5 * self.l / np.sqrt(3) * np.array([-1.0, 1.0]):  # Gauss
            at = vn + s * rate
            force = -0.5 * self.l * WATER * HEIGHT / 2 * self.fin.drag * np.hypot(at, vt) * at
            pull += force[:, None] * across
            turn += s * force
        clamp, its_rate = servo(t, *self.given)
        bent = self.spring * np.diff(angle, prepend=clamp) + self.damper * np.diff(rate, prepend=its_rate)
        Q = np.append(bent[1:], 0.0) - bent + turn - self.added * vn * vt
        Q += np.einsum("kja,ka->j", J, pull - self.mass * turned - swept)
        Jn = np.einsum("kja,ka->kj", J, across)
        M = self.mass * np.einsum("kia,kja->ij", J, J) + self.added * Jn.T @ Jn + self.inertia * np.eye(LINKS)
        turning = np.linalg.solve(M, Q)
        impulse = self.mass * (turned + np.einsum("kja,j->ka", J, turning)) + swept
        impulse += self.added * (Jn @ turning)[:, None] * across
        return turning, np.sum(pull - impulse, axis=0)

    def run(self):
        """Functions of time: force on the clamp along y [N], place of the tip along y [m]."""
        slope = lambda t, x: np.r_[x[LINKS:], self.parts(t, x)[0]]  # noqa: E731
        found = solve_ivp(
            slope, (0, STOP), np.zeros(2 * LINKS), "Radau", dense_output=True, rtol=1e-6, atol=1e-8, max_step=0.02
        )
        force = lambda t: np.array([self.parts(x, found.sol(x))[1][1] for x in t])  # noqa: E731
        tip = lambda t: self.l * np.sin(found.sol(t)[:LINKS]).sum(axis=0)  # noqa: E731
        return force, tip


def files(name, amplitude, frequency, seed):
    """Lines of the files of a run, by name, as three devices saw it: servo, load cell on a microcontroller, camera."""
    r = np.random.default_rng(seed)
    fin = Fin(*(x * (1 + s * r.normal()) for x, s in zip(TRUE, BETWEEN_RUNS, strict=True)))
    force, tip = Chain(fin, np.radians(amplitude), frequency).run()
    began = 1.0 + r.uniform(0, 0.02)
    pulse = lambda t: ((t >= began) & (t < began + 0.2)).astype(int)  # noqa: E731

    t = np.arange(0, STOP - 0.2, 0.01) + 1e-4 * r.normal(size=1000)
    ticks = np.round(2048 + np.degrees(servo(t, np.radians(amplitude), frequency)[0]) / 0.087890625)
    started = int(r.integers(1e8, 1e9))
    rows = [f"{started + round(1e6 * a)};{int(b)};{c}" for a, b, c in zip(t, ticks, pulse(t), strict=True)]
    found = {f"servo_{name}.csv": ["timestamp_us;present_tick;sync", *rows]}

    t = np.arange(0.05, STOP - 0.25, 1 / 80)
    t = t[r.random(t.size) > 0.005]  # some samples are lost
    seen = (
        force(np.maximum(t - CELL_LATE, 0))
        + 3e-3 * r.normal(size=t.size)
        + 4e-3 * np.sin(100 * np.pi * t + r.uniform(0, 6))
    )
    counts = np.round(431500 * (seen + 0.05 * r.normal() + 5e-4 * t) - 86000)
    started = int(r.integers(1000, 3000))
    rows = [f"{started + round(1e3 * a)},{int(b)},{c}" for a, b, c in zip(t, counts, pulse(t), strict=True)]
    rows[int(r.integers(200, 400))] = rows[300][:6]  # a line that was cut
    found[f"cell_{name}.csv"] = ["ms,raw,sync", *rows]

    t = np.arange(0.02, STOP - 0.3, 1 / 60)
    y = 240 - 1e3 * tip(np.maximum(t - CAMERA_LATE, 0)) / 0.42 + 0.3 * r.normal(size=t.size)
    rows = [f"{k},{a:.2f},{b}" for k, (a, b) in enumerate(zip(y, pulse(t), strict=True))]
    return found | {f"camera_{name}.csv": ["frame,tip_y_px,led", *rows]}


def main(folder: Path) -> None:
    """Write the files of six runs."""
    for number, (amplitude, repeat) in enumerate((a, k) for a in (15, 30) for k in (1, 2, 3)):
        for name, lines in files(f"A{amplitude}_{repeat}", amplitude, 1.0, number).items():
            (folder / name).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())

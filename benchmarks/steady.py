"""The steady motion as a root, on one core: beside time integration from rest, and on 200 random designs."""

import numpy as np

from nectosome.model import bind
from nectosome.robots import describe
from nectosome.solve import simulate, steady
from nectosome_studies.study import printed

from .designs import DesignCheck, check, draw, task
from .timing import clock, now, once

_RTOL = 1e-4
_DESIGNS, _EVERY = 200, 20


def main() -> None:
    _against_integration()
    _on_random_designs()


def _against_integration() -> None:
    print("\nsteady root (with its eigenvalues) and time integration from rest, five printed designs; medians of 5")
    print(
        f"  root: scaled residual at most 1e-10; integration: rtol {_RTOL:.0e}; settled: stays within 0.1 % of the root"
    )
    print("              root               2.5 s from rest            until settled       ratio of times")
    print("  row      ms        m/s      ms        m/s      off       s        ms        2.5 s  settled")
    book = printed("flagellum")
    _, build = bind(describe("flagellum"), ("L", "tip_radius", "alpha", "omega", "E"))
    for row in range(1, 6):
        d = book[f"flagellum/table2/row{row}/speed"]["design"]
        robot = build(np.array([d["length"], d["tip_radius"], np.radians(d["bend"]), d["rate"], d["young"]]))
        root = steady(robot)
        speed = -float(root.state.v[0])
        times = np.linspace(0.0, 6.0, 601)
        slow = -np.asarray(simulate(robot, 6.0, samples=601, rtol=_RTOL, atol=1e-2 * _RTOL).value.state.v[:, 0])
        outside = np.flatnonzero(np.abs(slow - speed) > 1e-3 * speed)
        settled = float(times[min(outside[-1] + 1, 600)])
        short = simulate(robot, 2.5, rtol=_RTOL, atol=1e-2 * _RTOL)
        reached = -float(short.value.state.v[-1, 0])
        root_s = clock(lambda robot=robot: steady(robot).value)
        short_s, long_s = (
            clock(lambda robot=robot, t=t: simulate(robot, t, rtol=_RTOL, atol=1e-2 * _RTOL).value)
            for t in (2.5, settled)
        )
        print(
            f"  {row}   {1e3 * root_s:7.1f} {speed:10.6f} {1e3 * short_s:7.0f} {reached:10.6f} "
            f"{100 * (reached / speed - 1):7.3f} % {settled:6.2f} {1e3 * long_s:9.0f} "
            f"{short_s / root_s:12.0f} {long_s / root_s:8.0f}"
        )


def _on_random_designs() -> None:
    print(f"\n{_DESIGNS} random designs (seed 1, log E), each solved from rest; every {_EVERY}th against its dynamics")
    began = now()
    us = draw(_DESIGNS)
    compile_s, _ = once(lambda: check(us[0], dynamics=True)[3])
    made = [check(u, dynamics=k % _EVERY == 0) for k, u in enumerate(us)]
    found = [k for k in made if not k.reason]
    print(f"  first design {compile_s:.0f} s with compilation, all {now() - began:.0f} s")
    print(f"  solved: {len(found)} of {_DESIGNS}, largest scaled residual {max(k.residual for k in found):.1e}")
    for k in made:
        if k.reason:
            print(f"    not solved: {_in_numbers(k)}: {k.reason}")
    held = [k for k in found if np.isfinite(k.settled_time)]
    print(
        f"  against dynamics from rest (rtol 1e-6), {len(held)} designs: {sum(k.agrees for k in held)} agree to 0.1 %"
    )
    for k in held:
        off = abs(k.settled_speed - k.speed)
        dynamics = f"dynamics {k.settled_speed:10.6f} m/s after {k.settled_time:2.0f} s"
        print(f"    root {k.speed:10.6f} m/s, {dynamics}, off by {off:.1e}")
    errors = np.array([k.derivative_error for k in found])
    for name, column in zip(("speed", "torque"), errors.T, strict=True):
        worst = found[int(np.argmax(column))]
        print(
            f"  derivatives of the {name}: median error {np.median(column):.1e}, 99 % {np.quantile(column, 0.99):.1e}, "
            f"over 1e-6: {np.sum(column > 1e-6)}, worst {column.max():.1e} at {_in_numbers(worst)}"
        )


def _in_numbers(k: DesignCheck) -> str:
    """A design in numbers."""
    values = task().box.values(k.u)
    return ", ".join(f"{v.name} {x:.4g}" for v, x in zip(task().variables, values, strict=True))


if __name__ == "__main__":
    main()

"""Faults that the tests must see: signs, factors and frames of the mechanics are changed, one at a time.

Each fault is made in a copy of the package, and the tests of its room run until the first that fails. A fault that no
test sees is named, and the exit code is 1.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

_HERE = Path(__file__).parents[1]
_QUICK = "--xla_backend_optimization_level=0"


class Fault(NamedTuple):
    """One place of the package, what becomes of it, and the tests that must see it."""

    file: str
    right: str
    wrong: str
    tests: str


FAULTS = [
    Fault("core/se3.py", "cross(w, m) + cross(v, f)", "cross(w, m) - cross(v, f)", "mechanism/test_conservation.py"),
    Fault("core/se3.py", "dot_t(R, v - cross(p, w))", "dot_t(R, v + cross(p, w))", "core/test_se3.py"),
    Fault("core/se3.py", "[w, v + cross(p, w)]", "[w, v - cross(p, w)]", "core/test_se3.py"),
    Fault("core/se3.py", "+ dot(moved, power))", "- dot(moved, power))", "core/test_se3.py mechanism"),
    Fault("mechanism/joints.py", "- cross(w, v)])", "+ cross(w, v)])", "mechanism"),
    Fault("mechanism/rods.py", "_MAGNUS = np.sqrt(3) / 12", "_MAGNUS = np.sqrt(3) / 6", "mechanism"),
    Fault("mechanism/rods.py", "second += 2 * _MAGNUS", "second += _MAGNUS", "mechanism"),
    Fault("mechanism/rods.py", "(7 + 6 * poisson)", "(7 + 12 * poisson)", "mechanism solve"),
    Fault("mechanism/rods.py", "[viscosity, 3 * viscosity,", "[viscosity, viscosity,", "mechanism solve"),
    Fault("mechanism/rods.py", "[-curvature[1] *", "[curvature[1] *", "mechanism solve"),
    Fault("mechanism/sections.py", "jnp.pi / 4 * half_y * half_z**3", "jnp.pi / 2 * half_y * half_z**3", "mechanism"),
    Fault("mechanism/links.py", "mass / 5 * jnp.stack([2", "mass / 5 * jnp.stack([1", "mechanism model"),
    Fault("mechanism/robot.py", "relative_rate) - coadjoint(", "relative_rate) + coadjoint(", "mechanism loads"),
    Fault(
        "mechanism/robot.py",
        "else -times(growth, relative)",
        "else times(growth, relative)",
        "loads/test_near_floor.py loads/test_contract.py loads",
    ),
    Fault("mechanism/robot.py", "dc - turning", "dc + turning", "loads/test_current.py loads"),
    Fault("mechanism/robot.py", "strips.velocity - c)", "strips.velocity + c)", "loads/test_current.py loads"),
    Fault(
        "mechanism/diagnose.py",
        "own = 0.5 * jnp.sum(twist",
        "own = jnp.sum(twist",
        "mechanism/test_part_energy.py mechanism/test_conservation.py",
    ),
    Fault(
        "loads/drag.py",
        "vy - r * self.lift * vz",
        "vy + r * self.lift * vz",
        "loads/test_drag.py loads/test_contract.py",
    ),
    Fault(
        "loads/drag.py",
        "scale * rz * jnp.abs(vy)",
        "scale * ry * jnp.abs(vy)",
        "loads/test_drag.py loads/test_contract.py",
    ),
    Fault(
        "loads/drag.py",
        "0.5 * water.density * self.drag_area",
        "water.density * self.drag_area",
        "loads/test_drag.py loads/test_contract.py",
    ),
    Fault(
        "loads/buoyancy.py",
        "return -water.gravity * jnp.sum(",
        "return water.gravity * jnp.sum(",
        "loads/test_buoyancy.py loads/test_contract.py",
    ),
    Fault(
        "loads/buoyancy.py", "root - root**3 / 3", "root + root**3 / 3", "loads/test_buoyancy.py loads/test_contract.py"
    ),
    Fault(
        "loads/added_mass.py",
        "self.normal * rz**2,",
        "self.normal * ry**2,",
        "loads/test_added_mass.py loads/test_contract.py",
    ),
    Fault(
        "loads/added_mass.py",
        "mass * self.length**2 / 12",
        "mass * self.length**2 / 3",
        "loads/test_added_mass.py loads/test_contract.py",
    ),
    Fault("loads/added_mass.py", ".add(0.5 * p @ V)", ".add(p @ V)", "loads/test_added_mass.py loads/test_contract.py"),
    Fault(
        "loads/added_mass.py", "k3 * mass / 5 *", "k2 * mass / 5 *", "loads/test_added_mass.py loads/test_contract.py"
    ),
    Fault("loads/forces.py", "cross(self.arm, f)", "cross(f, self.arm)", "loads robots"),
    Fault(
        "loads/springs.py",
        "return -self.side * push",
        "return self.side * push",
        "loads/test_joint_limits.py loads/test_contract.py",
    ),
    Fault("loads/bushing.py", "arm = 0.5 * cross(d, pull)", "arm = cross(d, pull)", "loads/test_pairs.py"),
    Fault("loads/near_floor.py", "lift = 0.5 * slope", "lift = slope", "loads/test_near_floor.py"),
    Fault("loads/leg.py", "- w[2] * y + dx", "+ w[2] * y + dx", "loads/test_leg.py"),
]


def main(names: list[str]) -> None:
    """Make all faults, or those of the files named."""
    missed = []
    chosen = [fault for fault in FAULTS if not names or fault.file in names]
    if not chosen:
        known = ", ".join(dict.fromkeys(fault.file for fault in FAULTS))
        sys.exit(f"There is no fault in {', '.join(names)}. There are some in: {known}.")
    print(f"\n{len(chosen)} faults")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "src"
        shutil.copytree(_HERE / "src", copy, ignore=shutil.ignore_patterns("__pycache__"))
        for fault in chosen:
            file = copy / "nectosome" / fault.file
            text = file.read_text(encoding="utf-8")
            if text.count(fault.right) != 1:
                sys.exit(f"{fault.file} has {text.count(fault.right)} places with `{fault.right}`, not one.")
            began = time.monotonic()
            file.write_text(text.replace(fault.right, fault.wrong), encoding="utf-8")
            seen_by = _seen_by(copy, fault.tests, Path(folder) / "cache")
            file.write_text(text, encoding="utf-8")
            missed += [] if seen_by else [fault]
            took = f"{time.monotonic() - began:4.0f} s"
            print(f"  {fault.file:24s} {fault.wrong:44s} {took}  {seen_by or 'NOT SEEN'}", flush=True)
    print(f"{len(chosen) - len(missed)} of {len(chosen)} seen")
    if missed:
        sys.exit(1)


def _seen_by(source: Path, tests: str, cache: Path) -> str:
    """The first test that fails; empty where none does."""
    environment = {**os.environ, "PYTHONPATH": str(source), "NECTOSOME_CACHE": str(cache), "XLA_FLAGS": _QUICK}
    paths = [f"tests/{path}" for path in tests.split()]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-m", "not slow", "--tb=no", "-rfE", *paths]
    done = subprocess.run(command, cwd=_HERE, env=environment, capture_output=True, text=True, check=False)
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if done.returncode not in (0, 1) or (done.returncode == 1 and not failed):
        sys.exit(f"pytest ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return failed[0].split()[1].removeprefix("tests/")[:90] if failed else ""


if __name__ == "__main__":
    main(sys.argv[1:])

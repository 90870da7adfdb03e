"""Faults that the tests must see: signs, factors and frames of the mechanics are changed, one at a time.

Each fault is made in a copy of the package, and the tests of its room run until the first that fails. A fault that no
test sees is named, and the exit code is 1.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

_HERE = Path(__file__).parents[1]
_QUICK = "--xla_backend_optimization_level=0"


class Fault(NamedTuple):
    """What stands in a file of the package, and what is put in its place."""

    right: str
    wrong: str


# by file: the tests that must see its faults, and these
FAULTS = {
    "core/se3.py": (
        "core/test_se3.py mechanism/test_conservation.py mechanism",
        Fault("cross(w, m) + cross(v, f)", "cross(w, m) - cross(v, f)"),
        Fault("dot_t(R, v - cross(p, w))", "dot_t(R, v + cross(p, w))"),
        Fault("[w, v + cross(p, w)]", "[w, v - cross(p, w)]"),
        Fault("+ dot(moved, power))", "- dot(moved, power))"),
    ),
    "mechanism/joints.py": ("mechanism/test_joints.py", Fault("- cross(w, v)])", "+ cross(w, v)])")),
    "mechanism/rods.py": (
        "mechanism/test_rods.py mechanism/test_strain.py mechanism",
        Fault("_MAGNUS = np.sqrt(3) / 12", "_MAGNUS = np.sqrt(3) / 6"),
        Fault("second += 2 * _MAGNUS", "second += _MAGNUS"),
        Fault("[viscosity, 3 * viscosity,", "[viscosity, viscosity,"),
        Fault("[-curvature[1] *", "[curvature[1] *"),
    ),
    "mechanism/sections.py": (
        "mechanism/test_links.py mechanism/test_rods.py",
        Fault("jnp.pi / 4 * half_y * half_z**3", "jnp.pi / 2 * half_y * half_z**3"),
        Fault("(7 + 6 * poisson)", "(7 + 12 * poisson)"),
    ),
    "mechanism/shapes/named.py": (
        "mechanism/test_shapes.py mechanism/test_links.py",
        Fault("+ mass * c @ c", "- mass * c @ c"),
    ),
    "mechanism/robot.py": (
        "loads mechanism",
        Fault("relative_rate) - coadjoint(", "relative_rate) + coadjoint("),
        Fault("dc - turning", "dc + turning"),
        Fault("strips.velocity - c)", "strips.velocity + c)"),
    ),
    "mechanism/carried.py": (
        "loads mechanism",
        Fault("else -times(self.growth, relative)", "else times(self.growth, relative)"),
    ),
    "mechanism/diagnose.py": (
        "mechanism/test_part_energy.py mechanism/test_conservation.py loads/test_separated.py",
        Fault("own = 0.5 * jnp.sum(twist", "own = jnp.sum(twist"),
        Fault("ADDED_MASS)].set(through_it)", "ADDED_MASS)].set(0 * through_it)"),
    ),
    "loads/drag.py": (
        "loads/test_drag.py loads/test_contract.py",
        Fault("vy - r * self.lift * vz", "vy + r * self.lift * vz"),
        Fault("self._coefficient(rz) * rz *", "self._coefficient(rz) * ry *"),
        Fault("0.5 * self.drag_area])", "self.drag_area])"),
    ),
    "loads/buoyancy.py": (
        "loads/test_buoyancy.py loads/test_contract.py",
        Fault("return -water.gravity * jnp.sum(", "return water.gravity * jnp.sum("),
    ),
    "core/immersion.py": (
        "core/test_immersion.py loads/test_buoyancy.py",
        Fault("(2 + t * t) / 3", "(2 - t * t) / 3"),
        Fault("0.5 * _difference(once, near, q) / q", "_difference(once, near, q) / q"),
        Fault("return ends[0] - ends[1]", "return ends[0] + ends[1]"),
        Fault("0.5 * weight * _first", "weight * _first"),
    ),
    "loads/trailing_edge.py": ("loads/test_trailing_edge.py", Fault("[0.5 * pressure[None]", "[pressure[None]")),
    "loads/added_mass.py": (
        "loads/test_added_mass.py loads/test_separated.py loads/test_contract.py loads/test_near_floor.py",
        Fault("lift = 0.5 * slope", "lift = slope"),
        Fault("self.normal * rz**2,", "self.normal * ry**2,"),
        Fault("mass * self.length**2 / 12", "mass * self.length**2 / 3"),
        Fault("k3 * mass / 5 *", "k2 * mass / 5 *"),
        Fault("[cross(v, A * v), lacks]", "[cross(A * v, v), lacks]"),
        Fault("- A * cross(turning, v)", "+ A * cross(turning, v)"),
    ),
    "loads/forces.py": ("loads robots", Fault("cross(self.arm, f)", "cross(f, self.arm)")),
    "loads/springs.py": (
        "loads/test_joint_limits.py loads/test_contract.py",
        Fault("return -self.side * one", "return self.side * one"),
    ),
    "loads/bushing.py": ("loads/test_pairs.py", Fault("arm = 0.5 * cross(d, pull)", "arm = cross(d, pull)")),
    "solve/static.py": ("solve/test_static.py", Fault("inner + load * outer", "inner - load * outer")),
    "solve/floating.py": (
        "solve/test_floating.py",
        Fault("new_rise + left[0]", "new_rise - left[0]"),
        Fault("skew(jnp.stack([left[1], left[2],", "skew(jnp.stack([left[2], left[1],"),
        Fault("force[0] / stiff, 0.0)", "-force[0] / stiff, 0.0)"),
    ),
    "loads/leg.py": ("loads/test_leg.py", Fault("- w[2] * y + dx", "+ w[2] * y + dx")),
    "loads/foil.py": (
        "loads/test_foil.py loads/test_contract.py",
        Fault("v = w - 0.5 * leads", "v = w + 0.5 * leads"),
        Fault("couple = m * u * v -", "couple = -m * u * v -"),
        Fault("- m * w * omega -", "+ m * w * omega -"),
        Fault("self.half_chord**2 / 8", "self.half_chord**2 / 4"),
        Fault("starting / (2 * jnp", "starting / (4 * jnp"),
        Fault("- along) * U * (starting", "+ along) * U * (starting"),
    ),
    "loads/rod_loads.py": (
        "mechanism/test_rod_damping.py",
        Fault("return -self.stiffness @ (self.share", "return self.stiffness @ (self.share"),
        Fault("(x - loss_factor * x**2)", "(x + loss_factor * x**2)"),
    ),
    "loads/foil_theory.py": (
        "loads/test_foil_theory.py loads/test_foil.py",
        Fault("return aspect_ratio / (2 +", "return aspect_ratio / (1 +"),
        Fault("1 - 0.425 * aspect_ratio", "1 + 0.425 * aspect_ratio"),
    ),
    "loads/contact.py": (
        "loads/test_pairs.py",
        Fault("arm = (0.5 * depth - self", "arm = (0.5 * depth + self"),
        Fault("add(-part[:, None] * cross(other", "add(part[:, None] * cross(other"),
    ),
    "core/dry_friction.py": (
        "core/test_dry_friction.py loads/test_joint_friction.py",
        Fault("w + 0.5 * (1 - w**2)", "w - 0.5 * (1 - w**2)"),
        Fault("return 0.5 * self.limit * self.slip", "return self.limit * self.slip"),
    ),
    "mechanism/tendons.py": (
        "mechanism/test_capstan.py mechanism/test_tendons.py",
        Fault("jnp.exp(-jnp.einsum(", "jnp.exp(jnp.einsum("),
        Fault("arms - lever[:, None]", "arms + lever[:, None]"),
    ),
    "drives/motor.py": (
        "drives/test_dry_friction.py cli/test_motors.py",
        Fault("* (1 - self.efficiency) * jnp", "* (1 / self.efficiency - 1) * jnp"),
    ),
}


def main(names: list[str]) -> None:
    """Make all faults, or those of the files named."""
    if unknown := [name for name in names if name not in FAULTS]:
        sys.exit(f"There is no fault in {unknown[0]}. There are some in: {', '.join(FAULTS)}.")
    seen = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "src"
        shutil.copytree(_HERE / "src", copy, ignore=shutil.ignore_patterns("__pycache__"))
        for name in names or FAULTS:
            tests, *faults = FAULTS[name]
            file = copy / "nectosome" / name
            text = file.read_text(encoding="utf-8")
            for fault in faults:
                if text.count(fault.right) != 1:
                    sys.exit(f"{name} has {text.count(fault.right)} places with `{fault.right}`, not one.")
                file.write_text(text.replace(fault.right, fault.wrong), encoding="utf-8")
                test = _seen_by(copy, tests, Path(folder) / "cache")
                seen.append(bool(test))
                print(f"  {name:22s} {fault.wrong:36s} {test or 'NOT SEEN'}", flush=True)
            file.write_text(text, encoding="utf-8")
    print(f"{sum(seen)} of {len(seen)} faults seen")
    if not all(seen):
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

"""A soft rod bends under a tip load; its large deflection is held against that of the elastica."""

from math import pi
from pathlib import Path

import nectosome as ns

# describe: a robot file of your own
cantilever = ns.describe(str(Path(__file__).with_name("cantilever.yaml")))
rod = cantilever.body
stiffness = rod.young * pi / 4 * rod.radius**4  # E I [N m2]

# Bisshop and Drucker (1945), by quadrature: P L^2/EI -> deflection over length
ELASTICA = {1.0: 0.30172, 5.0: 0.71379}
rows = ["load P (mN),deflection (mm),elastica (mm)"]
for size, deflection in ELASTICA.items():
    # change: the load, by its alias
    load = size * stiffness / rod.length**2
    robot = ns.apply_settings(cantilever, [f"P={load!r}N"])

    # run: static equilibrium
    data = ns.static(robot).to_dataset()

    # print: where the last station of the rod came
    tip = 1e3 * float(data["position"].sel(axis="z")[0, -1])
    expected = 1e3 * deflection * rod.length
    print(f"P = {1e3 * load:6.3f} mN: deflection {tip:.3f} mm, elastica {expected:.3f} mm")
    rows.append(f"{1e3 * load},{tip},{expected}")

# save
Path("out").mkdir(exist_ok=True)
Path("out/cantilever.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")

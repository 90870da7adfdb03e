"""Made-up datasets of a design study: numbers that look like its results, and mean nothing."""

import numpy as np
import xarray as xr


def starts():
    rng = np.random.default_rng(1)
    shape = (3, 3, 12)
    speed = np.array([0.683, 0.785, 0.78])[:, None, None] - np.abs(rng.normal(0, 0.04, shape)) ** 1.5 * 3
    speed[0, 0, :2] = np.nan
    seconds = np.array([20.0, 2.5, 35.0])[:, None, None] * rng.lognormal(0, 0.3, shape)
    dims = ("solver", "seed", "start")
    return xr.Dataset(
        {
            "speed": (dims, speed),
            "torque": (dims, np.full(shape, 0.5)),
            "seconds": (dims, seconds),
            "evaluations": (dims, rng.integers(100, 2000, shape).astype(float)),
            "rejected": (dims, rng.integers(0, 40, shape).astype(float)),
        },
        coords={"solver": ["pattern", "gradient", "evolution"], "seed": [1, 2, 3], "start": np.arange(12)},
        attrs={"printed_speed": 0.683, "printed_seconds": 19440.0},
    )


def history():
    k = np.arange(1, 61)
    speed = np.stack([0.68 - 0.3 / k, 0.785 - 0.4 / k**1.5, 0.78 - 0.45 / k**0.6])
    speed[1, 25:] = np.nan
    speed[2, :2] = np.nan
    work = np.stack([10.0 * k, 1.3 * k, 12.0 * k])
    dims = ("solver", "iteration")
    return xr.Dataset(
        {"speed": (dims, speed), "evaluations": (dims, np.where(np.isnan(speed) & (k > 10), np.nan, work))},
        coords={"solver": ["pattern", "gradient", "evolution"], "iteration": k},
        attrs={"printed_speed": 0.683},
    )


def chart():
    omega, young = np.linspace(5, 22, 18), np.geomspace(1.4e6, 1.681e9, 22)
    x, y = np.meshgrid(omega / 14.4, np.log(young / 7.4e6), indexing="ij")
    speed = np.stack([s * x * (np.exp(-((y - 0.5) ** 2) / 2) - 0.25) for s in (0.35, 0.68, 0.78)])
    torque = np.stack([s * x**2 * (1 + 0.1 * y) for s in (0.2, 0.5, 0.5)])
    speed[1, 14:, :3] = torque[1, 14:, :3] = np.nan
    dims = ("design", "omega", "young")
    return xr.Dataset(
        {
            "speed": (dims, speed),
            "torque": (dims, torque),
            "here_omega": ("design", [14.4, 14.4, 15.1]),
            "here_young": ("design", [1.379e6, 7.4e6, 6.2e6]),
        },
        coords={"design": ["old design", "Table II, row 1", "optimum <new>"], "omega": omega, "young": young},
        attrs={"torque_limit": 0.5},
    )


def sensitivity():
    percent = [[0.31, 1.2], [-0.12, -0.4], [0.05, 0.45], [0.94, 1.83], [0.0021, np.nan]]
    return xr.Dataset(
        {"percent": (("variable", "output"), percent)},
        coords={"variable": ["L", "tip_radius", "alpha", "omega", "E"], "output": ["speed", "torque"]},
        attrs={"label": "the optimum <new>"},
    )


def trend():
    alpha, tip = np.radians(np.linspace(20, 70, 8)), np.linspace(1e-3, 8e-3, 8)
    young = np.stack([4e6 * np.exp(alpha), 1.2e7 * (2e-3 / tip) ** 1.3])
    speed = np.stack([0.78 - (alpha - 0.8) ** 2, 0.78 - 3e3 * (tip - 5e-3) ** 2])
    young[0, 2] = speed[0, 2] = np.nan
    dims = ("fixed", "point")
    return xr.Dataset(
        {"value": (dims, np.stack([alpha, tip])), "young": (dims, young), "speed": (dims, speed)},
        coords={"fixed": ["alpha", "tip_radius"]},
    )


def best():
    k = np.arange(10.0)
    return xr.Dataset(
        {
            "L": ("rank", np.full(10, 0.7)),
            "tip_radius": ("rank", 5.65e-3 - 1e-4 * k),
            "alpha": ("rank", np.radians(42.3 - k)),
            "omega": ("rank", 14.4 + 0.1 * k),
            "E": ("rank", 7.4e6 + 1e5 * k),
            "speed": ("rank", 0.79 - 0.01 * k),
            "torque": ("rank", np.where(k < 5, 0.5, np.nan)),
            "source": ("rank", ["ours"] * 5 + ["Table II"] * 4 + ["Table <II>"]),
        }
    )


def pool():
    return xr.Dataset(
        {
            "printed_simulated": ("design", [0.154, 0.340]),
            "printed_measured": ("design", [0.160, 0.311]),
            "ours": ("design", [0.160, np.nan]),
            "kind": ("design", ["calibration", "prediction"]),
        },
        coords={"design": ["old design", "optimal design"]},
    )


def composite():
    beta = np.linspace(0, 1, 101)
    core, shell = 17e6, 592e3
    young = [
        core * beta**4 + shell * (1 - beta**4),
        core * beta**6 + shell * (1 - beta**4) * (1 - beta**2),
    ]
    return xr.Dataset(
        {"young": (("rule", "beta"), young)},
        coords={"rule": ["EJ", "EJV"], "beta": beta},
        attrs={"target": 7.4e6, "printed_beta": 0.81, "measured": 7.9e6},
    )


def static_test():
    mark = np.array([0.4, 0.55, 0.7, 0.85, 1.0])
    side = np.array([0.04, 0.07, 0.12])[:, None] * mark**2 + 0.04
    fitted = np.stack([side, 0.05 + 0.3 * mark - side**2], axis=-1)
    dims = ("case", "marker", "axis")
    noise = 1e-3 * np.random.default_rng(2).normal(size=fitted.shape)
    return xr.Dataset(
        {"measured": (dims, fitted + noise), "fitted": (dims, fitted)},
        coords={
            "case": ["low", "middle", "high"],
            "marker": mark,
            "axis": ["x", "z"],
            "weight": ("case", [0.5, 0.3, 0.1]),
        },
        attrs={"young": 7.84e6, "young_low": 7.6e6, "young_high": 8.1e6, "truth": 7.9e6, "synthetic": "yes"},
    )


def everything():
    return {
        "starts": starts(),
        "history": history(),
        "best": best(),
        "map": chart(),
        "sensitivity": sensitivity(),
        "trend": trend(),
        "composite": composite(),
        "static_test": static_test(),
        "pool": pool(),
    }

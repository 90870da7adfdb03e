"""The summary of a run: its body, driven joints, powers and energies, as means and as largest magnitudes."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nectosome.description.own_rows import DRIVE
from nectosome.io.summary import Summary
from nectosome.io.tables import AXES, Label, Number, Table
from nectosome.units.zero import counts_as_zero

from ..mean_window import beat_of_run, beats_of_samples, mean_of, mean_weights, mean_window, settling
from .motor_tables import LOOP_PEAKS, MOTOR_MEANS, MOTOR_PEAKS, endurance, motors, servos, tendons
from .stroke_tables import (
    EFFICIENCIES,
    OF_BEATS,
    forward_speeds,
    regime,
    stream_power,
    stroke,
    tail_first,
    too_soft,
    transport,
)

Arrays = Mapping[str, np.ndarray]

_PEAKS = ("reaction", "drive_velocity")
_CLOSED = 1e-4  # of the sizes of mean powers
_OVERFLOWED = "powers or momenta are NaN or infinite: values are too large. nectosome check warns of such values"


def run_summary(arrays: Arrays, attributes: Mapping[str, Any], each: bool = False) -> Summary:
    """Return body, joints, powers, energies and status; with `each`, each load on each part, and each part's energy.

    Means are over a cycle; of other runs over the last whole beats, about a tenth of the run; without a whole beat
    over the last tenth. Largest magnitudes are those of the whole run.
    """
    time = np.asarray(arrays["time"], dtype=float)
    start, over, beats = mean_window(time, attributes) if time.size > 1 else (float(time[0]), "", 0)
    weights = mean_weights(time, start, float(time[-1]))
    kept = weights > 0

    def mean(name: str) -> Any:
        return mean_of(arrays, attributes, name)

    def peak(name: str, values: np.ndarray | None = None) -> Any:
        known = arrays.get(f"{name}_peak")
        return np.abs(arrays[name] if values is None else values).max(axis=0) if known is None else known

    peaks = {name: peak(name) for name in ("reaction", "drive_velocity", "reaction_power") if name in arrays}
    load_power = arrays["load_power"].sum(axis=2)
    several = time.size > 1
    if "motor" in arrays:
        peaks |= {name: peak(name) for name in MOTOR_PEAKS if name not in LOOP_PEAKS}
        peaks |= {name: peak(name, arrays[name][kept]) for name in LOOP_PEAKS}
    through = arrays["velocity"][:, 0] - arrays.get("water_velocity", 0.0)
    velocity = mean("velocity")[0] - (mean("water_velocity") if "water_velocity" in arrays else 0.0)
    forward, _ = forward_speeds(arrays, attributes, weights, velocity, through[-1])
    fastest = float(np.linalg.norm(through, axis=-1).max())
    tables = [
        _body(arrays, attributes, weights, mean("velocity")[0], velocity),
        driven(arrays, mean("reaction"), peaks if several else None),
    ]
    if beats and not arrays["velocity"][:, 0].any():
        tables.append(
            mount(mean("load_force").sum(axis=(0, 1)), np.abs(arrays["load_force"].sum(axis=(1, 2))).max(axis=0))
        )
    if each:
        forces = acting(arrays, mean("load_force"), mean("load_power"), time[-1] - start)
        tables += [forces, *([stored(arrays, mean("part_energy"))] if "part_energy" in arrays else [])]
    total = load_power.sum(axis=1) + arrays["reaction_power"].sum(axis=1)
    settled = _settling(arrays, attributes)
    means = {name: mean(name) for name in MOTOR_MEANS if name in arrays}
    if {*OF_BEATS} <= {*arrays}:
        heading = f"stroke over {over.partition(',')[0]}{', not settled' if settled and not settled[0] else ''}"
        tables += [
            stroke(arrays, fastest, heading, EFFICIENCIES),
            transport({**arrays, **means}, float(peak("power_into_robot", total))),
        ]
    given = mean("load_power").sum(axis=1), mean("reaction_power")
    of_loads = peak("load_power", load_power)
    most = (of_loads, peaks["reaction_power"], float(peak("power_into_robot", total))) if several else None
    tables += [powers(arrays, *given, most)]
    energies = zip(map(str, arrays["form"]), mean("energy"), strict=True)
    rows = [(form, Number(float(joules), "J")) for form, joules in energies]
    tables.append(
        Table("energy", {"form": f"energy{_where(arrays)}", "mean": "mean" if several else ""}, rows, computed=True)
    )
    both = ((name, arrays.get(f"{name}_balance")) for name in ("power", "momentum"))
    balances = {name: float(np.max(off)) for name, off in both if off is not None}
    found, beyond = servos(arrays, peaks)
    if "battery_power" in arrays:
        known = arrays.get("battery_endurance")
        means["battery_endurance"] = endurance(arrays, attributes, weights) if known is None else known
    speed, known = float(np.linalg.norm(velocity)), arrays.get("range")
    held = counts_as_zero(mean("velocity")[0], 0.0, fastest).all() if known is None else np.isnan(known)
    more, saturated = motors(arrays, attributes, means, peaks, math.nan if streams(arrays) and held else speed)
    flow, meaning, cautions = regime({**arrays, **{key: mean(key) for key in ("load_power", "load_force")}}, attributes)
    if "tension" in arrays:
        more += tendons(arrays, mean("tension"), peak("tension"))
    return Summary(
        f"{attributes['title']}{f', {time[-1]:.4g} s' if several else ''}",
        [*tables, *flow, *found, *more],
        notes=[
            *([f"means: over {over}"] if over else []),
            *tail_first(forward, speed, fastest, str(arrays["part"][0]), attributes),
            *([settled[1]] if settled else []),
            *_not_closed(arrays),
            *_impulse(arrays),
            *meaning,
            *frames(arrays),
            *(["largest: in the whole run"] if several and "period" not in attributes else []),
            f"at the samples, off at worst: {', '.join(f'{name} balance {_off(x)}' for name, x in balances.items())}",
        ],
        warnings=[*beyond, *saturated, *([] if np.isfinite([*balances.values()]).all() else [_OVERFLOWED])],
        cautions=[*cautions, *too_soft(attributes)],
        attributes=attributes,
        values={
            "time": Number(float(time[-1]), "s"),
            "means_from": Number(start, "s"),
            **{f"{name}_balance": Number(off) for name, off in balances.items()},
            **({"impulse_energy": Number(float(arrays["impulse_energy"]), "J")} if "impulse_energy" in arrays else {}),
        },
    )


def _settling(arrays: Arrays, attributes: Mapping[str, Any]) -> tuple[bool, str] | None:
    """Return whether the motion has settled, and how the body's speed and the power of drives change from beat to beat.

    None of a run without beats, of less than two, and of a body that stays and takes no power.
    """
    beat = None if "period" in attributes else beat_of_run(attributes)
    if beat is None:
        return None
    drives = arrays["reaction_power"].sum(axis=1) + _driving(arrays)
    velocity, power = arrays.get("beat_velocity"), arrays.get("beat_power")
    if velocity is None or power is None:
        velocity, power = (beats_of_samples(arrays["time"], x, beat) for x in (arrays["velocity"][:, 0], drives))
    if not len(power):
        return None
    if "water_velocity" in arrays:
        seen = arrays.get("beat_water_velocity")
        seen = beats_of_samples(arrays["time"], arrays["water_velocity"], beat) if seen is None else seen
        velocity = velocity - seen
    size = float(np.linalg.norm(velocity[0]))
    known = {"power": (power, "W")}
    if not counts_as_zero(size, largest(arrays["velocity"])):
        known = {"speed": (velocity @ (velocity[0] / size), "m/s")} | known
    found = {name: (settling(means), unit) for name, (means, unit) in known.items()}
    words = []
    for name, (one, unit) in found.items():
        if one is not None and math.isfinite(one.change):
            comes = "" if one.settled or math.isnan(one.limit) else f", on its way to {one.limit:.3g} {unit}"
            words.append(f"{name} changes by {100 * one.change:.2g} % a beat{comes}")
    if not words:
        return None
    settled = all(one is None or one.settled for one, _ in found.values())
    return settled, f"{'settled' if settled else 'not settled'}: {'; '.join(words)}"


def _off(balance: float) -> str:
    return "not defined" if math.isnan(balance) else f"{balance:.1e}"


def _not_closed(arrays: Arrays) -> list[str]:
    """Return a line where the sum of mean powers is not the change of energy."""
    off = float(arrays.get("power_closure", 0.0))
    if not off > _CLOSED:
        return []
    return [
        f"mean powers: their sum misses the change of energy by {off:.1e} of their sizes; a smaller --rtol closes it"
    ]


def _driving(arrays: Arrays) -> np.ndarray:
    """Return the power of driven joints and motors over time [W]."""
    return arrays["load_power"][:, list(map(str, arrays["load"])).index(DRIVE)].sum(axis=1)


def _impulse(arrays: Arrays) -> list[str]:
    """Return a line about drives that are at speed at once, and how to start them from rest."""
    if not {"impulse", "impulse_energy"} <= {*arrays} or not arrays["impulse"].any():
        return []
    each = zip(map(str, arrays["prescribed"]), map(float, arrays["impulse"]), strict=True)
    name, most = max(each, key=lambda x: abs(x[1]))
    size = f"{most:.3g} {reaction_unit(name)} s at {name}" if is_joint(name) else f"at {name.rpartition('.')[0]}"
    energy = f"{float(arrays['impulse_energy']):.3g} J"
    return [f"start: an impulse brings the drives to speed ({size}, {energy}); with a ramp they start from rest"]


def streams(arrays: Arrays) -> bool:
    """Return whether a robot that water judges is in a stream: powers and energies over ground are others then."""
    return bool(np.any(arrays.get("water_velocity", 0.0)))


def frames(arrays: Arrays) -> list[str]:
    """Return a line about what is over ground and what through the water, of a robot in a stream."""
    if not streams(arrays):
        return []
    through = "; through the water: stroke, mean power of drives, its costs" if "power" in arrays else ""
    return [f"over ground: powers into the robot, energies{through}"]


def _where(arrays: Arrays) -> str:
    return ", over ground" if streams(arrays) else ""


def driven(arrays: Arrays, reaction: np.ndarray, peaks: Arrays | None) -> Table:
    """Return the mean `reaction` of each driven joint, with the largest one and the fastest speed of `peaks`."""
    heads = {"joint": "driven joint", "reaction": "mean reaction" if peaks else "reaction"}
    heads |= {"reaction_peak": "largest", "drive_velocity_peak": "fastest"} if peaks else {}
    rows = []
    for i, name in enumerate(map(str, arrays["prescribed"])):
        if is_joint(name):
            unit, rate = (reaction_unit(name), "rad/s") if reaction_unit(name) == "N m" else ("N", "m/s")
            most, fastest = (float(peaks[key][i]) if peaks and key in peaks else math.nan for key in _PEAKS)
            rows.append((name, Number(float(reaction[i]), unit, most), Number(most, unit), Number(fastest, rate)))
    return Table("driven_joints", heads, rows, computed=True, beside={"N": largest(arrays["load_force"])})


def largest(values: np.ndarray) -> float:
    """Return the largest magnitude, 0 of no values."""
    return float(abs(values).max(initial=0.0))


def mount(force: np.ndarray, peaks: np.ndarray) -> Table:
    """Return the mean force of a robot on what holds it [N]: over whole beats that of all loads on all of its parts.

    `peaks` are the largest magnitudes of their components.
    """
    each = (Number(float(x), "N", float(most)) for x, most in zip(force, peaks, strict=True))
    row = (Label("force", "mean force on it"), *each)
    return Table("mount", {"of": "mount", **AXES}, [row], computed=True, beside={"N": largest(peaks)})


def powers(
    arrays: Arrays,
    loads: np.ndarray,
    joints: np.ndarray,
    peaks: tuple[np.ndarray, np.ndarray, float] | None,
) -> Table:
    """Return mean powers of loads and of joints [W] and their sum; `peaks` are the largest magnitudes of all three.

    What gives or takes nothing is left out. A prescribed strain has several coordinates, whose largest powers come at
    different times: that of the whole strain is not known from them, and not told.
    """
    made: dict[str, np.ndarray] = {}
    strains = set[str]()
    load_peaks, joint_peaks, sum_peak = peaks or (loads, joints, 0.0)
    for name, *watts in zip(map(str, arrays["prescribed"]), joints, joint_peaks, strict=True):
        whole = name if is_joint(name) else name.rpartition(".")[0]
        strains |= {whole} - {name}
        made[whole] = made.get(whole, 0.0) + np.array(watts)
    made |= {str(name): np.array(watts) for name, *watts in zip(arrays["load"], loads, load_peaks, strict=True)}
    beside = stream_power(arrays)
    most = max(map(largest, made.values()), default=0.0)
    each = [(name, *map(float, x)) for name, x in made.items() if not counts_as_zero(x, max(most, beside)).all()]
    rows = [
        (_readable(name), Number(mean, "W", abs(peak)), Number(math.nan if name in strains else peak, "W"))
        for name, mean, peak in each
    ]
    total = (Label("sum", "sum"), Number(float(loads.sum() + joints.sum()), "W", sum_peak))
    heads = {"of": f"power into the robot{_where(arrays)}", "mean": "mean" if peaks else ""} | (
        {"peak": "largest"} if peaks else {}
    )
    return Table("power", heads, [*rows, total], computed=True, beside={"W": beside})


def acting(arrays: Arrays, force: np.ndarray, power: np.ndarray, time: float) -> Table:
    """Return mean force [load, part, axis] and mean power [load, part] of each load on each part that are not 0.

    With a `time` [s] that the means are over also the energy.
    """
    heads = {"of": "load on part", **AXES, "power": "power"} | ({"energy": "energy"} if time else {})
    rows = []
    nothing = counts_as_zero(force, largest(force)).all(axis=-1)
    nothing &= counts_as_zero(power, max(largest(power), stream_power(arrays)))
    for i, load in enumerate(map(str, arrays["load"])):
        for k, part in enumerate(map(str, arrays["part"])):
            if not nothing[i, k]:
                label = Label(f"{load} on {part}", f"{load.replace('_', ' ')} on {part}")
                gives = float(power[i, k])
                energy = (Number(time * gives, "J"),) if time else ()
                rows.append((label, *(Number(float(x), "N") for x in force[i, k]), Number(gives, "W"), *energy))
    return Table("load_force", heads, rows, computed=True, beside={"W": stream_power(arrays)})


def stored(arrays: Arrays, energy: np.ndarray) -> Table:
    """Return the mean energy [part, form] of each part that is not 0."""
    forms = {form: form for form in map(str, arrays["form"])}
    each = zip(map(str, arrays["part"]), energy, strict=True)
    rows = [(part, *(Number(float(x), "J") for x in joules)) for part, joules in each if joules.any()]
    return Table("part_energy", {"part": "energy of part", **forms}, rows, computed=True)


def is_joint(coordinate: str) -> bool:
    """Return whether a prescribed coordinate is that of a joint, not of a rod's strain."""
    return not coordinate.rpartition(".")[2].isdigit()


def reaction_unit(coordinate: str) -> str:
    """Return the unit of the reaction of a prescribed coordinate; N m of a strain, whose coordinate has no length."""
    turns = coordinate.rpartition(".")[2] in ("angle", "wx", "wy", "wz")
    return "N m" if turns or not is_joint(coordinate) else "N"


def origin(attributes: Mapping[str, Any]) -> Table:
    """Return the provenance of a run: settings, versions and time."""
    known: dict[str, Any] = json.loads(attributes["provenance"])
    rows = []
    for key, value in known.items():
        shown = ", ".join(f"{k} {_plain(v)}" for k, v in value.items()) if isinstance(value, dict) else _plain(value)
        rows.append((key, shown))
    return Table("made_with", {"what": "made with", "value": ""}, rows)


def _plain(value: Any) -> str:
    return f"({', '.join(map(str, value))})" if isinstance(value, list) else str(value)


def _readable(name: str) -> Label:
    return Label(name, name.replace("_", " "))


def _body(
    arrays: Arrays, attributes: Mapping[str, Any], weights: np.ndarray, mean: np.ndarray, through: np.ndarray
) -> Table:
    """Velocity of the root body's first station at the end and its mean, over ground and in a stream through the water.

    With its size and its part ahead; and the position at the end. `mean` is the mean velocity over ground, `through`
    that through the water [m/s].
    """
    over_ground, position = arrays["velocity"][:, 0], arrays["position"][-1, 0]
    seen, means = {"": over_ground}, {"": mean}
    if "water_velocity" in arrays:
        seen["_through_water"] = over_ground - arrays["water_velocity"]
        means["_through_water"] = through
    rows, none = list[tuple[Label, *tuple[Number, ...]]](), [Number(float(x), "m") for x in position]
    aheads = list[float]()
    for key, velocity in seen.items():
        words = key.replace("_through_water", " through the water")
        peaks = np.abs(velocity).max(axis=0)
        most = float(np.linalg.norm(peaks))
        on_mean, end = forward_speeds(arrays, attributes, weights, means[key], velocity[-1])
        shown = {"velocity_end": (velocity[-1], end, 0.0), "velocity_mean": (means[key], on_mean, 1.0)}
        named = {"velocity_end": f"velocity{words} at the end", "velocity_mean": f"mean velocity{words}"}
        if len(velocity) < 2:
            shown, named = {"velocity": shown["velocity_mean"]}, {"velocity": f"velocity{words}"}
        for name, (vector, ahead, share) in shown.items():
            numbers = [Number(float(x), "m/s", share * float(peak)) for x, peak in zip(vector, peaks, strict=True)]
            size = [Number(x, "m/s", share * most) for x in (float(np.linalg.norm(vector)), ahead) if x == x]
            rows.append((Label(f"{name}{key}", named[name]), *numbers, *size))
            aheads.append(ahead)
    where = ("position", "position") if len(over_ground) < 2 else ("position_end", "position at the end")
    rows.append((Label(*where), *none))
    heads = {"of": str(arrays["part"][0]), **AXES, "size": "size", "forward": "forward"}
    beside = {"m/s": max(largest(arrays["velocity"]), *map(largest, seen.values()))}
    hidden = still(np.abs([*seen.values()]).max(axis=(0, 1)), beside)
    if counts_as_zero(np.array(aheads), beside["m/s"]).all():  # it moves across its axis, or the axis is not known
        hidden |= {"forward"}
    return Table("body", heads, rows, computed=True, hidden=hidden, beside=beside)


def still(fastest: np.ndarray, beside: Mapping[str, float]) -> set[str]:
    """Return axes along which a body with these largest velocities rests; `size` and `forward` where it rests whole."""
    resting = {axis for axis, x in zip(AXES, fastest, strict=True) if counts_as_zero(x, beside["m/s"])}
    return resting | {"size", "forward"} if len(resting) == len(AXES) else resting

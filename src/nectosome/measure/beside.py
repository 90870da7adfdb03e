"""Files of other devices that ran beside a recording: one recording of all, at the times of the first."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.units import InputError, count, shorten

from .labels import file_of
from .sheet import DeviceClock, Sheet

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class DeviceFile:
    """A file of a device, how it is read, and how late it is."""

    name: str  # of the device
    path: Path
    sheet: Sheet
    clock: DeviceClock


def same_run(pattern: str, of: str, path: str) -> str:
    """Name of a device's file in the run of another one: what each * of the other's pattern stands for there.

    Raises InputError for another number of them.
    """
    stars = re.fullmatch(re.escape(of).replace(r"\*", "(.*)"), path)
    found = stars.groups() if stars is not None else ()
    if pattern.count("*") != len(found):
        raise InputError(f'"{shorten(pattern)}" needs as many signs * as "{shorten(of)}", {len(found)}.')
    parts = iter(found)
    return re.sub(r"\*", lambda _: next(parts), pattern)


def with_devices(recording: "xr.Dataset", others: "list[tuple[DeviceFile, xr.Dataset]]") -> "xr.Dataset":
    """A recording with the quantities of other devices, resampled at its times as by `signals.resample`.

    Clocks are as each file says: by a trigger, a date, an offset. A shift and a drift that are known come off; ranges
    are handed over to fits as clocks of the devices. The trigger of another device is not kept. Raises InputError for
    a recording without a time, and for quantities of one name.
    """
    from .signals.resample import resample

    about, clocks = json.loads(recording.attrs["provenance"]), json.loads(recording.attrs.get("clocks", "{}"))
    about["beside"] = {}
    for device, own in others:
        file, name = file_of(own), device.name
        for one, where in ((recording, file_of(recording)), (own, file)):
            if "time" not in one.dims or one.sizes["time"] < 2:
                raise InputError("has no time by which devices could be joined.", file=where)
        trigger = None if device.sheet.time is None else device.sheet.time.trigger
        own = own.drop_vars([trigger] if trigger is not None else [])
        twice = [str(x) for x in own.data_vars if x in recording.data_vars]
        if twice or name in clocks:
            what = (
                f"has {', '.join(twice)} as well as {file_of(recording)}" if twice else f"is called {name}, as a clock"
            )
            raise InputError(f"{what}. Give them other names under columns.", file=file)
        time = recording["time"].values
        moved = own.assign_coords(time=device.clock.times(own["time"].values, float(own["time"][0])))
        told = json.loads(own.attrs["provenance"])
        try:
            new = resample(moved.drop_attrs(), times=time)
        except ValueError:  # shorter than the filter
            new = resample(moved.drop_attrs(), times=time, antialias=False)
            told["warnings"].append("too short for a low-pass: what is faster than the recording may alias")
        low = json.loads(new.attrs["processing"])[-1]["antialias"]
        done = f"{', '.join(map(str, own.data_vars))}: resampled at the times of {file_of(recording)}"
        about["conversions"] += [f"{file}: {note}" for note in told["conversions"]]
        about["conversions"].append(f"{file}: {done}{f', after a low-pass of {low:.4g} Hz' if low else ''}")
        about["repairs"] += [f"{file}: {note}" for note in told["repairs"]]
        about["warnings"] += [f"{file}: {note}" for note in told["warnings"]]
        about["beside"][name] = {key: told[key] for key in ("file", "bytes", "sha256", "reader", "found")}
        for key in own.data_vars:
            values = new[key].values
            missing = int(np.isnan(values).sum())
            attributes = own[key].attrs | {"missing": missing, "clock": name}
            recording = recording.assign({str(key): ("time", values, attributes)})
            if missing:
                about["warnings"].append(f"{key}: {count(missing, 'time')} of the recording without a reading")
        late: dict[str, Any] = (
            {} if device.clock.is_known else {"shift": device.clock.shift, "drift": device.clock.drift}
        )
        clocks[name] = {"columns": [str(key) for key in own.data_vars], **late}
    return recording.assign_attrs(provenance=json.dumps(about), clocks=json.dumps(clocks))

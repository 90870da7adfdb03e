"""The page of one run: the robot in motion, its velocity, powers and energies."""

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import robot3d, series
from .closed_loop import closed_loop_panels
from .page import panel_html, write_page
from .tubes import description

if TYPE_CHECKING:
    import xarray as xr


def show_run(run: "xr.Dataset", path: str | Path) -> None:
    """Write a page about any one run, with its robot in motion, velocity, powers and energies.

    Of one under a controller also how the reference was followed. The page works offline and is written whole or not at
    all. Raises InputError where it cannot be written.
    """
    import json

    title = str(run.attrs.get("title") or "simulation")
    source = json.loads(run.attrs.get("provenance") or "{}")
    robot = description(run)
    parts = [f"<h1>{escape(title)}</h1>"]
    if robot is not None:
        parts.append(f"<p>{escape(robot.about)}</p>")
    parts.append(f'<p class="small">{escape(" · ".join(filter(None, [ended(run), origin(source)])))}</p>')
    panels = (robot3d.robot_panel, series.velocity_panel, series.power_panel, series.energy_panel)
    shown = [make(run) for make in panels]
    shown[1:1] = closed_loop_panels(run) if "reference" in run else []
    parts += [panel_html(panel, f"figure-{i + 1}") for i, panel in enumerate(shown)]
    write_page(path, title, parts)


def ended(run: "xr.Dataset") -> str:
    """How a run ended, in words."""
    return str(run.attrs.get("status_reason", ""))


def origin(source: Mapping[str, Any]) -> str:
    """Version, time, machine and packages in a line."""
    if not source:
        return ""
    packages = source.get("packages", {})
    words = [
        f"nectosome {source.get('nectosome', '')}",
        str(source.get("time", "")),
        f"Python {source.get('python', '')}",
        f"JAX {packages['jax']}" if "jax" in packages else "",
        str(source.get("platform", "")),
        f"{source['processors']} processors" if source.get("processors") else "",
    ]
    return " · ".join(word for word in words if word)

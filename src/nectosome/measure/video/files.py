"""Reading a `track.yaml`: of segments in one video, or of markers in several."""

from pathlib import Path

from nectosome.io.errors import InputError
from nectosome.io.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml

from .marker_sheet import MarkerSheet
from .sheet import SegmentSheet

_LEAST = "It needs segments, for one video; or cameras, points and markers, for several."


def load_sheet(path: str | Path) -> SegmentSheet | MarkerSheet:
    """Read a sheet. Raises InputError that names file, line and field."""
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    if isinstance(data, dict) and not {"segments", "cameras", "markers"} & set(data):
        raise InputError(f"says nothing of what to track. {_LEAST}", file=source)
    model = MarkerSheet if isinstance(data, dict) and {"cameras", "markers"} & set(data) else SegmentSheet
    return validate_as(model, data, _LEAST, file=source, lines=lines)

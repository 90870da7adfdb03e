"""Places along a part: its tip, its root, or a mark of a rod."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import core_schema

from nectosome.description.base import unfit
from nectosome.units import shorten


@dataclass(frozen=True)
class _PlaceField:
    """Reads `tip`, `root` or a fraction between 0 and 1, the place of a mark."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(_read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        fraction = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
        return {"description": "tip, root, or one of the rod's marks", "anyOf": [{"enum": ["tip", "root"]}, fraction]}


def _read(value: Any) -> str | float:
    if isinstance(value, str) and value in ("tip", "root"):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < 1:
        return float(value)
    why = f'"{shorten(value)}" is no place on a part. Write tip, root, or the fraction of one of the rod\'s marks.'
    raise unfit(why)


Place = Annotated[str | float, _PlaceField()]
"""`tip`, `root`, or the fraction (0 to 1) of one of a rod's marks."""

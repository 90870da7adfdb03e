"""All validation cases, for the tests and for the table in the documentation."""

from .case import Case, Omitted
from .flow import CASES as FLOW
from .rods import CASES as RODS
from .surface import CASES as SURFACE

CASES: list[Case] = [*RODS, *FLOW, *SURFACE]
OMITTED: list[Omitted] = [
    Omitted(
        "Taylor's swimming sheet",
        "a sheet in Stokes flow: the drag here is quadratic and local, and has no viscous limit to compare with; "
        "the resistive swimmer is its counterpart for a slender body with this drag",
    ),
]

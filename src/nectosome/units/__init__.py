"""Quantities with units as text to SI and back, ranges, and input errors."""

from .conversion import (
    expected,
    format_quantity,
    in_dimension,
    parse_quantity,
    read_any,
    read_positive,
    read_quantity,
    scale_to_si,
    show_quantity,
    show_span,
    show_value,
    shown_unit,
    split_unit,
    unit_to_si,
)
from .errors import (
    InputError,
    brief,
    check_choice,
    check_names,
    check_share,
    check_whole,
    count,
    cut_words,
    did_you_mean,
    kind_of,
    printable,
    read_numbers,
    read_pairs,
    shorten,
)
from .unit_names import DIMENSIONS, Dimension, MeshUnit, dimension_of

"""How well a loop tracks its reference, as rows of a table."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nectosome.cli.layout import Label, Number

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import Float


def tracking_errors(
    time: "Float[np.ndarray, 'k']",
    output: "Float[np.ndarray, 'k']",
    reference: "Float[np.ndarray, 'k']",
    unit: str,
    show: Callable[[float], str],
) -> list[tuple[Label, Number]]:
    """Rise, overshoot and settling of a step, and errors of any reference; `show` writes a value of it."""
    import numpy as np

    from nectosome.controllers import rms_error, step_response

    rows = list[tuple[Label, Number]]()

    def add(key: str, name: str, value: float, unit: str, shown: str) -> None:
        rows.append((Label(key, name), Number(float(value), unit, shown=shown if np.isfinite(value) else "never")))

    answer, largest = step_response(time, output, reference), np.abs(output - reference).max()
    if answer is not None:
        add("rise", "rise, 10 to 90 %", answer.rise, "s", f"{answer.rise:.4g} s")
        add("overshoot", "overshoot", answer.overshoot, "", f"{100 * answer.overshoot:.4g} %")
        add("settling", "settled within 5 %, from", answer.settling, "s", f"{answer.settling:.4g} s")
        add("steady_error", "steady error", answer.steady_error, unit, show(answer.steady_error))
    rms = rms_error(output, reference)
    add("rms_error", "rms error", rms, unit, show(rms))
    add("largest_error", "largest error", largest, unit, show(largest))
    return rows

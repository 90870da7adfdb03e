"""Matrices of added mass, 6 x 6, rotation before translation: their checks and their mirror images."""

from typing import Any


def matrix_image(rows: Any) -> Any:
    """Return the image of a 6 x 6 matrix, rotation before translation."""
    signs = (-1, 1, -1, 1, -1, 1)
    return tuple(
        tuple(a * b * x + 0.0 for b, x in zip(signs, row, strict=True)) for a, row in zip(signs, rows, strict=True)
    )


def check_added_mass(rows: Any) -> None:
    """Raise ValueError for a matrix that is not symmetric, or by which some motion has a negative energy."""
    import numpy as np

    matrix = np.array(rows)
    slack = 1e-9 * max(np.abs(matrix).max(), 1e-300)
    if np.abs(matrix - matrix.T).max() > slack:
        raise ValueError("an added-mass matrix is symmetric, this one is not.")
    if np.linalg.eigvalsh(matrix).min() < -slack:
        raise ValueError("an added mass takes energy in every direction, this matrix gives some: it is not valid.")

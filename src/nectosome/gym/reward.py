"""Rewards as expressions of quantities: arithmetic and a few functions, nothing else of Python."""

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, did_you_mean, kind_of, shorten

FUNCTIONS: dict[str, tuple[Callable[..., Any], int]] = {
    "abs": (np.abs, 1),
    "sqrt": (np.sqrt, 1),
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tanh": (np.tanh, 1),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
}
"""Functions of a reward, each with how many arguments it takes."""

_OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?:\.\w+)*")  # also tail.bending_z.0, which is none of Python's
_HINT = f"Take + - * / **, numbers in SI units, names of quantities and {', '.join(FUNCTIONS)}."
_LONGEST = 2000  # characters
_DEEPEST = 50  # levels of brackets and operators


class Reward:
    """An expression such as `-abs(heading - goal.heading) - 0.1 * electrical_power.middle.angle`; quantities in SI.

    Raises InputError for what is no such expression.
    """

    def __init__(self, text: str):
        if not isinstance(text, str):
            raise InputError(f"{kind_of(text)} is given where an expression is expected. {_HINT}", field="reward")
        self.text = text
        self._names: list[str] = []
        plain = _NAME.sub(self._placeholder, text)
        try:
            if len(text) > _LONGEST:
                raise SyntaxError
            self._tree = ast.parse(plain.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise InputError(f'"{shorten(text)}" is no expression. {_HINT}', field="reward") from None
        self._check(self._tree, 0)
        self.names = tuple(name for name in self._names if name not in FUNCTIONS)
        """Quantities in it, in the order in which they come first."""

    def value(self, quantities: Mapping[str, Float[np.ndarray, "n"]]) -> Float[np.ndarray, "n"]:
        """Its value, of arrays or numbers by the names of quantities; NaN or infinite where it has none."""
        with np.errstate(all="ignore"):
            return self._value(self._tree, quantities)

    def _placeholder(self, match: re.Match[str]) -> str:
        name = match[0]
        if name not in self._names:
            self._names.append(name)
        return f"x{self._names.index(name)}"

    def _name(self, node: ast.Name) -> str:
        return self._names[int(node.id[1:])]

    def _check(self, node: ast.AST, depth: int) -> None:
        """Raise InputError for anything but arithmetic."""
        inner: Sequence[ast.AST] = ()
        fits = depth < _DEEPEST
        if isinstance(node, ast.BinOp):
            fits, inner = fits and type(node.op) in _OPERATORS, [node.left, node.right]
        elif isinstance(node, ast.UnaryOp):
            fits, inner = fits and type(node.op) in _OPERATORS, [node.operand]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            called = self._name(node.func)
            if called not in FUNCTIONS:
                message = f'"{shorten(called)}" is no function.{did_you_mean(called, FUNCTIONS)}'
                raise InputError(f"{message} There are {', '.join(FUNCTIONS)}.", field="reward")
            takes = FUNCTIONS[called][1]
            if node.keywords or len(node.args) != takes:
                raise InputError(f"{called} takes {takes} value{'s' * (takes > 1)}.", field="reward")
            inner = node.args
        elif isinstance(node, ast.Name):
            fits = fits and self._name(node) not in FUNCTIONS
        else:
            fits = fits and isinstance(node, ast.Constant) and type(node.value) in (int, float)
        if not fits:
            raise InputError(f'"{shorten(self.text)}" is no expression. {_HINT}', field="reward")
        for one in inner:
            self._check(one, depth + 1)

    def _value(self, node: ast.AST, quantities: Mapping[str, Any]) -> Any:
        if isinstance(node, ast.BinOp):
            return _OPERATORS[type(node.op)](self._value(node.left, quantities), self._value(node.right, quantities))
        if isinstance(node, ast.UnaryOp):
            return _OPERATORS[type(node.op)](self._value(node.operand, quantities))
        if isinstance(node, ast.Call):
            assert isinstance(node.func, ast.Name)
            f, _ = FUNCTIONS[self._name(node.func)]
            return f(*(self._value(one, quantities) for one in node.args))
        if isinstance(node, ast.Name):
            return quantities[self._name(node)]
        assert isinstance(node, ast.Constant)
        return np.float64(node.value)  # type: ignore[arg-type]

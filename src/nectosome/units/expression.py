"""Formulas of quantities by name: expressions of arithmetic and a few functions, and functions of Python."""

import ast
import hashlib
import inspect
import operator
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .conversion import named_unit, written_unit
from .errors import InputError, did_you_mean, kind_of, shorten

FUNCTIONS = {
    "abs": ("abs", 1),
    "sqrt": ("sqrt", 1),
    "exp": ("exp", 1),
    "log": ("log", 1),
    "sin": ("sin", 1),
    "cos": ("cos", 1),
    "tanh": ("tanh", 1),
    "min": ("minimum", 2),
    "max": ("maximum", 2),
}
"""Functions of an expression, each by its name in NumPy and JAX, with how many arguments it takes."""

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


class Formula(ABC):
    """A number that follows from quantities in SI units."""

    text: str  # for people
    key: str  # the same for the same formula only
    names: tuple[str, ...]  # of its quantities, in the order in which they come first

    @abstractmethod
    def value(self, quantities: Mapping[str, Any], xp: Any = np) -> Any:
        """Its value, by NumPy or by `jax.numpy` (`xp`); NaN or infinite where it has none."""

    def each(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Its values of several rows, given by the columns of its quantities; one value where it has none."""
        if not self.names:
            return self.value({})
        each = zip(*(columns[name] for name in self.names), strict=True)
        return np.array([self.value(dict(zip(self.names, map(np.float64, row), strict=True))) for row in each], float)

    def unit(self, units: Mapping[str, str]) -> str:
        """Its unit, of the SI units of its quantities; "1" of a number, "" where it mixes units or none is known."""
        return ""


class Expression(Formula):
    """An expression such as `-abs(heading - goal.heading) - 0.1 * electrical_power.middle.angle`; quantities in SI.

    Its quantities may be arrays. Raises InputError, which names the `field`, for what is no such expression.
    """

    def __init__(self, text: str, field: str | None = "expression"):
        if not isinstance(text, str):
            raise InputError(f"{kind_of(text)} is given where an expression is expected. {_HINT}", field=field)
        self.text = self.key = text
        self._field = field
        self._names: list[str] = []
        plain = _NAME.sub(self._placeholder, text)
        try:
            if len(text) > _LONGEST:
                raise SyntaxError
            self._tree = ast.parse(plain.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise self._wrong() from None
        self._check(self._tree, 0)
        self.names = tuple(name for name in self._names if name not in FUNCTIONS)

    def value(self, quantities: Mapping[str, Any], xp: Any = np) -> Any:
        """Its value, of arrays or numbers by the names of quantities; NaN or infinite where it has none."""
        with np.errstate(all="ignore"):
            return self._value(self._tree, quantities, xp)

    def each(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Its values of several rows, at once."""
        return self.value(columns)

    def unit(self, units: Mapping[str, str]) -> str:
        """Its unit; numbers that are added to quantities, or compared with them, have theirs."""
        try:
            unit = self._unit(self._tree, units)
        except _MixedUnitsError:
            return ""
        return written_unit(unit or named_unit("")) or "1"

    def _wrong(self) -> InputError:
        return InputError(f'"{shorten(self.text)}" is no expression. {_HINT}', field=self._field)

    def _placeholder(self, match: re.Match[str]) -> str:
        name = match[0]
        if name not in self._names:
            self._names.append(name)
        return f"x{self._names.index(name)}"

    def _name(self, node: ast.expr) -> str:
        assert isinstance(node, ast.Name)
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
                raise InputError(f"{message} There are {', '.join(FUNCTIONS)}.", field=self._field)
            takes = FUNCTIONS[called][1]
            if node.keywords or len(node.args) != takes:
                raise InputError(f"{called} takes {takes} value{'s' * (takes > 1)}.", field=self._field)
            inner = node.args
        elif isinstance(node, ast.Name):
            fits = fits and self._name(node) not in FUNCTIONS
        else:
            fits = fits and isinstance(node, ast.Constant) and type(node.value) in (int, float)
        if not fits:
            raise self._wrong()
        for one in inner:
            self._check(one, depth + 1)

    def _value(self, node: ast.AST, quantities: Mapping[str, Any], xp: Any) -> Any:
        if isinstance(node, ast.BinOp):
            left, right = (self._value(one, quantities, xp) for one in (node.left, node.right))
            return _OPERATORS[type(node.op)](left, right)
        if isinstance(node, ast.UnaryOp):
            return _OPERATORS[type(node.op)](self._value(node.operand, quantities, xp))
        if isinstance(node, ast.Call):
            f = getattr(xp, FUNCTIONS[self._name(node.func)][0])
            return f(*(self._value(one, quantities, xp) for one in node.args))
        if isinstance(node, ast.Name):
            return _by_ieee(quantities[self._name(node)])
        assert isinstance(node, ast.Constant)
        return np.float64(node.value)  # type: ignore[arg-type]

    def _unit(self, node: ast.AST, units: Mapping[str, str]) -> Any:
        """Unit of a branch; None of a number, which has that of what it is added to."""
        if isinstance(node, ast.Name):
            return named_unit(units[self._name(node)])
        if isinstance(node, ast.UnaryOp):
            return self._unit(node.operand, units)
        if isinstance(node, ast.Call):
            called, own = self._name(node.func), [self._unit(one, units) for one in node.args]
            if called in ("abs", "min", "max"):
                return _common(own)
            if called == "sqrt" and own[0] is not None:
                return own[0] ** 0.5
            return None if own[0] is None else named_unit("")
        if not isinstance(node, ast.BinOp):
            return None
        left, right = self._unit(node.left, units), self._unit(node.right, units)
        if isinstance(node.op, ast.Add | ast.Sub):
            return _common([left, right])
        if isinstance(node.op, ast.Pow):
            constant = not any(isinstance(one, ast.Name) for one in ast.walk(node.right))
            if left is not None and constant:
                return left ** float(self._value(node.right, {}, np))
            return _common([left, left and named_unit("")])  # a power that changes is one of a number
        if left is None and right is None:
            return None
        left, right = (named_unit("") if one is None else one for one in (left, right))
        return left * right if isinstance(node.op, ast.Mult) else left / right


class FunctionFormula(Formula):
    """A function of Python that takes quantities, a mapping from names to numbers in SI units, and gives a number.

    It is called once to see which quantities it reads, of those that are `known`. Raises InputError, which names the
    `field`, for others, for what is no function, and for what gives no number.
    """

    def __init__(
        self, function: Callable[[Mapping[str, Any]], Any], known: Collection[str], field: str | None = "function"
    ):
        if not callable(function):
            words = f"{kind_of(function)} is given where a name, an expression or a function of quantities is expected."
            raise InputError(words, field=field)
        self.function, self._known, self._field = function, dict.fromkeys(known), field
        self.text = f"{getattr(function, '__name__', type(function).__name__).strip('<>')}()"
        self.names = ()
        read = dict[str, np.float64]()
        self._call(_Named(self._known, lambda name: read.setdefault(name, np.float64(1 + 0.1 * len(read)))))
        self.names = tuple(read)

    @property
    def key(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Its qualified name, and a digest of its source and of the values that it holds."""
        function: Any = inspect.unwrap(self.function)
        code = getattr(function, "__code__", None)
        if code is None:
            return repr(function)
        try:
            source = inspect.getsource(function)
        except (OSError, TypeError):  # typed in at a prompt
            source = ""
        constants = [one for one in code.co_consts if not inspect.iscode(one)]
        held = [*(function.__defaults__ or ()), *(cell.cell_contents for cell in function.__closure__ or ())]
        about = repr((source, code.co_code, constants, code.co_names, held))
        return f"{function.__module__}.{function.__qualname__} {hashlib.sha256(about.encode()).hexdigest()[:16]}"

    def value(self, quantities: Mapping[str, Any], xp: Any = np) -> Any:
        """Its value, of numbers by their names; NaN where arithmetic has none."""

        def given(name: str) -> Any:
            if name not in quantities:
                words = f'"{name}" is read at some values only. Read all quantities first, then decide.'
                raise InputError(words, field=self._field)
            return _by_ieee(quantities[name])

        return xp.asarray(self._call(_Named(self._known, given)), dtype=float)

    def _call(self, quantities: "_Named") -> Any:
        try:
            with np.errstate(all="ignore"):
                value = self.function(quantities)
        except InputError as error:
            raise InputError(f"{self.text}: {error.message}", field=self._field) from None
        except ArithmeticError:
            return np.nan
        except Exception as error:  # whatever somebody else's function raises
            words = f"{self.text} fails with {type(error).__name__}: {shorten(error, 200)}"
            raise InputError(words, field=self._field) from error
        plain = isinstance(value, int | float) and not isinstance(value, bool)
        if not plain and (np.ndim(value) or getattr(getattr(value, "dtype", None), "kind", "") not in ("f", "i", "u")):
            raise InputError(f"{self.text} gives {kind_of(value)}; a number is expected.", field=self._field)
        return value


class _Named(Mapping[str, Any]):
    """Quantities by name, of those that are known."""

    def __init__(self, known: Collection[str], given: Callable[[str], Any]):
        self._known, self._given = known, given

    def __getitem__(self, name: str) -> Any:
        if name not in self._known:
            near = did_you_mean(str(name), self._known, 0)
            raise InputError(f'"{shorten(name)}" is no quantity.{near} There are {", ".join([*self._known][:40])}.')
        return self._given(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


def _by_ieee(value: Any) -> Any:
    """A number of Python as one of NumPy, which divides by 0; others as they are."""
    return np.float64(value) if isinstance(value, int | float) else value


class _MixedUnitsError(Exception):
    """A sum of different units."""


def _common(units: Sequence[Any]) -> Any:
    """The one unit of values that are added or compared; None where all are numbers."""
    given = [unit for unit in units if unit is not None]
    if any(not unit.is_compatible_with(given[0]) for unit in given):
        raise _MixedUnitsError
    return given[0] if given else None

"""What code of a page imports and calls, held against the package without running it."""

import ast
import inspect
from importlib import import_module
from importlib.util import find_spec
from typing import Any


def wrong_in(code: str) -> list[str]:
    """Names that the package lacks, and keywords that its functions do not take."""
    tree = ast.parse(code)
    known: dict[str, Any] = {}
    wrong = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for name in node.names:
                first = name.name.partition(".")[0]
                module = import_module(name.name)
                known[name.asname or first] = module if name.asname else import_module(first)
        elif isinstance(node, ast.ImportFrom):
            module = import_module(node.module or "")
            for name in node.names:
                full = f"{node.module}.{name.name}"
                if hasattr(module, name.name):
                    known[name.asname or name.name] = getattr(module, name.name)
                elif find_spec(full):
                    known[name.asname or name.name] = import_module(full)
                else:
                    wrong.append(full)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            owner = _of(node.value, known)
            if inspect.ismodule(owner) and not hasattr(owner, node.attr):
                wrong.append(ast.unparse(node))
        elif isinstance(node, ast.Call) and callable(called := _of(node.func, known)):
            wrong += [f"{ast.unparse(node.func)}: {why}" for why in _unbound(called, node)]
    return wrong


def _of(node: ast.expr, known: dict[str, Any]) -> Any:
    """What a name or a chain of names is in the package; None for what only a run knows."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    if isinstance(node, ast.Attribute):
        return getattr(_of(node.value, known), node.attr, None)
    return None


def _unbound(called: Any, call: ast.Call) -> list[str]:
    """Why arguments do not fit a function of the package."""
    if not getattr(called, "__module__", "").startswith("nectosome"):
        return []
    if inspect.isclass(called) and issubclass(called, BaseException):
        return []
    if any(isinstance(a, ast.Starred) for a in call.args) or any(k.arg is None for k in call.keywords):
        return []
    try:
        inspect.signature(called).bind(*call.args, **{k.arg: k.value for k in call.keywords if k.arg})
    except TypeError as error:
        return [str(error)]
    return []

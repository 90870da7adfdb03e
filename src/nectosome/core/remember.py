"""Programs that are traced once and remembered on disk, so that a later process starts without tracing them again.

JAX's compilation cache spares the compiler, but tracing a robot's equations takes seconds too. Here a traced program is
exported beside that cache, under a name made of its function, the structure of its arguments, and the sources of all
classes in them; whatever changes makes it be traced anew.
"""

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
from jax import export

_programs: dict[str, Callable[..., list[jax.Array]]] = {}


def remembered(f: Callable[..., Any], out: Any, *args: Any) -> Any:
    """f(*args), compiled; `out` is any pytree of the structure that f returns.

    f must be a function of a module and depend on nothing but its arguments, whose leaves are arrays. Without a cache
    folder (`NECTOSOME_CACHE=`) it is traced as usual.
    """
    leaves, structure = jax.tree.flatten(args)
    shapes = [(leaf.shape, str(leaf.dtype)) for leaf in leaves]
    text = f"{f.__module__}.{f.__qualname__} {structure} {shapes} {jax.default_backend()}"
    if text not in _programs:
        _programs[text] = _program(f, structure, leaves, _file(text, args))
    return jax.tree.unflatten(jax.tree.structure(out), _programs[text](*leaves))


def _program(
    f: Callable[..., Any], structure: Any, leaves: list[jax.Array], file: Path | None
) -> Callable[..., list[jax.Array]]:
    def flat(*leaves: jax.Array) -> list[jax.Array]:
        return jax.tree.leaves(f(*jax.tree.unflatten(structure, leaves)))

    if file is None:
        return jax.jit(flat)
    try:
        exported = export.deserialize(bytearray(file.read_bytes()))
    except (OSError, ValueError):  # not there yet, or cut off by a kill: trace it
        exported = export.export(jax.jit(flat))(*leaves)
        _store(file, exported.serialize())
    return jax.jit(exported.call)


def _file(text: str, args: Any) -> Path | None:
    """Where the program is kept; None without a cache folder, or where its sources cannot be told."""
    compiled = jax.config.values["jax_compilation_cache_dir"]
    sources = {_source(kind) for kind in _classes(args)}
    if not compiled or None in sources or " at 0x" in text:
        return None
    digest = hashlib.sha256(text.encode())
    digest.update(f"{version('jax')} {version('equinox')}".encode())
    rooms = (path for room in _ROOMS for path in (_PACKAGE / room).glob("*.py"))
    for path in sorted({*rooms, *(path for path in sources if path)}):
        digest.update(path.read_bytes())
    return Path(compiled).parent / "traced" / digest.hexdigest()


_PACKAGE = Path(__file__).parents[1]
_ROOMS = ("core", "mechanism", "loads", "solve")


def _classes(x: Any) -> set[type]:
    """Classes of all modules in a tree."""
    found = {type(x)} if isinstance(x, eqx.Module) else set()
    inner = vars(x).values() if isinstance(x, eqx.Module) else x if isinstance(x, tuple | list) else ()
    inner = x.values() if isinstance(x, dict) else inner
    return found.union(*map(_classes, inner))


def _source(kind: type) -> Path | None:
    """File that defines a class; None where there is none, as in a notebook."""
    module = sys.modules.get(kind.__module__)
    file = getattr(module, "__file__", None)
    return Path(file) if file and kind.__module__ != "__main__" else None


def _store(file: Path, data: bytes | bytearray) -> None:
    """Write beside and rename; a cache that cannot be written is no reason to stop."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, beside = tempfile.mkstemp(dir=file.parent)
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        Path(beside).replace(file)
    except OSError:
        return

"""Cache of traced programs on disk, so that a later process starts without tracing them again.

JAX's compilation cache saves compile time, but tracing a robot's equations takes seconds, too. A traced program is
exported beside that cache. Its name is a hash of the function, the structure of its arguments, and the sources of both
(`sources`); any change of these leads to a new trace.

Most programs run a few times only, and compile in half the time without optimisation. One that turns out to run often
is compiled again beside its runs; one that `runs_long` is optimised from the start, so that its numbers never depend on
when that was.
"""

import ctypes
import gc
import hashlib
import mmap
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import equinox as eqx
import jax
from jax import export
from jax.extend.mlir.passmanager import PassManager

from nectosome.core.programs.import_closure import sources
from nectosome.core.programs.treedef_text import structure_of, structure_text
from nectosome.core.rows import all_on_device
from nectosome.core.tracers import traced
from nectosome.io.atomic import lock, make_kept_folder, read_kept, write_kept
from nectosome.io.file_system import exists
from nectosome.units import InputError

_F = TypeVar("_F", bound=Callable[..., Any])
_LONGEST = 300.0  # [s] wait for another process that traces the same program
_OFTEN = 20  # runs of a program after which it is optimised
_MUCH, _FEW = 900_000_000, 6  # bytes of this process above which all but a few programs are loaded anew where needed
_MORE = 1.1  # of the bytes that stayed when programs were forgotten last: below it these do not fill the memory


def resident() -> int:
    """Memory of this process [bytes]; 0 where the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE
    except OSError:
        return 0


def give_back() -> None:
    """Give memory that nothing needs any more back to the system; the C library of GNU keeps it otherwise."""
    gc.collect()
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").malloc_trim(0)


_NOT_OPTIMISED: dict[str, str | bool] = {"xla_backend_optimization_level": "0"}
_long: set[str] = set()
compiling: set[str] = set()  # functions whose programs are being made now
_programs: dict[Any, Future["_Program"]] = {}
_access = threading.Lock()  # to them
_workers = ThreadPoolExecutor(3)
_compiled = cache(eqx.filter_jit)
_stays = 0  # bytes of this process after programs were forgotten


@dataclass
class _Program:
    """A compiled function of a flat list of arrays, and the structure of its results."""

    run: Callable[..., list[jax.Array]]
    structure: Any
    optimised: Callable[[], Callable[..., list[jax.Array]]] | None  # compiles it again; None where it is
    kept: bool  # in the cache
    runs: int = 0

    def __call__(self, *leaves: Any) -> Any:
        """Results for these arguments."""
        self.runs += 1
        if self.runs == _OFTEN and self.optimised is not None:
            _workers.submit(self._optimise, self.optimised)
        return jax.tree.unflatten(self.structure, self.run(*leaves))

    def _optimise(self, optimised: Callable[[], Callable[..., list[jax.Array]]]) -> None:
        self.run, self.optimised = optimised(), None


def runs_long(f: _F) -> _F:
    """Mark a function whose program runs long, or thousands of times, where it is `remembered`."""
    _long.add(_name(f))
    return f


def _name(f: Callable[..., Any]) -> str:
    return f"{f.__module__}.{f.__qualname__}"


def remembered(f: Callable[..., Any], *args: Any) -> Any:
    """Compute f(*args) by a compiled program from the cache.

    f must be a module function of its arguments only. It is traced as usual if some leaves are traced themselves or no
    numbers (a Python function for a current), or without a cache folder (`NECTOSOME_CACHE=`).
    """
    leaves, inner = jax.tree.flatten(args)
    if traced(leaves):
        return _compiled(f)(*args)
    with jax.ensure_compile_time_eval():
        program = _prepared(f, args, leaves, inner)
        return _compiled(f)(*args) if program is None else program.result()(*leaves)


class Bound:
    """`remembered(f, *first, *rest)` for many calls, of which `rest` alone is new: arrays of the same shapes.

    A call hands arrays to the compiled program and looks nothing up; arrays of NumPy may be among them.
    """

    def __init__(self, f: Callable[..., Any], *first: Any):
        self._f, self._first = f, first
        self._leaves: list[Any] = []
        self._program: _Program | None = None
        self._shapes: list[Any] = []

    def __call__(self, *rest: Any) -> Any:
        """f(*first, *rest)."""
        leaves = jax.tree.leaves(rest)
        shapes = [(leaf.shape, leaf.dtype) for leaf in leaves]
        if self._program is None or shapes != self._shapes:
            args = (*self._first, *rest)
            every, inner = jax.tree.flatten(args)
            with jax.ensure_compile_time_eval():
                future = _prepared(self._f, args, every, inner)
                if future is None:
                    return _compiled(self._f)(*args)
            self._program, self._shapes = future.result(), shapes
            self._leaves = every[: len(every) - len(leaves)]
        return self._program(*self._leaves, *leaves)


def prepare(f: Callable[..., Any], *args: Any) -> None:
    """Compile f for arguments of these shapes in the background, for a later `remembered`."""
    _prepared(f, args, *jax.tree.flatten(args))


def _prepared(
    f: Callable[..., Any], args: tuple[Any, ...], leaves: list[Any], structure: Any
) -> Future[_Program] | None:
    """Program for these arguments; converts the leaves to arrays in place; None if some are not numbers."""
    new = [i for i, leaf in enumerate(leaves) if not isinstance(leaf, jax.Array)]
    if not all(eqx.is_array_like(leaves[i]) for i in new):
        return None
    for i, leaf in zip(new, all_on_device(*(leaves[i] for i in new)), strict=True):
        leaves[i] = leaf
    key = (f, structure, tuple((leaf.shape, leaf.dtype) for leaf in leaves))
    with _access:
        found = _programs.pop(key, None)
        if found is None:
            shapes = [jax.ShapeDtypeStruct(leaf.shape, leaf.dtype) for leaf in leaves]
            text = f"{_name(f)} {structure} {shapes} {jax.default_backend()}"
            found = _workers.submit(_program, f, structure, shapes, _file(f, text, args))
        _programs[key] = found  # the last one used comes last
    return found


def _program(f: Callable[..., Any], structure: Any, shapes: list[jax.ShapeDtypeStruct], file: Path | None) -> _Program:
    result = None

    def flat(*leaves: jax.Array) -> list[jax.Array]:
        nonlocal result
        out = f(*jax.tree.unflatten(structure, leaves))
        found, result = jax.tree.flatten(out)
        return found

    flat.__name__ = f.__name__  # XLA's name of the program
    traced, new = jax.jit(flat), None
    with _alone(file), _told(f.__name__):
        if file is not None:
            kept = _kept(file)
            if kept is None:  # missing, damaged, or of another version
                new = exported = export.export(traced)(*shapes)
            else:
                result, exported = kept
            call = exported.call

            def loaded(*leaves: jax.Array) -> Any:
                return call(*leaves)

            loaded.__name__ = f.__name__
            traced = jax.jit(loaded)
        long = _name(f) in _long
        run = _compiled_bare(traced.lower(*shapes), None if long else _NOT_OPTIMISED)
        if file is not None and new is not None:
            with suppress(TypeError):  # settings that have no text
                write_kept(file, structure_text(result).encode() + b"\n" + new.serialize())

    def optimised() -> Callable[..., list[jax.Array]]:
        with _alone(None if file is None else file.with_suffix(".optimised")):
            return _compiled_bare(traced.lower(*shapes), None)

    _bound_memory()
    return _Program(run, result, None if long else optimised, file is not None and exists(file))


def _compiled_bare(lowered: jax.stages.Lowered, options: dict[str, str | bool] | None) -> jax.stages.Compiled:
    """Compile without the lines that operations come from, which take a tenth of the compiler's memory."""
    module = lowered.compiler_ir("stablehlo")
    assert module is not None
    with module.context:
        PassManager.parse("builtin.module(strip-debuginfo)").run(module.operation)
    return lowered.compile(options)


def is_full() -> bool:
    """Whether the memory is full, and of more than stayed when programs were forgotten last.

    What stays is not theirs, and looking for it takes seconds in a large process.
    """
    global _stays
    now = resident()
    _stays = min(_stays, now)
    return now > max(_MUCH, _MORE * _stays)


def _bound_memory() -> None:
    """Forget programs that were not used lately where they fill the memory; the cache has them."""
    if is_full():
        with _access:
            done = {key: future for key, future in _programs.items() if future.done() and not future.exception()}
            kept = [key for key, future in done.items() if future.result().kept]
            for key in kept[:-_FEW]:
                del _programs[key]
        _forgotten()


def forget() -> None:
    """Give the memory of all programs of this process back: what follows has others."""
    with _access:
        _programs.clear()
    jax.clear_caches()
    _forgotten()


def _forgotten() -> None:
    global _stays
    give_back()
    _stays = resident()


def _kept(file: Path) -> tuple[Any, export.Exported] | None:
    """The structure of a program's results and the traced program, of its file; None where that is no sound one."""
    text, _, data = (read_kept(file) or b"").partition(b"\n")
    try:
        return (structure_of(text.decode()), export.deserialize(bytearray(data))) if data else None
    except ValueError:
        return None


@contextmanager
def _told(name: str) -> Iterator[None]:
    compiling.add(name)
    try:
        yield
    finally:
        compiling.discard(name)


@contextmanager
def _alone(file: Path | None) -> Iterator[None]:
    """Lock so that one process at a time makes a missing file; those that wait then load it, side by side."""
    if file is None or exists(file):
        yield
        return
    beside = file.with_suffix(".lock")
    with ExitStack() as stack:
        with suppress(OSError, InputError):
            make_kept_folder(beside.parent)
            lock(stack.enter_context(beside.open("w")), _LONGEST)
            stack.callback(beside.unlink, missing_ok=True)
        if exists(file):
            stack.close()
        yield


def _file(f: Callable[..., Any], text: str, args: Any) -> Path | None:
    """Path of the cached program; None without a cache folder, or with unknown sources."""
    compiled = jax.config.values["jax_compilation_cache_dir"]
    kinds = _classes(args)
    if not compiled or not all(map(_has_source, kinds)) or " at 0x" in text:
        return None
    digest = hashlib.sha256(text.encode())
    digest.update(f"{version('jax')} {version('equinox')}".encode())
    for path in sorted(sources({f.__module__, *(kind.__module__ for kind in kinds)})):
        digest.update(path.read_bytes())
    return Path(compiled).parent / "traced" / digest.hexdigest()


def _classes(x: Any) -> set[type]:
    """Classes of all modules in a tree, and those that modules hold."""
    if isinstance(x, type):
        return {x} if issubclass(x, eqx.Module) else set()
    found = {type(x)} if isinstance(x, eqx.Module) else set()
    inner = vars(x).values() if isinstance(x, eqx.Module) else x if isinstance(x, tuple | list) else ()
    inner = x.values() if isinstance(x, dict) else inner
    return found.union(*map(_classes, inner))


def _has_source(kind: type) -> bool:
    """Whether a file defines a class completely, unlike in a notebook or within a function."""
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    return file is not None and kind.__module__ != "__main__" and "<locals>" not in kind.__qualname__

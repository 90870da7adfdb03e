"""Pattern search: mesh adaptive direct search with a progressive barrier, by NOMAD (Audet and Dennis 2006, 2009)."""

import ctypes
import math
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from ..contract import OBJECTIVE_TOLERANCE, Ask, Optimiser, Outcome, Search, from_callback
from ..task import Evaluation, Space

_KEPT = 1e-6  # violation of a constraint that counts as kept
_ALONE = threading.Lock()  # NOMAD keeps its cache and random numbers in the process, one run at a time

# signal.signal would do, but for other threads than the first
_get_handler, _set_handler = ctypes.pythonapi.PyOS_getsig, ctypes.pythonapi.PyOS_setsig
_get_handler.argtypes, _get_handler.restype = [ctypes.c_int], ctypes.c_void_p
_set_handler.argtypes, _set_handler.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_void_p


@dataclass(frozen=True)
class Pattern(Optimiser):
    """Mesh adaptive direct search; needs no derivatives, copes with a rough objective.

    - mesh: the first step along each variable, as a share of the box, one number or one a variable; a tenth
      unless given. smallest_mesh: the step at which it ends. NOMAD calls these frame sizes, MATLAB mesh sizes.
    - objective_tolerance: it ends where the designs polled around the best one differ from it by less.
    - evaluations: at most so many.
    - directions: polled around the best design, twice as many as variables, or one more than variables.
    - models: quadratic models propose designs; about a third of the evaluations, but 10 to 40 ms each of its own.
    """

    mesh: float | tuple[float, ...] | None = None
    smallest_mesh: float = 1e-5
    objective_tolerance: float = OBJECTIVE_TOLERANCE
    evaluations: int = 2000
    directions: Literal["2n", "n+1"] = "2n"
    models: bool = False

    name: ClassVar[str] = "pattern"
    needs_start: ClassVar[bool] = True

    def __post_init__(self):
        super().__post_init__()
        meshes = self.mesh if isinstance(self.mesh, tuple) else () if self.mesh is None else (self.mesh,)
        positive = all(math.isfinite(mesh) and mesh > 0 for mesh in meshes)
        self._require("mesh", positive, f"is {self.mesh}; it must be positive.")
        small = math.isfinite(self.smallest_mesh) and 0 < self.smallest_mesh < min(meshes, default=math.inf)
        self._require("smallest_mesh", small, f"is {self.smallest_mesh}; it must be positive and below mesh.")
        known = self.directions in ("2n", "n+1")
        self._require("directions", known, f'is "{self.directions}"; it must be "2n" or "n+1".')

    def check(self, space: Space, start: bool) -> None:
        """Raise InputError without a start, for meshes of other variables, and where NOMAD is not installed."""
        super().check(space, start)
        try:
            import PyNomad  # noqa: F401  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            why = "there is no wheel of NOMAD for this machine. Take gradient or cmaes, or compile it: "
            raise InputError(f"{why}pip install PyNomadBBO.", field="optimiser") from error
        fits = not isinstance(self.mesh, tuple) or len(self.mesh) == space.variables
        self._require("mesh", fits, f"has not one number for each of the {space.variables} variables: {self.mesh}.")

    def likely(self, space: Space) -> int:
        """A poll each time that the mesh is halved."""
        mesh = np.max(0.1 if self.mesh is None else self.mesh)
        return min(self.evaluations, 2 * space.variables * math.ceil(math.log2(mesh / self.smallest_mesh)))

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Minimise from `start`, which must be solved."""
        assert start is not None
        (first,) = yield Ask(start[None])
        if not first.solved:
            return Outcome(False, f"the start has no solution: {first.reason}")
        return (yield from from_callback(lambda evaluate: self._solve(evaluate, space, first, seed)))

    def _solve(
        self, evaluate: Callable[[Ask], list[Evaluation]], space: Space, first: Evaluation, seed: int
    ) -> Outcome:
        import PyNomad  # pyright: ignore[reportMissingImports]

        start = first.u
        mesh = np.broadcast_to(np.array(0.1 if self.mesh is None else self.mesh, dtype=float), start.shape)
        mesh = np.where(space.steps > 0, space.steps, mesh)
        failure: list[BaseException] = []
        iterations, arrived = 0, False
        best, polled = first.objective if first.feasible(_KEPT) else np.inf, list[float]()
        handler = _get_handler(signal.SIGINT)

        def blackbox(point: Any) -> int:
            nonlocal best
            _set_handler(signal.SIGINT, handler)  # NOMAD takes Ctrl-C for itself and would call its run complete
            if failure:
                return 0
            try:  # NOMAD is C++: nothing may be raised through it
                z = np.array([point.get_coord(i) for i in range(point.size())])
                (e,) = evaluate(Ask(np.clip(start + z * mesh, 0.0, 1.0)[None], iterations=iterations))
                if e.solved:
                    polled.append(e.objective)
                    best = min(best, e.objective) if e.feasible(_KEPT) else best
                    point.setBBO(" ".join(repr(float(y)) for y in (e.objective, *e.constraints)).encode())
            except BaseException as error:
                failure.append(error)
                return 0
            return int(e.solved)

        def end_iteration(_: Any) -> bool:
            nonlocal iterations, arrived
            iterations += not failure
            near = [abs(objective - best) < self.objective_tolerance * abs(best) for objective in polled]
            arrived |= len(near) > start.size and all(near)
            polled.clear()
            return bool(failure) or arrived

        with _ALONE:
            # NOMAD does not take a seed that it has already: it draws on where it stood
            PyNomad.setSeed(0)
            PyNomad.setCustomMegaIterEndCallback(end_iteration)
            result = PyNomad.optimize(
                blackbox,
                [0.0] * start.size,
                (-start / mesh).tolist(),
                ((1.0 - start) / mesh).tolist(),
                self._parameters(mesh, space, seed),
            )
        _set_handler(signal.SIGINT, handler)
        if failure:
            raise failure[0]
        if "Ctrl-C" in result["stop_reason"]:  # it came before NOMAD's first evaluation
            raise KeyboardInterrupt
        if arrived:
            return self._arrived(iterations)
        message = str(result["stop_reason"]).replace("No termination (all).", "").strip()
        small = "Min frame size" in message or "Min mesh" in message
        return Outcome(small, f"mesh below {self.smallest_mesh:g}" if small else message, iterations)

    def _parameters(self, mesh: np.ndarray, space: Space, seed: int) -> list[str]:
        # in steps from the start: NOMAD makes powers of ten of first steps
        smallest = " ".join(repr(float(size)) for size in self.smallest_mesh / mesh)
        parameters = [
            "BB_OUTPUT_TYPE OBJ" + " PB" * space.constraints,
            f"DIRECTION_TYPE ORTHO {'2N' if self.directions == '2n' else 'N+1 QUAD' if self.models else 'N+1 NEG'}",
            f"QUAD_MODEL_SEARCH {'yes' if self.models else 'no'}",
            "INITIAL_FRAME_SIZE * 1",
            f"MIN_FRAME_SIZE ( {smallest} )",
            f"MAX_BB_EVAL {self.evaluations}",
            "RNG_ALT_SEEDING yes",  # the plain way draws as many numbers as the seed says
            f"SEED {seed or 2**31 - 1}",  # 0 is what it was set to
            "DISPLAY_DEGREE 0",
            "NB_THREADS_PARALLEL_EVAL 1",
        ]
        if not self.models:
            parameters.append("EVAL_QUEUE_SORT DIR_LAST_SUCCESS")  # the default sorts by a model
        return parameters

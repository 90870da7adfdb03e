"""Pattern search: mesh adaptive direct search with a progressive barrier, by NOMAD (Audet and Dennis 2006, 2009)."""

import ctypes
import math
import signal
import threading
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from .task import Evaluate, Outcome, Solver, require

_ALONE = threading.Lock()  # NOMAD keeps its cache and random numbers in the process, one run at a time

# signal.signal would do, but for other threads than the first
_get_handler, _set_handler = ctypes.pythonapi.PyOS_getsig, ctypes.pythonapi.PyOS_setsig
_get_handler.argtypes, _get_handler.restype = [ctypes.c_int], ctypes.c_void_p
_set_handler.argtypes, _set_handler.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_void_p


@dataclass(frozen=True)
class Pattern(Solver):
    """Mesh adaptive direct search; needs no slopes, copes with a rough objective.

    - mesh: the first step along each variable, in its own units, one number or one a variable; a tenth of the box
      unless given. smallest_mesh: the step at which it ends. NOMAD calls these frame sizes, MATLAB mesh sizes.
    - evaluations: at most so many.
    - directions: polled around the best design, twice as many as variables, or one more than variables.
    - models: quadratic models propose designs; about a third of the evaluations, but 10 to 40 ms each of its own.
    """

    mesh: float | tuple[float, ...] | None = None
    smallest_mesh: float = 1e-5
    evaluations: int = 2000
    directions: Literal["2n", "n+1"] = "2n"
    models: bool = False

    def __post_init__(self):
        meshes = self.mesh if isinstance(self.mesh, tuple) else () if self.mesh is None else (self.mesh,)
        require(
            all(math.isfinite(mesh) and mesh > 0 for mesh in meshes),
            f"Pattern: mesh is {self.mesh}; it must be positive.",
        )
        require(
            math.isfinite(self.smallest_mesh) and 0 < self.smallest_mesh < min(meshes, default=math.inf),
            f"Pattern: smallest_mesh is {self.smallest_mesh}; it must be positive and below mesh.",
        )
        require(self.evaluations >= 1, f"Pattern: evaluations is {self.evaluations}; at least 1 is needed.")
        require(
            self.directions in ("2n", "n+1"), f'Pattern: directions is "{self.directions}"; it must be "2n" or "n+1".'
        )

    def solve(self, evaluate: Evaluate, start: Float[np.ndarray, "n"], seed: int) -> Outcome:
        """Minimise from `start`, which must be solved."""
        import PyNomad  # pyright: ignore[reportMissingImports]

        first = evaluate(start)
        if not first.solved:
            return Outcome(False, f"the start has no solution: {first.reason}")
        mesh = self._mesh(evaluate.upper - evaluate.lower)
        failure: list[BaseException] = []

        handler = _get_handler(signal.SIGINT)

        def blackbox(point: Any) -> int:
            _set_handler(signal.SIGINT, handler)  # NOMAD takes Ctrl-C for itself and would call its run complete
            if failure:
                return 0
            try:  # NOMAD is C++: nothing may be raised through it
                z = np.array([point.get_coord(i) for i in range(point.size())])
                e = evaluate(np.clip(start + z * mesh, evaluate.lower, evaluate.upper))
                if e.solved:
                    point.setBBO(" ".join(repr(float(y)) for y in (e.objective, *e.constraints)).encode())
            except BaseException as error:
                failure.append(error)
                return 0
            return int(e.solved)

        def end_iteration(_: Any) -> bool:
            if not failure:
                evaluate.close_iteration()
            return bool(failure)

        with _ALONE:
            # NOMAD does not take a seed that it has already: it draws on where it stood
            PyNomad.setSeed(0)
            PyNomad.setCustomMegaIterEndCallback(end_iteration)
            result = PyNomad.optimize(
                blackbox,
                [0.0] * start.size,
                ((evaluate.lower - start) / mesh).tolist(),
                ((evaluate.upper - start) / mesh).tolist(),
                self._parameters(mesh, evaluate.constraints, seed),
            )
        _set_handler(signal.SIGINT, handler)
        if failure:
            raise failure[0]
        if "Ctrl-C" in result["stop_reason"]:  # it came before NOMAD's first evaluation
            raise KeyboardInterrupt
        message = str(result["stop_reason"]).replace("No termination (all).", "").strip()
        small = "Min frame size" in message or "Min mesh" in message
        return Outcome(small, f"mesh below {self.smallest_mesh:g}" if small else message)

    def _mesh(self, width: np.ndarray) -> np.ndarray:
        if isinstance(self.mesh, tuple) and len(self.mesh) != width.size:
            raise ValueError(f"Pattern: mesh has {len(self.mesh)} numbers; there are {width.size} variables.")
        return 0.1 * width if self.mesh is None else np.broadcast_to(np.array(self.mesh, dtype=float), width.shape)

    def _parameters(self, mesh: np.ndarray, constraints: int, seed: int) -> list[str]:
        # in steps from the start: NOMAD makes powers of ten of first steps
        smallest = " ".join(repr(float(size)) for size in self.smallest_mesh / mesh)
        parameters = [
            "BB_OUTPUT_TYPE OBJ" + " PB" * constraints,
            f"DIRECTION_TYPE ORTHO {'2N' if self.directions == '2n' else 'N+1 QUAD' if self.models else 'N+1 NEG'}",
            f"QUAD_MODEL_SEARCH {'yes' if self.models else 'no'}",
            "INITIAL_FRAME_SIZE * 1",
            f"MIN_FRAME_SIZE ( {smallest} )",
            f"MAX_BB_EVAL {self.evaluations}",
            "RNG_ALT_SEEDING yes",  # the plain way draws as many numbers as the seed says
            f"SEED {seed}",
            "DISPLAY_DEGREE 0",
            "NB_THREADS_PARALLEL_EVAL 1",
        ]
        if not self.models:
            parameters.append("EVAL_QUEUE_SORT DIR_LAST_SUCCESS")  # the default sorts by a model
        return parameters

"""Every shape in a public signature is checked while the tests run; robots that several rooms share are built once."""

import gc
import os
import re
import sys
import time
from functools import cache
from pathlib import Path
from typing import Any

from hypothesis import settings
from jaxtyping import install_import_hook

# `io` checks its own input; what JAX traces is checked once a program by its annotations; numpy's would be at each call
_TRACED = ("core", "mechanism", "loads", "solve", "model", "robots", "designs.plans", "designs.quantities")
install_import_hook([f"nectosome.{name}" for name in _TRACED], "beartype.beartype")

gc.set_threshold(50_000, 20, 20)  # as the command line does: tracing makes many objects that stay

settings.register_profile("nectosome", deadline=None, max_examples=30, derandomize=True)
settings.load_profile("nectosome")

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import jaxtyping  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402
from tests.small_robots import DRIFTER, PENDULUM  # noqa: E402
from xdist.scheduler import LoadFileScheduling  # noqa: E402

from nectosome.core import State  # noqa: E402
from nectosome.core.programs import remember  # noqa: E402
from nectosome.description import RobotDescription, parse_robot  # noqa: E402
from nectosome.model import build  # noqa: E402

ROOT = Path(__file__).parents[1]
_MOST = 4 * 2**30  # bytes of a process

remember._MUCH = _MOST  # tests of many robots take turns in one process
_forget = remember.forget
remember.forget = lambda: _forget() if remember.is_full() else None  # what a study forgets, later tests still need
if "optimization_level=0" in os.environ.get("XLA_FLAGS", ""):  # quick to compile: `make test`
    remember._OFTEN = sys.maxsize  # optimising again would change nothing
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)  # keeping others takes longer than they need


class BySharedRobot(LoadFileScheduling):
    """Tests of a file run in one process, and so do files whose first shared robot is the same."""

    def _split_scope(self, nodeid: str) -> str:
        return shared_robot(super()._split_scope(nodeid))


@cache
def shared_robot(file: str) -> str:
    """First robot of `small_robots` that a file of tests imports; the file itself without one."""
    text = (ROOT / file).read_text(encoding="utf-8")
    found = re.search(r"^from tests\.small_robots import (\w+)", text, re.MULTILINE)
    return file if found is None else found[1]


@pytest.hookimpl(optionalhook=True)  # without xdist there is one process
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> BySharedRobot:
    """Workers compile the programs of a robot once."""
    return BySharedRobot(config, log)


_BEGAN = pytest.StashKey[float]()


def _processor_seconds() -> float:
    """Of this process, and of those that it started and that have ended."""
    spent = os.times()
    return time.process_time() + spent.children_user + spent.children_system


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item):
    item.stash[_BEGAN] = _processor_seconds()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo):
    """What a test took, with its set-up, for `tests/budget.py`."""
    report = yield
    if report.when == "teardown":
        report.user_properties.append(("processor_seconds", f"{_processor_seconds() - item.stash[_BEGAN]:.2f}"))
    return report


def pytest_collection_finish():
    """What is there before the first test is there to stay."""
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def bounded_memory():
    """Forget compiled programs where they fill the memory: all tests in one process take some 10 GB."""
    yield
    remember.forget()


@pytest.fixture
def as_users_run():
    """Leave what public functions are given to their own checks."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.fixture(scope="session")
def pendulum() -> RobotDescription:
    return parse_robot(PENDULUM)


@pytest.fixture(scope="session")
def drifter():
    return build(parse_robot(DRIFTER))


@pytest.fixture(scope="session")
def some_state():
    """A random state of a robot, and accelerations; rotations of any size."""

    def draw(robot, seed: int = 0, scale: float = 0.3) -> tuple[State, jax.Array]:
        rng = np.random.default_rng(seed)
        x = robot.initial()
        q = jnp.asarray(x.q + scale * rng.normal(size=x.q.shape))
        v, a = (jnp.asarray(rng.normal(size=x.v.shape)) for _ in range(2))
        return State(q, v, x.z), a

    return draw

"""Optimisers of libraries that call their objective, in the contract of those that ask."""

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from ..contract import Ask, Outcome, Search
from ..task import Evaluation


class AbandonedError(Exception):
    """Nobody answers any more: the search was given up."""


def from_callback(solve: Callable[[Callable[[Ask], list[Evaluation]]], Outcome]) -> Search:
    """Search with solve(evaluate), which runs in a thread of its own and waits in `evaluate` for its answers.

    Once the search is closed `evaluate` raises AbandonedError, and `solve` must end.
    """
    asks: SimpleQueue[Any] = SimpleQueue()
    answers: SimpleQueue[list[Evaluation]] = SimpleQueue()
    abandoned = threading.Event()

    def evaluate(ask: Ask) -> list[Evaluation]:
        if not abandoned.is_set():
            asks.put(ask)
            answer = answers.get()
            if not abandoned.is_set():
                return answer
        raise AbandonedError

    def work() -> None:
        try:
            asks.put(solve(evaluate))
        except BaseException as error:
            asks.put(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    try:
        while isinstance(asked := asks.get(), Ask):
            answers.put((yield asked))
    finally:
        abandoned.set()
        answers.put([])
        thread.join()
    if isinstance(asked, BaseException):
        raise asked
    return asked

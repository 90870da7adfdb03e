"""The studio's two threads: work on the newest request, and a clock that plays."""

import threading
import time

from nectosome.studio.viewer import Player
from nectosome.studio.work import SolverThread


def test_only_the_last_of_what_waits_is_worked_on():
    began, go_on, seen = threading.Event(), threading.Event(), []

    def work(request):
        seen.append(request)
        began.set()
        go_on.wait(10)

    solver = SolverThread(work)
    solver.submit(1)
    assert began.wait(10)
    for k in range(2, 50):
        solver.submit(k)
    go_on.set()
    for _ in range(200):
        if len(seen) == 2:
            break
        time.sleep(0.01)
    solver.close()
    assert seen == [1, 49]


def test_time_goes_on_while_it_plays_stands_while_not_and_ends_when_closed():
    shown = []
    player = Player(shown.append)
    player.speed = 2.0
    player.seek(3.0)
    assert shown == [3.0]
    player.play(True)
    began = time.perf_counter()
    while len(shown) < 5 and time.perf_counter() - began < 20:
        time.sleep(0.02)
    player.play(False)
    passed = time.perf_counter() - began
    assert shown == sorted(shown)
    assert 3.0 < shown[-1] <= 3.0 + 2.0 * passed + 0.01
    time.sleep(0.2)
    count = len(shown)
    time.sleep(0.2)
    assert len(shown) == count
    player.close()
    for _ in range(100):
        if not any(thread.name == "studio-player" for thread in threading.enumerate()):
            break
        time.sleep(0.05)
    assert not any(thread.name == "studio-player" for thread in threading.enumerate())


def test_what_is_held_is_not_shown_while_time_goes_on():
    shown = []
    player = Player(shown.append)
    player.hold(60.0)
    player.play(True)
    time.sleep(0.3)
    assert shown == []
    player.hold(0.0)
    for _ in range(200):
        if shown:
            break
        time.sleep(0.02)
    player.close()
    assert shown[0] > 0.25

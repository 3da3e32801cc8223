"""Ctrl-C while a wall is solved: never a crash, and no other error."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from damagepred import Scene, solve
from damagepred.runtime.time_limit import interrupts_between_kernels
from damagepred.scene import Movement, Wall

SCENE = Scene(wall=Wall(length=1.44, height=0.45), movement=Movement(central_deflection=4e-3, increments=4))

AT_RANDOM = """
import os, random, signal, sys, threading
sys.path[:0] = {path}
signal.signal(signal.SIGINT, signal.default_int_handler)
from damagepred import solve
from tests.runtime.test_interrupts import SCENE

solve(SCENE)
random.seed(1)
ends = []
for _ in range(300):
    timer = threading.Timer(random.uniform(0.002, 0.03), os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        while True:
            solve(SCENE)
    except BaseException as error:
        ends.append(type(error).__name__)
print(set(ends))
"""


@pytest.fixture(autouse=True)
def _python_handles_interrupts() -> Iterator[None]:
    """A background job of a script inherits that interrupts are ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_ends_the_path_after_the_increment() -> None:
    seen: list[int] = []

    def stop(step: object) -> None:
        seen.append(len(seen))
        if len(seen) == 3:
            os.kill(os.getpid(), signal.SIGINT)

    ds = solve(SCENE, on_step=stop, on_failure="return")
    assert (ds.attrs["status"], ds.sizes["increment"]) == ("interrupted", 3)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with pytest.raises(KeyboardInterrupt):
        solve(SCENE, on_step=lambda step: os.kill(os.getpid(), signal.SIGINT))


def test_the_second_interrupt_acts_at_once() -> None:
    seen = []

    def press_twice() -> None:
        for number in range(2):
            os.kill(os.getpid(), signal.SIGINT)
            seen.append(number)

    with pytest.raises(KeyboardInterrupt), interrupts_between_kernels():
        press_twice()
    assert seen == [0]


def test_a_handler_of_the_caller_stays() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupts_between_kernels():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_timer_of_the_caller_acts_between_kernels() -> None:
    """Its own error arrives, and its handler is set again; an exception that numba turns into another one is none."""
    after = []

    def end(number: int, frame: object) -> None:
        raise RuntimeError("out of time")

    def ring(step: object) -> None:
        signal.raise_signal(signal.SIGTERM)
        after.append(step)

    before = signal.signal(signal.SIGTERM, end)
    try:
        with pytest.raises(RuntimeError, match="out of time"):
            solve(SCENE, on_step=ring)
        assert len(after) == 1
        assert signal.getsignal(signal.SIGTERM) is end
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.thorough
def test_interrupts_at_random_moments_are_interrupts() -> None:
    run = subprocess.run([sys.executable, "-c", AT_RANDOM.format(path=sys.path)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout == "{'KeyboardInterrupt'}\n"

"""Ratios of the program's shortest times to those of fixed work, measured alternately; slow cases twice."""

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, field

Work = Callable[[], object]

TRIES = 5
"""Times that a case is measured before it is called slow."""
PAUSE = 1.0
"""Seconds between two tries, in which a disturbance may end."""


def processor() -> float:
    """Return the processor seconds of this process and its finished children."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def seconds(work: Work) -> float:
    began = processor()
    work()
    return processor() - began


@dataclass
class Rounds:
    """Times (s) of a case and of its yardstick, measured in turn."""

    case: list[float] = field(default_factory=list)
    yardstick: list[float] = field(default_factory=list)

    @property
    def ratio(self) -> float:
        """Shortest over shortest."""
        return min(self.case) / min(self.yardstick)

    def with_yardstick(self, yardstick: Work) -> Callable[[], None]:
        """Return a function that runs before each round of a case that others measure."""
        return lambda: self.yardstick.append(seconds(yardstick))

    def add(self, work: Work, yardstick: Work, rounds: int) -> None:
        for _ in range(rounds):
            self.yardstick.append(seconds(yardstick))
            self.case.append(seconds(work))


def slow(found: Rounds, work: Work, yardstick: Work, rounds: int, most: float, pause: float = PAUSE) -> bool:
    """Return whether a case is slow: its ratio above ``most``, and still when it is measured again."""
    for _ in range(TRIES - 1):
        if found.ratio <= most:
            return False
        time.sleep(pause)
        found.add(work, yardstick, rounds)
    return found.ratio > most

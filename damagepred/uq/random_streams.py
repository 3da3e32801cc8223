"""Random streams of a study: independent random numbers for each sample and purpose."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class RandomStream(IntEnum):
    """Purpose of a random stream of a sample: ``SeedSequence(seed, spawn_key=(stream, sample))``."""

    WALL = 0
    FIELD = 1
    SCRAMBLE = 2
    BOOTSTRAP = 3
    SUBSET = 4
    SUBSET_START = 5
    GOODNESS = 7  # 6 was used by versions before 0.2.0


def generator(seed: int, stream: RandomStream, number: int) -> np.random.Generator:
    """Random numbers that belong to one sample and purpose."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(int(stream), number))))

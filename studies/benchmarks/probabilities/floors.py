"""Errors that do not decrease with the number of walls: a coarser wall, fewer increments, the form of the curve."""

from __future__ import annotations

from typing import Any

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from studies.benchmarks.probabilities import walls
from studies.benchmarks.probabilities.walls import Bank

AGAIN = 200


def floors_of(wall: str, banks: dict[str, Bank], asked: list[Any]) -> list[dict[str, object]]:
    """Return relative differences of the variants from the wall itself, with standard errors."""
    from studies.benchmarks.probabilities.errors import estimate, pooled

    random = np.random.default_rng(2)
    fine = banks["random"]
    rows: list[dict[str, object]] = []
    for question in asked:
        for name in walls.VARIANTS[wall]:
            if name not in banks:
                continue
            size = min(fine.lower.size, banks[name].lower.size)
            pair = [(b.lower[0, :size], b.upper[0, :size]) for b in (fine, banks[name])]

            def ratio(pick: IntArray, pair: list[Any] = pair, question: Any = question) -> float:
                before, after = (estimate(question, low[pick], high[pick]) for low, high in pair)
                return after / before - 1

            again = [ratio(random.integers(size, size=size)) for _ in range(AGAIN)]
            rows.append(_row(question, name, ratio(np.arange(size)), float(np.nanstd(again)), size))
        whole = pooled(banks)
        if np.isnan(question.at):
            value = _form(whole.lower, whole.upper)
            size = len(whole.lower)
            picks = (random.integers(size, size=size) for _ in range(AGAIN // 4))
            again = [_form(whole.lower[pick], whole.upper[pick]) for pick in picks]
            rows.append(_row(question, "lognormal form", value, float(np.nanstd(again)), size))
    return rows


def _form(lower: FloatArray, upper: FloatArray) -> float:
    """Return the difference of the lognormal's median from the empirical one, interpolated linearly in increments."""
    from studies.benchmarks.probabilities.errors import median

    marks = np.unique(np.concatenate((lower, upper[np.isfinite(upper)])))
    share = np.array([(upper <= m).mean() for m in marks])
    above = int((share >= 0.5).argmax())
    part = (0.5 - share[above - 1]) / (share[above] - share[above - 1])
    return median(lower, upper) / float(marks[above - 1] + part * (marks[above] - marks[above - 1])) - 1


def _row(question: Any, what: str, value: float, error: float, size: int) -> dict[str, object]:
    return {
        "question": question.name,
        "at": question.at,
        "what": what,
        "difference": value,
        "error": error,
        "walls": size,
    }

"""True errors of the sets of walls: replicates of each method compared with the estimate from all walls.

And the errors that do not decrease with the number of walls: a coarser wall, fewer increments, the form of the curve.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from damagepred.arrays import FloatArray, IntArray
from damagepred.uq.capacity import probability_reached
from damagepred.uq.fragility.estimators import fit_grouped
from damagepred.uq.fragility.fit import group_intervals
from studies import cases
from studies.benchmarks.probabilities import walls
from studies.benchmarks.probabilities.walls import Bank

DRAWS = 200
"""Replicates resampled from a random set with replacement: the whole set is then the true population."""
SCRAMBLES = 8
Row = dict[str, Any]


class Question(NamedTuple):
    """The estimated quantity: the median movement (at is NaN), or the probability at a movement (m)."""

    name: str
    at: float


MEDIAN = Question("median", np.nan)


class Truth(NamedTuple):
    """Reference value and its relative standard error."""

    value: float
    error: float


def median(lower: FloatArray, upper: FloatArray) -> float:
    """Return the median of the fitted lognormal curve; NaN if no curve can be fitted."""
    return fit_grouped(group_intervals(lower[None], upper[None], np.ones(len(lower)), None))[0].median


def probability(bank: Bank, at: float) -> FloatArray:
    """Return for each wall of a bank its weight if it reaches the category by a movement (m), else 0."""
    return bank.weight * probability_reached(bank.lower, bank.upper, at)


def write(into: Path, folder: Path, sets: dict[str, list[str]]) -> None:
    """Read all sets; write data.csv (errors of sampling) and floors.csv (of the model)."""
    rows: list[Row] = []
    floors: list[Row] = []
    subset, done = (pd.read_csv(folder / f"{name}.csv") for name in ("subset", "sets"))
    spent = done[["wall", "set"]].assign(mean=done["seconds"] / done["walls"])
    for wall, names in sets.items():
        cost = spent[spent["wall"] == wall].set_index("set")["mean"]
        banks = {name: walls.read(folder, wall, name) for name in names}
        rows += [{"wall": wall, **row} for row in curve_rows(banks, cost)]
        floors += [{"wall": wall, **row} for row in floors_of(wall, banks)]
        if np.isfinite(banks["rare random"].upper).any():
            own = subset[subset["wall"] == wall]
            rows += [{"wall": wall, **row} for row in rare_rows(wall, banks, cost, own)]
    mark = {name: "; ".join(map(str, done[name].unique())) for name in ("version", "date")}
    for name, table in (("data", rows), ("floors", floors)):
        cases.write([row | mark for row in table], into / f"{name}.csv")


def row_of(
    question: Question,
    method: str,
    count: float,
    seconds: float,
    found: FloatArray,
    truth: Truth,
    independent: float | None = None,
) -> Row:
    """Return one row of data.csv: the root mean square of relative errors, with a 90 % interval (of scatter)."""
    known, runs = found[np.isfinite(found)], len(found)
    away = known / truth.value - 1
    square = _mean_square(away, truth.error, independent or runs) if len(known) > 1 else np.nan
    low, high = (float(np.sqrt(square * runs / stats.chi2.ppf(q, runs))) for q in (0.95, 0.05))
    row = {"question": question.name, "at": question.at, "method": method, "walls": count, "seconds": seconds}
    row |= {"error": np.sqrt(square), "lower": low, "upper": high, "bias": float(away.mean()), "runs": runs}
    return row | {"no answer": 1 - len(known) / runs, "truth": truth.value, "truth error": truth.error}


def _mean_square(away: FloatArray, reference: float, runs: float) -> float:
    """Return the mean square error: variance, and squared bias beyond its standard error and the reference's."""
    scatter = float(away.var(ddof=1))
    return scatter + max(float(away.mean()) ** 2 - scatter / runs - np.nan_to_num(reference) ** 2, 0.0)


def powers(smallest: int, largest: int) -> list[int]:
    """Return the powers of two from one number to another."""
    return [2**k for k in range(40) if smallest <= 2**k <= largest]


def combined(values: Sequence[float], errors: Sequence[float]) -> Truth:
    """Return the mean of estimates, weighted by inverse variance."""
    weight = np.array(errors) ** -2.0
    value = float((weight * values).sum() / weight.sum())
    return Truth(value, float(weight.sum() ** -0.5) / value)


# -- curves -----------------------------------------------------------------------------------------------------------


def curve_rows(banks: dict[str, Bank], cost: pd.Series) -> list[Row]:
    """Return errors of the median."""
    first, random, rows, path = banks["random"], np.random.default_rng(1), [], cost["random"]
    truth, own = _truth(banks, random), Truth(median(first.lower[0], first.upper[0]), np.nan)
    for n in powers(8, first.lower.size // 2):
        found = np.array([_drawn(first, n, random) for _ in range(DRAWS)])
        row = row_of(MEDIAN, "random", n, n * path, found, own)
        rows.append(row | {"truth": truth.value, "truth error": truth.error})
    for name, bank in banks.items():
        if name == "sobol":
            rows += _sobol_rows(bank, truth, path, random)
        elif name.startswith("lhs"):
            n = bank.lower.shape[1]
            found = np.array([median(a, b) for a, b in zip(bank.lower, bank.upper)])
            rows.append(row_of(MEDIAN, "Latin hypercube", n, n * path, found, truth))
    return rows


def _truth(banks: dict[str, Bank], random: np.random.Generator) -> Truth:
    """Return the estimate from random walls and scrambles of Sobol points, weighted by inverse variance."""
    bank, sobol = banks["random"], banks["sobol"]
    n = min(bank.lower.size, 512)
    again = [_drawn(bank, n, random) for _ in range(DRAWS // 2)]
    values = [median(bank.lower.ravel(), bank.upper.ravel())]
    errors = [float(np.nanstd(again)) * np.sqrt(n / bank.lower.size)]
    if len(sobol.lower) > 3:
        each = [median(a, b) for a, b in zip(sobol.lower, sobol.upper)]
        values.append(median(sobol.lower.ravel(), sobol.upper.ravel()))
        errors.append(float(np.nanstd(each, ddof=1)) / np.sqrt(len(each)))
    return combined(values, errors)


def _drawn(bank: Bank, n: int, random: np.random.Generator) -> float:
    """Return the estimate of n walls resampled from a bank, with replacement."""
    pick = random.integers(bank.lower.size, size=n)
    return median(bank.lower.ravel()[pick], bank.upper.ravel()[pick])


def _sobol_rows(bank: Bank, truth: Truth, cost: float, random: np.random.Generator) -> list[Row]:
    """Return errors of one scramble, and of several that share the walls among them."""
    (runs, most), rows = bank.lower.shape, []
    for n in powers(8, most):
        found = np.array([median(a[:n], b[:n]) for a, b in zip(bank.lower, bank.upper)])
        rows.append(row_of(MEDIAN, "Sobol", n, n * cost, found, truth))
    for n in powers(8, most) if runs >= 2 * SCRAMBLES else []:
        groups = [random.integers(runs, size=SCRAMBLES) for _ in range(DRAWS // 3)]
        found = np.array([median(bank.lower[g, :n].ravel(), bank.upper[g, :n].ravel()) for g in groups])
        count = SCRAMBLES * n
        rows.append(row_of(MEDIAN, "Sobol, 8 scrambles", count, count * cost, found, truth, runs / SCRAMBLES))
    return rows


# -- small probabilities ----------------------------------------------------------------------------------------------


def rare_rows(wall: str, banks: dict[str, Bank], cost: pd.Series, subset: pd.DataFrame) -> list[Row]:
    """Return errors of a small probability."""
    question, rows = Question("small probability", walls.SETS[wall]["rare_at"]), []
    truth = rare_truth(question, banks, subset)
    for n in powers(64, 1 << 14):
        row = row_of(question, "random", n, n * cost["rare random"], np.full(2, truth.value), truth)
        exact = np.sqrt((1 - truth.value) / (truth.value * n))
        rows.append(row | {"error": exact, "lower": np.nan, "upper": np.nan, "runs": 0})
    for name, method, form in (
        ("rare sobol", "Sobol", "rare random"),
        ("importance", "importance", "importance"),
        ("importance sobol", "importance, Sobol", "importance"),
    ):
        for n in powers(64 if name == "rare sobol" else 16, banks[name].lower.shape[1]) if name in banks else []:
            found = probability(banks[name], question.at)[:, :n].mean(axis=1)
            rows.append(row_of(question, method, n, n * cost[form], found, truth))
    for _, runs in subset.groupby("level"):
        spent = runs["walls"].mean(), runs["seconds"].mean()
        rows.append(row_of(question, "subset simulation", *spent, runs["probability"].to_numpy(), truth))
    return rows


def rare_truth(question: Question, banks: dict[str, Bank], subset: pd.DataFrame) -> Truth:
    """Return the estimate of all methods, each pooled, weighted by inverse variance."""
    values, errors = [], []
    for group in (("rare random", "rare sobol"), ("importance", "importance sobol")):
        each = [probability(banks[name], question.at).ravel() for name in group if name in banks]
        found = np.concatenate(each) if each else np.zeros(1)
        if found.any():
            values.append(float(found.mean()))
            errors.append(float(found.std() / np.sqrt(len(found))))
    if len(subset) > 5:  # runs are weighted by their numbers of walls
        share = subset["walls"] / subset["walls"].sum()
        values.append(float((share * subset["probability"]).sum()))
        spread = float(np.sqrt((share**2 * (subset["probability"] - values[-1]) ** 2).sum()))
        errors.append(spread * float(np.sqrt(len(subset) / (len(subset) - 1))))
    return combined(values, errors)


# -- errors that do not decrease --------------------------------------------------------------------------------------


def floors_of(wall: str, banks: dict[str, Bank]) -> list[Row]:
    """Return relative differences of the median: of the variants from the wall itself, and of the form of the curve."""
    random, rows = np.random.default_rng(2), []

    def add(what: str, size: int, difference: Callable[[IntArray], float], draws: int) -> None:
        again = [difference(random.integers(size, size=size)) for _ in range(draws)]
        row = {"question": "median", "what": what, "difference": difference(np.arange(size))}
        rows.append(row | {"error": float(np.nanstd(again)), "walls": size})

    for name in (name for name in walls.SETS[wall]["variants"] if name in banks):
        size = min(banks[which].lower.size for which in ("random", name))
        pair = [(b.lower[0, :size], b.upper[0, :size]) for b in (banks[name], banks["random"])]

        def ratio(pick: IntArray, pair: list[Any] = pair) -> float:
            after, before = (median(low[pick], high[pick]) for low, high in pair)
            return after / before - 1

        add(name, size, ratio, DRAWS)
    plain = [bank for name, bank in banks.items() if name in ("random", "sobol") or name.startswith("lhs")]
    lower, upper = (np.concatenate([getattr(b, end).ravel() for b in plain]) for end in ("lower", "upper"))
    add("lognormal form", len(lower), lambda pick: _form(lower[pick], upper[pick]), DRAWS // 4)
    return rows


def _form(lower: FloatArray, upper: FloatArray) -> float:
    """Return the difference of the lognormal's median from the empirical one, interpolated linearly in increments."""
    marks = np.unique(np.concatenate((lower, upper[np.isfinite(upper)])))
    share = np.array([(upper <= m).mean() for m in marks])
    above = max(1, int((share >= 0.5).argmax()))
    around = slice(above - 1, above + 1)
    return median(lower, upper) / float(np.interp(0.5, share[around], marks[around])) - 1

"""True errors of the sets of walls: replicates of each method compared with the estimate from all walls."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from damagepred.arrays import FloatArray
from damagepred.uq.capacity import probability_reached
from damagepred.uq.control_variate import read_pilot, two_level
from damagepred.uq.fragility.grouped_data import group_intervals
from damagepred.uq.fragility.models import fit_grouped
from studies.benchmarks import cases
from studies.benchmarks.probabilities import walls
from studies.benchmarks.probabilities.floors import floors_of
from studies.benchmarks.probabilities.walls import Bank, Plan

DRAWS = 200
"""Replicates resampled from a random set with replacement: the whole set is then the true population."""

PILOT = 32
SCRAMBLES = 8


class Question(NamedTuple):
    """The estimated quantity: the median movement (at is NaN), or the probability at a movement (m)."""

    name: str
    at: float


class Truth(NamedTuple):
    """Reference value and its relative standard error."""

    value: float
    error: float


def median(lower: FloatArray, upper: FloatArray, count: FloatArray | None = None) -> float:
    """Return the median of the fitted lognormal curve; NaN if no curve can be fitted."""
    number = None if count is None else count.astype(np.int64)
    cells = group_intervals(lower[None], upper[None], np.ones(len(lower)), number)
    return fit_grouped(cells)[0].median


def estimate(question: Question, lower: FloatArray, upper: FloatArray, weight: FloatArray | None = None) -> float:
    """Return the estimate of a study of these walls."""
    if np.isnan(question.at):
        return median(lower, upper)
    found = probability_reached(lower, upper, question.at)
    return float(found.mean() if weight is None else (weight * found).mean())


def questions(bank: Bank) -> list[Question]:
    """Return the quantities of curves: the median, and the probability at the increment where it is nearest to 0.1."""
    marks = np.unique(bank.upper[np.isfinite(bank.upper)])
    share = np.array([(bank.upper <= m).mean() for m in marks])
    good = share > 0
    at = float(marks[good][np.abs(np.log(share[good] / 0.1)).argmin()])
    return [Question("median", np.nan), Question("probability near 0.1", at)]


def write(into: Path, folder: Path, sets: dict[str, tuple[list[Plan], list[Plan]]]) -> None:
    """Read all sets; write data.csv (errors of sampling), floors.csv (of the model) and costs.csv."""
    rows: list[dict[str, object]] = []
    floors: list[dict[str, object]] = []
    spent, subset = pd.read_csv(folder / "costs.csv"), pd.read_csv(folder / "subset.csv")
    for wall, (curve, rare) in sets.items():
        cost = spent[spent["wall"] == wall].set_index("form")["mean"]
        banks = {p.name: walls.read(walls.file_of(folder, wall, p)) for p in curve + rare}
        there = {name: bank for name, bank in banks.items() if bank is not None}
        rows += [{"wall": wall, **row} for row in curve_rows(wall, there, cost)]
        floors += [{"wall": wall, **row} for row in floors_of(wall, there, questions(there["random"]))]
        if np.isfinite(there["rare random"].upper).any():
            own = subset[subset["wall"] == wall]
            rows += [{"wall": wall, **row} for row in rare_rows(wall, there, cost, own)]
    cases.write(rows, into / "data.csv")
    cases.write(floors, into / "floors.csv")
    cases.write(spent.to_dict("records"), into / "costs.csv")


def row_of(
    question: Question,
    method: str,
    count: float,
    seconds: float,
    found: FloatArray,
    truth: Truth,
    runs: int,
    apart: float | None = None,
) -> dict[str, object]:
    """Return one row of data.csv: the root mean square of relative errors, with a 90 % interval (of scatter).

    Parameters
    ----------
    question, method, count, seconds
        Quantity, method, number of walls, and processor time (s).
    found : array
        Estimate of each replicate; NaN if there is none.
    truth : Truth
        Reference value.
    runs : int
        Independent replicates among them.
    apart : float, optional
        Number of independent estimates, where estimates share replicates.
    """
    known = found[np.isfinite(found)]
    away = known / truth.value - 1
    square = _mean_square(away, truth.error, runs if apart is None else apart) if len(known) > 1 else np.nan
    low, high = (float(np.sqrt(square * runs / stats.chi2.ppf(q, runs))) for q in (0.95, 0.05))
    return {
        "question": question.name,
        "at": question.at,
        "method": method,
        "walls": count,
        "seconds": seconds,
        "error": np.sqrt(square),
        "lower": low,
        "upper": high,
        "bias": float(away.mean()),
        "runs": runs,
        "no answer": 1 - len(known) / len(found),
        "truth": truth.value,
        "truth error": truth.error,
    }


def _mean_square(away: FloatArray, reference: float, runs: float) -> float:
    """Return the mean square error: variance, and squared bias beyond its standard error and the reference's."""
    scatter = float(away.var(ddof=1))
    return scatter + max(
        float(away.mean()) ** 2 - scatter / runs - (reference**2 if reference == reference else 0.0), 0.0
    )


def pooled(banks: dict[str, Bank]) -> Bank:
    """Return all walls sampled from the study's distributions, without variants of the wall."""
    plain = [bank for name, bank in banks.items() if name in ("random", "sobol") or name.startswith("lhs")]
    joined = (np.concatenate([getattr(b, field).ravel() for b in plain]) for field in ("lower", "upper", "weight"))
    return Bank(*joined, sum(b.failed for b in plain))


def powers(smallest: int, largest: int) -> list[int]:
    """Return the powers of two from one number to another."""
    return [2**k for k in range(40) if smallest <= 2**k <= largest]


# -- curves -----------------------------------------------------------------------------------------------------------


def curve_rows(wall: str, banks: dict[str, Bank], cost: pd.Series) -> list[dict[str, object]]:
    """Return errors of the median and of a probability near 0.1."""
    first = banks["random"]
    random = np.random.default_rng(1)
    rows = []
    for question in questions(first):
        truth = _truth(question, banks, random)
        own = Truth(estimate(question, first.lower[0], first.upper[0]), np.nan)
        for n in powers(8, first.lower.size // 2):
            found = np.array([_drawn(question, first, n, random) for _ in range(DRAWS)])
            row = row_of(question, "random", n, n * cost["path"], found, own, DRAWS)
            rows.append(row | {"truth": truth.value, "truth error": truth.error})
        for name, bank in banks.items():
            if name == "sobol":
                rows += _sobol_rows(question, bank, truth, cost["path"], random)
            elif name.startswith("lhs"):
                n = bank.lower.shape[1]
                found = np.array([estimate(question, a, b) for a, b in zip(bank.lower, bank.upper)])
                rows.append(row_of(question, "Latin hypercube", n, n * cost["path"], found, truth, len(found)))
            elif name in walls.VARIANTS[wall] and not np.isnan(question.at) and cost[name] < cost["path"]:
                rows += _two_level_rows(question, first, bank, name, cost, random)
    return rows


def _truth(question: Question, banks: dict[str, Bank], random: np.random.Generator) -> Truth:
    """Return the estimate from random walls and scrambles of Sobol points, weighted by inverse variance."""
    values, errors = [], []
    for name, bank in banks.items():
        if name != "random" and not (name == "sobol" and len(bank.lower) > 3):
            continue
        values.append(estimate(question, bank.lower.ravel(), bank.upper.ravel()))
        if name == "random":
            n = min(bank.lower.size, 512)
            again = np.array([_drawn(question, bank, n, random) for _ in range(DRAWS // 2)])
            errors.append(float(np.nanstd(again)) * np.sqrt(n / bank.lower.size))
        else:
            each = np.array([estimate(question, a, b) for a, b in zip(bank.lower, bank.upper)])
            errors.append(float(np.nanstd(each, ddof=1)) / np.sqrt(len(each)))
    weight = np.array(errors) ** -2.0
    value = float((weight * values).sum() / weight.sum())
    return Truth(value, float(weight.sum() ** -0.5) / value)


def _drawn(question: Question, bank: Bank, n: int, random: np.random.Generator) -> float:
    """Return the estimate of n walls resampled from a bank, with replacement."""
    lower, upper = bank.lower.ravel(), bank.upper.ravel()
    pick = random.integers(len(lower), size=n)
    return estimate(question, lower[pick], upper[pick])


def _sobol_rows(
    question: Question, bank: Bank, truth: Truth, cost: float, random: np.random.Generator
) -> list[dict[str, object]]:
    """Return errors of one scramble, and of several that share the walls among them."""
    runs, most = bank.lower.shape
    rows = []
    for n in powers(8, most):
        found = np.array([estimate(question, a[:n], b[:n]) for a, b in zip(bank.lower, bank.upper)])
        rows.append(row_of(question, "Sobol", n, n * cost, found, truth, runs))
    for n in powers(8, most) if runs >= 2 * SCRAMBLES else []:
        groups = [random.integers(runs, size=SCRAMBLES) for _ in range(DRAWS // 3)]
        found = np.array([estimate(question, bank.lower[g, :n].ravel(), bank.upper[g, :n].ravel()) for g in groups])
        count = SCRAMBLES * n
        rows.append(row_of(question, "Sobol, 8 scrambles", count, count * cost, found, truth, runs, runs / SCRAMBLES))
    return rows


def _two_level_rows(
    question: Question, fine: Bank, coarse: Bank, name: str, cost: pd.Series, random: np.random.Generator
) -> list[dict[str, object]]:
    """Return errors of a control variate: with a pilot that decides, and whose walls count as time."""
    size = min(fine.lower.size, coarse.lower.size)
    y, x = (probability_reached(b.lower[0, :size], b.upper[0, :size], question.at) for b in (fine, coarse))
    truth = Truth(float(y.mean()), float(np.sqrt((1 - y.mean()) / (y.mean() * size))))
    ratio = cost[name] / cost["path"]
    rows = []
    for budget in (32, 128, 512):
        found, spent = np.array([_two_level(y, x, ratio, budget, random) for _ in range(DRAWS)]).T
        walls_spent = float(spent.mean())
        rows.append(
            row_of(question, f"two-level, {name}", walls_spent, walls_spent * cost["path"], found, truth, DRAWS)
        )
    return rows


def _two_level(
    y: FloatArray, x: FloatArray, ratio: float, budget: float, random: np.random.Generator
) -> tuple[float, float]:
    """Return the estimate of one two-level study, and its cost in fine walls."""
    pick = random.integers(len(y), size=PILOT)
    n, m = read_pilot(y[pick], x[pick], 1.0, ratio).allocation(budget)
    pick = random.integers(len(y), size=max(n, m))
    value = two_level(y[pick[:n]], x[pick[:n]], x[pick[n:]]).value if m else float(y[pick].mean())
    return value, PILOT * (1 + ratio) + n + m * ratio


# -- small probabilities ----------------------------------------------------------------------------------------------


def rare_rows(wall: str, banks: dict[str, Bank], cost: pd.Series, subset: pd.DataFrame) -> list[dict[str, object]]:
    """Return errors of a small probability."""
    question = Question("small probability", walls.RARE_AT[wall])
    truth = rare_truth(question, banks, subset)
    rows = []
    for n in powers(64, 1 << 14):
        row = row_of(question, "random", n, n * cost["short path"], np.full(2, truth.value), truth, 1)
        exact = np.sqrt((1 - truth.value) / (truth.value * n))
        rows.append(row | {"error": exact, "lower": np.nan, "upper": np.nan, "runs": 0})
    for name, method, form in (
        ("rare sobol", "Sobol", "short path"),
        ("importance", "importance", "short path, shifted"),
        ("importance sobol", "importance, Sobol", "short path, shifted"),
    ):
        if name not in banks:
            continue
        bank = banks[name]
        for n in powers(64 if name == "rare sobol" else 16, bank.lower.shape[1]):
            found = np.array(
                [estimate(question, a[:n], b[:n], w[:n]) for a, b, w in zip(bank.lower, bank.upper, bank.weight)]
            )
            rows.append(row_of(question, method, n, n * cost[form], found, truth, len(found)))
    for _, runs in subset.groupby("level"):
        found = runs["probability"].to_numpy()
        row = row_of(
            question, "subset simulation", runs["walls"].mean(), runs["seconds"].mean(), found, truth, len(found)
        )
        within = (runs["lower"] <= truth.value) & (runs["upper"] >= truth.value)
        rows.append(row | {"stated": float(np.sqrt((runs["variation"] ** 2).mean())), "held": float(within.mean())})
    return rows


def rare_truth(question: Question, banks: dict[str, Bank], subset: pd.DataFrame) -> Truth:
    """Return the estimate of all methods, weighted by inverse variance."""
    said = rare_answers(question, banks, subset)
    weight = said["error"] ** -2.0
    value = float((said["value"] * weight).sum() / weight.sum())
    return Truth(value, float(weight.sum() ** -0.5 / value))


def rare_answers(question: Question, banks: dict[str, Bank], subset: pd.DataFrame) -> pd.DataFrame:
    """Return the pooled estimate of each method, with its standard error."""
    rows = []
    plain = [banks[name] for name in ("rare random", "rare sobol") if name in banks]
    hits = np.concatenate([probability_reached(b.lower, b.upper, question.at).ravel() for b in plain])
    p = float(hits.mean())
    rows.append({"method": "random and Sobol", "value": p, "error": np.sqrt(max(p * (1 - p), 1e-12) / len(hits))})
    shifted = [banks[n] for n in ("importance", "importance sobol") if n in banks]
    if shifted:
        values = np.concatenate(
            [(b.weight * probability_reached(b.lower, b.upper, question.at)).ravel() for b in shifted]
        )
        if values.any():
            error = float(values.std() / np.sqrt(len(values)))
            rows.append({"method": "importance", "value": values.mean(), "error": error})
    if len(subset) > 5:
        # runs are weighted by their numbers of walls
        share = subset["walls"] / subset["walls"].sum()
        value = float((share * subset["probability"]).sum())
        spread = float(np.sqrt((share**2 * (subset["probability"] - value) ** 2).sum()))
        rows.append(
            {"method": "subset simulation", "value": value, "error": spread * np.sqrt(len(subset) / (len(subset) - 1))}
        )
    return pd.DataFrame(rows)

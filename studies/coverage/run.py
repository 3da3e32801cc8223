"""Coverage of every interval of 90 % that the toolkit prints.

Run: python studies/coverage/run.py [--repetitions 200] [--seconds 15]
    [--quick] [--only WORD ...] [--seed 1] [-o FOLDER] [--page]
"""

from __future__ import annotations

import argparse
import sys
import time
import zlib
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from intervals import Case, cases  # noqa: E402

from damagepred.archive.files import write_whole  # noqa: E402
from damagepred.errors import InputError  # noqa: E402
from studies.pages import put_in  # noqa: E402

LEAST = 0.85
"""Smallest acceptable coverage."""

FEWEST = 100
"""Repetitions of a slow case."""


def measure(
    interval: str, samples: str, case: Case, repetitions: int, seed: int, seconds: float = np.inf
) -> list[dict[str, object]]:
    """Repeat a case, after ``FEWEST`` repetitions no longer than some seconds; return a row for each quantity."""
    ends: dict[str, list[tuple[float, float, float]]] = {}
    number = zlib.crc32(f"{interval}, {samples}".encode())
    began = time.monotonic()
    for repetition in range(repetitions):
        if repetition >= FEWEST and time.monotonic() - began > seconds:
            repetitions = repetition
            break
        random = np.random.default_rng([seed, number, repetition])
        try:
            found = case(random)
        except InputError:
            continue
        for name, limits in found.items():
            ends.setdefault(name, []).append(limits)
    rows: list[dict[str, object]] = []
    for name, limits in ends.items():
        lower, upper, truth = np.array(limits).T
        given = np.isfinite(lower) & ~np.isnan(upper)
        count = int(given.sum())
        below, above = (float((given & miss).sum()) / max(count, 1) for miss in (truth < lower, truth > upper))
        coverage = 1.0 - below - above if count else np.nan
        error = np.sqrt(coverage * (1 - coverage) / count) if count else np.nan
        rows.append(
            {
                "interval": interval,
                "samples": samples,
                "quantity": name,
                "repetitions": repetitions,
                "given": count / repetitions,
                "coverage": coverage,
                "error": error,
                "truth_below": below,
                "truth_above": above,
            }
        )
    return rows


def chosen(only: Sequence[str]) -> dict[tuple[str, str], Case]:
    """Return the cases whose interval begins with one of the words."""
    return {key: case for key, case in cases().items() if not only or any(key[0].startswith(word) for word in only)}


def run(folder: Path, repetitions: int, seed: int, only: Sequence[str] = (), seconds: float = np.inf) -> pd.DataFrame:
    """Measure all cases, and write the table after each."""
    rows: list[dict[str, object]] = []
    began, wanted = time.monotonic(), chosen(only)
    with ProcessPoolExecutor(2) as pool:
        jobs = [pool.submit(measure, *key, case, repetitions, seed, seconds) for key, case in wanted.items()]
        for number, (key, job) in enumerate(zip(wanted, jobs), 1):
            rows += job.result()
            table = pd.DataFrame(rows)
            write_whole(folder / "coverage.csv", lambda path, t=table: t.to_csv(path, index=False, float_format="%.4g"))
            print(f"{number} of {len(wanted)}, {time.monotonic() - began:.0f} s: {', '.join(key)}", flush=True)
    return pd.DataFrame(rows)


def table(folder: Path) -> str:
    """Table of the page: coverage by quantity, and share of the samples for which an interval was given."""
    rows = ["| interval | samples | coverage | given |", "|---|---|---|---|"]
    for (interval, samples), own in pd.read_csv(folder / "coverage.csv").groupby(["interval", "samples"], sort=False):
        cells = []
        for row in own.to_dict("records"):
            value = "refused" if row["given"] == 0 else f"{row['coverage']:.2f} ± {row['error']:.2f}"
            low = row["coverage"] + 2 * row["error"] < LEAST
            cells.append(f"{row['quantity']} {f'**{value}**' if low else value}")
        rows.append(f"| {interval} | {samples} | {'; '.join(cells)} | {own['given'].min():.2f} |")
    return "\n".join(rows)


def main() -> None:
    """Read the command line, measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=15.0, help=f"of a case, after {FEWEST} repetitions")
    parser.add_argument("--quick", action="store_true", help="10 repetitions")
    parser.add_argument("--only", nargs="*", default=[], help="words that intervals begin with")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=HERE)
    parser.add_argument("--page", action="store_true", help="write the page from the stored table")
    asked = parser.parse_args()
    asked.output.mkdir(parents=True, exist_ok=True)
    if not asked.page:
        run(asked.output, 10 if asked.quick else asked.repetitions, asked.seed, asked.only, asked.seconds)
    if asked.output == HERE and not asked.only:
        put_in(HERE / "README.md", table(HERE))


if __name__ == "__main__":
    main()

"""Causes: posterior odds of five forms of ground movement and of growth, on walls that the archives do not hold.

    python studies/back_analysis/causes.py [--samples 40] [--cases 16] [-j 2] [--folder results]

One study a cause, each with a prescribed form of the ground, or with bricks that grow on still ground. The same
command resumes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from synthetic import Case, Survey, archives, area, infer_cases, promised_area  # noqa: E402

from damagepred.analyses.back_analysis import InferenceOptions  # noqa: E402
from damagepred.arrays import FloatArray  # noqa: E402
from damagepred.scene import Movement  # noqa: E402
from studies.pages import put_in  # noqa: E402

LARGEST = 10e-3
"""Largest movement of the ground under the wall at the end of each study (m)."""
GROWTH = 1e-3
"""Growth of the bricks at the end of its study (1): the upper end of what clay bricks do in 15 years."""
LENGTH = 7.2


def _form(kind: str, profile: Callable[[FloatArray], FloatArray]) -> dict[str, Any]:
    """Return a prescribed form whose largest movement is that of all causes."""
    moved = Movement.from_function(profile, points=25, kind=kind)
    value = np.array(moved.table)[:, 1]
    deflection = abs(value[12] - 0.5 * (value[0] + value[-1])) / np.abs(value).max() * LARGEST
    return {"shape": "table", "kind": kind, "table": moved.table, "central_deflection": float(deflection)}


def _bump(middle: float, width: float) -> Callable[[FloatArray], FloatArray]:
    return lambda x: np.exp(-0.5 * ((x - middle) / width) ** 2)


CAUSES = {
    "dishing": {"shape": "parabola", "kind": "dishing", "central_deflection": LARGEST},
    "doming": {"shape": "parabola", "kind": "doming", "central_deflection": LARGEST},
    "tree": _form("doming", lambda x: -np.exp(-x / 0.2)),  # dries the clay under the left end, which settles
    "leak": _form("doming", _bump(0.65, 0.12)),  # wets the clay under a pipe, which heaves
    "trench": _form("dishing", lambda x: -_bump(0.3, 0.15)(x)),  # Gaussian trough of a trench or a tunnel
    "growth": {"central_deflection": 0.0, "stage": [{"central_deflection": 0.0, "strain": GROWTH, "increments": 10}]},
}
MARKS = "<!-- written by causes.py -->", "<!-- end of causes -->"
CRACKS = tuple((share * LENGTH, y) for share in (0.1, 0.3, 0.5, 0.7, 0.9) for y in (0.15, 0.75))
LEVELS = tuple((share * LENGTH, 0.075) for share in (0.05, 0.3, 0.5, 0.7, 0.95))
SURVEYS = {
    "cracks": Survey(CRACKS, within=0.6),
    "cracks and levels": Survey(CRACKS, LEVELS, within=0.6),
}


def scores(cases: list[Case]) -> dict[str, Any]:
    """Return areas under the curve, one cause against the rest, the confusion of causes, and coverage."""
    true, probability = np.array([c.cause for c in cases]), np.array([c.probability for c in cases])
    seen, guess, count = np.array([c.cracked for c in cases]), probability.argmax(axis=1), len(CAUSES)
    pair = true < 2  # dishing and doming, against each other
    odds = probability[pair, 1] / np.maximum(probability[pair, :2].sum(axis=1), 1e-300)
    areas = {cause: area(probability[:, k], true == k) for k, cause in enumerate(CAUSES)}
    return {
        "cases": len(cases),
        "area": areas,
        "area_mean": float(np.mean(list(areas.values()))),
        "area_promised": float(np.mean([promised_area(p) for p in probability.T])),
        "area_dishing_doming": area(odds, true[pair] == 1),
        "cases_with_a_crack": int(seen.sum()),
        "likeliest_is_right": float((guess == true).mean()),
        "confusion": [[int(((true == i) & (guess == j)).sum()) for j in range(count)] for i in range(count)],
        "effective_samples_median": float(np.median([c.effective for c in cases])),
        "coverage_90": float(np.mean([0.05 < c.rank < 0.95 for c in cases])),
    }


def page_text(result: dict[str, Any]) -> str:
    """Return the tables of the page."""
    lines = [
        "| survey | " + " | ".join(CAUSES) + " | mean | promised | dishing against doming |",
        "|---|" + "---|" * (len(CAUSES) + 3),
    ]
    for name in SURVEYS:
        one = result[name]
        areas = " | ".join(f"{one['area'][cause]:.2f}" for cause in CAUSES)
        lines.append(
            f"| {name} | {areas} | {one['area_mean']:.2f} | {one['area_promised']:.2f} | "
            f"{one['area_dishing_doming']:.2f} |"
        )
    name, one = next((name, result[name]) for name in SURVEYS)
    lines += ["", f"| {name}: true cause, likeliest | " + " | ".join(CAUSES) + " |", "|---|" + "---|" * len(CAUSES)]
    lines += [f"| {cause} | " + " | ".join(map(str, row)) + " |" for cause, row in zip(CAUSES, one["confusion"])]
    lines += [
        "",
        f"{one['cases']} cases, {one['cases_with_a_crack']} with a crack. The likeliest cause is the true one in "
        f"{one['likeliest_is_right']:.0%}; intervals of 90 % of the movement hold it in {one['coverage_90']:.0%}. "
        f"Median of the effective samples: {one['effective_samples_median']:.0f}.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Run the cases and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=40)
    parser.add_argument("--cases", type=int, default=16, help="unseen walls of each cause")
    parser.add_argument("--surveys", type=int, default=4, help="of each wall, at other movements and with other errors")
    parser.add_argument("--folder", type=Path, default=HERE / "results")
    parser.add_argument("-j", "--workers", type=int, default=2)
    given = parser.parse_args()
    start = time.monotonic()
    study = HERE / "causes.toml"
    stored = archives(study, CAUSES, given.folder / "causes_stored", given.samples, 11, given.workers)
    unseen = archives(study, CAUSES, given.folder / "causes_unseen", given.cases, 12, given.workers)
    result: dict[str, Any] = {"seconds_walls_and_replays": time.monotonic() - start}
    for name, survey in SURVEYS.items():
        options = InferenceOptions(replays=given.samples)
        result[name] = scores(list(infer_cases(stored, unseen, survey, options, range(7, 7 + given.surveys))))
    print(json.dumps(result, indent=1))
    if given.folder == HERE / "results":
        put_in(HERE / "README.md", page_text(result), *MARKS)
    (given.folder / "causes.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

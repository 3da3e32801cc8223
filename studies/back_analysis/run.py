"""Back-analysis of synthetic cases: coverage, ranks and causes, on walls that the archives do not hold.

    python studies/back_analysis/run.py [--samples 300] [--cases 200] [-j 2] [--folder results]

Each case is a wall of a study with another seed, at a movement drawn from the prior. Four places are looked at, always
the same: a crack's width is measured there with the survey's error and the model's discrepancy, or nothing is seen.
The discrepancy of each survey is drawn from the fitted distribution. Every wall is surveyed many times, at other
movements and with other errors. Fewer stored walls, surveys of levels too, and a discrepancy that is taken as certain
are tried with the first of these surveys. The same command resumes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from synthetic import Case, Survey, archives, area, infer_cases, promised_area  # noqa: E402

from damagepred.analyses.inference_options import InferenceOptions  # noqa: E402
from studies.pages import put_in  # noqa: E402

KINDS = {kind: {"kind": kind} for kind in ("dishing", "doming")}
PLACES = ((0.2, 0.1), (0.96, 0.1), (1.7, 0.1), (0.96, 0.5))
LEVELS = ((0.96, 0.0375), (0.12, 0.0375), (1.8, 0.0375))
RANKS = 10
MARKS = "<!-- written by run.py -->", "<!-- end of run -->"


def scores(cases: list[Case], surveys: int) -> dict[str, Any]:
    """Return coverage of intervals, uniformity of ranks, and areas under the curve."""
    ranks, causes = np.array([c.rank for c in cases]), np.array([c.cause for c in cases])
    doming, effective = np.array([c.probability[1] for c in cases]), np.array([c.effective for c in cases])
    cracked, enough = np.array([c.cracked for c in cases]), effective >= 50
    counts = np.histogram(ranks, bins=RANKS, range=(0, 1))[0]
    covered = (ranks > 0.05) & (ranks < 0.95)
    each = covered.reshape(surveys, -1).mean(axis=1)
    return {
        "cases": len(cases),
        "coverage_90": float(covered.mean()),
        "coverage_90_of_each_survey": each.tolist(),
        "scatter_of_these": float(each.std(ddof=1)),
        "scatter_of_independent_surveys": float(np.sqrt(covered.mean() * (1 - covered.mean()) * surveys / len(cases))),
        "cases_of_50_effective_samples": int(enough.sum()),
        "coverage_90_of_these": float(covered[enough].mean()),
        "coverage_90_of_the_others": float(covered[~enough].mean()),
        "rank_counts": counts.tolist(),
        "rank_chi_square_p": float(stats.chisquare(counts).pvalue),
        "area": area(doming, causes == 1),
        "area_promised": promised_area(doming),
        "cases_with_a_crack": int(cracked.sum()),
        "area_of_these": area(doming[cracked], causes[cracked] == 1),
        "area_of_the_others": area(doming[~cracked], causes[~cracked] == 1),
        "effective_samples_median": float(np.median(effective)),
        "resembled": float(np.mean([c.resembles for c in cases])),
    }


def page_text(result: dict[str, Any]) -> str:
    """Return the tables of the page."""
    found = result["cracks"]
    each = found["coverage_90_of_each_survey"]
    walls = found["cases"] // len(each)
    lines = [
        f"| {found['cases']} cases: {walls} walls, {len(each)} surveys each | measured | expected |",
        "|---|---|---|",
        f"| coverage of the intervals of 90 % | {found['coverage_90']:.3f} | 0.85 to 0.95 |",
        f"| coverage of the first survey | {each[0]:.3f} | 0.85 to 0.95 |",
        f"| coverage of each survey, least and most | {min(each):.3f}, {max(each):.3f} | |",
        f"| standard deviation of these | {found['scatter_of_these']:.3f} | "
        f"{found['scatter_of_independent_surveys']:.3f} by chance |",
        f"| coverage with 50 effective samples or more ({found['cases_of_50_effective_samples']} cases) | "
        f"{found['coverage_90_of_these']:.3f} | |",
        f"| coverage with fewer | {found['coverage_90_of_the_others']:.3f} | |",
        f"| chi-square test of the ranks, p | {found['rank_chi_square_p']:.2f} | above 0.01 |",
        "",
        "| survey | stored walls a kind | cases | coverage | chi-square test of the ranks, p | area, all cases | "
        "area that the posteriors promise | with a crack |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, one in ((name, one) for name, one in result.items() if isinstance(one, dict)):
        lines.append(
            f"| {name} | {one['stored_walls']} | {one['cases']} | {one['coverage_90']:.3f} | "
            f"{one['rank_chi_square_p']:.2g} | {one['area']:.3f} | {one['area_promised']:.3f} | "
            f"{one['area_of_these']:.3f} ({one['cases_with_a_crack']}) |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run the cases and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=300)
    parser.add_argument("--cases", type=int, default=200, help="walls of both kinds")
    parser.add_argument("--surveys", type=int, default=5, help="of each wall, at other movements and with other errors")
    parser.add_argument("--few", type=int, default=2, help="surveys with fewer stored walls, and with levels")
    parser.add_argument("--folder", type=Path, default=HERE / "results")
    parser.add_argument("-j", "--workers", type=int, default=2)
    given = parser.parse_args()
    study = HERE / "study.toml"
    start = time.monotonic()
    stored = archives(study, KINDS, given.folder / "stored", given.samples, 1, given.workers)
    unseen = archives(study, KINDS, given.folder / "unseen", given.cases // 2, 2, given.workers)
    result: dict[str, Any] = {"seconds_walls_and_replays": time.monotonic() - start}
    cracks, certain = Survey(PLACES), InferenceOptions(replays=given.samples, discrepancy_points=1)
    for name, survey, options, surveys in (
        ("cracks", cracks, InferenceOptions(replays=given.samples), given.surveys),
        ("cracks, discrepancy taken as certain", cracks, certain, given.few),
        ("cracks, half of the stored walls", cracks, InferenceOptions(replays=given.samples // 2), given.few),
        ("cracks, a quarter of the stored walls", cracks, InferenceOptions(replays=given.samples // 4), given.few),
        ("cracks and levels", Survey(PLACES, LEVELS), InferenceOptions(replays=given.samples), given.few),
    ):
        seeds = range(5, 5 + min(surveys, given.surveys))
        cases = list(infer_cases(stored, unseen, survey, options, seeds))
        result[name] = {**scores(cases, len(seeds)), "stored_walls": options.replays}
    print(json.dumps(result, indent=1))
    if given.folder == HERE / "results":
        put_in(HERE / "README.md", page_text(result), *MARKS)
    (given.folder / "result.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

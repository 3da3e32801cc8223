"""Back-analysis of synthetic cases: coverage, ranks and causes, on walls that the archives do not hold.

    python studies/back_analysis/run.py [--samples 400] [--cases 200] [-j 2] [--folder results]

Each case is a wall of a study with another seed, at an increment drawn from the prior. Four places are looked at,
always the same: a crack's width is measured there with the survey's error and the model's discrepancy, or nothing is
seen. The same command resumes.
"""

from __future__ import annotations

import argparse
import json
import time
import tomllib
from pathlib import Path

import numpy as np
from scipy import stats

from damagepred.study import Study
from damagepred.study.analyses.back_analysis import InferenceOptions, StoredWalls, movement_cdf, posterior
from damagepred.study.settings import StudySettings
from damagepred.uq.observations import CrackObservation, Discrepancy, Observations

HERE = Path(__file__).parent
PLACES = ((0.2, 0.1), (0.96, 0.1), (1.7, 0.1), (0.96, 0.5))
WITHIN, ERROR, VISIBLE = 0.25, 2e-4, 3e-4
KINDS = ("dishing", "doming")
RANKS = 10


def archives(folder: Path, samples: int, seed: int, workers: int) -> list[StoredWalls]:
    """Run the walls of both causes and replay them all."""
    found = []
    for kind in KINDS:
        tables = tomllib.loads((HERE / "study.toml").read_text(encoding="utf-8"))
        tables["scene"]["movement"]["kind"] = kind
        tables["study"]["seed"] = seed
        place = folder / f"{kind}.dp"
        Study(StudySettings.from_dict(tables)).run(place, samples, workers)
        walls = StoredWalls(place)
        walls.replay(np.flatnonzero(walls.known), workers, None)
        found.append(walls)
    return found


def survey(walls: StoredWalls, sample: int, increment: int, random: np.random.Generator) -> Observations:
    """Look at the places of a wall; what is measured is drawn as the likelihood has it."""
    model, seen = Discrepancy(), []
    for x, y in PLACES:
        place = {"x": x, "y": y, "within": WITHIN, "error": ERROR}
        width = walls.replayed(sample).widest(CrackObservation(**place, none=True), walls.movement.shape[1])[0]
        true = width[increment]
        deviation = np.sqrt(ERROR**2 + model.width**2 + (model.width_share * true) ** 2)
        value = true + deviation * random.standard_normal()
        seen.append(
            CrackObservation(**place, width=value)
            if value > VISIBLE
            else CrackObservation(**place, none=True, visible=VISIBLE)
        )
    return Observations(crack=tuple(seen))


def area(score: np.ndarray, cause: np.ndarray) -> float:
    """Return the area under the receiver operating characteristic."""
    found = stats.mannwhitneyu(score[cause == 1], score[cause == 0])
    return float(found.statistic / ((cause == 1).sum() * (cause == 0).sum()))


def main() -> None:
    """Run the cases and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--surveys", type=int, default=4, help="of each case, with other movements and errors")
    parser.add_argument("--folder", type=Path, default=HERE / "results")
    parser.add_argument("-j", "--workers", type=int, default=2)
    given = parser.parse_args()
    start = time.monotonic()
    stored = archives(given.folder / "stored", given.samples, 1, given.workers)
    unseen = archives(given.folder / "unseen", given.cases // 2, 2, given.workers)
    solved = time.monotonic()
    random = [np.random.default_rng(5 + k) for k in range(given.surveys)]
    options = InferenceOptions(replays=given.samples, negligible=1.0)  # no maps are made
    rank, own_cause, score, effective, misfit, seen_cracks = [], [], [], [], [], []
    cases = [
        (generator, cause, walls, int(sample))
        for generator in random
        for cause, walls in enumerate(unseen)
        for sample in np.flatnonzero(walls.known)
    ]
    for generator, cause, walls, sample in cases:
        # the movement is uniform over the study's; the state is that of the nearest increment
        movement = generator.uniform(0.0, walls.largest)
        increment = int(np.searchsorted(walls.edges[sample], movement, side="right")) - 1
        seen = survey(walls, sample, increment, generator)
        found = posterior(stored, seen, options=options)
        count = len(stored[0].known)
        weight = found["posterior"].values[cause * count : (cause + 1) * count]
        rank.append(float(movement_cdf(stored[cause], weight, np.array([movement]))[0]))
        own_cause.append(cause)
        score.append(float(found["cause_posterior"].sel(study="doming")))
        effective.append(float(found["effective_samples"][cause]))
        misfit.append(bool(found["resembles"].values.any()))
        seen_cracks.append(any(crack.width is not None for crack in seen.crack))
    ranks, causes = np.array(rank), np.array(own_cause)
    counts = np.histogram(ranks, bins=RANKS, range=(0, 1))[0]
    scores, cracked, enough = np.array(score), np.array(seen_cracks), np.array(effective) >= 50
    covered = (ranks > 0.05) & (ranks < 0.95)
    result = {
        "cases": len(ranks),
        "coverage_90": float(covered.mean()),
        "coverage_90_of_each_survey": [float(part.mean()) for part in np.split(covered, given.surveys)],
        "cases_of_50_effective_samples": int(enough.sum()),
        "coverage_90_of_these": float(covered[enough].mean()),
        "rank_counts": counts.tolist(),
        "rank_chi_square_p": float(stats.chisquare(counts).pvalue),
        "auc_dishing_doming": area(scores, causes),
        "cases_with_a_crack": int(cracked.sum()),
        "auc_of_these": area(scores[cracked], causes[cracked]),
        "effective_samples_median": float(np.median(effective)),
        "resembled": float(np.mean(misfit)),
        "seconds_walls_and_replays": solved - start,
        "seconds_a_posterior": (time.monotonic() - solved) / len(ranks),
    }
    print(json.dumps(result, indent=1))
    (given.folder / "result.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""What the studies of synthetic cases share: archives whose walls are all replayed, surveys of walls, and scores."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "validation"))


from damagepred.analyses.back_analysis import posterior
from damagepred.analyses.inference_options import InferenceOptions
from damagepred.analyses.posterior_dataset import movement_cdf
from damagepred.analyses.stored_walls import StoredWalls
from damagepred.arrays import FloatArray
from damagepred.campaign.settings import StudySettings
from damagepred.inputs.input_files import read_toml
from damagepred.study import Study
from damagepred.uq.discrepancy import Discrepancy
from damagepred.uq.observations import CrackObservation, LevelObservation, Observations

Point = tuple[float, float]


def archives(
    study: Path, movements: Mapping[str, Mapping[str, Any]], folder: Path, samples: int, seed: int, workers: int
) -> list[StoredWalls]:
    """Run the walls of each cause and replay them all."""
    found = []
    for name, movement in movements.items():
        tables = read_toml(study)
        tables["scene"]["movement"] = {**tables["scene"]["movement"], **movement}
        tables["study"]["seed"] = seed
        place = folder / f"{name}.dp"
        if Study(StudySettings.from_dict(tables)).run(place, samples, workers).interrupted:
            raise SystemExit(130)
        walls = StoredWalls(place)
        walls.replay(np.flatnonzero(walls.known), workers, None)
        found.append(walls)
        print(f"{place}: {len(walls.known)} walls, {int((~walls.known).sum())} failed", flush=True)
    return found


@dataclass(frozen=True)
class Survey:
    """Places of cracks and of levels that are measured on every wall, reach, standard errors, visible width (m)."""

    places: tuple[Point, ...]
    levels: tuple[Point, ...] = ()
    within: float = 0.25
    width_error: float = 2e-4
    level_error: float = 1e-3
    visible: float = 3e-4

    def of(self, walls: StoredWalls, sample: int, increment: int, random: np.random.Generator) -> Observations:
        """Look at a wall; what is measured is drawn as the likelihood has it, or not seen.

        The discrepancy is drawn from its fitted distribution, and all observations of the survey share it.
        """
        fitted, seen = Discrepancy(), []
        model = fitted.at(random.standard_normal(len(fitted.uncertain)))
        count, wall = walls.movement.shape[1], walls.replayed(sample)
        for x, y in self.places:
            place = {"x": x, "y": y, "within": self.within, "error": self.width_error}
            true = wall.widest(CrackObservation(**place, none=True), count)[0][increment]
            deviation = np.sqrt(self.width_error**2 + model.width**2 + (model.width_share * true) ** 2)
            value = true + deviation * random.standard_normal()
            more = {"width": value} if value > self.visible else {"none": True, "visible": self.visible}
            seen.append(CrackObservation(**place, **more))
        levels = []
        for to in self.levels[1:]:
            rise = wall.level(self.levels[0], to, count)[increment]
            rise += np.hypot(self.level_error, model.level) * random.standard_normal()
            (x, y), (to_x, to_y) = self.levels[0], to
            levels.append(LevelObservation(x=x, y=y, to_x=to_x, to_y=to_y, difference=rise, error=self.level_error))
        return Observations(crack=tuple(seen), level=tuple(levels))


class Case(NamedTuple):
    """True cause, rank of the true movement in its posterior, probability of each cause, effective samples."""

    cause: int
    rank: float
    probability: FloatArray
    effective: float
    cracked: bool
    resembles: bool


def infer_cases(
    stored: Sequence[StoredWalls],
    unseen: Sequence[StoredWalls],
    survey: Survey,
    options: InferenceOptions,
    seeds: Sequence[int],
) -> Iterator[Case]:
    """Survey each unseen wall once for each seed, at a movement drawn from the prior, and infer.

    Of stored walls only so many are used as are replayed.
    """
    options = replace(options, negligible=1.0)  # no maps are made
    for random in map(np.random.default_rng, seeds):
        for cause, walls in enumerate(unseen):
            for sample in np.flatnonzero(walls.known):
                # the movement is uniform over the study's; the state is that of the nearest increment
                movement = random.uniform(0.0, walls.largest)
                increment = int(np.searchsorted(walls.edges[sample], movement, side="right")) - 1
                seen = survey.of(walls, int(sample), increment, random)
                yield _case(stored, cause, movement, seen, posterior(stored, seen, options=options))


def _case(stored: Sequence[StoredWalls], cause: int, movement: float, seen: Observations, found: xr.Dataset) -> Case:
    weight = found["posterior"].values[found["study_of_sample"].values == cause]
    return Case(
        cause,
        float(movement_cdf(stored[cause], weight[:, : stored[cause].movement.shape[1]], np.array([movement]))[0]),
        np.bincount(found["study_of_sample"].values, found["posterior"].values.sum(axis=1), len(stored)),
        float(found["effective_samples"][cause]),
        any(crack.width is not None for crack in seen.crack),
        bool(found["resembles"].values.any()),
    )


def area(score: FloatArray, true: FloatArray) -> float:
    """Return the area under the receiver operating characteristic."""
    found = stats.mannwhitneyu(score[true], score[~true])
    return float(found.statistic / (true.sum() * (~true).sum()))


def promised_area(probability: FloatArray) -> float:
    """Return the area that probabilities promise of themselves, if they are right, without a look at the truth.

    A case counts as a true one with its probability p, and as another with 1 - p.
    """
    order = np.argsort(probability, kind="stable")
    p = probability[order]
    _, start = np.unique(p, return_index=True)
    true, other = np.add.reduceat(p, start), np.add.reduceat(1.0 - p, start)
    below = np.cumsum(other) - 0.5 * other
    return float((true * below).sum() / (true.sum() * other.sum()))

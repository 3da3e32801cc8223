"""Shifts for importance sampling, read from the walls of a study as a pilot run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from damagepred.archive.folder import open_study
from damagepred.campaign.campaign import Campaign
from damagepred.errors import InputError
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.uq.capacity import reached_by
from damagepred.uq.correlation import varying
from damagepred.uq.exceedance import category_capacities
from damagepred.uq.importance import cross_entropy_shift


@dataclass(frozen=True)
class ProposalOptions:
    """Options of the proposal.

    Attributes
    ----------
    fewest_walls : int
        Fewest walls that a shift is read from.
    significance : float
        Smallest shift that is proposed, in its standard errors.
    """

    fewest_walls: int = 20
    significance: float = 2.0


class Proposed(NamedTuple):
    """Shifts that a pilot proposes.

    Attributes
    ----------
    shift : dict of str to float
        In standard deviations of the underlying normal, by place; variables of which none is seen are left out.
    walls, reached : int
        Walls they are read from, and how many of them reached the category by the movement.
    """

    shift: dict[str, float]
    walls: int
    reached: int

    def lines(self) -> list[str]:
        """Return the tables for the study file, and what to know of them."""
        said = [f"# from {self.walls} walls, {self.reached} of which reached the category by the movement"]
        if self.reached < self.walls:
            said.append("# the others are the next to reach it: run this as a pilot, and ask again")
        said += ["[study]", "nominal_share = 0.1"]
        for place, shift in self.shift.items():
            said += [f'[study.importance."{place}"]', f"shift = {shift:.2f}"]
        return said


@one_blas_thread()
def propose(
    path: str | Path,
    category: int,
    at: float,
    options: ProposalOptions = ProposalOptions(),
) -> Proposed:
    """Propose the shifts of importance sampling for the probability of a category by a movement."""
    study, ds = Campaign.from_folder(path), open_study(path)
    design = study.design
    if design.sampler.kind == "table" or not design.wall:
        raise InputError(f"{path}: importance sampling needs variables with one value a wall, drawn by the study.")
    known = category_capacities(ds, category)
    known = known.part(~known.failing)
    order = np.argsort(known.upper, kind="stable")
    reached = int(reached_by(known.upper, at).sum())
    count = max(reached, options.fewest_walls)
    if np.isfinite(known.upper).sum() < count:
        raise InputError(
            f"{path}: {int(np.isfinite(known.upper).sum())} walls reached category {category}, and a shift is read "
            f"from {options.fewest_walls} or more: take more walls or a larger movement for the pilot, or `damagepred "
            "rare`."
        )
    chosen = order[:count]
    normal = design.draw(ds.sizes["sample"]).normal[known.sample[chosen]]
    weight = np.ones(count) if known.weight is None else known.weight[chosen]
    found = cross_entropy_shift(normal, weight)
    seen = {
        place: round(float(mean), 2)
        for place, mean, error, own in zip(design.wall, found.mean, found.error, varying(design.wall_factor))
        if own and abs(mean) > options.significance * error
    }
    return Proposed(seen, count, reached)

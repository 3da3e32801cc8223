"""Design search: the cheapest combination of measures against damage.

The cheapest one with a probability of damage below a target, or the one with the least expected cost with repairs.

Alternatives are the combinations of one option of each choice. Each is a separate study with the same samples (common
random numbers); if the fields are drawn on the study's own wall, the joints' values are also the same.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from pydantic import Field

from damagepred.archive.files import check_output
from damagepred.archive.folder import open_study
from damagepred.arrays import FloatArray
from damagepred.campaign.campaign import Campaign, Progress
from damagepred.campaign.cost_estimate import seconds_per_wall
from damagepred.campaign.dispatch import sample_timeout
from damagepred.campaign.settings import StudySettings, study_tables
from damagepred.campaign.workers import LocalPool
from damagepred.errors import InputError, require_count
from damagepred.formatting import duration
from damagepred.inputs.arguments import checked
from damagepred.inputs.input_files import read_toml
from damagepred.runtime.one_thread import one_blas_thread
from damagepred.scene import Scene
from damagepred.scene.described import build, described
from damagepred.scene.keys import key_values, merged
from damagepred.scene.quantity import Count, Pure
from damagepred.uq.exceedance import category_capacities, known_hits, wanted_movement
from damagepred.uq.intensity import attributes, chosen_intensity
from damagepred.uq.movement_distribution import movement_distribution
from damagepred.uq.selection import select_cheapest, select_least_expected
from damagepred.uq.stopping import interim_sizes


@described
class Option:
    """Option of construction (``[[choice.option]]``)."""

    name: str
    """Name of the option."""
    cost: Pure = 0.0
    """Cost in any currency."""
    scene: dict[str, Any] = Field(default_factory=dict)
    """Differing tables of the scene, such as ``scene.footing.depth = "500 mm"``."""


@described
class Choice:
    """Choice among options (``[[choice]]``); the first is the reference."""

    name: str
    """Name of the choice."""
    option: tuple[Option, ...] = Field(min_length=1)
    """The options."""


@described
class Target:
    """Target (``[target]``): P(category or worse) is at most ``probability``, or the least expected cost."""

    at: str
    """Movement, site class or distribution."""
    category: Count | None = Field(default=None, ge=1)
    """Category, or worse."""
    probability: Pure | None = Field(default=None, gt=0, lt=1)
    """Largest accepted probability."""
    repair_costs: tuple[Pure, ...] = ()
    """Instead of both: costs of repair of category 1, 2, ..., in the currency of the options; the last also holds for
    all worse categories."""
    tolerance: Pure = Field(default=0.0, ge=0)
    """Negligible difference of expected costs."""
    confidence: Pure = Field(default=0.95, gt=0, lt=1)
    """Probability of a correct selection."""
    first: Count = Field(default=32, ge=1)
    most: Count = Field(default=1024, ge=1)
    """Samples of an alternative in the first round, and their limit."""

    def __post_init__(self) -> None:
        """Refuse two targets, or half of one."""
        given = (self.category is not None, self.probability is not None)
        if any(given) == bool(self.repair_costs) or any(given) != all(given):
            raise InputError("give category and probability, or repair_costs.")
        if self.tolerance and not self.repair_costs:
            raise InputError("tolerance: is of expected costs; it needs repair_costs.")
        steps = np.diff(self.repair_costs, prepend=0.0)
        if self.repair_costs and (steps.min() < 0 or self.repair_costs[-1] <= 0):
            raise InputError("repair_costs: must not be negative, nor fall from category to category.")

    @property
    def rounds(self) -> list[int]:
        """Samples of an alternative in each round."""
        return interim_sizes(self.first, max(self.most, self.first))

    def __str__(self) -> str:
        """Target in words."""
        if self.repair_costs:
            return f"expected cost with repairs at {self.at}"
        return f"P(category >= {self.category} at {self.at}) <= {self.probability:g}"


@described
class Choices:
    """Content of the file of choices."""

    study: str
    """Study file, beside this one."""
    target: Target
    """Target of the search."""
    choice: tuple[Choice, ...] = Field(min_length=1)
    """Choices."""


@checked
@one_blas_thread()
def search_design(
    choices: str | Path,
    out: str | Path,
    *,
    workers: int = 1,
    on_round: Callable[[int, int], None] | None = None,
    on_walls: Callable[[Progress], None] | None = None,
) -> xr.Dataset:
    """Cheapest alternative that meets the target.

    Parameters
    ----------
    choices : path
        File of the choices.
    out : path
        Folder for the studies of the alternatives; the same call resumes.
    workers : int
        Number of worker processes.
    on_round : callable, optional
        Called before each round with the samples per alternative, and the number of alternatives.
    on_walls : callable, optional
        Called with the progress of the walls of an alternative.

    Returns
    -------
    xarray.Dataset
        On (alternative,): cost, probability with bounds, samples and decision; ``probability_unfollowed`` is the part
        from walls that failed or have no result at the movement, which count as damaged. On (measure,): the value of
        each option relative to the first of its choice, as the mean paired difference of the probability, with its
        standard error.
        With repair costs: ``expected_cost`` instead of the probability, and differences of the cost of repair.
        Attributes ``chosen`` and ``sure``, and ``regret`` with repair costs.

    Raises
    ------
    InputError
        If the file is invalid, or no wall has a result at the target's movement.

    Examples
    --------
    >>> import damagepred
    >>> ds = damagepred.search_design("choices.toml", "choices.design")
    >>> ds.attrs["chosen"]
    'as it is'
    """
    require_count("workers", workers)
    check_output(out)
    content, built, names, settings = _read(choices)
    values: dict[int, FloatArray] = {}
    doubt = np.full(len(built), np.nan)

    def losses(k: int, count: int) -> FloatArray:
        folder = Path(out) / f"alternative_{k + 1:03d}.dp"
        folder.parent.mkdir(exist_ok=True, parents=True)
        if Campaign(settings[k]).run(folder, count, executor=pool, on_progress=on_walls).interrupted:
            raise KeyboardInterrupt
        ds = open_study(folder)
        values[k] = loss(ds, content.target)[:count]
        doubt[k] = float((values[k] - loss(ds, content.target, unfollowed=0.0)[:count]).mean())
        return values[k]

    costs = np.array([sum(option.cost for option in chosen) for chosen in built])
    target, rounds = content.target, content.target.rounds
    # new workers for each alternative would take longer than small walls
    with LocalPool(workers, sample_timeout(None, Campaign(settings[0]).limits, None)) as pool:
        if target.probability is not None:
            selection = select_cheapest(costs, losses, target.probability, rounds, target.confidence, on_round)
            quantity, units, words = "probability", {"units": "1"}, "undecided_or_dearer meets fails"
        else:
            sure = rounds, target.confidence, target.tolerance
            selection = select_least_expected(costs, losses, target.repair_costs[-1], *sure, on_round)
            quantity, units, words = "expected_cost", {}, "undecided best dearer"
    measures = list(_values_of_measures(content, built, values))
    decision = np.where(selection.meets, 1, np.where(selection.fails, 2, 0)).astype(np.int8)
    flags = {"flag_values": np.array([0, 1, 2], dtype=np.int8), "flag_meanings": words}
    return xr.Dataset(
        {
            "cost": ("alternative", costs),
            quantity: ("alternative", selection.mean, units),
            f"{quantity}_lower": ("alternative", selection.lower, units),
            f"{quantity}_upper": ("alternative", selection.upper, units),
            f"{quantity}_unfollowed": ("alternative", doubt, units),
            "samples": ("alternative", selection.samples),
            "decision": ("alternative", decision, flags),
            "value": ("measure", np.array([m[1] for m in measures]), units),
            "value_error": ("measure", np.array([m[2] for m in measures]), units),
            "extra_cost": ("measure", np.array([m[3] for m in measures])),
        },
        {"alternative": names, "measure": [m[0] for m in measures]},
        {
            "title": str(target),
            "quantity": quantity,
            "chosen": "" if selection.chosen is None else names[selection.chosen],
            "sure": int(selection.sure),
            "limit": np.nan if target.probability is None else target.probability,
            "regret": selection.regret,
            "confidence": target.confidence,
        },
    )


def price_of_search(choices: str | Path, workers: int) -> str:
    """Cost estimate of a search (first round, upper bound); times one reference wall."""
    content, built, _, settings = _read(choices)
    seconds, rounds = seconds_per_wall([settings[0].scene]) * len(built) / workers, content.target.rounds
    return (
        f"{len(built)} alternatives like the first: {rounds[0]} samples each to begin with, about "
        f"{duration(seconds * rounds[0])}; {rounds[-1]} each at most, about {duration(seconds * rounds[-1])}"
    )


def _read(choices: str | Path) -> tuple[Choices, list[tuple[Option, ...]], list[str], list[StudySettings]]:
    """Choices, their combinations, and the name and study of each combination."""
    content = build(Choices, read_toml(choices), str(choices))
    file = Path(choices).parent / content.study
    base = StudySettings.from_toml(file)
    if base.study.importance or base.study.sampler == "table" or base.study.movement == "sampled":
        raise InputError(
            f"{content.study}: a design search draws its own samples; no importance, table or sampled movement."
        )
    built = list(itertools.product(*(choice.option for choice in content.choice)))
    names = [" + ".join(option.name for option in chosen) for chosen in built]
    if len(set(names)) < len(names):
        raise InputError(f"{choices}: two options of a choice have the same name.")
    tables, folder = study_tables(file)
    settings = [_settings_of(base, file, tables, folder, content.target.rounds[-1], chosen) for chosen in built]
    return content, built, names, settings


def loss(ds: xr.Dataset, target: Target, unfollowed: float = 1.0) -> FloatArray:
    """Probability of each sample to reach the category, or expected cost of its repair; see ``damaged``."""
    if target.category is not None:
        return damaged(ds, target.category, target.at, unfollowed)
    steps = np.diff(target.repair_costs, prepend=0.0)
    each = [step * damaged(ds, k, target.at, unfollowed) for k, step in enumerate(steps, 1) if step]
    return np.asarray(np.sum(each, axis=0))


def damaged(ds: xr.Dataset, category: int, movement: str, unfollowed: float = 1.0) -> FloatArray:
    """Probability of each sample to reach a category, over the movements of the target; a bound where unknown."""
    measure = chosen_intensity(ds, None)
    wanted = movement_distribution(movement, str(attributes(ds, measure)["units"]), "target.at")
    capacities = category_capacities(ds, category, measure, wanted_movement(ds, wanted, measure))
    least, most = (known_hits(capacities, wanted, unknown) for unknown in (0.0, 1.0))
    if (most - least == 1.0).all():
        raise InputError(f"target.at = {wanted.name}: no sample has a result there; give the study a larger movement.")
    result = np.full(ds.sizes["sample"], unfollowed)
    result[capacities.sample] = most if unfollowed else least
    return result


def _settings_of(
    base: StudySettings, file: Path, tables: dict[str, Any], folder: Path, most: int, chosen: tuple[Option, ...]
) -> StudySettings:
    """Study of an alternative: tables of the study file, with the scene's files in a folder, and of its options."""
    of_scene = tables["scene"]
    for option in chosen:
        changes = dict(key_values(option.scene))
        if "wall.length" in changes:
            base.scene.require_own_length(f"option {option.name}")
        try:
            of_scene = merged(of_scene, option.scene)
            base.require_not_drawn(changes, of_scene)
        except InputError as error:
            raise InputError(f"option {option.name}: {error}") from None
    scene = Scene.from_file_tables(of_scene, folder, f"alternative {' + '.join(option.name for option in chosen)}")
    settings = StudySettings.from_file_tables(tables, scene, file)
    how = replace(settings.study, samples=most, sampler="random", replicates=1, stop_when=None, title=None)
    drawn_on_joints = any(variable.field is not None for variable in settings.variables.values())
    if drawn_on_joints and how.fields_from is None:
        how = replace(how, fields_from=base.scene)
    return replace(settings, study=how)


def _values_of_measures(
    content: Choices, built: list[tuple[Option, ...]], values: Mapping[int, FloatArray]
) -> list[tuple[str, float, float, float]]:
    """Name, mean difference of probability or repair cost to the first option, standard error, extra cost."""
    measures = []
    for position, choice in enumerate(content.choice):
        for option in choice.option[1:]:
            differences = []
            for k, chosen in enumerate(built):
                if chosen[position] is not option:
                    continue
                other = built.index((*chosen[:position], choice.option[0], *chosen[position + 1 :]))
                if k in values and other in values:
                    count = min(len(values[k]), len(values[other]))
                    differences.append(values[k][:count] - values[other][:count])
            count = min((len(d) for d in differences), default=0)
            # the mean over pairs of alternatives first: they share their samples
            each = np.mean([d[:count] for d in differences], axis=0) if count else np.empty(0)
            error = float(each.std(ddof=1) / np.sqrt(count)) if count > 1 else np.nan
            value = float(each.mean()) if count else np.nan
            measures.append((f"{choice.name}: {option.name}", value, error, option.cost - choice.option[0].cost))
    return measures

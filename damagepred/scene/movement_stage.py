"""Stages and increments of a history of movement, and its seasons on reactive clay: trend, swing and steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from damagepred.arrays import FloatArray, IntArray
from damagepred.enumerations import SYNONYMS
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Length, Pure, Years, to_si

Kind = Annotated[Literal["dishing", "doming", "settle", "heave"], BeforeValidator(lambda w: SYNONYMS.get(str(w), w))]
UP = ("doming", "heave")
OPPOSITE: dict[str, Kind] = {"dishing": "doming", "doming": "dishing", "settle": "heave", "heave": "settle"}


def sizes(stages: Any, key: str) -> list[Any]:
    """Given sizes of stages, tables or objects."""
    listed = stages if isinstance(stages, list | tuple) else ()
    found = [s.get(key) if isinstance(s, Mapping) else getattr(s, key, None) for s in listed]
    return [size for size in found if size is not None]


def largest_size(stages: Any, key: str) -> float | None:
    """Largest size (m) of stages, 0 if none is given; None without stages, and if a size is no length."""
    try:
        return max((to_si(size, "m") for size in sizes(stages, key)), default=0.0 if stages else None)
    except ValueError:
        return None


def with_largest_stage(tables: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene whose mound moves by the largest of the stages where it says nothing else."""
    movement, mound = tables.get("movement"), tables.get("mound", {})
    stages = movement.get("stage") if isinstance(movement, Mapping) else getattr(movement, "stage", None)
    full = largest_size(stages, "surface_movement")
    if not full or not isinstance(mound, Mapping) or "surface_movement" in mound:
        return tables
    return {**tables, "mound": {**mound, "surface_movement": full}}


@described
class Stage:
    """Stage of a movement history (``[[movement.stage]]``): from the end of the last one, in equal increments.

    Examples
    --------
    >>> from damagepred import scene
    >>> dry_summer = scene.Stage(kind="doming", central_deflection="8 mm", increments=4)
    >>> scene.Movement(stage=(dry_summer,)).stage[0].central_deflection
    0.008
    """

    kind: Kind = "dishing"
    """Side of the centre, relative to the line through the ends, at the end of the stage. Where ``movement.kind`` is
    settle or heave: whether the ground is then below or above its level."""
    central_deflection: Length | None = Field(default=None, ge=0)
    """Deflection of the centre at the end of the stage (m), not negative; 0 is level ground. Not for mounds. A stage
    with only a time or a strain stays where the last one ended."""
    surface_movement: Length | None = Field(default=None, ge=0)
    """For mounds instead: the surface movement at the end of the stage (m)."""
    settlement: Length | None = Field(default=None, ge=0)
    """For a movement with a ``settlement`` instead: its size at the end of the stage (m)."""
    load_factor: Pure | None = Field(default=None, ge=-1, le=1)
    """For laboratory tests instead: controlled quantity of ``[loading]`` at the end of the stage, over its value there
    (1). Below 0 loads and displacement are reversed."""
    increments: Count = Field(default=10, ge=1)
    """Number of equal increments."""
    time: Years | None = Field(default=None, gt=0)
    """End of the stage (years). All stages have a time, or no stage."""
    strain: Pure | None = Field(default=None, ge=-0.01, le=0.01)
    """Strain of the bricks at the end of the stage, without ``[strain]`` (1). None: as at its start."""

    @property
    def size(self) -> float:
        """Deflection, surface movement, settlement (m) or load factor (1) at the end of the stage."""
        return self.surface_movement or self.central_deflection or self.settlement or self.load_factor or 0.0


class History(NamedTuple):
    """Increments of a movement history, from the dead load on."""

    load_factors: FloatArray  # (increments + 1,): from 0; below 0 where the ground moves the other way
    stage: IntArray  # (increments + 1,): number of the stage, from 1; 0 for the dead load
    time: FloatArray | None  # (increments + 1,): years since the dead load
    # (increments + 1,): strain of the bricks (1) by the stages, in a model also by ``[strain]``
    strain: FloatArray | None = None


@described
class SeasonStep:
    """Lasting change of the ground, as by a leak or a tree (``[[movement.seasons.step]]``).

    Examples
    --------
    >>> from damagepred import scene
    >>> leak = scene.SeasonStep(year=12, movement="15 mm", end=14, probability=0.2)
    >>> leak.movement
    0.015
    """

    year: Years = Field(ge=0)
    """Start (years)."""
    movement: Length
    """Size (m); positive on the side of ``movement.kind``."""
    rise: Years = Field(default=1.0, ge=0)
    """Duration of the rise to its size (years)."""
    end: Years | None = Field(default=None, gt=0)
    """End (years), such as the repair of a leak. None: no end."""
    probability: Pure = Field(default=1.0, ge=0, le=1)
    """Share of the samples of a study with this step."""


@described
class Seasons:
    """Movement history of some years, two stages a year (``[movement.seasons]``).

    The movement at the end of half year k, at time t = k / 2 years, is ::

        trend t / years + shift b_j +- (swing / 2) max(1 + swing_cov a_j, 0) + steps

    with + in the first half of a year and - in the second. The yearly numbers a_j and b_j are standard normal and
    correlated from year to year (autoregressive process of first order). They follow from ``seed``; in a study each
    sample has its own seed, from the study's.

    Examples
    --------
    >>> from damagepred import scene
    >>> movement = scene.Movement(seasons=scene.Seasons(years=2, swing="10 mm", swing_cov=0))
    >>> [(stage.kind, stage.central_deflection, stage.time) for stage in movement.stage][:2]
    [('dishing', 0.005, 0.5), ('doming', 0.005, 1.0)]
    """

    years: Count = Field(default=30, ge=1, le=200)
    """Number of years."""
    trend: Length = 0.0
    """Change of the mean over all years (m); positive on the side of ``movement.kind``."""
    swing: Length = Field(default=10e-3, ge=0)
    """Mean movement from the wettest to the driest state of a year (m). A soil log determines it."""
    swing_share: Pure = Field(default=0.6, ge=0)
    """With ``[[soil_layer]]``: mean swing over the surface movement y_s of the log (1). Assumed: 0.6; the widest swing
    of thirty years, with ``swing_cov`` of 0.3, is then y_s on average."""
    swing_cov: Pure = Field(default=0.3, ge=0)
    """Coefficient of variation of the swing from year to year. Assumed."""
    shift: Length = Field(default=0.0, ge=0)
    """Standard deviation of the mean movement of a year (m): wet years and dry years."""
    correlation: Pure = Field(default=0.3, ge=0, lt=1)
    """Correlation of a year with the one before. Assumed."""
    increments: Count = Field(default=4, ge=1)
    """Increments of each half year."""
    step: tuple[SeasonStep, ...] = ()
    """Lasting changes."""
    seed: Count = Field(default=1, ge=0)
    """Seed of the random numbers."""

    @model_validator(mode="after")
    def _something_moves(self) -> Seasons:
        if not np.any(self.movements()):
            raise ValueError("nothing moves: give a trend, a swing or a step")
        return self

    @property
    def times(self) -> FloatArray:
        """Ends of the half years (years)."""
        return np.arange(1, 2 * self.years + 1) / 2.0

    def movements(self) -> FloatArray:
        """Movement at the end of each half year (m), positive on the side of ``movement.kind``."""
        of_swing, of_mean, of_steps = map(np.random.default_rng, np.random.SeedSequence(self.seed).spawn(3))
        size = np.maximum(1.0 + self.swing_cov * self._yearly(of_swing), 0.0)
        movement = self.trend * self.times / self.years + np.repeat(self.shift * self._yearly(of_mean), 2)
        movement += 0.5 * self.swing * np.repeat(size, 2) * np.tile([1.0, -1.0], self.years)
        for step, drawn in zip(self.step, of_steps.random(len(self.step))):
            since, active = self.times - step.year, self.times >= step.year
            grown = np.minimum(since / step.rise, 1.0) if step.rise else 1.0
            active &= self.times < (np.inf if step.end is None else step.end)
            movement += (drawn < step.probability) * step.movement * np.where(active, grown, 0.0)
        return movement

    def _yearly(self, generator: np.random.Generator) -> FloatArray:
        """Stationary autoregressive process of first order, of variance 1, one value per year."""
        values = generator.standard_normal(self.years)
        for j in range(1, self.years):
            values[j] = self.correlation * values[j - 1] + np.sqrt(1.0 - self.correlation**2) * values[j]
        return values

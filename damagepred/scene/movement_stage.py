"""Stages and increments of a history of movement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field

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

"""Sampling of the walls of a study."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from damagepred.inputs.text import check_title
from damagepred.scene import Scene
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Pure
from damagepred.uq.importance import Proposal
from damagepred.uq.stopping import StopWhen


def _stop(value: Any) -> Any:
    whole = isinstance(value, int) and not isinstance(value, bool)
    if value is None or value == "none" or (whole and value >= 1):
        return value
    raise ValueError('must be the number of a category, 1 or more, or "none" to solve every path to its end')


Stop = Annotated[Any, BeforeValidator(_stop)]  # category at which a path ends, ``"none"``, or None


@described
class Sampling:
    """Sampling of the walls (``[study]``)."""

    title: Annotated[str, AfterValidator(check_title)] | None = None
    """Question of the study; by default the scene's title."""
    samples: Count = Field(default=100, ge=1)
    """Number of walls; ``-n`` of the command takes precedence."""
    seed: Count = Field(default=1, ge=0, lt=2**63)
    """Seed of all random streams."""
    sampler: Literal["sobol", "lhs", "random", "table"] = "sobol"
    """Sampler of the values for whole walls. A Latin hypercube cannot be extended."""
    replicates: Count = Field(default=1, ge=1, le=1024)
    """Number of independent scrambles of the Sobol points, in turn. From 4 on, the differences of their means give the
    error of an estimate. With fewer, the points count as random, on the safe side."""
    table: str | None = None
    """CSV file with the samples for ``sampler = "table"``, beside the study file: one row per wall."""
    table_columns: tuple[str, ...] = ()
    """Variables of the table, from its header."""
    importance: dict[str, Proposal] = Field(default_factory=dict)
    """Where variables are drawn instead, by place; every sample then has a ``weight``."""
    nominal_share: Pure = Field(default=0.0, ge=0, lt=1)
    """With ``importance``, share of walls drawn as the distributions say; it keeps weights below one over it."""
    stop_when: StopWhen | None = None
    """Run no more walls once a quantity is known well enough; ``samples`` is then the most there may be."""
    epistemic: dict[str, dict[str, dict[str, Any]]] = Field(default_factory=dict)
    """Alternatives to the distributions, by name: ``[study.epistemic."less sure"."dpc.friction"] cov = 0.3``. Walls are
    weighted, not run again (``damagepred estimate``)."""
    fields_from: Scene | None = None
    """The wall on whose joints the fields are drawn, if not the scene's own; a joint has the value of the nearest."""
    store_fields: bool = True
    """Whether the design file also records every joint's values. They follow from the seed; the record is for the
    archive."""
    material_scatter: bool = False
    """Whether all values of ``scene.material`` with a known scatter are lognormal variables, with the correlations of
    the library, in addition to the given variables."""
    stop_at_category: Stop = None
    """A path ends once this category is reached, and the movement beyond is not solved. None: the table's highest;
    "none": every path is solved to the end of the movement."""
    crossed: bool = False
    """Only for replays of archives of version 0.1: samples in fours, two walls and two fields in every combination."""
    movement: Literal["path", "sampled", "both"] = "path"
    """Stored increments of each wall. ``path``: every increment up to its own sampled movement. ``sampled``: only the
    end of it, one value per sample. ``both``: also the end, as ``end_*``. With the end, paths are solved to it unless
    ``stop_at_category`` is given."""

    @model_validator(mode="after")
    def _fits_together(self) -> Sampling:
        if (self.table is None) != (self.sampler != "table"):
            raise ValueError('table: goes with sampler = "table", which needs it')
        if self.replicates > 1 and self.sampler != "sobol":
            raise ValueError(f"replicates = {self.replicates}: is for sampler = 'sobol' alone")
        if self.importance and self.sampler == "table":
            raise ValueError("importance: a table's samples are as they are; give it no importance")
        if self.nominal_share and not self.importance:
            raise ValueError(f"nominal_share = {self.nominal_share:g}: goes with [study.importance]")
        if self.stop_when is not None and self.movement == "sampled":
            raise ValueError(
                'stop_when: with movement = "sampled" each wall has a result only at its own movement, not at a common '
                'one; take movement = "both"'
            )
        if self.stop_when is not None and self.stop_when.first % self.replicates:
            raise ValueError(
                f"stop_when.first = {self.stop_when.first}: must be a multiple of replicates = {self.replicates}"
            )
        return self

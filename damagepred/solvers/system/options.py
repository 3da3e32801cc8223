"""Tolerance of elastic solutions; steps of creep."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Pure


@described
class ElasticSolutionOptions:
    """Elastic solutions of the intact wall: under which residual they count.

    Attributes
    ----------
    residual_tolerance : float
        Residual over the largest load, above which the wall counts as singular: its joints do not hold it (1).
    """

    residual_tolerance: Pure = Field(default=1e-3, gt=0)


@described
class CreepOptions:
    """Creep of joints along a history: steps in time.

    Attributes
    ----------
    longest_step : float
        Longest step over the relaxation time (1). Creep is exact at constant opening, and of second order in the step
        elsewhere.
    """

    longest_step: Pure = Field(default=0.1, gt=0)


DEFAULTS = ElasticSolutionOptions()
DEFAULT_CREEP = CreepOptions()

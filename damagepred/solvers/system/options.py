"""Tolerance of elastic solutions; steps of creep."""

from __future__ import annotations

from pydantic import Field

from damagepred.scene.described import described
from damagepred.scene.quantity import Pure


@described
class ElasticSolutionOptions:
    """Elastic solutions of the intact wall.

    Attributes
    ----------
    residual_tolerance : float
        Residual over the largest load, above which the wall counts as singular (1).
    """

    residual_tolerance: Pure = Field(default=1e-3, gt=0)


@described
class CreepOptions:
    """Creep of joints along a history: steps in time.

    Attributes
    ----------
    longest_step : float
        Longest step over the relaxation time (1); exact at constant opening, otherwise of second order.
    """

    longest_step: Pure = Field(default=0.1, gt=0)


DEFAULTS = ElasticSolutionOptions()
DEFAULT_CREEP = CreepOptions()

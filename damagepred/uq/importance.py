"""Importance sampling: walls drawn where damage is likelier, and the weights that make up for it.

The proposal shifts and stretches the underlying standard normals of named variables, correlation kept. A share of
walls may be drawn as the study says (a defensive mixture): no weight can then exceed one over that share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from damagepred.errors import InputError, nearest
from damagepred.scene.described import described
from damagepred.scene.quantity import Pure

FloatArray = NDArray[np.float64]


@described
class Proposal:
    """Where one variable is drawn instead (``[study.importance."PLACE"]``).

    Attributes
    ----------
    shift : float
        Of the underlying standard normal's mean, in its standard deviations; negative: towards small values.
    scale : float
        Of its standard deviation. Below 1 the weights have heavy tails.
    """

    shift: Pure = 0.0
    scale: Pure = Field(default=1.0, gt=0)


class Drawn(NamedTuple):
    """Standard normals of walls and their weights.

    Attributes
    ----------
    normal : array (samples, variables)
        Correlated standard normals, where drawn.
    weight : array (samples,)
        Density of the study's distributions over that of the proposal, 1 where there is none.
    """

    normal: FloatArray
    weight: FloatArray


def draw(
    independent: FloatArray,
    factor: FloatArray,
    places: Sequence[str],
    proposals: Mapping[str, Proposal],
    nominal_share: float = 0.0,
    turn: FloatArray | None = None,
) -> Drawn:
    """Turn independent standard normals into those of the proposal, with weights.

    Parameters
    ----------
    independent : array (samples, variables)
        Standard normals.
    factor : array (variables, variables)
        Cholesky factor of their correlation.
    places : sequence of str
        Variables in order.
    proposals : mapping of str to Proposal
        By place; variables left out are drawn as they are.
    nominal_share : float
        Share of walls drawn from the study's own distributions.
    turn : array (samples,), optional
        Uniform numbers that decide which walls these are.

    Raises
    ------
    InputError
        If a proposal is for none of the places.
    """
    check(places, proposals)
    normal = independent @ factor.T
    if not proposals:
        return Drawn(normal, np.ones(len(normal)))
    shift = np.array([proposals[p].shift if p in proposals else 0.0 for p in places])
    scale = np.array([proposals[p].scale if p in proposals else 1.0 for p in places])
    moved = normal * scale + shift
    if nominal_share > 0 and turn is not None:
        moved = np.where(turn[:, None] < nominal_share, normal, moved)
    inverse = np.linalg.inv(factor)
    # squares of the independent normals that either density would have drawn these walls from
    as_stated = ((moved @ inverse.T) ** 2).sum(axis=1)
    as_proposed = ((((moved - shift) / scale) @ inverse.T) ** 2).sum(axis=1)
    likelier = np.exp(np.clip(0.5 * (as_stated - as_proposed) - np.log(scale).sum(), -700.0, 700.0))
    return Drawn(moved, 1.0 / (nominal_share + (1.0 - nominal_share) * likelier))


def check(places: Sequence[str], proposals: Mapping[str, Proposal]) -> None:
    """Check that proposals are for variables with one value a wall.

    Raises
    ------
    InputError
        If one is not.
    """
    for place in proposals:
        if place not in places:
            raise InputError(
                f'[study.importance."{place}"]: is no variable with one value a wall.'
                + (nearest(place, places) or f" There are: {', '.join(places) or 'none'}.")
            )

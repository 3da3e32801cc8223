"""Importance sampling: walls drawn where damage is likelier, and the weights that make up for it.

The proposal shifts and stretches the standard normals of named variables. The others shift to their conditional mean.
A share of walls may be drawn as stated (a defensive mixture), which bounds the weights. The shift to the mean of likely
walls is the proposal of least cross-entropy (Rubinstein and Kroese 2004, The Cross-Entropy Method).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from damagepred.arrays import FloatArray
from damagepred.errors import InputError, nearest
from damagepred.scene.described import described
from damagepred.scene.quantity import Pure
from damagepred.uq.correlation import independent_normals, varying


@described
class Proposal:
    """Where one variable is drawn instead (``[study.importance."PLACE"]``)."""

    shift: Pure = 0.0
    """Of the underlying standard normal's mean, in its standard deviations; negative: towards small values."""
    scale: Pure = Field(default=1.0, gt=0)
    """Of its standard deviation. Below 1 the weights have heavy tails."""


class Drawn(NamedTuple):
    """Standard normals of walls and their weights."""

    normal: FloatArray  # (samples, variables): correlated standard normals, where drawn
    # (samples,): density of the study's distributions over the proposal's, 1 without a proposal
    weight: FloatArray


def draw(
    independent: FloatArray,
    factor: FloatArray,
    places: Sequence[str],
    proposals: Mapping[str, Proposal],
    nominal_share: float = 0.0,
    turn: FloatArray | None = None,
) -> Drawn:
    """Standard normals of the proposal from independent ones, with weights."""
    check(places, proposals)
    normal = independent @ factor.T
    if not proposals:
        return Drawn(normal, np.ones(len(normal)))
    shift = conditional_shift(factor @ factor.T, places, {p: proposal.shift for p, proposal in proposals.items()})
    scale = np.array([proposals[p].scale if p in proposals else 1.0 for p in places])
    moved = normal * scale + shift
    if nominal_share > 0 and turn is not None:
        moved = np.where(turn[:, None] < nominal_share, normal, moved)
    # squares of the independent normals that either density would have drawn these walls from
    try:
        as_stated = (independent_normals(moved, factor) ** 2).sum(axis=1)
        as_proposed = (independent_normals((moved - shift) / scale, factor) ** 2).sum(axis=1)
    except ValueError:
        raise InputError(
            "[study.importance]: some of these variables follow from others (correlation 1 or -1) and are shifted or "
            "scaled otherwise; give them the same scale, and the shift that follows, or name one of them."
        ) from None
    widened = np.log(scale[varying(factor)]).sum()
    likelier = np.exp(np.clip(0.5 * (as_stated - as_proposed) - widened, -700.0, 700.0))
    return Drawn(moved, 1.0 / (nominal_share + (1.0 - nominal_share) * likelier))


def conditional_shift(correlation: FloatArray, places: Sequence[str], given: Mapping[str, float]) -> FloatArray:
    """Shift of each variable, array (variables,); variables without a given shift have their conditional mean."""
    named = np.array([p in given for p in places])
    shift = np.array([given.get(p, 0.0) for p in places])
    if named.any() and not named.all():
        among = correlation[np.ix_(named, named)]
        singular = np.linalg.eigvalsh(among)[0] < 1e-8
        solution = np.linalg.pinv(among, 1e-8) @ shift[named] if singular else np.linalg.solve(among, shift[named])
        shift[~named] = correlation[np.ix_(~named, named)] @ solution
    return shift


def cross_entropy_shift(normal: FloatArray, weight: FloatArray) -> FloatArray:
    """Mean of weighted walls in standard normals, array (variables,)."""
    return weight @ normal / weight.sum()


def check(places: Sequence[str], proposals: Mapping[str, Proposal]) -> None:
    """Refuse proposals for other variables than those with one value per wall."""
    for place in proposals:
        if place not in places:
            raise InputError(
                f'[study.importance."{place}"]: is no variable with one value per sample.'
                + (nearest(place, places) or f" There are: {', '.join(places) or 'none'}.")
            )

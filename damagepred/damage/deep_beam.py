"""Strain of a deep elastic beam that follows the ground (Burland and Wroth 1974), from the deflection ratio.

The beam is simply supported with a point load in the middle, and carries shear of parabolic distribution:

    D/L = eps_b [L/(12 t) + 3 E I/(2 t L H G)]        at the edge, in bending
    D/L = eps_d [1 + H L^2 G/(18 E I)]                 along the diagonal, in shear

with I for unit thickness. Sagging (dishing): the neutral axis is at mid-height, I = H^3/12, t = H/2. Hogging (doming):
at the underside, restrained by the ground, I = H^3/3, t = H; the same as sagging of a wall twice as high. The bending
strain is the larger where L/H > E/(4 G) in sagging, L/H > E/(2 G) in hogging.

The slope in shear is the shear strain at the neutral axis, 3/2 of the mean; by its energy it would be 6/5 of it, so for
a given deflection the strains are underrated by up to a quarter where shear governs.

The beam has no joints, openings or damp-proof course, and it follows the ground everywhere.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray
from damagepred.enumerations import SYNONYMS
from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.inputs.documentation import documented

Kind = Literal["dishing", "doming"]


@documented
class BeamStrain(NamedTuple):
    """Largest tensile strains of the beam, each of the shape that its inputs broadcast to.

    Examples
    --------
    >>> from damagepred import damage
    >>> strain = damage.beam_strain(1 / 2000, 6.0, 2.4, "dishing")
    >>> bool(strain.bending > strain.diagonal)
    True
    """

    bending: FloatArray
    diagonal: FloatArray
    """At the edge and along the diagonal (1), the horizontal strain of the ground included."""

    @property
    def largest(self) -> FloatArray:
        """The larger of the two (1)."""
        return np.maximum(self.bending, self.diagonal)


@checked
def deflection_over_strain(
    length: ArrayLike, height: ArrayLike, kind: Kind, modulus_ratio: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Deflection ratio per unit strain, in bending and along the diagonal (1).

    The smaller one times the limiting strain is the critical deflection ratio.

    Parameters
    ----------
    length, height : array_like
        Size of the wall (m).
    kind : {"dishing", "doming"}
        Sagging or hogging.
    modulus_ratio : array_like
        E/G (1): 2 (1 + nu) of an isotropic wall; more where openings weaken it in shear.

    Raises
    ------
    InputError
        If a size or the ratio is not positive, or the kind unknown.

    Examples
    --------
    A wall 6 m by 2.4 m that sags: bending governs, with the smaller deflection ratio.

    >>> from damagepred import damage
    >>> [round(float(ratio), 2) for ratio in damage.deflection_over_strain(6.0, 2.4, "dishing", 2.4)]
    [0.66, 2.74]
    """
    slenderness = _positive(length, "length", "m") / _positive(height, "height", "m")
    ratio = _positive(modulus_ratio, "modulus_ratio")
    kind = SYNONYMS.get(str(kind), kind)  # type: ignore[assignment]
    if kind not in ("dishing", "doming"):
        raise InputError(f"kind = {kind!r}: must be 'dishing' (sagging) or 'doming' (hogging).")
    # I / H^3 and t / H
    second, edge = (1 / 12, 1 / 2) if kind == "dishing" else (1 / 3, 1.0)
    bending = slenderness / (12 * edge) + 3 * ratio * second / (2 * edge * slenderness)
    diagonal = 1 + slenderness**2 / (18 * ratio * second)
    return bending, diagonal


@checked
def beam_strain(
    deflection_ratio: ArrayLike,
    length: ArrayLike,
    height: ArrayLike,
    kind: Kind,
    modulus_ratio: ArrayLike = 2.6,
    *,
    ground_strain: ArrayLike = 0.0,
    poisson_ratio: ArrayLike = 0.3,
) -> BeamStrain:
    """Tensile strains of a wall that follows the ground; all arguments except the kind may be arrays.

    Parameters
    ----------
    deflection_ratio : array_like
        Central deflection over length (1), without sign; NaN stays NaN.
    length, height : array_like
        Size of the wall (m).
    kind : {"dishing", "doming"}
        Sagging or hogging.
    modulus_ratio : array_like
        E/G (1).
    ground_strain : array_like
        Horizontal strain of the ground (1), tension positive, which the wall follows (Boscardin and Cording 1989): it
        adds to the bending strain, and combines with the diagonal strain in Mohr's circle.
    poisson_ratio : array_like
        nu (1), used with a ground strain only.

    Raises
    ------
    InputError
        If a size or a ratio is not positive, or the kind unknown.

    Examples
    --------
    A wall 6 m by 2.4 m that sags by L/2000:

    >>> beam_strain(1 / 2000, 6.0, 2.4, "dishing").bending.round(6)
    np.float64(0.000739)
    """
    for name, value in (("deflection_ratio", deflection_ratio), ("ground_strain", ground_strain)):
        if (np.abs(np.asarray(value, dtype=np.float64)) > 1.0).any():
            raise InputError(f"{name}: must be between -1 and 1, as strains and ratios are small.")
    if not (np.abs(np.asarray(poisson_ratio, dtype=np.float64)) <= 0.5).all():
        raise InputError("poisson_ratio: must be between -0.5 and 0.5.")
    per_bending, per_diagonal = deflection_over_strain(length, height, kind, modulus_ratio)
    sagged = np.abs(np.asarray(deflection_ratio, dtype=np.float64))
    bending, diagonal = sagged / per_bending, sagged / per_diagonal
    ground, nu = np.asarray(ground_strain, dtype=np.float64), np.asarray(poisson_ratio, dtype=np.float64)
    return BeamStrain(bending + ground, ground * (1 - nu) / 2 + np.sqrt((ground * (1 + nu) / 2) ** 2 + diagonal**2))


def _positive(value: ArrayLike, name: str, unit: str = "") -> FloatArray:
    numbers = np.asarray(value, dtype=np.float64)
    right = (numbers > 0) & (numbers <= 1e9)
    if not right.all():
        wrong = numbers[~right].ravel()[0]
        raise InputError(f"{name} = {wrong:g}: must be a finite number greater than 0 {unit}".rstrip() + ".")
    return numbers

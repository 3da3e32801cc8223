"""Result of an increment, the same record for every solver."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from damagepred.arrays import FloatArray, Int8Array
from damagepred.diagnostics import Counters, Energies, Residuals


class ZoneResults(NamedTuple):
    """Deformable blocks at an increment; g gridpoints, z zones.

    Attributes
    ----------
    displacement : array (g, 2)
        x, y of the gridpoints (m).
    stress : array (z, 4)
        s_xx, s_yy, s_xy and s_zz, tension positive (Pa).
    state : array of int8 (z,)
        ``ZoneState``.
    """

    displacement: FloatArray
    stress: FloatArray
    state: Int8Array


@dataclass(frozen=True)
class Increment(Residuals):
    """Equilibrium at one point of the path, with its residuals; n blocks, m interfaces with q contacts each.

    The unbalanced force ratio is above the tolerance of the quasi-static solver, and at most 1e-3, where Coulomb
    friction admitted no equilibrium on the way (cyclic stick-slip).

    Attributes
    ----------
    number : int
        0 is the state under dead load, before any movement.
    load_factor : float
        Share of the full movement, 0 to 1.
    displacement : array (n, 3)
        x, y (m) and rotation (rad, counter-clockwise) of each block.
    opening, slip : array (m, q)
        Relative displacement normal to the joint, opening positive, and plastic slip along it (m).
    normal_stress, shear_stress : array (m, q)
        Tension positive (Pa).
    state : array of int8 (m, q)
        ``ContactState``: cracked once tension has passed its strength, also while the bond still softens (or brittle
        shear has broken it), else slipping once it has slid.
    base_reaction : float
        Vertical force of ground and supports on the wall (N, upwards).
    counters : Counters
        Work spent on it.
    energy : Energies
        Energy balance of the quasi-static solver and of dynamic runs.
    collapsed : bool
        Whether a part of the wall is detached; then the increment is no equilibrium, and ``load_factor`` is that of
        collapse.
    last_stable_load_factor : float
        Of an increment in which the wall collapsed, the load factor of the last equilibrium before.
    time : float
        Physical time of a dynamic run (s).
    base : tuple of float
        Displacement x, y of the base of a dynamic run (m); that of the blocks is relative to it.
    searches : int
        Searches of a dynamic run for neighbouring blocks so far.
    strain : array (n, 2) or None
        Strain along its bed (elongation positive) and curvature (1/m, ends up positive) of each block, 0 of
        rigid ones; None if no block is elastic.
    support_force : array (n, 3) or None
        Force of the supports on each block, x, y (N) and moment (N m); 0 where the block is free.
    zones : ZoneResults or None
        Of the deformable blocks; ``displacement`` has their mean motion.
    deflection : float
        Of a footing on jacks or soil: its centre relative to its ends (m, upwards).
    jack_load : float
        Of each jack under it (N, upwards).
    broken_at : array (m, q) or None
        Load factor at which each bond failed, NaN where it holds or there was none; None of dynamic runs.
    ended : str
        Why the path ends before the full movement: ``"jacks"`` or ``"supports"`` carry no load; ``""`` if it does not.
    """

    number: int
    load_factor: float
    displacement: FloatArray
    opening: FloatArray
    slip: FloatArray
    normal_stress: FloatArray
    shear_stress: FloatArray
    state: Int8Array
    base_reaction: float
    counters: Counters = field(default_factory=Counters)
    energy: Energies = field(default_factory=Energies)
    collapsed: bool = False
    last_stable_load_factor: float = float("nan")
    time: float = float("nan")
    base: tuple[float, float] = (0.0, 0.0)
    searches: int = 0
    strain: FloatArray | None = None
    support_force: FloatArray | None = None
    zones: ZoneResults | None = None
    deflection: float = float("nan")
    jack_load: float = float("nan")
    broken_at: FloatArray | None = None
    ended: str = ""

"""Result of an increment, the same record for every solver."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from damagepred.arrays import FloatArray, Int8Array
from damagepred.diagnostics import Counters, Energies, Residuals


class ZoneResults(NamedTuple):
    """Deformable blocks at an increment; g gridpoints, z zones."""

    displacement: FloatArray  # (g, 2) of the gridpoints (m)
    stress: FloatArray  # (z, 4) xx, yy, xy, zz, tension positive (Pa)
    state: Int8Array  # (z,) ``ZoneState``


class FootingResults(NamedTuple):
    """Footing on jacks or soil at an increment."""

    deflection: float = float("nan")  # centre relative to the ends (m, upwards)
    jack_load: float = float("nan")  # of each jack (N, upwards)


class MotionResults(NamedTuple):
    """Output of a dynamic run."""

    time: float  # (s)
    base: tuple[float, float]  # displacement of the base (m); block displacements are relative to it
    searches: int  # neighbour searches up to this output


class PathEnd(NamedTuple):
    """End of a path before its full movement."""

    unloaded: str = ""  # ``"jacks"`` or ``"supports"`` that have no load
    last_stable_load_factor: float = float("nan")  # last equilibrium before collapse


@dataclass(frozen=True)
class Increment:
    """Equilibrium at one point of the path, with its residuals; n blocks, m interfaces with q contacts each.

    The unbalanced force ratio is above the tolerance of the quasi-static solver, and at most 1e-3, where Coulomb
    friction admitted no equilibrium on the way (cyclic stick-slip).
    """

    number: int  # 0: dead load before any movement
    load_factor: float  # share of the full movement
    displacement: FloatArray  # (n, 3) x, y (m) and rotation (rad, counter-clockwise)
    opening: FloatArray  # (m, q) opening positive (m)
    slip: FloatArray  # (m, q) plastic (m)
    normal_stress: FloatArray  # (m, q) tension positive (Pa)
    shear_stress: FloatArray  # (m, q) (Pa)
    # (m, q) ``ContactState``: cracked after tension passed its strength (also while the bond softens) or brittle shear
    # broke the bond, otherwise slipping after slip
    state: Int8Array
    base_reaction: float  # vertical force of ground and supports on the wall (N, upwards)
    residuals: Residuals = field(default_factory=Residuals)
    counters: Counters = field(default_factory=Counters)  # work of the solver
    energy: Energies = field(default_factory=Energies)  # quasi-static and dynamic runs
    collapsed: bool = False  # a part is detached: no equilibrium; ``load_factor`` at collapse
    end: PathEnd = field(default_factory=PathEnd)
    motion: MotionResults | None = None  # None: static path
    # (n, 2) strain along the bed (elongation positive) and curvature (1/m, ends up positive), 0 for rigid blocks; None
    # for walls without elastic blocks
    strain: FloatArray | None = None
    support_force: FloatArray | None = None  # (n, 3) on each block: x, y (N) and moment (N m); 0 where it is free
    zones: ZoneResults | None = None  # ``displacement`` has the mean motion of deformable blocks
    footing: FootingResults = field(default_factory=FootingResults)
    broken_at: FloatArray | None = None  # (m, q) load factor at failure of each bond, NaN if intact; None: dynamic run

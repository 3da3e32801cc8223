"""Result of an increment, the same record for every solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from damagepred.arrays import FloatArray, Int8Array


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


class Counters(NamedTuple):
    """Work spent on an increment.

    Attributes
    ----------
    newton_iterations : int
        Of the quasi-static solver.
    cycles : int
        Of the explicit solver, or time steps of a dynamic run.
    events, factorisations : int
        Of the quasi-static solver: times at which bonds failed, and factorisations of the stiffness.
    """

    newton_iterations: int = 0
    cycles: int = 0
    events: int = 0
    factorisations: int = 0

    def since(self, before: Counters) -> Counters:
        """Return the work done since earlier counters."""
        return Counters(*(now - then for now, then in zip(self, before, strict=True)))


class Energies(NamedTuple):
    """Energy balance (J): works are summed along the path; NaN where a solver has none.

    Attributes
    ----------
    external_work : float
        Work of loads and movement.
    elastic_energy : float
        Stored in joints and zones.
    friction_work, fracture_work, crushing_work, plastic_work : float
        Dissipated by friction, by softening bonds, by crushing, and by zones that yield.
    released_energy : float
        Set free where bonds failed or the wall snapped through.
    snap_through_energy : float
        Part of that: by snap-through to a distant equilibrium.
    energy_error : float
        Imbalance of these terms; of the quasi-static solver the sum of its magnitudes.
    kinetic_energy, boundary_work, damping_work : float
        Of a dynamic run: energy of motion, work of ground and supports (part of ``external_work``), and dissipated by
        damping.
    """

    external_work: float = float("nan")
    elastic_energy: float = float("nan")
    friction_work: float = float("nan")
    fracture_work: float = float("nan")
    crushing_work: float = float("nan")
    plastic_work: float = float("nan")
    released_energy: float = float("nan")
    snap_through_energy: float = float("nan")
    energy_error: float = float("nan")
    kinetic_energy: float = float("nan")
    boundary_work: float = float("nan")
    damping_work: float = float("nan")


NO_WORK, NO_ENERGIES = Counters(), Energies()


@dataclass(frozen=True)
class Increment:
    """Equilibrium at one point of the path; n blocks, m interfaces with q contacts each.

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
    unbalanced_force_ratio : float
        Largest residual force over the mean block weight. Above the tolerance of the quasi-static solver, and at most
        1e-3, where Coulomb friction admitted no equilibrium on the way (cyclic stick-slip).
    base_reaction : float
        Vertical force of ground and supports on the wall (N, upwards).
    counters : Counters
        Work spent on it.
    energy : Energies
        Energy balance of the quasi-static solver and of dynamic runs.
    joint_law_violation : float
        Stress by which a joint exceeds its law, at most (Pa), of the quasi-static solver.
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
    unbalanced_force_ratio: float
    base_reaction: float
    counters: Counters = NO_WORK
    energy: Energies = NO_ENERGIES
    collapsed: bool = False
    joint_law_violation: float = float("nan")
    last_stable_load_factor: float = float("nan")
    time: float = float("nan")
    base: tuple[float, float] = (0.0, 0.0)
    searches: int = 0
    support_force: FloatArray | None = None
    zones: ZoneResults | None = None
    deflection: float = float("nan")
    jack_load: float = float("nan")
    broken_at: FloatArray | None = None
    ended: str = ""
